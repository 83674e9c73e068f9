"""What a flight does leg by leg: how long it takes, how fast it is, which limits bind; and what would shorten it.

A limit binds where at least 99 % of it is used, at the middles of 64 equal parts of every polynomial.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.cached import cached_property
from minsnap.basics.limit_kinds import KIND
from minsnap.trajectory.norm_maxima import norm_maxima

BINDING = 0.99
"""Share of a limit from which it binds."""

INSTANTS = 64
"""Of every polynomial, at which uses of limits are sampled."""

Shares = Callable[[FloatArray], Mapping[str, FloatArray]]
"""Uses of limits by name at instants (m,) [s], (m,) each; 1 is fully used."""


@dataclass(frozen=True)
class LegUse:
    """One leg of a flight.

    Parameters
    ----------
    leg : int
    start, duration : float
        When it begins, and how long it takes [s].
    mean_speed, max_speed : float
        Length of the way over the duration, to about 1e-4 of it, and the greatest speed, exact [m/s].
    binding : tuple of (str, float)
        Names of the limits that bind on it and for how long [s], the longest first.
    """

    leg: int
    start: float
    duration: float
    mean_speed: float
    max_speed: float
    binding: tuple[tuple[str, float], ...] = ()

    @property
    def limit(self) -> str | None:
        """Name of the limit that binds longest; None where none does."""
        return self.binding[0][0] if self.binding else None


@dataclass(frozen=True)
class Sensitivity:
    """How much longer a flight takes for one unit more of a limit, or of room at a waypoint.

    Parameters
    ----------
    name : str
        Of the limit; or "gate", "ball" or "box": all edges outwards, or the half-width.
    waypoint : int or None
        Which waypoint it is; None of a limit.
    value : float
        The limit in its unit, or the smallest distance from the middle to the edge [m].
    seconds : float
        Per unit [s]; negative where more of it shortens the flight.
    """

    name: str
    waypoint: int | None
    value: float
    seconds: float

    @property
    def unit(self) -> str:
        """Unit of the value."""
        return "m" if self.waypoint is not None else KIND[self.name].unit

    @property
    def label(self) -> str:
        """What it is, for a person."""
        return KIND[self.name].label if self.waypoint is None else f"{self.name} of waypoint {self.waypoint}"


class PlainLegs:
    """What the report of a plan without limits knows of its legs, measured at the first use.

    Parameters
    ----------
    curve : Trajectory
    """

    sensitivities: tuple[Sensitivity, ...] = ()

    def __init__(self, curve: Any) -> None:
        self._curve = curve.with_yaw(curve.yaw)  # without its report, which keeps this

    @cached_property
    def legs(self) -> tuple[LegUse, ...]:
        """Each leg of the flight."""
        return leg_uses(self._curve)


def leg_uses(curve: Any, shares: Shares | None = None) -> tuple[LegUse, ...]:
    """Return what a flight does leg by leg.

    Parameters
    ----------
    curve : Trajectory
    shares : callable, optional
        Uses of its limits.
    """
    middles = (np.arange(INSTANTS) + 0.5) / INSTANTS
    t = (curve.breaks[:-1, None] + curve.durations[:, None] * middles).reshape(-1)
    part = np.repeat(curve.durations / INSTANTS, INSTANTS)
    per_leg = curve.pieces * INSTANTS
    speed = np.sqrt((curve(t, 1) ** 2).sum(axis=1))
    ways = (part * speed).reshape(-1, per_leg).sum(axis=1)
    bound = {name: part * (share >= BINDING) for name, share in (shares(t) if shares is not None else {}).items()}
    times = {name: seconds.reshape(-1, per_leg).sum(axis=1) for name, seconds in bound.items()}
    starts, durations = curve.leg_breaks[:-1], np.diff(curve.leg_breaks)
    legs = []
    for leg in range(curve.legs):
        found = sorted(((name, float(own[leg])) for name, own in times.items() if own[leg] > 0.0), key=lambda e: -e[1])
        figures = float(starts[leg]), float(durations[leg]), float(ways[leg] / durations[leg]), _fastest(curve, leg)
        legs.append(LegUse(leg, *figures, tuple(found)))
    return tuple(legs)


def _fastest(curve: Any, leg: int) -> float:
    own = slice(leg * curve.pieces, (leg + 1) * curve.pieces)
    durations = np.ascontiguousarray(curve.durations[own])
    breaks = np.concatenate(([0.0], np.cumsum(durations)))
    return norm_maxima(np.ascontiguousarray(curve.control_points[own]), durations, breaks, [1])[0][0]
