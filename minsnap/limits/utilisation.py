"""Utilisation of each limit by a trajectory: exact maxima of polynomials and of their quotients."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Protocol

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.limits.kinds import KIND, Kind
from minsnap.limits.measures import MEASURES, Motion, exact_motion
from minsnap.limits.yaw_rate import largest_yaw_rate
from minsnap.trajectory.medium import Medium
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.trajectory import Trajectory


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
    return _measured(limits, traj, exact_motion(traj, limits.norm, limits.medium.gravity), but)


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
    return _measured(limits, instant, motion, ())


def _measured(limits: Given, traj: Trajectory, motion: Motion, but: Collection[str]) -> tuple[Utilisation, ...]:
    used = []
    for name, limit in limits.given().items():
        kind = KIND[name]
        if name in but:
            continue
        if kind.measure == "yaw_rate":
            used.append(used_at(traj, name, limit, *largest_yaw_rate(traj)))
            continue
        value, piece, s = MEASURES[kind.measure].largest(motion, kind.order)
        instant = float(traj.breaks[piece] + s * traj.durations[piece])
        used.append(Utilisation(name, value, limit, _share(kind, value, limit), piece // traj.pieces, instant))
    return tuple(used)


def used_at(
    traj: Trajectory, name: str, limit: float, value: float, instant: float, method: str = "exact"
) -> Utilisation:
    """Return the utilisation of a limit by a value that is reached at an instant [s]."""
    return Utilisation(name, value, limit, _share(KIND[name], value, limit), leg_at(traj, instant), instant, method)


def leg_at(traj: Trajectory, instant: float) -> int:
    """Leg of a trajectory at an instant [s]."""
    return int(np.clip(np.searchsorted(traj.leg_breaks, instant, side="right") - 1, 0, traj.legs - 1))


def _share(kind: Kind, value: float, limit: float) -> float:
    """Share of a limit that a value uses; 1 is fully used, also for a lower bound."""
    if not kind.least:
        return float(max(value / limit, 0.0))
    return float(limit / value) if value > 0.0 else float(np.inf)
