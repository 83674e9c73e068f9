"""Tubes, boxes and room in the scene: their triangles, and faces that can be dragged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.files import Box, FileRequest
from minsnap.plot.geometry import leg_bodies
from minsnap.studio.edits import ROOM, change_box, move_face, named_boxes
from minsnap.studio.page_inputs import Change, DragHandles, Editor
from minsnap.studio.workbench import BenchState

_BOX_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4]]
    + [[1, 5, 7], [1, 7, 3]]
)


TUBE, BOX, AROUND, REFUSED = (86, 180, 233), (0, 158, 115), (120, 120, 120), (224, 49, 49)
"""Colours of tubes, boxes, the room, and the walls of a leg that cannot be planned."""

NO_FACES = "none"
"""Choice of what has faces to drag, besides the names of boxes."""


def tube_prism(start: Sequence[float], end: Sequence[float], half_width: float) -> tuple[FloatArray, IntArray]:
    """Return the sides of a tube between the waypoints of its leg, whose body is that of the figures.

    Parameters
    ----------
    start, end : sequence of 3 floats
        Waypoints [m], different ones.
    half_width : float
        [m].

    Returns
    -------
    vertices : ndarray, shape (2 m, 3)
        Corners at the start and at the end [m].
    faces : ndarray of int, shape (2 m, 3)
        Triangles of the sides.
    """
    from scipy.spatial import ConvexHull

    ends = np.array((start, end), dtype=np.float64)
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    unit = np.stack([np.zeros(3), along])
    corners = leg_bodies(1.0, unit)[0]  # of every length and width: no hull is found of a very thin body
    there = corners @ along > 0.5
    faces = ConvexHull(corners).simplices
    which = there.astype(np.intp)
    vertices = ends[which] + half_width * (corners - unit[which])
    return vertices, faces[there[faces].any(axis=1) & ~there[faces].all(axis=1)]


def box_surface(boxes: Any) -> tuple[FloatArray, IntArray]:
    """Return the corners and the triangles of boxes, shapes (8 n, 3) [m] and (12 n, 3), from (n, 2, 3) or one."""
    bounds = np.array(boxes, dtype=np.float64).reshape(-1, 2, 3)
    pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])
    faces = _BOX_FACES + 8 * np.arange(len(bounds))[:, None, None]
    return bounds[:, pick, np.arange(3)].reshape(-1, 3), faces.reshape(-1, 3)


def box_edges(box: Box) -> FloatArray:
    """Return the 12 edges of a box, shape (12, 2, 3) [m]."""
    corners = box_surface(box)[0]
    pairs = [(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit]
    return np.asarray(corners[np.array(pairs)])


def face_centres(box: Box) -> FloatArray:
    """Return the centers of the faces, shape (3, 2, 3) by axis and side [m]."""
    bounds = np.array(box, dtype=np.float64)
    centers = np.tile(bounds.mean(axis=0), (3, 2, 1))
    centers[range(3), :, range(3)] = bounds.T
    return centers


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
        self._request: FileRequest | None = None
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
