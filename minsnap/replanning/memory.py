"""What a replan answers, and what a Replanner keeps of its last answers."""

from __future__ import annotations

from collections import defaultdict, deque
from dataclasses import dataclass, fields
from functools import partial
from math import inf

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_number
from minsnap.corridors.constraint import Walls, walls_from
from minsnap.errors import TimingError
from minsnap.optimisation.task import Task
from minsnap.replanning.horizon import PATIENCE, Aim
from minsnap.replanning.splice import Splice
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Change:
    """A change of the plan that is being flown.

    Parameters
    ----------
    trajectory : Trajectory
        What to fly from the splice on; its time 0 is the splice.
    splice : float
        Instant at which it takes over, on the clock of the flown plan [s].
    stop : Trajectory or None
        From the state at the splice to hover, inside the corridor and the limits; its time 0 is the splice.
    kept : bool
        True: the trajectory is the rest of the flown plan.
    certified : bool
        Whether the trajectory is proved to be inside the walls ahead and the limits; false only for a rest that is kept
        because no certified curve was ready in time. Then fly ``stop``. A rest that is kept passes the waypoints where
        they were when it was planned.
    reason : str
        Why the rest was kept, or flown with other angles in other times than requested; else empty.
    no_stop : str
        Why there is no stop; empty where there is one.
    limits_from : float
        Instant from which the trajectory keeps the limits [s]; 0 but for a state outside of them.
    inside_from : float
        Instant from which it is inside the corridor [s]; 0 but for a state outside of it.
    took : float
        Seconds that the answer took, on the replanner's clock.
    late : float
        Seconds by which it came after it was due; 0 where it came in time. A splice that has passed is not flown: hold
        or fly the stop before, and give a longer budget (``minsnap bench`` says which this machine needs).
    legs : int
        Legs of the flown plan that end before the splice: as many waypoints have been passed.
    """

    trajectory: Trajectory
    splice: float
    stop: Trajectory | None
    kept: bool
    certified: bool = True
    reason: str = ""
    no_stop: str = ""
    limits_from: float = 0.0
    inside_from: float = 0.0
    took: float = 0.0
    late: float = 0.0
    legs: int = 0


UNCHANGED = "nothing has changed"
"""Why a rest is kept that was planned for the same."""

ANSWERS = 50
"""Answers whose times are remembered."""

SKIPS = 25
"""Answers in a row for which a part is left out because of them."""

MARGIN = 1.25
"""Factor on them for what is yet to come."""


@dataclass(frozen=True, eq=False)
class Memory:
    """The last answer.

    Parameters
    ----------
    answer : Trajectory
        That was returned.
    leg_start : ndarray, shape (dim,)
        Where its first leg begins, for corridors that run along legs [m].
    task : Task
        What it answers.
    aim : Aim
        And what was minimised.
    settled : bool
        Whether the search behind it ended by itself.
    since : float
        Flight since the last search [s]; infinite where there was none.
    free : bool
        Whether the answer touches no wall.
    guess : Trajectory or None
        The last planned curve for these legs, where it was not returned.
    """

    answer: Trajectory
    leg_start: FloatArray
    task: Task
    aim: Aim
    settled: bool
    since: float
    free: bool
    guess: Trajectory | None = None

    def unchanged(self, splice: Splice, task: Task, free: bool, ahead: float) -> str:
        """Say that nothing has changed that this answer depends on, the best that a search found; empty if it has.

        Parameters
        ----------
        splice : Splice
        task : Task
        free : bool
            Whether what is left of the answer touches no wall. Where it did not either, other walls leave it as good
            as it was: what can be gained is gained by flying on.
        ahead : float
            Flight time of what would be searched, small parts of which are waited for; 0 where more would be searched
            than was [s].
        """
        if not (self.settled and same_waypoints(task, self.task, splice.passed)):
            return ""
        if same_walls(task, self.task, splice.passed):
            return UNCHANGED
        recent = self.since + splice.instant < PATIENCE.recent * ahead
        return "no wall that it touches has changed" if free and self.free and recent else ""

    def first_guess(self, splice: Splice, legs: int) -> Trajectory | None:
        """Return the rest of the last curve, if it has that number of legs."""
        rest = None if self.guess is None else Splice(self.guess, splice.instant, splice.half).rest
        return rest if rest is not None and rest.legs == legs else None


def leg_start_of(splice: Splice, memory: Memory | None) -> FloatArray:
    """Where the leg being flown begins, (dim,) [m]: before earlier splices, too."""
    return splice.leg_start if memory is None or splice.passed else memory.leg_start


def same_waypoints(task: Task, before: Task, passed: int) -> bool:
    """Whether the waypoints of a task are what they were in one with some more, now passed, before them."""
    names = ("waypoints", "lower", "upper")
    return all(np.array_equal(getattr(before, name)[passed + 1 :], getattr(task, name)[1:]) for name in names)


def same_walls(task: Task, before: Task, passed: int) -> bool:
    """Whether its walls are."""
    walls = walls_from(before.walls, passed, before.legs)
    names = [entry.name for entry in fields(Walls)]
    both = ((getattr(a, name), getattr(b, name)) for a, b in zip(walls, task.walls, strict=False) for name in names)
    return len(walls) == len(task.walls) and all(np.array_equal(a, b) for a, b in both)


class Takes:
    """How long parts of the last answers took [s]."""

    def __init__(self) -> None:
        self._known: defaultdict[str, deque[float]] = defaultdict(partial(deque, maxlen=ANSWERS))
        self._skipped: defaultdict[str, int] = defaultdict(int)

    def add(self, part: str, seconds: float) -> None:
        """Count one more."""
        self._known[part].append(seconds)
        self._skipped[part] = 0

    def skip(self, part: str) -> None:
        """Count an answer without a part; after some in a row what is known is forgotten, so that it is tried again."""
        self._skipped[part] += 1
        if self._skipped[part] >= SKIPS:
            self._known[part].clear()
            self._skipped[part] = 0

    def most(self, part: str, first: float = 0.0) -> float:
        """Return the longest known time of a part; ``first`` before it has run."""
        known = self._known[part]
        return MARGIN * max(known) if known else first

    def usual(self, part: str, first: float = 0.0) -> float:
        """Return the same but for one answer in ten, and for one of a few."""
        known = sorted(self._known[part])
        return MARGIN * known[9 * (len(known) - 1) // 10] if known else first


def due_of(called: float, now: float, seconds: float, began: float | None) -> float:
    """Return when an answer is due: ``seconds`` after its call, or at the splice where the flight's clock is known.

    Parameters
    ----------
    called : float
        Reading of the clock at the call [s].
    now, seconds : float
        Instant on the flown plan's clock, and the budget [s].
    began : float or None
        Reading of the clock at time 0 of the flown plan [s].

    Raises
    ------
    InputError
        If ``began`` is no number.
    TimingError
        If the splice has passed already.
    """
    if began is None:
        return called + seconds
    due = float(check_number("began", began, -inf, inf, "give a number of seconds")) + now + seconds
    if called >= due:
        raise TimingError(
            f"the splice at {now + seconds:.6g} s of the flown plan passed {called - due:.4g} s ago: replan earlier"
        )
    return due
