"""Tubes, boxes and room in the scene, with faces that can be dragged."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.planning.request import Box, PlanRequest
from minsnap.studio.edits import move_face, replace_box
from minsnap.studio.page_inputs import Editor
from minsnap.studio.wall_shapes import box_edges, box_surface, face_centres, tube_prism
from minsnap.studio.workbench import BenchState

TUBE, BOX, ROOM, REFUSED = (86, 180, 233), (0, 158, 115), (120, 120, 120), (224, 49, 49)
"""Colours of walls; the last one of a leg that cannot be planned."""

NO_FACES, ROOM_FACES = "none", "room"
"""Choices of what has faces to drag, besides ``"box 0"`` and so on."""


class WallView:
    """Walls of the scene; drags end in the server's thread while plans are shown in others, one at a time.

    Parameters
    ----------
    server : viser.ViserServer
        Where they are drawn.
    editor : Editor
        What drags of faces edit.
    """

    def __init__(self, server: Any, editor: Editor) -> None:
        self._server, self._editor = server, editor
        self._lock = threading.RLock()
        self._tubes: dict[int, tuple[Any, Any]] = {}
        self._boxes: dict[str, tuple[Any, Any]] = {}
        self._faces: dict[tuple[int, int], Any] = {}
        self._dragged: set[tuple[int, int]] = set()
        self._chosen = NO_FACES
        self._request: PlanRequest | None = None
        self._warning = server.scene.add_label("/plan/refusal", "", visible=False, anchor="bottom-center")

    def show(self, state: BenchState) -> None:
        """Draw the walls of the document; the leg that cannot be planned is red, and says so."""
        self._show_tubes(state)
        self._show_boxes(state)
        with self._lock:
            self._request = state.request
            self._show_faces()
        self._warning.visible = bool(state.refusal) and state.leg is not None
        if self._warning.visible and state.leg is not None:
            ends = np.array(state.request.waypoints)[state.leg : state.leg + 2]
            self._warning.position = ends.mean(axis=0)
            self._warning.text = f"leg {state.leg} cannot be planned"

    def choose(self, which: str) -> None:
        """Give the room, a box or nothing faces to drag."""
        with self._lock:
            self._chosen = which
            for handle in self._faces.values():
                handle.remove()
            self._faces = {}
            self._dragged.clear()
            self._show_faces()

    def _show_tubes(self, state: BenchState) -> None:
        request = state.request
        wanted = {} if request.corridor is None else {leg: _tube(state, leg) for leg in range(request.legs)}
        for leg in [leg for leg, (key, _) in self._tubes.items() if wanted.get(leg) != key]:
            self._tubes.pop(leg)[1].remove()
        for leg, key in wanted.items():
            if leg not in self._tubes and key is not None:
                self._tubes[leg] = (key, self._tube_mesh(leg, *key))

    def _tube_mesh(self, leg: int, start: Any, end: Any, width: float, refused: bool) -> Any:
        vertices, faces = tube_prism(start, end, width)
        look = {"color": REFUSED if refused else TUBE, "opacity": 0.45 if refused else 0.1, "side": "double"}
        plain = {"cast_shadow": False, "receive_shadow": False, "flat_shading": True}
        return self._server.scene.add_mesh_simple(f"/plan/tube/{leg}", vertices, faces, **look, **plain)

    def _show_boxes(self, state: BenchState) -> None:
        wanted: dict[str, Any] = {}
        if state.request.room is not None:
            wanted["room"] = (state.request.room, ROOM, 0.06)
        for leg, box in enumerate(state.request.boxes or ()):
            refused = bool(state.refusal) and state.leg == leg
            wanted[f"box {leg}"] = (box, REFUSED if refused else BOX, 0.3 if refused else 0.1)
        for name in [name for name, (key, _) in self._boxes.items() if wanted.get(name) != key]:
            self._boxes.pop(name)[1].remove()
        for name, key in wanted.items():
            if name not in self._boxes:
                self._boxes[name] = (key, self._box_nodes(name.replace(" ", "/"), *key))

    def _box_nodes(self, name: str, box: Box, colour: Any, opacity: float) -> Any:
        """Draw faces, and edges as their child, which goes with them; return the faces."""
        vertices, faces = box_surface(box)
        plain = {"cast_shadow": False, "receive_shadow": False, "side": "double", "flat_shading": True}
        scene = self._server.scene
        mesh = scene.add_mesh_simple(f"/walls/{name}", vertices, faces, color=colour, opacity=opacity, **plain)
        lines = {"thickness": 1.5, "thickness_units": "screen"}
        scene.add_line_segments(f"/walls/{name}/edges", box_edges(box), colour, **lines)
        return mesh

    def _box(self, request: PlanRequest | None) -> tuple[int | None, Box | None]:
        """Return the leg and the box whose faces can be dragged; (None, the room); or (None, None)."""
        if request is None or self._chosen == NO_FACES:
            return None, None
        if self._chosen == ROOM_FACES:
            return None, request.room
        leg = int(self._chosen.split()[1])
        boxes = request.boxes or ()
        return (leg, boxes[leg]) if leg < len(boxes) else (None, None)

    def _show_faces(self) -> None:
        """Move the faces to where the document has them, but for those that a hand holds."""
        box = self._box(self._request)[1]
        if box is None:
            for handle in self._faces.values():
                handle.remove()
            self._faces = {}
            return
        centers = face_centres(box)
        for axis in range(3):
            for side in range(2):
                place = (axis, side)
                if place not in self._faces:
                    self._faces[place] = self._face(axis, side)
                handle = self._faces[place]
                moved = np.abs(np.asarray(handle.position) - centers[place]).max() > 1e-6
                if moved and place not in self._dragged:
                    handle.position = centers[place]

    def _face(self, axis: int, side: int) -> Any:
        active = tuple(i == axis for i in range(3))
        how = {"active_axes": active, "disable_sliders": True, "disable_rotations": True, "scale": 0.6}
        handle = self._server.scene.add_transform_controls(f"/faces/{axis}{side}", depth_test=False, **how)

        async def moved(event: Any) -> None:
            if event.phase == "start":
                self._dragged.add((axis, side))
            elif event.phase == "update":
                value = float(handle.position[axis])
                self._editor.edit(lambda request: self._moved(request, axis, side, value), "face", held=True)
            else:
                self._editor.pause()
                with self._lock:
                    self._dragged.discard((axis, side))
                    self._show_faces()

        handle.on_update(moved)
        return handle

    def _moved(self, request: PlanRequest, axis: int, side: int, value: float) -> PlanRequest:
        leg, box = self._box(request)
        if box is None:
            return replace(request)
        return replace_box(request, leg, move_face(box, axis, side, value))


def _tube(state: BenchState, leg: int) -> Any:
    """Return what the tube of a leg is drawn from; None where the leg has no direction or its width no meaning."""
    start, end = state.request.waypoints[leg : leg + 2]
    widths = state.request.corridor or ()
    if start == end or leg >= len(widths) or not 0.0 < widths[leg] < np.inf:
        return None
    return start, end, widths[leg], bool(state.refusal) and state.leg == leg
