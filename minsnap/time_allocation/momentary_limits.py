r"""Limits that are not convex, linearised around an instant: least thrust, body rate, and others of the same form.

With :math:`f = \ddot r + g e_z`, :math:`c = \|f\|` and :math:`z = f / c` the thrust turns at the rate
:math:`\|j - z (z \cdot j)\| / c` (D. Mellinger and V. Kumar, ICRA 2011).  Gradients are taken by complex steps (W.
Squire and G. Trapp, "Using complex variables to estimate derivatives of real functions", SIAM Review 40, 1998): exact
to rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from minsnap.arrays import FloatArray, IntArray
from minsnap.limits.limits import Limits
from minsnap.native.joint_search import BODY_RATE, LEAST_THRUST, ORDERS, ConditionBlock
from minsnap.optimisation.units import Units
from minsnap.time_allocation.joint_rows import LIMIT, Block, Derivatives, Linearised

STEP = 1e-30
"""Imaginary step of a derivative."""

TINY = 1e-12
"""Added to a squared norm, relative to its limit squared, so that its root is smooth."""

SLOWING = 2.0
"""Excess that slowing down by a factor e takes away, about: thrust goes as the square of the speed."""

BAND = 0.35

Excess = Callable[[dict[int, FloatArray]], FloatArray]


@dataclass(frozen=True, eq=False)
class MomentaryLimit:
    """A limit at an instant.

    Parameters
    ----------
    excess : callable
        From physical derivatives by order, each (..., dim) and possibly complex, to values (..., count).
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
    """

    excess: Excess
    orders: tuple[int, ...]
    count: int
    scale: float
    kind: int
    parameters: tuple[float, ...]
    name: str


class Momentary:
    """Smooth functions of derivatives at an instant that must not be positive, on every piece.

    Parameters
    ----------
    limit : MomentaryLimit
    units : Units
    pieces : int
    """

    slack, weight, size, band = LIMIT, SLOWING, 1, BAND

    def __init__(self, limit: MomentaryLimit, units: Units, pieces: int) -> None:
        self.limit, self.excess, self.orders = limit, limit.excess, limit.orders
        self.count, self.name = limit.count, limit.name
        self.units = {order: units.of_order(order) for order in self.orders}
        self.piece = np.repeat(np.arange(pieces), self.count)
        highest = max(self.orders)
        self.metric = (highest, np.full(pieces, self.units[highest] / limit.scale))

    def condition_block(self) -> ConditionBlock:
        """Return kind and parameters for the native core."""
        units = [self.units.get(order, 0.0) for order in range(ORDERS)]
        orders, weights = (min(self.orders), max(self.orders)), (self.slack, self.weight, self.band)
        values = np.array([*units, *self.limit.parameters])
        return ConditionBlock(self.limit.kind, orders, 1, *weights, self.piece, values)

    def _physical(self, x: Derivatives) -> dict[int, FloatArray]:
        return {order: x[order] * self.units[order] for order in self.orders}

    def on_grid(self, x: Derivatives) -> FloatArray:
        """Excess (pieces * count, m)."""
        values = self.excess(self._physical(x))
        return np.asarray(values.transpose(0, 2, 1).reshape(-1, values.shape[1]))

    def at(self, x: Derivatives, index: IntArray) -> FloatArray:
        """Excess (n,)."""
        return np.asarray(self.excess(self._physical(x))[np.arange(len(index)), index % self.count])

    def linearised(self, x: Derivatives, index: IntArray) -> Linearised:
        """Half-lines of minus the linearised excess."""
        value, gradient = self._linearised(x, index)
        own = sum((order * (gradient[order] * x[order]).sum(axis=1) for order in self.orders), np.zeros(len(value)))
        slopes = {order: -gradient[order][:, None] for order in self.orders}
        return Linearised(-value[:, None], slopes, own[:, None], np.zeros((len(value), 1)))

    def _linearised(self, x: Derivatives, index: IntArray) -> tuple[FloatArray, dict[int, FloatArray]]:
        """Value (n,) and its gradient by order, each (n, dim): all complex steps in one evaluation."""
        count, dim = x[self.orders[0]].shape
        steps = 1j * STEP * np.eye(len(self.orders) * dim).reshape(-1, len(self.orders), 1, dim)
        shifted = {order: x[order] + steps[:, k] for k, order in enumerate(self.orders)}
        found = self.excess(self._physical(shifted))[:, np.arange(count), index % self.count]
        slopes = found.reshape(len(self.orders), dim, count).imag / STEP
        return found[0].real, {order: np.ascontiguousarray(slopes[k].T) for k, order in enumerate(self.orders)}


def norm(vectors: FloatArray, floor: float = 0.0) -> FloatArray:
    """Euclidean norm over the last axis, analytic, so that complex steps pass through it."""
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=-1) + floor))


def inner(left: FloatArray, right: FloatArray) -> FloatArray:
    """Inner product over the last axis without conjugation."""
    return np.asarray((left * right).sum(axis=-1))


def lifted(acceleration: FloatArray, gravity: float) -> FloatArray:
    """Thrust per mass: acceleration and gravity."""
    return np.asarray(acceleration + np.array([0.0, 0.0, gravity]))


def least_thrust(ratio: float, gravity: float) -> Excess:
    """Shortfall of the thrust below ``ratio`` times gravity, in weights."""

    def excess(x: dict[int, FloatArray]) -> FloatArray:
        return (ratio - norm(lifted(x[2], gravity), TINY * gravity**2) / gravity)[..., None]

    return excess


def body_rate(limit: float, gravity: float) -> Excess:
    """Excess of the rate at which the thrust turns, times the thrust so that nothing is divided by it."""

    def excess(x: dict[int, FloatArray]) -> FloatArray:
        force = lifted(x[2], gravity)
        thrust = norm(force, TINY * gravity**2)
        axis = force / thrust[..., None]
        across = x[3] - axis * inner(axis, x[3])[..., None]
        turning = norm(across, TINY * (limit * gravity) ** 2)
        return np.asarray((turning - limit * thrust) / (2.0 * limit * gravity))[..., None]

    return excess


def momentary_blocks(limits: Limits, units: Units, pieces: int) -> list[Block]:
    """Limits on thrust and on its direction that are not convex.

    The least thrust is one where accelerations are bounded; elsewhere its vertical part alone ends the search.
    """
    gravity, blocks = limits.gravity, list[Block]()
    bounded = limits.max_thrust is not None or limits.acceleration is not None
    if limits.min_thrust is not None and bounded:
        least = least_thrust(limits.min_thrust, gravity)
        still = (gravity, 0.0, 0.0, 0.0, 0.0)
        limit = MomentaryLimit(least, (2,), 1, gravity, LEAST_THRUST, (*still, limits.min_thrust), "min_thrust")
        blocks.append(Momentary(limit, units, pieces))
    if limits.body_rate is not None:
        turning = body_rate(limits.body_rate, gravity)
        scale = 2.0 * gravity * limits.body_rate
        still = (gravity, 0.0, 0.0, 0.0, 0.0)
        limit = MomentaryLimit(turning, (2, 3), 1, scale, BODY_RATE, (*still, limits.body_rate), "body_rate")
        blocks.append(Momentary(limit, units, pieces))
    return blocks
