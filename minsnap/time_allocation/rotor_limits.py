r"""The rotors' thrusts as conditions of the joint search.

With f along the thrust axis (:mod:`minsnap.trajectory.medium`) and :math:`c = \|f\|`, without spin about that axis the
angular acceleration is :math:`\|w\| / c` with :math:`w = \ddot f_\perp - 2 \dot c\, \dot f_\perp / c`, wherever the
body points about that axis; the rotor that has most to do has at most the mean thrust, the largest arm's share of the
torque, and its share of that about the axis, which unequal inertias ask for. With a yaw the body axes follow from it
(D. Mellinger and V. Kumar, ICRA 2011), as do rates and accelerations, by differentiating :math:`x \cdot f = y \cdot f =
y \cdot h = 0`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.limits.proved_bound import MARGIN
from minsnap.limits.vehicle_drag import medium_of
from minsnap.native.joint_steps import UNSPUN_ROTORS, YAWED_ROTORS
from minsnap.optimisation.units import Units
from minsnap.time_allocation.momentary_limits import (
    TINY,
    Excess,
    Momentary,
    MomentaryLimit,
    lift_of,
    orders_of,
    thrust_of,
)
from minsnap.trajectory.medium import Medium, inner, norm
from minsnap.vehicle.quadrotor import Quadrotor


@dataclass(frozen=True)
class RotorRange:
    """Least and most thrust that a rotor may be asked for [N]."""

    least: float
    most: float

    @classmethod
    def of(cls, vehicle: Quadrotor, reserve: float) -> RotorRange:
        """Return the range that leaves a share of the room around hover to feedback, and what its proof needs."""
        hover, (least, most) = vehicle.hover_thrust, vehicle.rotor_thrust_limits
        below, above = ((1.0 - reserve) * room - MARGIN * hover for room in (hover - least, most - hover))
        return cls(hover - below, hover + above)


def rotor_block(vehicle: Quadrotor, reserve: float, units: Units, pieces: int, yaw: float | None) -> Momentary:
    """Conditions on the rotors' thrusts for a constant yaw, or for none: without spin, however the body is turned."""
    allowed, medium = RotorRange.of(vehicle, reserve), medium_of(vehicle)
    leverage, gyration = _leverage(vehicle), _gyration(vehicle)
    scale = 0.25 * allowed.most / leverage * vehicle.gravity
    common = (*medium.values, vehicle.mass, allowed.least, allowed.most)
    if yaw is None:
        excess, count, kind, parameters = (
            unspun(vehicle, medium, allowed),
            2,
            UNSPUN_ROTORS,
            (*common, leverage, gyration),
        )
    else:
        excess, count, kind = with_yaw(vehicle, medium, allowed, yaw), 8, YAWED_ROTORS
        body = (*vehicle.inertia.reshape(-1), *vehicle.inverse_mixer.reshape(-1))
        parameters = (*common, np.cos(yaw), np.sin(yaw), *body)
    limit = MomentaryLimit(
        excess, orders_of(medium, 4), count, scale, kind, tuple(map(float, parameters)), "rotor_thrust"
    )
    return Momentary(limit, units, pieces)


def _leverage(vehicle: Quadrotor) -> float:
    """Most thrust of a rotor for an angular acceleration of one about any horizontal body axis [N s^2/rad]."""
    return float(np.linalg.norm(vehicle.inverse_mixer[:, 1:3] @ vehicle.inertia[:2, :2], axis=1).max())


def _gyration(vehicle: Quadrotor) -> float:
    """Most thrust of a rotor for a turn at a rate of one, whose torque comes from unequal inertias [N s^2]."""
    (first, mixed), (_, second) = vehicle.inertia[:2, :2]
    return float(np.abs(vehicle.inverse_mixer[:, 3]).max() * np.hypot((second - first) / 2.0, mixed))


def unspun(vehicle: Quadrotor, medium: Medium, allowed: RotorRange) -> Excess:
    """Excess above the most and below the least thrust, the latter times the thrust per mass."""
    share, gyration, mass, gravity = _leverage(vehicle), _gyration(vehicle), vehicle.mass, vehicle.gravity

    def excess(x: dict[int, FloatArray]) -> FloatArray:
        force, change, bend = lift_of(medium, x, 2)
        thrust = norm(force, TINY * gravity**2)
        axis = force / thrust[..., None]
        pull = inner(axis, change)
        across = change - axis * pull[..., None]
        turn = bend - axis * inner(axis, bend)[..., None] - 2.0 * across * (pull / thrust)[..., None]
        mean = mass * thrust_of(medium, force, x) / 4.0
        push = share * norm(turn, TINY * (allowed.most * gravity / share) ** 2)
        push = push + gyration * inner(across, across) / thrust
        above = (mean + push / thrust - allowed.most) / allowed.most
        below = (push - (mean - allowed.least) * thrust) / (allowed.most * 2.0 * gravity)
        return np.stack((above, below), axis=-1)

    return excess


def with_yaw(vehicle: Quadrotor, medium: Medium, allowed: RotorRange, yaw: float) -> Excess:
    """Excess of every rotor above the most thrust, then of every rotor below the least."""
    heading = np.array([np.cos(yaw), np.sin(yaw), 0.0])

    def excess(x: dict[int, FloatArray]) -> FloatArray:
        force, change, bend = lift_of(medium, x, 2)
        rates, accelerations = _turning(force, norm(force, TINY * vehicle.gravity**2), change, bend, heading)
        torque = accelerations @ vehicle.inertia.T + np.cross(rates, rates @ vehicle.inertia.T)
        thrust = vehicle.mass * thrust_of(medium, force, x)
        wrench = np.concatenate((thrust[..., None], torque), axis=-1)
        rotors = wrench @ vehicle.inverse_mixer.T
        return np.concatenate((rotors - allowed.most, allowed.least - rotors), axis=-1) / allowed.most

    return excess


def _turning(
    force: FloatArray, thrust: FloatArray, jerk: FloatArray, snap: FloatArray, heading: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Body rates and angular accelerations, each (..., 3), for a constant yaw."""
    z, lateral = force / thrust[..., None], np.cross(force, heading)
    y = lateral / norm(lateral)[..., None]
    x = np.cross(y, z)
    forward, upward, pull = inner(x, heading), inner(z, heading), inner(z, jerk) / thrust
    p, q = -inner(y, jerk) / thrust, inner(x, jerk) / thrust
    r = p * upward / forward
    p_rate = r * q - 2.0 * p * pull - inner(y, snap) / thrust
    q_rate = inner(x, snap) / thrust - r * p - 2.0 * q * pull
    r_rate = (p * q * forward + r * q * upward + p_rate * upward) / forward
    return np.stack((p, q, r), axis=-1), np.stack((p_rate, q_rate, r_rate), axis=-1)
