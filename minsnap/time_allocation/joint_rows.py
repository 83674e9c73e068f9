r"""Walls and limits as the joint search sees them: excess at any instant, and cones linear in curve and durations.

With :math:`x = X / T^p` a derivative of order p on a piece of duration T, a plane :math:`n \cdot x \le b` becomes
:math:`n \cdot X \le b\,T^p` and a ball :math:`\|M x - m\| \le \rho + c \cdot x` becomes a second-order cone in X and
:math:`T^p`; to first order in the relative change u of T, :math:`T^p` grows by :math:`p\,u`.  Everything is divided by
the width or the radius of the wall.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.corridors.constraint import Walls
from minsnap.native.joint_steps import WALL as WALL_KIND
from minsnap.native.joint_steps import ConditionBlock
from minsnap.optimisation.units import Units

Derivatives = Mapping[int, FloatArray]
"""By order: values of shape (..., dim), normalised."""

LIMIT, WALL = 0, 1
"""Slacks: of what slowing down cures, and of what it does not."""


NEAR, NEAREST, NEAR_WALL = 0.35, 0.9, 0.4
"""How far inside a limit, times its order and at most, and inside a wall rows stand, in widths."""


@dataclass(frozen=True, eq=False)
class Linearised:
    """What must lie in second-order cones: ``value + gradient . dx + own * u`` (first component: the axis of the cone).

    A cone of one component is a half-line: the value must not be negative.

    Parameters
    ----------
    value : ndarray, shape (n, c)
    gradient : mapping of int to ndarray, shape (n, c, dim)
        In the derivative of each order, durations held.
    own : ndarray, shape (n, c)
        In the relative change of the piece's own duration, derivatives times T^p held.
    curvature : ndarray, shape (n, c)
        Second derivative in the same.
    """

    value: FloatArray
    gradient: dict[int, FloatArray]
    own: FloatArray
    curvature: FloatArray


class Block(Protocol):
    """Conditions of one kind, each on one piece.

    Attributes
    ----------
    piece : ndarray of int, shape (r,)
    orders : tuple of int
        Derivatives that they depend on.
    slack : int
        ``LIMIT`` or ``WALL``.
    weight : float
        By how much a slack of 1 widens the cone: for a limit what slowing down by a factor does.
    band : float
        Excess above which an instant of the grid becomes a row.
    size : int
        Components of a cone.
    metric : tuple of int and ndarray (pieces in all,)
        The order, and one over the length that counts as large there.
    name : str
    power : int
        Of the duration by which its cones are multiplied.
    """

    piece: IntArray
    orders: tuple[int, ...]
    slack: int
    weight: float
    band: float
    size: int
    metric: tuple[int, FloatArray]
    name: str
    power: int

    def on_grid(self, x: Derivatives) -> FloatArray:
        """Excess of every condition (r, m) from derivatives of all pieces (pieces, m, dim)."""
        ...

    def at(self, x: Derivatives, index: IntArray) -> FloatArray:
        """Excess of the conditions ``index`` (n,) at derivatives (n, dim)."""
        ...

    def linearised(self, x: Derivatives, index: IntArray) -> Linearised:
        """Walls of the conditions ``index`` (n,) around derivatives (n, dim)."""
        ...

    def condition_block(self) -> ConditionBlock | None:
        """Return the same conditions for the native core; None where it does not know them."""
        ...


class WallBlock:
    r"""Walls of one kind: :math:`\|M x + m\| \le \rho + c \cdot x`; planes have no M.

    Parameters
    ----------
    order : int
        Of the derivative x.
    piece : ndarray of int, shape (r,)
    rows : ndarray, shape (r, 1 + q, dim)
        c and M.
    offset : ndarray, shape (r, 1 + q)
        Right-hand side and m, in widths.
    pieces : int
        In all.
    name : str
    """

    def __init__(self, order: int, piece: IntArray, rows: FloatArray, offset: FloatArray, pieces: int, name: str):
        self.piece, self.rows, self.offset, self.name = piece, rows, offset, name
        self.order, self.power, self.size = order, order, rows.shape[1]
        self.orders: tuple[int, ...] = (order,)
        self.slack, self.weight = (LIMIT, float(order)) if order else (WALL, 1.0)
        self.band = min(NEAR * order, NEAREST) if order else NEAR_WALL
        steep = np.zeros(pieces)
        np.maximum.at(steep, piece, np.linalg.norm(rows[:, -1] if self.size == 1 else rows[:, 1], axis=1))
        self.metric = (order, steep)

    def on_grid(self, x: Derivatives) -> FloatArray:
        """Excess (r, m)."""
        return beyond(np.matmul(x[self.order][self.piece], self.rows.transpose(0, 2, 1)) + self.offset[:, None])

    def at(self, x: Derivatives, index: IntArray) -> FloatArray:
        """Excess (n,)."""
        return beyond(self._parts(x, index))

    def _parts(self, x: Derivatives, index: IntArray) -> FloatArray:
        return np.asarray(np.einsum("ncd,nd->nc", self.rows[index], x[self.order]) + self.offset[index])

    def condition_block(self) -> ConditionBlock:
        """Return the rows and offsets for the native core."""
        values = np.concatenate((self.rows.reshape(-1), self.offset.reshape(-1)))
        orders, weights = (self.order, self.order), (self.slack, self.weight, self.band)
        return ConditionBlock(WALL_KIND, orders, self.size, *weights, self.piece, values)

    def linearised(self, x: Derivatives, index: IntArray) -> Linearised:
        """Walls of 1 + q components."""
        p, offset = self.order, self.offset[index]
        return Linearised(self._parts(x, index), {p: self.rows[index]}, p * offset, p * (p - 1) * offset)


def beyond(parts: FloatArray) -> FloatArray:
    """Norm of all components but the first one, less the first."""
    rest = parts[..., 1:]
    return np.asarray(np.sqrt((rest * rest).sum(axis=-1)) - parts[..., 0])


def largest_metrics(blocks: Sequence[Block], pieces: int) -> dict[int, FloatArray]:
    """By order, one over the least length that counts as large on every piece, (pieces,)."""
    steep: dict[int, FloatArray] = {}
    for block in blocks:
        order, size = block.metric
        steep[order] = np.maximum(steep.get(order, np.zeros(pieces)), size)
    return steep


def wall_blocks(walls: Sequence[Walls], units: Units, per_leg: int, pieces: int) -> list[Block]:
    """Bring walls into normalised units and onto every piece of their legs."""
    return [_on_pieces(wall.cones, units, per_leg, pieces) for wall in walls if len(wall.cones.leg)]


def _on_pieces(cones: Walls, units: Units, per_leg: int, pieces: int) -> WallBlock:
    row, piece = cones.on_pieces(per_leg)
    rows, offset = cones.in_widths(row, units.origin)
    return WallBlock(cones.order, piece, rows * units.of_order(cones.order), offset, pieces, cones.name)
