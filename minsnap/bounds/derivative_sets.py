"""Convex sets in which limits keep acceleration and velocity, as a bound of the flight time takes them.

Every flight within the limits stays in all of them. What a bound cannot use is left out and named: a yaw rate, a least
thrust, tilt with drag, thrust with drag where no speed is bounded, a climb or a descent that is bounded one way alone.
Jerk, snap, body rate and the torque of rotors bound how soon after rest an acceleration can be large, or turned: such
sets grow with time, and hold at ends where the flight hovers. On the way they are left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from math import hypot, inf, sqrt, tan
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.limit_kinds import KIND
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.polynomials.enclosures import UNIT

Vector = tuple[float, float, float]

BESIDE = 1.0 + 8.0 * UNIT
"""Factor on what is computed from limits, above its rounding."""

ROTORS = "single rotors"
"""What is said of the limits of a vehicle's rotors, each by itself."""

WIDEST = 1.2
"""Half-angle up to which a cone around the vertical counts [rad]."""


@dataclass(frozen=True)
class DerivativeSet:
    """Vectors in three coordinates: the sum of a center, of a product of balls, and of a cone that is cut.

    Parameters
    ----------
    balls : tuple of (tuple of int, float)
        Coordinates and radius of each ball; other coordinates are free where there is no cone.
    center : tuple of float
        Of the balls, or the tip of the cone, which opens upwards.
    slope, height : float
        Of the cone: horizontal over vertical distance from its tip, and where it is cut; a height of 0 for no cone.
    """

    balls: tuple[tuple[tuple[int, ...], float], ...] = ()
    center: Vector = (0.0, 0.0, 0.0)
    slope: float = 0.0
    height: float = 0.0

    @property
    def covered(self) -> frozenset[int]:
        """Coordinates that it bounds."""
        return frozenset(range(3)) if self.height else frozenset(axis for axes, _ in self.balls for axis in axes)

    @property
    def size(self) -> float:
        """Length of the longest of its vectors, roughly."""
        center = max(abs(value) for value in self.center)
        return center + max((radius for _, radius in self.balls), default=self.height * (1.0 + self.slope))

    def support(self, along: FloatArray, slope: FloatArray | None = None) -> FloatArray:
        """Return how far it reaches along vectors (..., 3) that are zero in the coordinates that are free: (...).

        A cone does so with other slopes (...) where they are given.
        """
        reach = along @ np.array(self.center)
        for axes, radius in self.balls:
            reach = reach + radius * np.sqrt((along[..., list(axes)] ** 2).sum(axis=-1))
        if self.height:
            aside = np.sqrt((along[..., :2] ** 2).sum(axis=-1))
            opened = aside * (self.slope if slope is None else slope)
            reach = reach + self.height * np.maximum(along[..., 2] + opened, 0.0)
        return np.asarray(reach)

    def scaled(self, factor: float) -> DerivativeSet:
        """Return the set with all vectors times a factor."""
        center = self.center[0] * factor, self.center[1] * factor, self.center[2] * factor
        balls = tuple((axes, radius * factor) for axes, radius in self.balls)
        return replace(self, balls=balls, center=center, height=self.height * factor)


Sets = tuple[DerivativeSet, ...]


@dataclass(frozen=True)
class GrowingSet:
    """Accelerations that a flight can have some time after it hovers, or before it hovers.

    Parameters
    ----------
    name : str
        Of the limit.
    unit : DerivativeSet
        A cone, whose half-angle grows, or balls, whose radii are shares of 1 that grow.
    rate : float
        What it grows by: an angle or a radius is at most rate t, or rate t^2 / 2.
    power : int
        Of time, 1 or 2: the flight hovers where its derivatives up to order 1 + power are zero.
    """

    name: str
    unit: DerivativeSet
    rate: float
    power: int

    def size(self, time: FloatArray) -> FloatArray:
        """Return the half-angle or the radius at times [s]."""
        return np.asarray(self.rate * time**self.power / self.power)

    def support(self, along: FloatArray, time: FloatArray) -> FloatArray:
        """Return how far it reaches at times (...) along vectors (..., 3): (...)."""
        unit, size = self.unit, self.size(time)
        return unit.support(along, self.slope(size)) if unit.height else np.asarray(size * unit.support(along))

    def share(self, along: FloatArray, time: FloatArray) -> FloatArray:
        """Return the parts of vectors (..., 3) that a set of thrusts up to a norm loses least by, at times (...).

        Of a cone, what is left without the projection on it, along which alone it reaches nowhere (J. J. Moreau, 1962).
        """
        size = self.size(time)
        if not self.unit.height:
            return along
        slope, upright = self.slope(size), along[..., 2]
        aside = np.sqrt((along[..., :2] ** 2).sum(axis=-1))
        height = np.where(aside > slope * upright, np.maximum(slope * aside + upright, 0.0) / (1.0 + slope**2), upright)
        radius = np.minimum(aside, slope * height)
        level = along[..., :2] * (radius / np.where(aside > 0.0, aside, 1.0))[..., None]
        inside = np.concatenate((level, height[..., None]), axis=-1)
        return np.asarray(np.where((size <= WIDEST)[..., None], along - inside, 0.0))

    @staticmethod
    def slope(angle: FloatArray) -> FloatArray:
        """Return the slope of a cone of a half-angle, up to the widest."""
        return np.asarray(np.tan(np.minimum(angle, WIDEST)) * BESIDE)


