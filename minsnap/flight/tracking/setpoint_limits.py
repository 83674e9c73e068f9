r"""What corrected setpoints may ask of a vehicle, as convex sets of their derivatives with the nearest point of each.

The sets are balls, slabs, and for the tilt the cone :math:`\|a_{xy}\| \le \tan\theta\,(g + a_z)`; what is nearest in a
cone is in closed form (S. Boyd and L. Vandenberghe, Convex Optimization, 2004, exercise 8.3).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.limit_kinds import KIND
from minsnap.limits import MEASURES, ORDINARY, Limits, Motion
from minsnap.trajectory import Samples

ROOM = {1: 1.25, 2: 1.5, 3: 1.5}
"""Setpoints may ask for so many times what the plan does of a derivative.

They run ahead of the plan, and where it turns all the way, as on a circle, no correction is found without such room:
its error falls by 69 % in three flights, and by 85 % with it. All that a vehicle's parameters allow was too much for a
race lap at its limits, whose controller saturated.
"""

GENTLE = {
    "speed": 0.5,
    "horizontal_speed": 0.5,
    "vertical_speed": 0.5,
    "acceleration": 2.5,
    "horizontal_acceleration": 2.5,
    "vertical_acceleration": 1.0,
    "tilt": 0.25,
    "jerk": 15.0,
}
"""What every vehicle can do, in the units of the limits: a plan that asks for less bounds nothing to less."""

_SPATIAL = ("horizontal_speed", "vertical_speed", "horizontal_acceleration", "vertical_acceleration", "tilt", "jerk")
_PLANE = ("speed", "acceleration", "jerk")

Projection = Callable[[FloatArray, FloatArray, float], FloatArray]
"""From values (m, dim), the limit at each (m,), and gravity, to the nearest values within the limit."""


@dataclass(frozen=True, eq=False)
class SetpointLimit:
    """One limit of setpoints.

    Parameters
    ----------
    name : str
        The field of :class:`~minsnap.Limits`.
    order : int
        Derivative that it bounds.
    limit : float
    own : ndarray, shape (m, dim)
        That derivative of the plan, at its instants.
    near : ndarray, shape (m,)
        What corrections are held to, a hundredth within the limit unless the plan itself asks for more there.
    gravity : float
        [m/s^2].
    """

    name: str
    order: int
    limit: float
    own: FloatArray
    near: FloatArray
    gravity: float

    def nearest(self, values: FloatArray) -> FloatArray:
        """Return the nearest values of the derivative that are held to the limit, shape (m, dim)."""
        return _PROJECTIONS[KIND[self.name].measure](values, self.near, self.gravity)

    def used(self, change: FloatArray) -> float:
        """Return the greatest share of the limit that the plan and a change of its derivative (m, dim) use."""
        return float(_sampled(self.name, self.own + change, self.gravity).max()) / self.limit


def setpoint_limits(plan: Samples, allowed: Limits | None = None) -> list[SetpointLimit]:
    """Return the limits of setpoints that correct a plan.

    Acceleration, tilt and jerk are at most half as much again as the plan reaches itself, and its speed a quarter more;
    the tilt is at most 45 degrees. Where the vehicle's limits are known, they hold as well, but where the plan itself
    asks for more.

    Parameters
    ----------
    plan : Samples
        With velocity and acceleration, at equal steps.
    allowed : Limits, optional
        Of the vehicle. Limits of snap, body rates and yaw, and least thrusts, bound no correction.
    """
    gravity = Limits().gravity if allowed is None else allowed.gravity
    given = {} if allowed is None else allowed.given()
    names = _SPATIAL if plan.dim == 3 else _PLANE
    bounding = [name for name in given if KIND[name].measure in _PROJECTIONS and KIND[name].order < 4]
    return [_limit(name, plan, names, given, gravity) for name in dict.fromkeys((*names, *bounding))]


def _limit(
    name: str, plan: Samples, usual: tuple[str, ...], given: Mapping[str, float], gravity: float
) -> SetpointLimit:
    order = KIND[name].order or 2
    own = _derivative(plan, name, order)
    asked = _sampled(name, own, gravity)
    most = float(asked.max())
    roomy = min(ROOM[order] * most, ORDINARY["tilt"]) if name == "tilt" else ROOM[order] * most
    bounds = [max(roomy, most, GENTLE[name])] if name in usual else []
    limit = min([*bounds, *([max(given[name], most)] if name in given else [])])
    return SetpointLimit(name, order, limit, own, np.clip(asked, 0.99 * limit, limit), gravity)


def _derivative(plan: Samples, name: str, order: int) -> FloatArray:
    """Return the plan's derivative, (m, dim); with what offsets drag for limits of the thrust's direction and size."""
    assert plan.velocity is not None and plan.acceleration is not None
    if order == 1:
        return plan.velocity
    if order == 3:
        step = plan.duration / (len(plan) - 1)
        return np.asarray(np.gradient(plan.acceleration, step, axis=0)) if plan.jerk is None else plan.jerk
    if plan.feed_forward is None or KIND[name].measure not in ("tilt", "thrust"):
        return plan.acceleration
    return plan.acceleration + plan.feed_forward


def _sampled(name: str, values: FloatArray, gravity: float) -> FloatArray:
    motion = Motion(lambda _: values, "euclidean", Limits(gravity=gravity).medium)
    return MEASURES[KIND[name].measure].sampled(motion, KIND[name].order)


def within_ball(values: FloatArray, radius: FloatArray) -> FloatArray:
    """Return the nearest values of a norm of at most ``radius`` (m,), shape (m, dim)."""
    length = np.linalg.norm(values, axis=1)
    return np.asarray(values * np.minimum(1.0, radius / np.maximum(length, 1e-12))[:, None])


def _level(values: FloatArray, limit: FloatArray, gravity: float) -> FloatArray:
    return np.column_stack([within_ball(values[:, :2], limit), values[:, 2:]])


def _between(low: float, high: float) -> Projection:
    def clipped(values: FloatArray, limit: FloatArray, gravity: float) -> FloatArray:
        return np.column_stack([values[:, :2], np.clip(values[:, 2], low * limit, high * limit)])

    return clipped


def _lifted(values: FloatArray, limit: FloatArray, gravity: float) -> FloatArray:
    up = np.array([0.0, 0.0, gravity])
    return np.asarray(within_ball(values + up, gravity * limit) - up)


def _upright(values: FloatArray, limit: FloatArray, gravity: float) -> FloatArray:
    """Return the nearest accelerations whose thrust leans by the limit at most."""
    slope, lift, aside = np.tan(limit), values[:, 2] + gravity, np.linalg.norm(values[:, :2], axis=1)
    held = np.maximum(0.0, (slope * aside + lift) / (1.0 + slope**2))
    leans = aside > slope * lift
    share = np.where(leans, slope * held / np.maximum(aside, 1e-12), 1.0)
    return np.column_stack([share[:, None] * values[:, :2], np.where(leans, held, lift) - gravity])


_PROJECTIONS: dict[str, Projection] = {
    "norm": lambda values, limit, gravity: within_ball(values, limit),
    "horizontal": _level,
    "upwards": _between(-np.inf, 1.0),
    "downwards": _between(-1.0, np.inf),
    "vertical": _between(-1.0, 1.0),
    "thrust": _lifted,
    "tilt": _upright,
}
"""By the measure of the limit."""
