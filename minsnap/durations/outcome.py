"""How a question about durations ends: in one value, which functions return, with a plan or with the reason for none.

What is raised below this room, by solves, factors on time and deadlines, becomes a value here; where a public call ends
the reason is raised, once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from typing import TypeVar

from minsnap.basics.deadline import LateError
from minsnap.durations.timing import Timed
from minsnap.errors import InfeasibleError, LimitError, MinsnapError, SolverError, YawError

Value = TypeVar("Value")


class End(Enum):
    """How a question ended."""

    KEPT = "there is a plan"
    SPENT = "time, work or Ctrl-C ended it; the plan, if any, is the best so far"
    REFUSED = "there is none, for a reason with its evidence"


@dataclass(frozen=True, eq=False)
class PlanOutcome:
    """How a question ended.

    Parameters
    ----------
    planned : Timed or None
        The plan, which keeps everything.
    reason : MinsnapError or None
        Why there is none.
    """

    planned: Timed | None = None
    reason: MinsnapError | None = None

    @property
    def end(self) -> End:
        """Whether it is kept, spent or refused."""
        if self.planned is not None:
            return End.SPENT if self.planned.interrupted else End.KEPT
        return End.SPENT if isinstance(self.reason, LateError) else End.REFUSED

    @property
    def refused(self) -> InfeasibleError | SolverError | None:
        """The reason where other times or pieces may have a plan; None for a plan, bad input, or no time left."""
        reason = self.reason
        return reason if isinstance(reason, InfeasibleError | SolverError) and self.end is End.REFUSED else None

    @property
    def stands_in(self) -> bool:
        """Whether the plan stands in for the end of a search, and there is time left for others."""
        return self.planned is not None and self.planned.stands_in and self.end is End.KEPT

    def or_quicker(self, other: PlanOutcome) -> PlanOutcome:
        """Return the plan of the shorter flight, the reason of this one where neither has any."""
        plan = quickest((self, other))
        return self if plan is None or plan is self.planned else other

    def plan(self) -> Timed:
        """Return the plan.

        Raises
        ------
        MinsnapError
            The reason, where there is none.
        """
        if self.planned is None:
            assert self.reason is not None
            raise self.reason
        return self.planned


def outcome_of(attempt: Callable[[], Timed | PlanOutcome | MinsnapError]) -> PlanOutcome:
    """Return how an attempt ends."""
    try:
        ended = attempt()
    except (InfeasibleError, SolverError, LimitError) as reason:
        ended = reason
    if isinstance(ended, PlanOutcome):
        return ended
    return PlanOutcome(reason=ended) if isinstance(ended, MinsnapError) else PlanOutcome(ended)


def if_possible(attempt: Callable[[], Value | None]) -> Value | None:
    """Return what an attempt finds; None where a solve, a limit, a yaw or the end of time is in its way."""
    with suppress(InfeasibleError, SolverError, LimitError, YawError):
        return attempt()
    return None


def or_reason(attempt: Callable[[], Value]) -> Value | LimitError | SolverError | YawError:
    """Return what an attempt finds, or why its curve is none at any factor on time; the end of time goes on."""
    try:
        return attempt()
    except LateError:
        raise
    except (LimitError, SolverError, YawError) as reason:
        return reason


def quickest(outcomes: Iterable[PlanOutcome | Timed | None]) -> Timed | None:
    """Return the plan of the shortest flight, the first of equal ones; None without any."""
    plans = (one.planned if isinstance(one, PlanOutcome) else one for one in outcomes)
    return min((one for one in plans if one is not None), key=lambda one: one.trajectory.duration, default=None)
