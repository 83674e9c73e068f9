"""Utilisation of each limit by a trajectory: exact maxima of polynomials, of their quotients, of yaw rates."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.limit_kinds import KIND, Kind
from minsnap.limits.measures import MEASURES, Motion, exact_motion
from minsnap.native.thrust_axis import thrust_peaks
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.trajectory import Trajectory


def measured(bounds: Mapping[str, float], traj: Trajectory, norm: str, gravity: float) -> tuple[Utilisation, ...]:
    """Measure limits, by name, over all time of a trajectory; exactly, but for the drag."""
    orders = [KIND[name].order for name in bounds if KIND[name].measure == "norm"] if norm == "euclidean" else []
    norms = dict(zip(orders, traj.max_norms([min(p, traj.degree + 1) for p in orders]) if orders else [], strict=True))
    measures = {KIND[name].measure for name in bounds}
    peaks = thrust_peaks(traj.control_points, traj.durations, gravity, measures)
    motion: Motion | None = None
    used = []
    for name, limit in bounds.items():
        kind = KIND[name]
        if kind.measure == "yaw_rate":
            used.append(used_at(traj, name, limit, *largest_yaw_rate(traj)))
        elif kind.order in norms and kind.measure == "norm":
            used.append(used_at(traj, name, limit, *norms[kind.order]))
        else:
            peak = peaks.get(kind.measure)
            if peak is None:
                motion = motion or exact_motion(traj, norm, gravity)
                peak = MEASURES[kind.measure].largest(motion, kind.order)
            value, piece, s = peak
            instant = float(traj.breaks[piece] + s * traj.durations[piece])
            used.append(Utilisation(name, value, limit, _share(kind, value, limit), piece // traj.pieces, instant))
    return tuple(used)


def speed_of_legs(traj: Trajectory, speeds: FloatArray, norm: str, gravity: float) -> Utilisation:
    """Return the use of the speed on the leg where most of its own limit is used; speeds are of each leg (legs,)."""
    found: list[Utilisation] = []
    for leg, (limit, start) in enumerate(zip(speeds.tolist(), traj.leg_breaks.tolist(), strict=False)):
        own = slice(leg * traj.pieces, (leg + 1) * traj.pieces)
        part = Trajectory(traj.control_points[own], traj.durations[own], pieces=traj.pieces)
        (used,) = measured({"speed": limit}, part, norm, gravity)
        found.append(replace(used, leg=leg, instant=start + used.instant))
    return max(found, key=lambda used: used.fraction)


def at_instant(bounds: Mapping[str, float], state: Motion) -> tuple[Utilisation, ...]:
    """Measure limits, by name, in the state at one instant; the yaw is no part of it."""
    values = {
        name: float(MEASURES[KIND[name].measure].sampled(state, KIND[name].order)[0])
        for name in bounds
        if KIND[name].measure in MEASURES
    }
    return tuple(
        Utilisation(name, value, bounds[name], _share(KIND[name], value, bounds[name]), 0, 0.0)
        for name, value in values.items()
    )


def used_at(
    traj: Trajectory, name: str, limit: float, value: float, instant: float, method: str = "exact"
) -> Utilisation:
    """Return the utilisation of a limit by a value that is reached at an instant [s]."""
    return Utilisation(name, value, limit, _share(KIND[name], value, limit), leg_at(traj, instant), instant, method)


def leg_at(traj: Trajectory, instant: float) -> int:
    """Leg of a trajectory at an instant [s]."""
    return min(bisect_right(traj.leg_breaks.tolist(), instant), traj.legs) - 1


def _share(kind: Kind, value: float, limit: float) -> float:
    """Share of a limit that a value uses; 1 is fully used, also for a lower bound."""
    if not kind.least:
        return float(max(value / limit, 0.0))
    return float(limit / value) if value > 0.0 else float(np.inf)


def largest_yaw_rate(traj: Trajectory) -> tuple[float, float, str]:
    """Largest yaw rate [rad/s], its instant [s], and its method, ``"exact"`` or ``"sampled"``."""
    largest = traj.yaw.largest_rate(0.0, traj.duration)
    return _sampled(traj) if largest is None else (*largest, "exact")


def _sampled(traj: Trajectory) -> tuple[float, float, str]:
    """Of a yaw rate that is no polynomial and no quotient of polynomials."""
    grid = traj.breaks[:-1, None] + traj.durations[:, None] * np.linspace(0.0, 1.0, 200)
    instants = np.minimum(grid.reshape(-1), traj.duration)
    rates = np.abs(traj.yaw(instants, 1))
    return float(rates.max()), float(instants[rates.argmax()]), "sampled"
