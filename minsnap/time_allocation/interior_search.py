"""One native search for the shortest time, and its answer made certain.

The native search keeps walls and limits at instants and at the peaks that it sees between them.  Here exact extrema
have the last word: a curve outside a wall is searched again with the walls moved further inwards, and the time is
scaled until the most used limit is just kept; where that does not help, the limits are tightened.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from minsnap.basics.limit_kinds import KIND
from minsnap.errors import MinsnapError
from minsnap.limits.compliance import KEPT, largest_use, shares_of_norms
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.native.shortest_time import ShortestCurve, ShortestQuestion, search_shortest
from minsnap.optimisation.optimum import Optimum
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.time_allocation.shortest_question import INWARD, scales
from minsnap.time_allocation.time_stretch import nearby_factor, nothing_limits, touching_factor
from minsnap.time_allocation.timing import AttachHeading
from minsnap.trajectory.cut_pieces import LONGEST_PIECE
from minsnap.trajectory.trajectory import Trajectory

INWARDS = 10.0
"""Factor on the share by which walls are moved inwards, where a curve is outside."""

TRIES, SEEN, ENOUGH = 3, 0.05, 2.0
"""How often is searched, the excess of a limit beyond which the search has not seen it, and how far it is tightened."""

NOT_LONGER = 1e-3
"""Share by which the certified curve may be slower than that of the search; beyond, the search did not see a limit."""

IDLE = 0.8
"""Factor on time below which nothing limits the time: only that curves should be smooth ended the search."""

GRAIN = 2.0**32
"""Factors on time are rounded up to its fractions, so that the last bits of exact extrema do not decide a plan."""


class InteriorSearch:
    """Searches of a task within limits, and the curve of the last one.

    Parameters
    ----------
    task : Task
        Without walls of limits.
    limits : Limits
    finish : callable
        Gives a curve its yaw.
    poll : callable
        Called with the total time before every iteration [s]; True ends the search.
    """

    def __init__(self, task: Task, limits: Limits, finish: AttachHeading, poll: Callable[[float, bool], bool]) -> None:
        self.task, self.limits, self.finish, self.poll = task, limits, finish, poll
        self.answer: ShortestCurve | None = None

    def run(self, question: ShortestQuestion, far: float = NOT_LONGER) -> SolvedTask | None:
        """Return a certified plan; None where the search has no curve, or none that can be certified nearby.

        Parameters
        ----------
        question : ShortestQuestion
        far : float
            Share by which it may be slower than the curve of the search.
        """
        last = None
        for _ in range(TRIES):
            self.answer = answer = search_shortest(question, self.poll)
            if answer is None or not answer.kept or not answer.durations.max() <= LONGEST_PIECE:
                break
            solved = solved_at(self.task, answer, 1.0)
            if not solved.inside:
                question = replace(question, inwards=INWARDS * max(question.inwards, INWARD))
                continue
            last = solved
            kept, excess = self._within(answer, solved, far, question.price > 0.0)
            if kept is not None or answer.stopped or excess > SEEN:
                return kept
            question = replace(question, tightened=question.tightened + ENOUGH * excess)
        return None if last is None or not self.task.still else self._slowed(last)

    def _within(
        self, answer: ShortestCurve, solved: SolvedTask, far: float, priced: bool
    ) -> tuple[SolvedTask | None, float]:
        """Fly the same path at the speed at which the most used limit is just kept, if that is about its own.

        Returns
        -------
        solved : SolvedTask or None
        excess : float
            Of the most used limit, relative.
        """
        curve = self.finish(solved.trajectory)
        if not scales(self.task, self.limits):
            excess = largest_use(self.limits, curve) - 1.0
            if excess <= KEPT:
                if priced or not self._may_be_hastened():
                    return solved, excess
                return solved_at(self.task, answer, _hastened(self.limits, curve, 1.0 + excess)), excess
            if far == NOT_LONGER or not self.task.still:
                return None, excess
        factor = _rounded(_slowdown(self.limits, curve))
        if priced or any(wall.order for wall in self.task.walls):
            factor = max(factor, 1.0)
        elif factor < IDLE and not answer.stopped:
            raise nothing_limits(list(self.limits.given()))
        kept = solved_at(self.task, answer, factor) if factor <= 1.0 + far or answer.stopped else None
        return kept, factor - 1.0

    def _may_be_hastened(self) -> bool:
        """Whether rotors limit a path that may be flown faster; a body rate's few ten-thousandths cost too much."""
        still = self.task.still and not any(wall.order for wall in self.task.walls)
        return still and isinstance(self.limits, VehicleLimits)

    def _slowed(self, solved: SolvedTask) -> SolvedTask | None:
        """Fly the same path as much more slowly as the limits ask for."""
        try:
            factor = touching_factor(self.limits, self.finish(solved.trajectory))
        except MinsnapError:
            return None
        assert self.answer is not None
        return solved_at(self.task, self.answer, factor)


def _slowdown(limits: Limits, curve: Trajectory) -> float:
    """Factor on time at which the most used limit is just kept; it divides a derivative by its power of that order."""
    shares = shares_of_norms(limits, curve)
    if shares is not None:
        return max(float(share ** (1.0 / order)) for order, share in shares.items())
    orders = [KIND[name].order for name in limits.given()]
    if all(orders):
        used = limits.utilisation(curve)
        return max(float(entry.fraction ** (1.0 / order)) for entry, order in zip(used, orders, strict=True))
    return nearby_factor(limits, curve) or touching_factor(limits, curve)


def _hastened(limits: Limits, curve: Trajectory, use: float) -> float:
    """Factor on time, at most one, with which limits are touched that the last barrier has kept away from."""
    nearby = nearby_factor(limits, curve, use)
    return 1.0 if nearby is None else min(_rounded(nearby), 1.0)


def _rounded(factor: float) -> float:
    return float(np.ceil(factor * GRAIN)) / GRAIN


def solved_at(task: Task, answer: ShortestCurve, factor: float) -> SolvedTask:
    """Wrap the curve of a search, flown more slowly by a factor, as a solved task."""
    pieces = len(answer.durations) // task.legs
    continuity = max(task.continuity, task.half - 1)
    if (pieces, continuity) != (task.pieces, task.continuity):
        task = replace(task, pieces=pieces, continuity=continuity)
    durations = answer.durations * factor
    units = task.units(durations)
    scale, knots = 1.0, np.empty_like(answer.knots)
    for order in range(task.half):
        knots[:, order] = answer.knots[:, order] * (scale / units.of_order(order))
        scale /= factor
    knots[:, 0] = (answer.knots[:, 0] - task.positions) / units.length
    optimum = Optimum(
        knots, None, np.zeros(0), answer.iterations, "interior point", core="native", points=answer.points
    )
    return SolvedTask(task, durations, units, optimum)
