"""The native search of one question for its shortest times: told of, counted, and ended by time, work or Ctrl-C."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import prod

import numpy as np

from minsnap.basics.deadline import WORK, LateError
from minsnap.durations.least_cost import Log
from minsnap.durations.timing import Timing
from minsnap.native.shortest_time import ShortestCurve, ShortestQuestion, Watch, search_shortest
from minsnap.optimisation.task import Task
from minsnap.refusals.sentences import UnlimitedError, nothing_limits

REMEMBERED = 32
"""Searches of a question whose end is remembered."""

INTERRUPTED = "the search was interrupted before it had a plan that can be certified"
"""What Ctrl-C leaves to be said."""

VANISHING = 1e-6
"""Share of the longest total below which nothing limits the time."""


class WatchedSearch:
    """What all searches of one question share, and all that changes while they run.

    Parameters
    ----------
    task : Task
    timing : Timing
        With limits.

    Attributes
    ----------
    log : Log
        Of the steps.
    ended : LateError or None
        What ended the search from outside.
    spare : ShortestCurve or None
        The shortest curve inside all limits that a search came by whose end is another; not certified.
    """

    def __init__(self, task: Task, timing: Timing) -> None:
        self.timing, self.log = timing, Log(timing.progress)
        self.ended: LateError | None = None
        self.spare: ShortestCurve | None = None
        self.deadline, self._own, self._longest = timing.in_time(task).deadline, task.deadline, 0.0

    @property
    def lost(self) -> bool:
        """Whether time or Ctrl-C ended it; where work did, a refusal is still looked for."""
        return self.ended is not None and (self.deadline.late or not self.deadline.spent)

    def curve(self, question: ShortestQuestion, task: Task, row_work: float) -> ShortestCurve | UnlimitedError | None:
        """Return the curve of a search; None where the native core does not take the question.

        Parameters
        ----------
        question : ShortestQuestion
        task : Task
            That it is about.
        row_work : float
            Of an iteration, for each row.
        """
        for asked, found in self.deadline.work.known:
            if question.same(asked):
                known: ShortestCurve = found
                return known
        pieces = task.legs * prod(question.parts) * (1 if question.guess is None else question.guess.pieces)
        work, vanished = self.deadline.work, list[bool]()

        def tell(totals: list[float], done: float, pressed: bool) -> bool:
            work.done = done
            with self.interruptible():
                for total in totals:
                    self._longest = max(self._longest, total)
                    if total < VANISHING * self._longest:
                        vanished.append(True)
                        return True
                    self.log.add(total, total)
                if pressed:
                    raise KeyboardInterrupt
            if self.ended is None and self.deadline.passed:
                self.ended = self.deadline.error()
            return self.ended is not None

        watch = Watch(
            tell,
            self.timing.progress is not None or self.deadline.due < np.inf,
            row_work=row_work,
            iteration_work=WORK.block * pieces * ((task.half - 1) * task.dim) ** 3,
            work=work.done,
            worth=work.enough,
            longest=self._longest,
            vanishing=VANISHING,
        )
        curve = search_shortest(question, watch)
        self._own.resume()  # the search has its own end
        if vanished:
            return nothing_limits(list(self.timing.bounds.given()))
        if curve is not None and not curve.stopped and work.remembers:
            work.known = (*work.known[1 - REMEMBERED :], (question, curve))
        return curve

    def spared(self, curve: ShortestCurve | None) -> None:
        """Keep a curve that a search came by, where it is the shortest so far."""
        if curve is not None and (self.spare is None or curve.durations.sum() < self.spare.durations.sum()):
            self.spare = curve

    @contextmanager
    def interruptible(self) -> Iterator[None]:
        """Note that Ctrl-C ends the search, where the best so far is wanted then."""
        try:
            yield
        except KeyboardInterrupt:
            if not self.timing.best_on_interrupt:
                raise
            self.ended = LateError(INTERRUPTED)
