"""The part of the panel about the corridor: tubes, boxes and the room, and what of them cannot be met."""

from __future__ import annotations

from typing import Any

from minsnap.planning.request import Box, PlanRequest
from minsnap.studio.edits import WIDTH, replace_box, set_width, with_boxes, with_room, with_tube
from minsnap.studio.page_inputs import Change, Editor, InputRows, editing, follow, sentence, when_changed
from minsnap.studio.wall_view import NO_FACES, ROOM_FACES, WallView
from minsnap.studio.workbench import BenchState

NARROWEST, WIDEST = 0.01, 3.0
"""Ends of the sliders of half-widths [m]."""


class CorridorPanel:
    """Half-widths of the legs, boxes and room.

    Parameters
    ----------
    gui : viser.GuiApi
        Where it is added, in the present container.
    editor : Editor
        What inputs edit.
    view : WallView
        Where faces can be dragged.
    """

    def __init__(self, gui: Any, editor: Editor, view: WallView) -> None:
        self._gui, self._editor, self._view = gui, editor, view
        self._tube = self._checkbox("Corridor: a tube around each leg", with_tube)
        self._rows = InputRows(gui.add_folder("Half-width per leg [m]"), self._row)
        self._boxes = self._checkbox("Corridor: a box around each leg", with_boxes)
        self._room = self._checkbox("Room around all legs", with_room)
        self._faces = when_changed(gui.add_dropdown("Faces to drag", (NO_FACES,)), self._choose)
        self._lower = gui.add_vector3("Lower corner", (0.0, 0.0, 0.0), step=0.05, visible=False)
        self._upper = gui.add_vector3("Upper corner", (1.0, 1.0, 1.0), step=0.05, visible=False)
        when_changed(self._lower, lambda value: self._set_corner(0, value))
        when_changed(self._upper, lambda value: self._set_corner(1, value))
        self._request: PlanRequest | None = None

    def show(self, state: BenchState) -> None:
        """Show the walls of the document, and beside its leg why one is too narrow."""
        self._request = request = state.request
        follow(self._tube, request.corridor is not None)
        follow(self._boxes, request.boxes is not None)
        follow(self._room, request.room is not None)
        self._rows.folder.visible = request.corridor is not None
        self._rows.show(request.corridor or ())
        for leg, (_, note) in enumerate(self._rows.handles):
            note.visible = bool(state.refusal) and state.leg == leg
            if note.visible:
                note.content = sentence(state.refusal, "refusal")
        self._show_faces(request)

    def _checkbox(self, label: str, change: Any) -> Any:
        return when_changed(self._gui.add_checkbox(label, False), editing(self._editor, change))

    def _row(self, leg: int) -> tuple[Any, Any]:
        widen = editing(self._editor, lambda request, width: set_width(request, leg, width), f"width {leg}")
        how = {"min": NARROWEST, "max": WIDEST, "step": 0.01, "initial_value": WIDTH}
        return when_changed(self._gui.add_slider(f"Leg {leg}", **how), widen), self._gui.add_html("", visible=False)

    def _show_faces(self, request: PlanRequest) -> None:
        boxes = tuple(f"box {leg}" for leg in range(len(request.boxes or ())))
        options = (NO_FACES, *((ROOM_FACES,) if request.room is not None else ()), *boxes)
        if tuple(self._faces.options) != options:
            kept = self._faces.value if self._faces.value in options else NO_FACES
            self._faces.options = options
            follow(self._faces, kept)
            self._view.choose(kept)
        box = self._box(request)
        self._lower.visible = self._upper.visible = box is not None
        if box is not None:
            follow(self._lower, box[0])
            follow(self._upper, box[1])

    def _choose(self, which: str) -> None:
        self._view.choose(which)
        if self._request is not None:
            self._show_faces(self._request)

    def _box(self, request: PlanRequest) -> Box | None:
        which = self._faces.value
        if which == NO_FACES:
            return None
        return request.room if which == ROOM_FACES else (request.boxes or ())[int(which.split()[1])]

    def _set_corner(self, side: int, value: Any) -> None:
        self._editor.edit(self._with_corner(side, value), f"corner {side} of {self._faces.value}")

    def _with_corner(self, side: int, value: Any) -> Change:
        def change(request: PlanRequest) -> PlanRequest:
            box = self._box(request)
            if box is None:
                return request
            leg = None if self._faces.value == ROOM_FACES else int(self._faces.value.split()[1])
            return replace_box(request, leg, (value, box[1]) if side == 0 else (box[0], value))

        return change
