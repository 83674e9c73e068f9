"""Limits that depend on several derivatives at an instant, as the native search knows them: kinds and parameters.

Their functions stand in ``src/shortest_time/instant_limits.hpp``.  Rotors are limited for a constant yaw; for any other
without spin about the thrust axis, however the body is turned: the rotor that has most to do has at most the mean
thrust, the largest arm's share of the torque, and its share of that about the axis, which unequal inertias ask for.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.limits.proved_bound import MARGIN
from minsnap.limits.vehicle_drag import medium_of
from minsnap.native.shortest_time import InstantKind, InstantLimit
from minsnap.time_allocation.initial_guess import stop_and_go_times
from minsnap.trajectory.heading import Heading
from minsnap.vehicle.quadrotor import Quadrotor


def instant_limits(limits: Limits, heading: Heading | None, lengths: FloatArray) -> list[InstantLimit]:
    """Return the limits that are no sets of one derivative, to thirteen digits: no rounding of a library may decide.

    Parameters
    ----------
    limits : Limits
    heading : Heading or None
        Of any curve of the task.
    lengths : ndarray, shape (legs,)
        Of the legs, none very short [m].
    """
    medium = limits.medium
    share = 1.0 - MARGIN if medium.drags else 1.0
    entries = []
    if medium.drags and limits.min_thrust is not None:
        entries.append(InstantLimit(InstantKind.LEAST_THRUST, (*medium.values, limits.min_thrust / share)))
    if medium.drags and limits.max_thrust is not None:
        entries.append(InstantLimit(InstantKind.MOST_THRUST, (*medium.values, limits.max_thrust * share)))
    if medium.drags and limits.tilt is not None:
        entries.append(InstantLimit(InstantKind.TILT, (*medium.values, float(np.tan(limits.tilt * share)))))
    if limits.body_rate is not None:
        entries.append(InstantLimit(InstantKind.BODY_RATE, (*medium.values, limits.body_rate * share)))
    if isinstance(limits, VehicleLimits):
        entries.append(_rotors(limits.vehicle, limits.reserve, None if heading is None else heading.constant))
    if limits.yaw_rate is not None and heading is not None:
        speed = float((lengths / stop_and_go_times(lengths, limits)).mean())
        entries += heading.rate_limits(limits.yaw_rate, float(lengths.mean()), speed)
    return [replace(one, parameters=tuple(float(f"{value:.13g}") for value in one.parameters)) for one in entries]


def _rotors(vehicle: Quadrotor, reserve: float, yaw: float | None) -> InstantLimit:
    """Limit the rotors' thrusts to a share of their room around hover, less what its proof needs."""
    hover, (least, most) = vehicle.hover_thrust, vehicle.rotor_thrust_limits
    below, above = ((1.0 - reserve) * room - MARGIN * hover for room in (hover - least, most - hover))
    common = (*medium_of(vehicle).values, vehicle.mass, hover - below, hover + above)
    if yaw is None:
        return InstantLimit(InstantKind.UNSPUN_ROTORS, (*common, _leverage(vehicle), _gyration(vehicle)))
    body = (*vehicle.inertia.reshape(-1), *vehicle.inverse_mixer.reshape(-1))
    return InstantLimit(InstantKind.YAWED_ROTORS, (*common, float(np.cos(yaw)), float(np.sin(yaw)), *map(float, body)))


def _leverage(vehicle: Quadrotor) -> float:
    """Most thrust of a rotor for an angular acceleration of one about any horizontal body axis [N s^2/rad]."""
    return float(np.linalg.norm(vehicle.inverse_mixer[:, 1:3] @ vehicle.inertia[:2, :2], axis=1).max())


def _gyration(vehicle: Quadrotor) -> float:
    """Most thrust of a rotor for a turn at a rate of one, whose torque comes from unequal inertias [N s^2]."""
    (first, mixed), (_, second) = vehicle.inertia[:2, :2]
    return float(np.abs(vehicle.inverse_mixer[:, 3]).max() * np.hypot((second - first) / 2.0, mixed))
