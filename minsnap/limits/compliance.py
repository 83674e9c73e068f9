"""From which instant on a trajectory keeps its limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from minsnap.basics.tolerances import EXACT
from minsnap.limits.limits import Limits
from minsnap.limits.utilisation import largest_yaw_rate, leg_at
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.trajectory import Trajectory

KEPT = EXACT
"""How far above 1 a utilisation may be."""


def use_from(limits: Limits, trajectory: Trajectory, start: float) -> tuple[Utilisation, ...]:
    """Utilisation of every limit from an instant on [s]; legs and instants are those of the whole trajectory."""
    if start <= 0.0:
        return limits.utilisation(trajectory)
    used = limits.utilisation(trajectory.between(start, trajectory.duration))
    return tuple(_moved(entry, trajectory, start) for entry in used)


def _moved(used: Utilisation, trajectory: Trajectory, start: float) -> Utilisation:
    instant = used.instant + start
    return replace(used, leg=leg_at(trajectory, instant), instant=instant)


def kept_from(limits: Limits, trajectory: Trajectory) -> float:
    """First instant from which all limits are kept to the end [s]: 0 where they always are.

    Returns
    -------
    float
        By bisection, to a billionth of the duration, never too early; the duration where they are not kept at the end.
    """
    return first_from(lambda start: keeps(limits, trajectory, start), trajectory.duration, 1e-9 * trajectory.duration)


def first_from(holds: Callable[[float], bool], latest: float, precision: float) -> float:
    """First instant from which something holds to the end, by bisection to a precision, never too early [s]."""
    low, high = 0.0, 0.0 if holds(0.0) else latest
    while high - low > precision:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def keeps(limits: Limits, trajectory: Trajectory, start: float = 0.0) -> bool:
    """Whether a trajectory keeps all limits from an instant on [s]."""
    if start <= 0.0 and largest_use(limits, trajectory, proved=False) > 1.0 + KEPT:
        return False  # at samples already, which take less time than a proof
    return all(used.fraction <= 1.0 + KEPT for used in use_from(limits, trajectory, start))


def turns_within(limits: Limits | None, trajectory: Trajectory) -> bool:
    """Whether a trajectory keeps the limit on the yaw rate."""
    most = None if limits is None else limits.yaw_rate
    return most is None or largest_yaw_rate(trajectory)[0] <= most * (1.0 + KEPT)


def most_used(limits: Limits, trajectory: Trajectory, proved: bool = True) -> Utilisation:
    """Return the limit that is used most over all time; see ``Limits.utilisation``."""
    return max(limits.utilisation(trajectory, proved), key=lambda used: used.fraction)


def largest_use(limits: Limits, trajectory: Trajectory, proved: bool = True) -> float:
    """Share of the most used limit over all time, 0 without limits; see ``Limits.utilisation``."""
    return max((used.fraction for used in limits.utilisation(trajectory, proved)), default=0.0)
