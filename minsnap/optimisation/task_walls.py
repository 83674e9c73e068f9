"""The walls of a task on its pieces, with those of waypoints: boxes, gates, balls, directions of crossing.

Both cores read these, and so do proofs. Walls of waypoints hold at one end of a piece. The slanted planes of gates, on
which waypoints must lie, come last; the reference core has them in its own form, as equality rows, and all others in
units in which lengths and times are of order one (``normalised_walls``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.cached import cached_property
from minsnap.basics.tolerances import ROUNDING
from minsnap.corridors.constraint import Walls
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.optimisation.task import Task
from minsnap.optimisation.touches import Side
from minsnap.optimisation.units import Units


@dataclass(frozen=True, eq=False)
class AllWalls:
    """All walls of a task, in one count.

    Parameters
    ----------
    blocks : tuple of Walls
        ``leg`` is the piece.
    """

    blocks: tuple[Walls, ...]

    @cached_property
    def first(self) -> IntArray:
        """Where each block begins in the count, and the number of all walls."""
        return np.cumsum([0, *(len(block.leg) for block in self.blocks)], dtype=np.intp)

    def __len__(self) -> int:
        return int(self.first[-1])

    @cached_property
    def piece(self) -> IntArray:
        """Piece of each wall."""
        return np.concatenate([np.zeros(0, dtype=np.intp), *(block.leg for block in self.blocks)])

    @cached_property
    def width(self) -> FloatArray:
        """Width of each wall."""
        return np.concatenate([np.zeros(0), *(block.width for block in self.blocks)])

    @cached_property
    def radius(self) -> FloatArray:
        """Radius of each wall, of planes the bound at their anchor."""
        return np.concatenate([np.zeros(0), *(block.radius for block in self.blocks)])

    @cached_property
    def order(self) -> IntArray:
        """Order of the derivative that each wall bounds."""
        return self._of_each([block.order for block in self.blocks])

    @cached_property
    def equal(self) -> BoolArray:
        """Which are planes on which the curve lies."""
        return self._of_each([block.equal for block in self.blocks]).astype(bool)

    @cached_property
    def momentary(self) -> BoolArray:
        """Which hold at one end of their piece."""
        return self._of_each([block.at is not None for block in self.blocks]).astype(bool)

    def _of_each(self, values: Sequence[int]) -> IntArray:
        return np.repeat(np.array(values, dtype=np.intp), np.diff(self.first))

    def place(self, wall: int) -> tuple[Walls, int]:
        """Return the block of a wall, and its index there."""
        block = int(np.searchsorted(self.first, wall, side="right")) - 1
        return self.blocks[block], wall - int(self.first[block])

    def relaxed(self, amounts: FloatArray) -> AllWalls:
        """Return the same walls, each moved outwards by so many of its widths, (walls,)."""
        moved = amounts * self.width
        parts = zip(self.blocks, self.first, strict=False)
        return AllWalls(tuple(block.moved(moved[first : first + len(block.leg)]) for block, first in parts))


def all_walls(task: Task) -> AllWalls:
    """Return all walls of a task in metres, with pieces in the place of legs."""
    at_knots = _knot_walls(task)
    return AllWalls((*(walls.cut(task.pieces) for walls in task.walls), *at_knots))


def _knot_walls(task: Task) -> list[Walls]:
    """Return the walls at waypoints that may vary, each on a piece that begins or ends there; planes of gates last."""
    if not task.held.any():
        return []
    at = task.own_regions
    sides = [k for k, region in at.items() for _ in region.bounds]
    normals = [normal for region in at.values() for normal in region.normals]
    bounds = np.array([bound for region in at.values() for bound in region.bounds])
    crossings = {k: -region.crossing for k, region in at.items() if region.crossing is not None}
    gates = {k: region.plane for k, region in at.items() if region.plane is not None}
    still, flat = np.zeros(len(crossings)), np.zeros(len(gates))
    result = [
        _boxes(task),
        _planes(task, sides, normals, bounds, bounds),
        _balls(task, {k: region.radius for k, region in at.items() if np.isfinite(region.radius)}),
        _planes(task, list(crossings), list(crossings.values()), still, still + 1.0, order=1),
        replace(_planes(task, list(gates), list(gates.values()), flat, flat + task.length), equal=True),
    ]
    return [_at_ends(task, walls) for walls in result if len(walls.leg)]


def _at_ends(task: Task, walls: Walls) -> Walls:
    """Return walls of waypoints as walls at the start of pieces, or at the end of the last one."""
    knot = walls.leg * task.pieces
    end = (knot == task.legs * task.pieces).astype(np.intp)
    return replace(walls, leg=knot - end, at=end)


def _boxes(task: Task) -> Walls:
    """Two planes for each coordinate that may vary within bounds, upper ones first."""
    waypoint, axis = np.nonzero(task.upper > task.lower)
    if task.closed:
        waypoint, axis = waypoint[waypoint < task.legs], axis[waypoint < task.legs]
    upper, lower = task.upper[waypoint, axis], task.lower[waypoint, axis]
    normal, width = np.eye(task.dim)[axis], np.tile((upper - lower) / 2.0, 2)
    return _planes(task, np.tile(waypoint, 2), np.vstack((normal, -normal)), np.concatenate((upper, -lower)), width)


def _balls(task: Task, radii: dict[int, float]) -> Walls:
    waypoint, radius = np.array(list(radii), dtype=np.intp), np.array(list(radii.values()))
    matrix, still = np.tile(np.eye(task.dim), (len(radius), 1, 1)), np.zeros((len(radius), task.dim))
    return Walls(waypoint, matrix, task.waypoints[waypoint], still, radius, radius, 0, "waypoint")


def _planes(
    task: Task,
    waypoint: Sequence[int] | IntArray,
    normal: Sequence[FloatArray] | FloatArray,
    bound: FloatArray,
    width: FloatArray,
    order: int = 0,
) -> Walls:
    """Planes on the offset from a waypoint, or on a derivative there."""
    at, normals = np.asarray(waypoint, dtype=np.intp), np.asarray(normal).reshape(-1, task.dim)
    anchor = np.zeros(normals.shape) if order else task.waypoints[at]
    return Walls(at, np.zeros((len(at), 0, task.dim)), anchor, -normals, bound, width, order, "waypoint")


def normalised_walls(task: Task, problem: ReducedProblem, units: Units) -> AllWalls:
    """Return a task's walls, but for planes of gates, in a problem's units, and those of touches after them.

    Positions are counted from the nominal start of each piece, as control points are there.
    """
    known = [_normalised(walls, problem, units) for walls in all_walls(task).blocks if not walls.equal]
    return AllWalls((*known, *_touching(task)))


def _normalised(walls: Walls, problem: ReducedProblem, units: Units) -> Walls:
    """Walls in normalised units; planes are counted from zero, and one that a nominal knot lies on goes through it."""
    unit, anchor, piece = units.of_order(walls.order), walls.anchor, walls.leg
    anchor = anchor / unit if walls.order else (anchor - units.origin) / unit - problem.nominal[piece]
    radius, width = walls.radius / unit, walls.width / unit
    if walls.flat:
        radius, anchor = radius - (walls.slope * anchor).sum(axis=1), np.zeros(anchor.shape)
    if walls.flat and not walls.order:
        farther = np.maximum(-(problem.steps[piece] * walls.slope).sum(axis=1), 0.0)
        radius = np.where(np.abs(radius - farther) <= ROUNDING * width, farther, radius)
    return replace(walls, anchor=anchor, radius=radius, width=width)


def _touching(task: Task) -> list[Walls]:
    """Return, for each touched wall, the bound of the first derivative that is not pinned; one block for each order."""
    by_axis: dict[int, list[tuple[int, int, FloatArray]]] = {}
    for side, above, waypoint, axis in np.argwhere(task.touches).tolist():
        knot, end = waypoint * task.pieces, int(side == Side.BEFORE)
        if not 0 <= knot - end < task.legs * task.pieces:
            continue
        slots = task.slots.end if end else task.slots.start
        order = next((q for q in range(1, task.half) if task.free[knot, slots[q], axis]), task.half)
        outwards = (-1.0 if above else 1.0) * (-1.0) ** (order * end)
        by_axis.setdefault(order, []).append((knot - end, end, outwards * np.eye(task.dim)[axis]))
    return [_derivative_bounds(rows, order) for order, rows in sorted(by_axis.items())]


def _derivative_bounds(rows: list[tuple[int, int, FloatArray]], order: int) -> Walls:
    """Planes through zero on derivatives, from pieces, their ends (0 or 1) and outward normals."""
    piece, at, normal = (np.array(column) for column in zip(*rows, strict=True))
    still, planes = np.zeros(len(rows)), np.zeros((len(rows), 0, normal.shape[1]))
    return Walls(piece, planes, 0.0 * normal, -normal, still, still + 1.0, order, "waypoint", at)
