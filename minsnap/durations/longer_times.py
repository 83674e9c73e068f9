"""Plans in longer times, where those that were given have none.

Their proportions are tried at many scales with the limits as walls; the first that has a plan is shortened as far as it
keeps one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import LONGEST, SHORTEST
from minsnap.basics.deadline import Deadline
from minsnap.durations.timing import Timed

BARELY = (5e-4, 3e-3)
"""Shares by which durations are lengthened where about as long ones have a plan."""

LONGER = (*BARELY, 0.02, 0.1, 0.2, 0.5, 1.5, 4.0, 14.0, 60.0, 400.0)
"""Shares by which durations are lengthened until a plan for them succeeds, however long it takes."""

Attempt = Callable[[FloatArray], Timed | None]
"""Plans for piece durations [s]; None where there is no plan, or it is not certified."""


def least_longer(attempt: Attempt, durations: FloatArray, deadline: Deadline) -> Timed | None:
    """Return the plan of the least factor on durations, from one on; None where no factor has one.

    Parameters
    ----------
    attempt : callable
    durations : ndarray, shape (pieces in all,)
        Whose proportions are kept [s].
    deadline : Deadline
        From which a plan that was found is not shortened any more, and no other is sought.
    """
    first = _first(attempt, durations)
    if first is None:
        return None
    low, high, shortest = first
    while high / low > 1.01 and not deadline.passed:
        middle = float(np.sqrt(low * high))
        shorter = _attempted(attempt, durations * middle)
        low, high = (middle, high) if shorter is None else (low, middle)
        shortest = min(shortest, shorter or shortest, key=lambda one: one.trajectory.duration)
    return shortest


Bracket = tuple[float, float, Timed]
"""The last factor without a plan, the first with one, and the plan."""


def _first(attempt: Attempt, durations: FloatArray) -> Bracket | None:
    """Return the first factor of all that has a plan, sought from a usual one: what barely fails costs most."""
    factors = [1.0 + share for share in LONGER]
    usual = len(BARELY)
    planned = _attempted(attempt, durations * factors[usual])
    if planned is not None:
        return _falling(attempt, durations, factors[:usual], (1.0, factors[usual], planned))
    return _rising(attempt, durations, factors[usual], factors[usual + 1 :])


def _falling(attempt: Attempt, durations: FloatArray, factors: Sequence[float], first: Bracket) -> Bracket:
    """Return the first of rising factors from which on all have a plan, the best plan with it."""
    low, high, best = first
    for factor in reversed(factors):
        planned = _attempted(attempt, durations * factor)
        if planned is None:
            return factor, high, best
        high, best = factor, min(planned, best, key=lambda one: one.trajectory.duration)
    return low, high, best


def _rising(attempt: Attempt, durations: FloatArray, low: float, factors: Sequence[float]) -> Bracket | None:
    """Return the first of some factors, above a low one, that has a plan."""
    for high in factors:
        planned = _attempted(attempt, durations * high)
        if planned is not None:
            return low, high, planned
        low = high
    return None


def _attempted(attempt: Attempt, durations: FloatArray) -> Timed | None:
    within = bool(((durations >= SHORTEST) & (durations <= LONGEST)).all())
    return attempt(durations) if within else None
