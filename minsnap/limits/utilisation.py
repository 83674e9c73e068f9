"""Utilisation of each limit by a trajectory: exact maxima of polynomials and of their quotients."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Protocol

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.limits.kinds import KIND, Kind
from minsnap.limits.measures import MEASURES, Found, Motion, exact_motion
from minsnap.trajectory.heading import ConstantHeading, RemappedHeading
from minsnap.trajectory.look_at import LookAtHeading
from minsnap.trajectory.medium import Medium
from minsnap.trajectory.path import Heading
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.tilt_heading import TiltHeading
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.turn_rates import largest_heading_rate, largest_look_rate
from minsnap.trajectory.velocity_heading import VelocityHeading

YAW_RATE = 200
"""Samples per leg of a yaw rate that is not a polynomial."""


class Given(Protocol):
    """Protocol of the limits measured here."""

    @property
    def norm(self) -> str:
        """Norm of speed to snap."""

    @property
    def medium(self) -> Medium:
        """Gravity and drag."""

    def given(self) -> dict[str, float]:
        """Return the limits that are set, by name."""


def measure_all(limits: Given, traj: Trajectory, but: Collection[str] = ()) -> tuple[Utilisation, ...]:
    """Measure every limit that is set, in the order of its fields, but for those named; drag is left out."""
    motion = exact_motion(traj, limits.norm, limits.medium.gravity)
    return tuple(_Measures(limits, traj, motion).all(but))


def measure_state(limits: Given, derivatives: Mapping[int, FloatArray], dim: int) -> tuple[Utilisation, ...]:
    """Measure the state at a single instant.

    Parameters
    ----------
    derivatives : mapping of int to ndarray, shape (dim,)
        By order; those missing are zero.
    dim : int
    """
    instant = Trajectory(np.zeros((1, 1, dim)), np.ones(1))
    motion = Motion(lambda order: derivatives.get(order, np.zeros(dim)).reshape(1, 1, dim), limits.norm, limits.medium)
    return tuple(_Measures(limits, instant, motion).all(()))


class _Measures:
    """The measurement of each limit on one trajectory."""

    def __init__(self, limits: Given, traj: Trajectory, motion: Motion) -> None:
        self.limits, self.traj, self.motion = limits, traj, motion

    def all(self, but: Collection[str]) -> Iterator[Utilisation]:
        """Iterate over the limits that are set, but for those named."""
        for name, limit in self.limits.given().items():
            kind = KIND[name]
            if name in but:
                continue
            if kind.measure == "yaw_rate":
                yield self._yaw_rate(limit)
            else:
                yield self._used(kind, limit, MEASURES[kind.measure].largest(self.motion, kind.order))

    def _used(self, kind: Kind, limit: float, found: Found) -> Utilisation:
        value, piece, s = found
        instant = float(self.traj.breaks[piece] + s * self.traj.durations[piece])
        return Utilisation(kind.name, value, limit, used_share(kind, value, limit), piece // self.traj.pieces, instant)

    def _yaw_rate(self, limit: float) -> Utilisation:
        heading: Heading = self.traj.yaw
        rate = 1.0
        while isinstance(heading, RemappedHeading) and heading.start == 0.0:
            rate *= heading.rate
            heading = heading.heading
        if isinstance(heading, PlannedHeading):
            value, instant = heading.trajectory.max_norm(1)
            return self._yaw_used(value * rate, limit, instant / rate, "exact")
        if isinstance(heading, (ConstantHeading, TiltHeading)):
            return self._yaw_used(0.0, limit, 0.0, "exact")
        if isinstance(heading, VelocityHeading) and isinstance(heading.path, Trajectory):
            value, instant = largest_heading_rate(heading, heading.path)
            return self._yaw_used(value * abs(rate), limit, instant / rate, "exact")
        if isinstance(heading, LookAtHeading) and isinstance(heading.path, Trajectory):
            value, instant = largest_look_rate(heading, heading.path)
            return self._yaw_used(value * abs(rate), limit, instant / rate, "exact")
        grid = self.traj.breaks[:-1, None] + self.traj.durations[:, None] * np.linspace(0.0, 1.0, YAW_RATE)
        instants = np.minimum(grid.reshape(-1), self.traj.duration)
        rates = np.abs(self.traj.yaw(instants, 1))
        return self._yaw_used(float(rates.max()), limit, float(instants[rates.argmax()]), "sampled")

    def _yaw_used(self, value: float, limit: float, instant: float, method: str) -> Utilisation:
        return Utilisation("yaw_rate", value, limit, value / limit, leg_at(self.traj, instant), instant, method)


def leg_at(traj: Trajectory, instant: float) -> int:
    """Leg of a trajectory at an instant [s]."""
    return int(np.clip(np.searchsorted(traj.leg_breaks, instant, side="right") - 1, 0, traj.legs - 1))


def used_share(kind: Kind, value: float, limit: float) -> float:
    """Share of a limit that a value uses; 1 is fully used, also for a lower bound."""
    if not kind.least:
        return float(max(value / limit, 0.0))
    return float(limit / value) if value > 0.0 else float(np.inf)
