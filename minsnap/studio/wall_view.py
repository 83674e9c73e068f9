"""Tubes, boxes and room in the scene: their triangles, and faces that can be dragged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.planning.request import Box, PlanRequest
from minsnap.studio.edits import ROOM, change_box, move_face, named_boxes
from minsnap.studio.page_inputs import Change, DragHandles, Editor
from minsnap.studio.workbench import BenchState

TOUCHING = 1e-9
"""Relative distance from a plane below which a corner lies on it."""

_BOX_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4]]
    + [[1, 5, 7], [1, 7, 3]]
)


TUBE, BOX, AROUND, REFUSED = (86, 180, 233), (0, 158, 115), (120, 120, 120), (224, 49, 49)
"""Colours of tubes, boxes, the room, and the walls of a leg that cannot be planned."""

NO_FACES = "none"
"""Choice of what has faces to drag, besides the names of boxes."""


def tube_prism(start: Sequence[float], end: Sequence[float], half_width: float) -> tuple[FloatArray, IntArray]:
    r"""Return the surface of a tube between the waypoints of its leg.

    Across the leg the tube is the polygon :math:`\|d\|_\infty \le \delta` of the plane :math:`d \perp u` (see
    :class:`~minsnap.Tube`): its corners are where two of the planes :math:`d_k = \pm\delta` meet.

    Parameters
    ----------
    start, end : sequence of 3 floats
        Waypoints [m], different ones.
    half_width : float
        :math:`\delta` [m].

    Returns
    -------
    vertices : ndarray, shape (2 m, 3)
        The polygon at the start, then at the end [m].
    faces : ndarray of int, shape (2 m, 3)
        Triangles of the sides.
    """
    first, last = np.array(start, dtype=np.float64), np.array(end, dtype=np.float64)
    corners = _polygon((last - first) / np.linalg.norm(last - first), half_width)
    count = len(corners)
    here, following = np.arange(count), np.roll(np.arange(count), -1)
    lower = np.column_stack([here, following, here + count])
    upper = np.column_stack([following, following + count, here + count])
    return np.vstack([corners + first, corners + last]), np.vstack([lower, upper])


def box_surface(box: Box) -> tuple[FloatArray, IntArray]:
    """Return the corners and the triangles of a box, shapes (8, 3) [m] and (12, 3)."""
    bounds = np.array(box, dtype=np.float64)
    pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])
    return bounds[pick, np.arange(3)], _BOX_FACES


def box_edges(box: Box) -> FloatArray:
    """Return the 12 edges of a box, shape (12, 2, 3) [m]."""
    corners = box_surface(box)[0]
    pairs = [(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit]
    return np.asarray(corners[np.array(pairs)])


def face_centres(box: Box) -> FloatArray:
    """Return the centers of the faces, shape (3, 2, 3) by axis and side [m]."""
    bounds = np.array(box, dtype=np.float64)
    centers = np.tile(bounds.mean(axis=0), (3, 2, 1))
    for axis in range(3):
        centers[axis, :, axis] = bounds[:, axis]
    return centers


def _polygon(along: FloatArray, half_width: float) -> FloatArray:
    """Return the corners of the section across a direction, in order, shape (m, 3) [m]."""
    across = _basis(along)
    normals = np.vstack([across, -across])
    kept = np.linalg.norm(normals, axis=1) > TOUCHING
    normals = normals[kept]
    vertices = []
    for i, first in enumerate(normals):
        for second in normals[i + 1 :]:
            matrix = np.array([first, second])
            if abs(np.linalg.det(matrix)) > TOUCHING:
                corner = np.linalg.solve(matrix, np.full(2, half_width))
                if (normals @ corner).max() <= half_width * (1.0 + TOUCHING):
                    vertices.append(corner)
    corners = np.array(vertices)
    order = np.argsort(np.arctan2(corners[:, 1], corners[:, 0]))
    return np.asarray(corners[order] @ across.T)


def _basis(along: FloatArray) -> FloatArray:
    """Return two unit vectors across a direction as columns, shape (3, 2): row k is axis k in their plane."""
    helper = np.eye(3)[int(np.abs(along).argmin())]
    first = np.cross(along, helper)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(along, first)])


class WallView:
    """Walls of the scene.

    Parameters
    ----------
    server : viser.ViserServer
        Where they are drawn.
    editor : Editor
        What drags of faces edit.
    """

    def __init__(self, server: Any, editor: Editor) -> None:
        self._server = server
        self._tubes: dict[int, tuple[Any, Any]] = {}
        self._boxes: dict[str, tuple[Any, Any]] = {}
        self._faces = DragHandles(editor, self._face, lambda face, place: (self._moved(face, place), "face"))
        self._chosen = NO_FACES
        self._request: PlanRequest | None = None
        self._warning = server.scene.add_label("/plan/refusal", "", visible=False, anchor="bottom-center")

    def show(self, state: BenchState) -> None:
        """Draw the walls of the document; the leg that cannot be planned is red, and says so."""
        self._show_tubes(state)
        self._show_boxes(state)
        with self._faces.lock:
            self._request = state.request
            self._show_faces()
        self._warning.visible = bool(state.refusal) and state.leg is not None
        if self._warning.visible and state.leg is not None:
            ends = np.array(state.request.waypoints)[state.leg : state.leg + 2]
            self._warning.position = ends.mean(axis=0)
            self._warning.text = f"leg {state.leg} cannot be planned"

    def choose(self, which: str) -> None:
        """Give the room, a box or nothing faces to drag."""
        with self._faces.lock:
            self._chosen = which
            self._faces.show({})
            self._show_faces()

    def _show_tubes(self, state: BenchState) -> None:
        request = state.request
        wanted = {} if request.corridor is None else {leg: _tube(state, leg) for leg in range(request.legs)}
        _redraw(self._tubes, {leg: key for leg, key in wanted.items() if key is not None}, self._tube_mesh)

    def _tube_mesh(self, leg: int, start: Any, end: Any, width: float, refused: bool) -> Any:
        vertices, faces = tube_prism(start, end, width)
        look = {"color": REFUSED if refused else TUBE, "opacity": 0.45 if refused else 0.1, "side": "double"}
        plain = {"cast_shadow": False, "receive_shadow": False, "flat_shading": True}
        return self._server.scene.add_mesh_simple(f"/plan/tube/{leg}", vertices, faces, **look, **plain)

    def _show_boxes(self, state: BenchState) -> None:
        looks = {ROOM: (AROUND, 0.06)} | ({f"box {state.leg}": (REFUSED, 0.3)} if state.refusal else {})
        wanted = {name: (box, *looks.get(name, (BOX, 0.1))) for name, box in named_boxes(state.request).items()}
        _redraw(self._boxes, wanted, self._box_nodes)

    def _box_nodes(self, name: str, box: Box, colour: Any, opacity: float) -> Any:
        """Draw faces, and edges as their child, which goes with them; return the faces."""
        vertices, faces, path = *box_surface(box), f"/walls/{name.replace(' ', '/')}"
        plain = {"cast_shadow": False, "receive_shadow": False, "side": "double", "flat_shading": True}
        scene = self._server.scene
        mesh = scene.add_mesh_simple(path, vertices, faces, color=colour, opacity=opacity, **plain)
        lines = {"thickness": 1.5, "thickness_units": "screen"}
        scene.add_line_segments(f"{path}/edges", box_edges(box), colour, **lines)
        return mesh

    def _show_faces(self) -> None:
        box = None if self._request is None else named_boxes(self._request).get(self._chosen)
        centers = {} if box is None else dict(zip(np.ndindex(3, 2), face_centres(box).reshape(6, 3), strict=True))
        self._faces.show(centers)

    def _face(self, face: tuple[int, int], place: FloatArray) -> Any:
        axis, side = face
        active = tuple(i == axis for i in range(3))
        how = {"active_axes": active, "disable_sliders": True, "disable_rotations": True, "scale": 0.6}
        return self._server.scene.add_transform_controls(f"/faces/{axis}{side}", depth_test=False, **how)

    def _moved(self, face: tuple[int, int], place: tuple[float, ...]) -> Change:
        return lambda request: change_box(request, self._chosen, lambda box: move_face(box, *face, place[face[0]]))


def _redraw(drawn: dict[Any, tuple[Any, Any]], wanted: dict[Any, Any], draw: Callable[..., Any]) -> None:
    """Remove what is no longer wanted as it was drawn, and draw what is not there, from what stands for it."""
    for name in [name for name, (key, _) in drawn.items() if wanted.get(name) != key]:
        drawn.pop(name)[1].remove()
    for name, key in wanted.items():
        if name not in drawn:
            drawn[name] = (key, draw(name, *key))


def _tube(state: BenchState, leg: int) -> Any:
    """Return what the tube of a leg is drawn from; None where the leg has no direction or its width no meaning."""
    start, end = state.request.waypoints[leg : leg + 2]
    widths = state.request.corridor or ()
    if start == end or leg >= len(widths) or not 0.0 < widths[leg] < np.inf:
        return None
    return start, end, widths[leg], bool(state.refusal) and state.leg == leg
