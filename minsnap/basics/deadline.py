"""When work is due: by an instant on a monotonic clock, or after so much of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import inf
from time import monotonic, thread_time
from typing import Any

from minsnap.basics.checks import is_number
from minsnap.basics.messages import shown
from minsnap.errors import InputError, SolverError

Clock = Callable[[], float]
"""Reads a monotonic clock [s]."""


def checked_clock(clock: Clock) -> Clock:
    """Return a clock that reads floats, whatever numbers the given one reads; raise InputError for what is none."""
    if not callable(clock):
        raise InputError(f"the clock is {shown(clock)}: give a function that returns seconds")

    def read() -> float:
        seconds = clock()
        if not is_number(seconds):
            raise InputError(f"the clock reads {shown(seconds)}: give one that reads a number of seconds")
        return float(seconds)

    return clock if clock is monotonic else read


LATE = "time_limit has passed without a certified plan: give more time, or loosen limits or walls"

SPENT = (
    "no plan was certified within the work that a question is worth: "
    "loosen limits or walls, or give a time_limit for more"
)


@dataclass(frozen=True)
class WorkPrices:
    """What work is counted as, in milliseconds of a processor, about.

    Parameters
    ----------
    solve : float
        A solve of the native core that does all the work that one is worth.
    rotors_used, yaw_rate_used, limits_used : float
        How far limits are used along a curve: those of rotors, for each of its pieces; those of a yaw; all others.
    pieces_besides : int
        Pieces that the use of rotors takes as long as besides.
    yaw_pieces : int
        Pieces of a yaw that take as long as one of a curve.
    iteration, rotors, yawed, turning : float
        An iteration of a search for the shortest time, for each row; the same with limits of single rotors under any
        yaw, under a constant one, and under one that turns.
    block : float
        Further work of an iteration: for each piece, times the cube of the number of values that are free at a knot.
    active_set, interior_point : float
        A QP by either method, for each entry of its rows and each unknown.
    slacks : float
        A pivot of a programme of slacks, for each entry of its rows.
    term : float
        An exact coefficient that is added to a sum.
    question, legs, pieces : float, int, int
        What a question of so many legs and pieces is worth; it grows with the square of either.
    """

    solve: float = 360.0
    iteration: float = 6e-5
    rotors: float = 1.2e-3
    yawed: float = 2.5e-4
    turning: float = 3.5e-4
    block: float = 5e-6
    rotors_used: float = 0.3
    pieces_besides: int = 5
    yaw_pieces: int = 20
    yaw_rate_used: float = 2.0
    limits_used: float = 0.3
    active_set: float = 1e-5
    interior_point: float = 6e-5
    slacks: float = 4e-6
    term: float = 0.01
    question: float = 2000.0
    legs: int = 5
    pieces: int = 30

    def worth(self, legs: int, pieces: int) -> float:
        """Return what a question of so many legs, and pieces in all, is worth."""
        return self.question * max(1.0, legs / self.legs, pieces / self.pieces) ** 2


WORK = WorkPrices()

IMPROVING, LAST_TRY = 0.5, 0.75
"""Shares of the worth of a question after which what was found is not improved any more, and after one last try."""


@dataclass(eq=False)
class Work:
    """Work on one question, counted, so that neither the machine nor its load decides where a search ends.

    Parameters
    ----------
    worth : float
        Milliseconds of a processor, about, after which nothing new is begun.
    done : float
        So far.
    share : float
        Of the worth, after which what was found is not improved any more.
    known : tuple
        The last searches of the question that ended by themselves, each with what it found: none is made twice.
    remembers : bool
        Whether it is of one question, whose searches are worth to be known.
    """

    worth: float = inf
    done: float = 0.0
    share: float = IMPROVING
    known: tuple[tuple[Any, Any], ...] = ()
    remembers: bool = True

    def __getstate__(self) -> dict[str, Any]:
        """Leave the searches out: they hold memory of the native core."""
        return {**vars(self), "known": ()}

    @property
    def enough(self) -> float:
        """Work from which on what was found is not improved any more."""
        return self.share * self.worth


class Stopwatch:
    """Time on a clock since a start [s], without what other programs took of the processor meanwhile.

    Parameters
    ----------
    clock : callable
        Reads a monotonic clock [s].

    Attributes
    ----------
    began : float
        Its reading at the start [s].
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.restart()

    def restart(self) -> None:
        """Start again."""
        self.began, self._processor = self._clock(), thread_time()

    def lap(self) -> float:
        """Return the seconds since the start, and start again."""
        began, processor = self.began, self._processor
        self.restart()
        return min(self.began - began, self._processor - processor)

    @property
    def seconds(self) -> float:
        """Seconds since the start."""
        return min(self.on_clock, thread_time() - self._processor)

    @property
    def on_clock(self) -> float:
        """The same with what other programs took."""
        return self._clock() - self.began