Growing = tuple[GrowingSet, ...]


class BoundingSets(NamedTuple):
    """Sets of accelerations and of velocities, names of the limits that are left out, and sets after hovering."""

    accelerations: Sets
    velocities: Sets
    left_out: tuple[str, ...]
    growing: Growing = ()


def bounding_sets(limits: Limits, dim: int) -> BoundingSets:
    """Return what limits say of acceleration and velocity, for curves of a number of coordinates, at most three.

    The first set of each kind covers all coordinates that any of them covers.
    """
    limits.check_dim(dim)
    given, axes = limits.given(), tuple(range(dim))
    norm = tuple((axis,) for axis in axes) if limits.norm == "axis" else (axes,)
    kinds = ((1, "speed", "climb_speed", "descent_speed"), (2, "acceleration", "", ""))
    used, of_order = set[str](), dict[int, list[DerivativeSet]]()
    for order, name, up, down in kinds:
        whole = given.get(name, inf)
        parts = _parts(given, name, up, down, whole, used)
        of_order[order] = [DerivativeSet(tuple((group, whole) for group in norm))] if whole < inf else []
        of_order[order] += [parts] if parts.balls else []
        used |= {name}
    thrust, names = _of_thrust(limits, given, of_order[2])
    of_order[2] += thrust
    used |= names
    for sets in of_order.values():
        sets.sort(key=lambda one: -len(one.covered))
    left_out = [_named(name, limits.medium.drags) for name in given if name not in used]
    left_out += ["slower speeds of legs"] if limits.leg_speeds else []
    left_out += [ROTORS] if isinstance(limits, VehicleLimits) else []
    growing = tuple(_growing(limits, given, norm, thrust)) if of_order[2] else ()
    return BoundingSets(tuple(of_order[2]), tuple(of_order[1]), tuple(left_out), growing)


def _parts(given: dict[str, float], name: str, up: str, down: str, whole: float, used: set[str]) -> DerivativeSet:
    """Return the bounds of the horizontal and of the vertical part of a derivative as one set."""
    flat, both = given.get(f"horizontal_{name}", inf), given.get(f"vertical_{name}", inf)
    above, below = min(given.get(up, inf), both), min(given.get(down, inf), both)
    used |= {f"horizontal_{name}", f"vertical_{name}"}
    balls: list[tuple[tuple[int, ...], float]] = [((0, 1), flat)] if flat < inf else []
    center = 0.0
    if min(above, below) < inf and max(above, below, whole) >= min(above, below):
        above, below = min(above, whole), min(below, whole)
        if max(above, below) < inf:
            center = 0.5 * (above - below)
            balls.append(((2,), 0.5 * (above + below) * BESIDE))
            used |= {up, down}
    return DerivativeSet(tuple(balls), (0.0, 0.0, center))


def _of_thrust(
    limits: Limits, given: dict[str, float], others: list[DerivativeSet]
) -> tuple[list[DerivativeSet], set[str]]:
    """Return the sets of thrust and tilt around free fall; a cone is cut where another limit bounds its height."""
    if limits.medium.drags:
        return _of_dragged_thrust(limits, given)
    sets, used, fall = [], set[str](), (0.0, 0.0, -limits.gravity)
    height = min((radius for one in others for axes, radius in one.balls if 2 in axes), default=inf) + limits.gravity
    if "max_thrust" in given:
        most = given["max_thrust"] * limits.gravity * BESIDE
        sets.append(DerivativeSet((((0, 1, 2), most),), fall))
        height, used = min(height, most), used | {"max_thrust"}
    if "tilt" in given and height < inf:
        sets.append(DerivativeSet((), fall, tan(given["tilt"]) * BESIDE, height * BESIDE))
        used |= {"tilt"}
    return sets, used


