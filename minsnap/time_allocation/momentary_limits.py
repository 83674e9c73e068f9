r"""Limits that are not convex, linearised around an instant: least thrust, body rate, and others of the same form.

With f along the thrust axis (:mod:`minsnap.trajectory.medium`), :math:`c = \|f\|` and :math:`z = f / c` the thrust
turns at the rate :math:`\|\dot f - z (z \cdot \dot f)\| / c` (D. Mellinger and V. Kumar, ICRA 2011).  With drag the
most thrust and the tilt are second-order cones of functions that are linearised; without drag they are walls.
Gradients are taken by complex steps (W. Squire and G. Trapp, "Using complex variables to estimate derivatives of real
functions", SIAM Review 40, 1998): exact to rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.limits.limits import Limits
from minsnap.limits.proved_bound import MARGIN
from minsnap.native.joint_steps import (
    BODY_RATE,
    HEADING_RATE,
    LEAST_THRUST,
    LOOK_RATE,
    MOST_THRUST,
    ORDERS,
    TILT,
    ConditionBlock,
)
from minsnap.optimisation.units import Units
from minsnap.time_allocation.joint_rows import LIMIT, Block, Derivatives, Linearised, beyond
from minsnap.trajectory.look_at import LookAtHeading
from minsnap.trajectory.medium import Medium, inner, norm
from minsnap.trajectory.velocity_heading import SLOW, SLOW_SHARE, VelocityHeading

STEP = 1e-30
"""Imaginary step of a derivative."""

TINY = 1e-12
"""Added to a squared norm, relative to its limit squared, so that its root is smooth."""

SLOWING = 2.0
"""Excess that slowing down by a factor e takes away, about: thrust goes as the square of the speed."""

BAND, CONE_BAND = 0.35, 0.7
"""How far inside a limit rows stand, of single functions and of cones."""

DIRECTED = 0.01
"""Share of the weight below which thrust is taken to have no direction: there a small change turns it by any angle."""

HELD_ROOM = 10.0
"""Allowance of a turn where a heading along the velocity is held, for rest; in units of the limit at typical speed."""

LOOK_ROOM = 0.05
"""Least distance from a point that is looked at, in those at which a typical speed turns past it at the limit."""

Excess = Callable[[dict[int, FloatArray]], FloatArray]


@dataclass(frozen=True, eq=False)
class MomentaryLimit:
    """A limit at an instant.

    Parameters
    ----------
    excess : callable
        From physical derivatives by order, each (..., dim) and possibly complex, to values (..., count) that must not
        be positive, or to the parts (..., size) of a cone, its axis first.
    orders : tuple of int
    count : int
        Number of functions.
    scale : float
        Size of the highest derivative that counts as large, physical.
    kind : int
        Of the same functions in the native core.
    parameters : tuple of float
        Theirs there.
    name : str
    size : int
        Parts of a cone; 1 for functions.
    """

    excess: Excess
    orders: tuple[int, ...]
    count: int
    scale: float
    kind: int
    parameters: tuple[float, ...]
    name: str
    size: int = 1


class Momentary:
    """Smooth functions of derivatives at an instant that must not be positive, on every piece.

    Parameters
    ----------
    limit : MomentaryLimit
    units : Units
    pieces : int
    dim : int
    """

    slack, weight, power = LIMIT, SLOWING, 0

    def __init__(self, limit: MomentaryLimit, units: Units, pieces: int, dim: int = 3) -> None:
        self.limit, self.orders, self.dim = limit, limit.orders, dim
        self.count, self.name, self.size = limit.count, limit.name, limit.size
        self.band = BAND if limit.size == 1 else CONE_BAND
        self.units = {order: units.of_order(order) for order in self.orders}
        self.piece = np.repeat(np.arange(pieces), self.count)
        highest = max(self.orders)
        self.metric = (highest, np.full(pieces, self.units[highest] / limit.scale))

    def condition_block(self) -> ConditionBlock | None:
        """Return kind and parameters for the native core, which knows them in space."""
        if self.dim != 3:
            return None
        units = [self.units.get(order, 0.0) for order in range(ORDERS)]
        orders, weights = (min(self.orders), max(self.orders)), (self.slack, self.weight, self.band)
        values = np.array([*units, *self.limit.parameters])
        return ConditionBlock(self.limit.kind, orders, self.size, *weights, self.piece, values)

    def _physical(self, x: Derivatives) -> dict[int, FloatArray]:
        return {order: x[order] * self.units[order] for order in self.orders}

    def on_grid(self, x: Derivatives) -> FloatArray:
        """Excess (pieces * count, m)."""
        values = self.limit.excess(self._physical(x))
        if self.size > 1:
            values = beyond(values)[..., None]
        return np.asarray(values.transpose(0, 2, 1).reshape(-1, values.shape[1]))

    def at(self, x: Derivatives, index: IntArray) -> FloatArray:
        """Excess (n,)."""
        return beyond(self._parts(x, index))

    def _parts(self, x: Derivatives, index: IntArray) -> FloatArray:
        """Return what must lie in the cone, (..., n, size): minus the excess of a function, a half-line."""
        values = self.limit.excess(self._physical(x))
        if self.size > 1:
            return values
        return -values[..., np.arange(len(index)), index % self.count][..., None]

    def linearised(self, x: Derivatives, index: IntArray) -> Linearised:
        """Linearised parts of the cones."""
        value, gradient = self._linearised(x, index)
        own = -sum((p * np.einsum("ncd,nd->nc", gradient[p], x[p]) for p in self.orders), np.zeros(value.shape))
        return Linearised(value, gradient, own, np.zeros(value.shape))

    def _linearised(self, x: Derivatives, index: IntArray) -> tuple[FloatArray, dict[int, FloatArray]]:
        """Parts (n, size) and their gradients by order, each (n, size, dim): all complex steps in one evaluation."""
        count, dim = x[self.orders[0]].shape
        steps = 1j * STEP * np.eye(len(self.orders) * dim).reshape(-1, len(self.orders), 1, dim)
        shifted = {order: x[order] + steps[:, k] for k, order in enumerate(self.orders)}
        found = self._parts(shifted, index)
        slopes = found.imag.reshape(len(self.orders), dim, count, self.size).transpose(0, 2, 3, 1) / STEP
        return found[0].real, {order: np.ascontiguousarray(slopes[k]) for k, order in enumerate(self.orders)}


def lift_of(medium: Medium, x: dict[int, FloatArray], derivatives: int = 0) -> tuple[FloatArray, ...]:
    """Vector along the thrust axis, and derivatives of it."""
    motion = (x[order] for order in range(2, 3 + derivatives))
    return medium.lift(x.get(1, x[2]), *motion, floor=TINY * medium.gravity**2)


def orders_of(medium: Medium, highest: int) -> tuple[int, ...]:
    """Return the derivatives that the thrust depends on, up to one of them: the velocity only with drag."""
    return tuple(range(1 if medium.drags else 2, highest + 1))


def thrust_of(medium: Medium, force: FloatArray, x: dict[int, FloatArray]) -> FloatArray:
    """Thrust per mass."""
    return medium.thrust(force, x.get(1, x[2]), TINY * medium.gravity**2)


def least_thrust(ratio: float, medium: Medium) -> Excess:
    """Shortfall of the thrust below ``ratio`` times gravity, in weights."""

    def excess(x: dict[int, FloatArray]) -> FloatArray:
        return (ratio - thrust_of(medium, lift_of(medium, x)[0], x) / medium.gravity)[..., None]

    return excess


def most_thrust(ratio: float, medium: Medium) -> Excess:
    """Cone of the vector f, as wide as the limit less what drag along the thrust axis adds; in units of the limit."""

    def parts(x: dict[int, FloatArray]) -> FloatArray:
        force = lift_of(medium, x)[0]
        more = thrust_of(medium, force, x) - norm(force, TINY * medium.gravity**2)
        unit = ratio * medium.gravity
        return np.concatenate(((1.0 - more / unit)[..., None], force / unit), axis=-1)

    return parts


def tilted(limit: float, medium: Medium) -> Excess:
    """Cone of the vector f around the vertical, in units of gravity."""

    def parts(x: dict[int, FloatArray]) -> FloatArray:
        force = lift_of(medium, x)[0] / medium.gravity
        return np.concatenate((force[..., 2:], force[..., :2] / np.tan(limit)), axis=-1)

    return parts


def body_rate(limit: float, medium: Medium) -> Excess:
    """Excess of the rate at which the thrust turns, times the thrust so that nothing is divided by it."""
    gravity = medium.gravity

    def excess(x: dict[int, FloatArray]) -> FloatArray:
        force, change = lift_of(medium, x, 1)
        thrust = norm(force, TINY * gravity**2)
        axis = force / thrust[..., None]
        across = change - axis * inner(axis, change)[..., None]
        turning = norm(across, TINY * (limit * gravity) ** 2)
        return np.asarray((turning - limit * thrust) / (2.0 * limit * gravity))[..., None]

    return excess


def heading_rate(limit: float, typical: float, held: float) -> Excess:
    """Excess of the rate at which the horizontal velocity turns, either way, times the speed; none far below ``held``.

    Parameters
    ----------
    limit : float
        [rad/s].
    typical, held : float
        A typical speed, and the horizontal one below which the heading is held [m/s].
    """

    def excess(x: dict[int, FloatArray]) -> FloatArray:
        velocity, acceleration = x[1][..., :2], x[2][..., :2]
        speed = norm(velocity, TINY * typical**2)
        turn = (velocity[..., 0] * acceleration[..., 1] - velocity[..., 1] * acceleration[..., 0]) / speed
        room = speed / typical + np.where(speed.real < held, HELD_ROOM * (1.0 - speed / held), 0.0)
        return np.stack((turn / (limit * typical) - room, -turn / (limit * typical) - room), axis=-1)

    return excess


def look_rate(limit: float, typical: float, point: FloatArray) -> Excess:
    """Excess of the rate at which a point is passed, either way, times the distance, and how near it is.

    A curve straight through the point has no rate, but for a jump.

    Parameters
    ----------
    limit : float
        [rad/s].
    typical : float
        A typical speed [m/s].
    point : ndarray, shape (2,)
        That is looked at, from where positions are counted [m].
    """

    def excess(x: dict[int, FloatArray]) -> FloatArray:
        way, velocity = x[0][..., :2] - point, x[1]
        distance = norm(way, TINY * (typical / limit) ** 2)
        turn = (way[..., 0] * velocity[..., 1] - way[..., 1] * velocity[..., 0]) / (typical * distance)
        allowed = limit / typical * distance
        return np.stack((turn - allowed, -turn - allowed, 1.0 - allowed / LOOK_ROOM), axis=-1)

    return excess


def momentary_blocks(limits: Limits, units: Units, pieces: int) -> list[Block]:
    """Limits on thrust and on its direction that are not convex.

    The least thrust is one where accelerations are bounded; elsewhere its vertical part alone ends the search.  Where
    only the direction is limited, there is a small least thrust besides.
    """
    medium = limits.medium
    share = 1.0 - MARGIN if medium.drags else 1.0
    first, gravity, found = medium.values, medium.gravity, list[MomentaryLimit]()
    bounded = limits.max_thrust is not None or limits.acceleration is not None
    orders, least = orders_of(medium, 2), limits.min_thrust
    directed = least is None and (limits.tilt is not None or limits.body_rate is not None)
    if directed or (least is not None and (bounded or medium.drags)):
        ratio = DIRECTED if least is None else least / share
        kept = least_thrust(ratio, medium)
        found.append(MomentaryLimit(kept, orders, 1, gravity, LEAST_THRUST, (*first, ratio), "min_thrust"))
    if limits.max_thrust is not None and medium.drags:
        ratio = limits.max_thrust * share
        kept, scale = most_thrust(ratio, medium), gravity * ratio
        found.append(MomentaryLimit(kept, orders, 1, scale, MOST_THRUST, (*first, ratio), "max_thrust", 4))
    if limits.tilt is not None and medium.drags:
        angle = limits.tilt * share
        kept, scale = tilted(angle, medium), gravity * float(np.tan(angle))
        found.append(MomentaryLimit(kept, orders, 1, scale, TILT, (*first, float(np.tan(angle))), "tilt", 3))
    if limits.body_rate is not None:
        rate = limits.body_rate * share
        kept, scale = body_rate(rate, medium), 2.0 * gravity * rate
        found.append(MomentaryLimit(kept, orders_of(medium, 3), 1, scale, BODY_RATE, (*first, rate), "body_rate"))
    return [Momentary(limit, units, pieces) for limit in found]


def heading_block(limit: float, heading: VelocityHeading, units: Units, pieces: int, dim: int) -> Block:
    """Limit on the rate of a heading along the velocity [rad/s]."""
    typical = units.of_order(1)
    slow = min(SLOW, SLOW_SHARE * typical) if heading.hold_below is None else heading.hold_below
    kept, parameters = heading_rate(limit, typical, slow), (limit, typical, slow, HELD_ROOM)
    rate = MomentaryLimit(kept, (1, 2), 2, limit * typical, HEADING_RATE, parameters, "yaw_rate")
    return Momentary(rate, units, pieces, dim)


def look_block(limit: float, heading: LookAtHeading, units: Units, pieces: int, dim: int) -> Block:
    """Limit on the rate of a heading towards a point [rad/s]."""
    typical, point = units.of_order(1), heading.target.point[:2] - units.origin[:2]
    kept, place = look_rate(limit, typical, point), (float(point[0]), float(point[1]))
    parameters = (limit, typical, *place, LOOK_ROOM)
    rate = MomentaryLimit(kept, (0, 1), 3, typical, LOOK_RATE, parameters, "yaw_rate")
    return Momentary(rate, units, pieces, dim)