class LateError(SolverError):
    """Time, work or Ctrl-C ended a search before there was a plan that can be certified."""


@dataclass(eq=False)
class Deadline:
    """When work is due.

    Parameters
    ----------
    due : float
        Reading of the clock by which it must have ended [s].
    clock : callable
        Reads a monotonic clock [s].
    expected : float
        How long the work between two checks may take, as far as is known [s].
    work : Work
        Of the question, which all its deadlines share.
    """

    due: float = inf
    clock: Clock = monotonic
    expected: float = 0.0
    work: Work = field(default_factory=Work)

    def __post_init__(self) -> None:
        self.longest, self._watch = 0.0, Stopwatch(self.clock)

    @property
    def passed(self) -> bool:
        """Whether it is time to end with what was found."""
        return self.late or self.spent

    @property
    def unspent(self) -> float:
        """Work that is left until what was found is not improved any more."""
        return self.work.enough - self.work.done

    @property
    def left_of_work(self) -> float:
        """Work that is left until nothing new is begun."""
        return self.work.worth - self.work.done

    @property
    def solves(self) -> float:
        """The same in solves of the native core that do all the work that one is worth."""
        return max(self.left_of_work, 0.0) / WORK.solve

    @property
    def spent(self) -> bool:
        """Whether so much work is done that a plan that was found is not improved any more."""
        return self.unspent < 0.0

    @property
    def late(self) -> bool:
        """Whether the time allowed is over."""
        return self.due < inf and self.clock() > self.due

    @property
    def left(self) -> float:
        """Seconds until then."""
        return self.due - self.clock()

    @property
    def since(self) -> float:
        """Seconds since the last check, or since this deadline was made."""
        return self._watch.seconds

    def resume(self) -> None:
        """Leave out the time since the last check, in which something ran that has its own end."""
        self._watch.restart()

    def require(self) -> None:
        """Raise LateError if time or work are over."""
        if self.late or self.work.done > self.work.worth:
            raise self.error()

    def error(self) -> LateError:
        """Return the error that says what is over."""
        return LateError(LATE if self.late else SPENT)

    def has_last_try(self) -> bool:
        """Whether work alone is over, for the first time: then a little more is allowed, for what takes little."""
        first = self.spent and not self.late and self.work.share < LAST_TRY
        if first:
            self.work.share = LAST_TRY
        return first

    def until(self, due: float) -> Deadline:
        """Return the same question's deadline at another instant."""
        return replace(self, due=due)

    def spend(self, milliseconds: float) -> None:
        """Count work."""
        self.work.done += milliseconds

    def affords(self, milliseconds: float) -> bool:
        """Whether time and so much more work are left."""
        return not self.late and self.work.done + milliseconds <= self.work.worth

    def check(self) -> None:
        """Raise LateError if the time is over, or will probably be at the next check.

        The next check is taken to be as far away as the longest time between two checks so far.
        """
        self.require()
        if self.due == inf:
            return
        self.longest = max(self.longest, self._watch.lap())
        if self._watch.began + max(self.longest, self.expected) > self.due:
            raise LateError(LATE)


NEVER = Deadline(work=Work(remembers=False))
"""No deadline."""