def _of_dragged_thrust(limits: Limits, given: dict[str, float]) -> tuple[list[DerivativeSet], set[str]]:
    r"""Return the set of a thrust that drag helps: :math:`\|a + g e_z\| \le f + \|D(v)\|`, v being the top speed."""
    speed = _top_speed(limits, given)
    if not isinstance(limits, VehicleLimits) or "max_thrust" not in given or not speed < inf:
        return [], set()
    drag, mass = limits.vehicle.flat_drag, float(limits.vehicle.mass)
    linear, quadratic = (max(map(float, values)) / mass for values in (drag.linear, drag.quadratic))
    most = given["max_thrust"] * limits.gravity + (linear + quadratic * speed) * speed
    return [DerivativeSet((((0, 1, 2), most * BESIDE),), (0.0, 0.0, -limits.gravity))], {"max_thrust"}


def _growing(
    limits: Limits, given: dict[str, float], norm: tuple[tuple[int, ...], ...], thrust: list[DerivativeSet]
) -> Iterator[GrowingSet]:
    """Yield what bounds accelerations soon after rest: jerk and snap, and how fast thrust turns from the vertical."""
    unit = DerivativeSet(tuple((axes, 1.0) for axes in norm))
    for power, name in ((1, "jerk"), (2, "snap")):
        if name in given:
            yield GrowingSet(KIND[name].label, unit, given[name] * BESIDE, power)
    if "max_thrust" not in given or not thrust:
        return
    most, height = thrust[0].balls[0][1], given["max_thrust"] * limits.gravity * BESIDE
    dragged = (((0, 1, 2), (most - height) * BESIDE),) if limits.medium.drags else ()
    cone = DerivativeSet(dragged, thrust[0].center, height=height)
    if "body_rate" in given:
        yield GrowingSet(KIND["body_rate"].label, cone, given["body_rate"] * BESIDE, 1)
    turning = most_angular_acceleration(limits) if isinstance(limits, VehicleLimits) else None
    if turning is not None:
        yield GrowingSet(ROTORS, cone, turning * BESIDE, 2)


def most_angular_acceleration(limits: VehicleLimits) -> float | None:
    r"""Return the most by which rotors change the rate at which the thrust axis turns [rad/s^2]; None where unknown.

    Whatever the rate about that axis, Euler's equations with principal inertias :math:`I_x, I_y < I_z` change
    :math:`Q = \sum_{i = x, y} I_i (I_z - I_i) \omega_i^2` by torques alone:
    :math:`\tfrac12 \dot Q = \sum (I_z - I_i) \omega_i \tau_i`. So its root grows by
    :math:`\max \sqrt{\sum (I_z - I_i) \tau_i^2 / I_i}` at most, and the axis turns at
    :math:`\sqrt{Q / \min I_i (I_z - I_i)}` at most. With :math:`I_x = I_y` both have the factor :math:`I_z - I_x`.
    """
    vehicle = limits.vehicle
    inertia = np.asarray(vehicle.inertia, dtype=np.float64)
    own, upright = inertia.diagonal()[:2], float(inertia[2, 2])
    if np.any(inertia != np.diag(inertia.diagonal())):
        return None
    excess = np.ones(2) if own[0] == own[1] else upright - own
    if not excess.min() > 0.0:
        return None
    hover = vehicle.hover_thrust
    ends = [hover + (1.0 - limits.reserve) * (thrust - hover) for thrust in vehicle.rotor_thrust_limits]
    corners = np.array(list(product(ends, repeat=4)))
    torques = corners @ np.asarray(vehicle.mixer)[1:3].T
    return float(np.sqrt((excess * torques**2 / own).sum(axis=1).max() / (own * excess).min()))


def _top_speed(limits: Limits, given: dict[str, float]) -> float:
    """Return the greatest speed that limits allow [m/s]; infinity where they bound none."""
    whole = given.get("speed", inf) * (sqrt(3.0) if limits.norm == "axis" else 1.0)
    both = given.get("vertical_speed", inf)
    upright = max(min(given.get("climb_speed", inf), both), min(given.get("descent_speed", inf), both))
    return min(whole, hypot(given.get("horizontal_speed", inf), upright)) * BESIDE


def _named(name: str, drags: bool) -> str:
    label = "the least thrust" if name == "min_thrust" else KIND[name].label
    return f"{label} with drag" if drags and name in ("max_thrust", "tilt") else label
