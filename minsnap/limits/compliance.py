"""From which instant on a trajectory keeps its limits."""

from __future__ import annotations

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
    if keeps(limits, trajectory):
        return 0.0
    low, high = 0.0, trajectory.duration
    while high - low > 1e-9 * trajectory.duration:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if keeps(limits, trajectory, middle) else (middle, high)
    return high


def keeps(limits: Limits, trajectory: Trajectory, start: float = 0.0) -> bool:
    """Whether a trajectory keeps all limits from an instant on [s]."""
    return all(used.fraction <= 1.0 + KEPT for used in use_from(limits, trajectory, start))


def turns_within(limits: Limits | None, trajectory: Trajectory) -> bool:
    """Whether a trajectory keeps the limit on the yaw rate."""
    most = None if limits is None else limits.yaw_rate
    return most is None or largest_yaw_rate(trajectory)[0] <= most * (1.0 + KEPT)


def most_used(limits: Limits, trajectory: Trajectory) -> Utilisation:
    """Return the limit that is used most over all time."""
    return max(limits.utilisation(trajectory), key=lambda used: used.fraction)


def largest_use(limits: Limits, trajectory: Trajectory, proved: bool = True) -> float:
    """Share of the most used limit over all time, 0 without limits; see ``Limits.utilisation``."""
    return max((used.fraction for used in limits.utilisation(trajectory, proved)), default=0.0)
