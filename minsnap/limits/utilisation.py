"""Utilisation of each limit by a trajectory: exact maxima of polynomials and of their quotients."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from minsnap.basics.limit_kinds import KIND, Kind
from minsnap.limits.measures import MEASURES, Motion
from minsnap.limits.yaw_rate import largest_yaw_rate
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.trajectory import Trajectory


def measured(bounds: Mapping[str, float], traj: Trajectory, motion: Motion) -> tuple[Utilisation, ...]:
    """Measure limits, by name, over all time of a trajectory with these derivatives."""
    used = []
    for name, limit in bounds.items():
        kind = KIND[name]
        if kind.measure == "yaw_rate":
            used.append(used_at(traj, name, limit, *largest_yaw_rate(traj)))
            continue
        value, piece, s = MEASURES[kind.measure].largest(motion, kind.order)
        instant = float(traj.breaks[piece] + s * traj.durations[piece])
        used.append(Utilisation(name, value, limit, _share(kind, value, limit), piece // traj.pieces, instant))
    return tuple(used)


def used_at(traj: Trajectory, name: str, limit: float, value: float, instant: float, method: str) -> Utilisation:
    """Return the utilisation of a limit by a value that is reached at an instant [s]."""
    return Utilisation(name, value, limit, _share(KIND[name], value, limit), leg_at(traj, instant), instant, method)


def leg_at(traj: Trajectory, instant: float) -> int:
    """Leg of a trajectory at an instant [s]."""
    return min(int(np.searchsorted(traj.leg_breaks, instant, side="right")), traj.legs) - 1


def _share(kind: Kind, value: float, limit: float) -> float:
    """Share of a limit that a value uses; 1 is fully used, also for a lower bound."""
    if not kind.least:
        return float(max(value / limit, 0.0))
    return float(limit / value) if value > 0.0 else float(np.inf)
