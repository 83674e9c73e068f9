"""What a scene keeps out of: boxes that cover cells and points of files, and all obstacles of the document, drawn."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.corridors import Avoided
from minsnap.files import FileRequest
from minsnap.plot.obstacles import faces_of
from minsnap.studio.ground_view import Obstacles
from minsnap.studio.page_inputs import Change
from minsnap.studio.workbench import BenchState

MOST_BOXES = 64
"""Boxes that cells and points of a file are covered with at most: a plan around more takes tens of seconds."""

FINEST = 64
"""Cells along the longest side of what points are covered with at first."""

CLEARANCE = 0.3
"""Room around cells and points of a file unless told otherwise [m]."""

COLOUR = (150, 158, 168)

Named = tuple[str, tuple[float, ...]]
"""An obstacle of a document: its name and its numbers."""


def avoiding(found: Obstacles, clearance: float = CLEARANCE) -> Change:
    """Return the change of a document that keeps out of what a file holds, and of some room around it [m]."""
    boxes = covered(found)
    named: tuple[Named, ...] = tuple(
        ("cuboid", (*(low - clearance).tolist(), *(high + clearance).tolist())) for low, high in boxes
    )

    def change(request: FileRequest) -> FileRequest:
        return replace(request, avoid=(*request.avoid, *(each for each in named if each not in request.avoid)))

    return change


def covered(found: Obstacles) -> FloatArray:
    """Return few boxes that cover all cells and points, shape (m, 2, 3) [m]; cells grow until these are few enough."""
    if not len(found.boxes) and not len(found.points):
        return np.zeros((0, 2, 3))
    low, high = _extent(found)
    longest = max(float((high - low).max()), 1e-9)
    side = _least_side(found, longest)
    while True:
        boxes = low + side * merged(np.unique(_cells(found, low, side), axis=0))
        if len(boxes) <= MOST_BOXES:
            return np.asarray(boxes)
        side *= 1.5


def _extent(found: Obstacles) -> tuple[FloatArray, FloatArray]:
    ends = np.concatenate((found.boxes.reshape(-1, 3), found.points))
    return ends.min(axis=0), ends.max(axis=0)


def _least_side(found: Obstacles, longest: float) -> float:
    """Return the side of the first cells: that of the file's own, of points a share of their extent [m]."""
    sides = found.boxes[:, 1] - found.boxes[:, 0]
    own = float(sides.min()) if len(sides) else longest / FINEST
    return max(own, longest / FINEST)


def _cells(found: Obstacles, low: FloatArray, side: float) -> IntArray:
    """Return the indices of the cells that points lie in, and that boxes meet, shape (k, 3)."""
    parts = [np.floor((found.points - low) / side).astype(np.intp)]
    for corner, end in (found.boxes - low) / side:
        first = np.floor(corner + 1e-6).astype(np.intp)
        last = np.maximum(np.ceil(end - 1e-6).astype(np.intp), first + 1)
        parts.append(np.stack(np.meshgrid(*map(np.arange, first, last), indexing="ij"), axis=-1).reshape(-1, 3))
    return np.concatenate(parts)


def merged(cells: Iterable[Any]) -> FloatArray:
    """Return boxes that cover cells exactly, joined along z, then y, then x, shape (m, 2, 3) in cells."""
    boxes = [(tuple(cell), tuple(index + 1 for index in cell)) for cell in np.asarray(cells).tolist()]
    for axis in (2, 1, 0):
        rest: dict[Any, list[tuple[int, int]]] = {}
        for low, high in boxes:
            across = low[:axis] + low[axis + 1 :], high[:axis] + high[axis + 1 :]
            rest.setdefault(across, []).append((low[axis], high[axis]))
        boxes = [
            ((*low[:axis], a, *low[axis:]), (*high[:axis], b, *high[axis:]))
            for (low, high), spans in rest.items()
            for a, b in _joined(sorted(spans))
        ]
    return np.array(boxes, dtype=np.float64).reshape(-1, 2, 3)


def _joined(spans: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return spans in order, those joined that touch."""
    found: list[tuple[int, int]] = []
    for low, high in spans:
        if found and found[-1][1] == low:
            found[-1] = found[-1][0], high
        else:
            found.append((low, high))
    return found


class ObstacleView:
    """The obstacles that the plan keeps out of.

    Parameters
    ----------
    server : viser.ViserServer
        Where they are drawn.
    """

    def __init__(self, server: Any) -> None:
        self._scene = server.scene
        self._shown: Any = ()
        self._mesh: Any = None

    def show(self, state: BenchState) -> None:
        """Draw the obstacles of the document near its waypoints."""
        request = state.request
        key = request.avoid, request.waypoints
        if key == self._shown:
            return
        self._shown = key
        if self._mesh is not None:
            self._mesh.remove()
            self._mesh = None
        vertices, faces = triangles(request.obstacles, np.array(request.waypoints, dtype=np.float64))
        if len(faces):
            look = {"color": COLOUR, "flat_shading": True, "side": "double"}  # opaque: tubes hide what is not
            self._mesh = self._scene.add_mesh_simple("/avoided", vertices, faces, **look)


def triangles(avoid: Sequence[Avoided], places: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return corners and triangles of obstacles near places (k, 3) [m], shapes (n, 3) [m] and (m, 3)."""
    around = np.concatenate((places - 2.0, places + 2.0))
    faces = [face for obstacle in avoid for face in faces_of(obstacle, around)]
    return halves_of(np.array(faces, dtype=np.float64).reshape(-1, 4, 3))


def halves_of(faces: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return corners and triangles of faces with four corners (n, 4, 3) [m], shapes (4 n, 3) [m] and (2 n, 3)."""
    first = 4 * np.arange(len(faces))[:, None]
    return faces.reshape(-1, 3), np.concatenate((first + [0, 1, 2], first + [0, 2, 3])).astype(np.intp)
