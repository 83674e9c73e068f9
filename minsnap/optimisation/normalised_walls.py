"""All walls of a problem in normalised units, on pieces.

Positions are counted from the nominal start of each piece, as control points are there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import ROUNDING
from minsnap.corridors.constraint import Walls
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.optimisation.task import Task
from minsnap.optimisation.task_walls import AllWalls, all_walls
from minsnap.optimisation.touches import Side
from minsnap.optimisation.units import Units


def normalised_walls(task: Task, problem: ReducedProblem, units: Units) -> AllWalls:
    """Convert a task's walls, but for planes of gates, to a problem's units and origins; those of touches follow."""
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
