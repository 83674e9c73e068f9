"""The parts of the panel about where the path goes: waypoints, gates, heading; tubes, boxes and room."""

from __future__ import annotations

from dataclasses import replace
from math import degrees, radians
from typing import Any

import numpy as np

from minsnap.planning.request import Box, PlanRequest
from minsnap.studio.edits import (
    WIDTH,
    axes_of,
    delete_waypoint,
    insert_waypoint,
    move_in_order,
    move_waypoint,
    replace_box,
    reshape_gate,
    set_width,
    sized,
    with_boxes,
    with_gate,
    with_room,
    with_tube,
)
from minsnap.studio.page_inputs import Change, Editor, InputRows, editing, follow, sentence, when_changed
from minsnap.studio.wall_view import NO_FACES, ROOM_FACES, WallView
from minsnap.studio.waypoint_view import GateView, WaypointView
from minsnap.studio.workbench import BenchState

HEADINGS = ("fixed", "per waypoint", "velocity", "tilt")
"""Ways to give the heading."""

ORDER = ("Add", "Delete", "↑", "↓")
"""What can be done with a waypoint."""


NARROWEST, WIDEST = 0.01, 3.0
"""Ends of the sliders of half-widths [m]."""


class RoutePanel:
    """InputRows of waypoints, buttons that change their number and order, heading.

    Parameters
    ----------
    gui : viser.GuiApi
        Where it is added, in the present container.
    editor : Editor
        What inputs edit.
    view : WaypointView
        Where the chosen waypoint is marked, and can be clicked.
    gates : GateView
        Where the gate at the chosen waypoint has a handle.
    """

    def __init__(self, gui: Any, editor: Editor, view: WaypointView, gates: GateView) -> None:
        self._gui, self._editor, self._view, self._gates = gui, editor, view, gates
        view.when_clicked(self.choose)
        self._rows = InputRows(gui.add_folder("Waypoints [m]"), self._row)
        self._chosen = when_changed(gui.add_number("Waypoint", 0, min=0, step=1), self._choose)
        self._order = gui.add_button_group("Order", ORDER)
        self._order.on_click(self._reorder)
        self._gate = when_changed(gui.add_checkbox("Gate", False), self._set_gate)
        self._size = gui.add_vector2("Width, height [m]", (1.0, 1.0), min=(0.05, 0.05), step=0.05, visible=False)
        when_changed(self._size, self._set_size)
        self._margin = gui.add_number("Margin [m]", 0.0, min=0.0, step=0.05, visible=False)
        when_changed(self._margin, self._set_margin)
        self._request: PlanRequest | None = None
        self._closed = when_changed(gui.add_checkbox("Closed lap", False), editing(editor, _closed))
        self._heading = when_changed(gui.add_dropdown("Heading", HEADINGS), editing(editor, _headed))
        turn = editing(editor, lambda request, angle: replace(request, yaw=radians(angle)), "heading")
        self._angle = when_changed(gui.add_number("Angle [degrees]", 0.0, step=1.0), turn)
        self._turns = InputRows(gui.add_folder("Headings [degrees]", visible=False), self._turn)

    def show(self, state: BenchState) -> None:
        """Show the waypoints and the heading of the document."""
        self._request = request = state.request
        self._rows.show(request.waypoints)
        self.choose(int(self._chosen.value))
        follow(self._closed, request.closed)
        follow(self._heading, _heading(request))
        self._angle.visible = _heading(request) == "fixed"
        if isinstance(request.yaw, float):
            follow(self._angle, round(degrees(request.yaw), 9))
        self._turns.folder.visible = bool(request.turns)
        self._turns.show([round(degrees(angle), 9) for angle in request.turns])

    def _row(self, index: int) -> tuple[Any]:
        move = editing(self._editor, lambda request, point: move_waypoint(request, index, point), f"waypoint {index}")
        return (when_changed(self._gui.add_vector3(f"{index}", (0.0, 0.0, 0.0), step=0.05), move),)

    async def _reorder(self, event: Any) -> None:
        if event.client_id is None:
            return
        index, what = int(self._chosen.value), event.target.value
        change = {
            ORDER[0]: lambda request: insert_waypoint(request, _within(request, index)),
            ORDER[1]: lambda request: delete_waypoint(request, _within(request, index)),
            ORDER[2]: lambda request: move_in_order(request, _within(request, index), -1),
            ORDER[3]: lambda request: move_in_order(request, _within(request, index), 1),
        }[what]
        self._editor.edit(change)
        self.choose(index + {ORDER[0]: 1, ORDER[2]: -1, ORDER[3]: 1}.get(what, 0))

    def choose(self, index: int) -> None:
        """Choose the waypoint that buttons and keys act on."""
        follow(self._chosen, min(max(index, 0), len(self._rows.handles) - 1))
        self._choose(int(self._chosen.value))

    def _choose(self, index: int) -> None:
        self._view.choose(index)
        self._gates.choose(index)
        gate = None if self._request is None else next((g for g in self._request.openings if g[0] == index), None)
        follow(self._gate, gate is not None)
        self._size.visible = self._margin.visible = gate is not None
        if gate is not None:
            corners = np.array(gate[1])
            follow(self._size, tuple(np.ptp(corners @ np.stack(axes_of(corners)).T, axis=0).round(6).tolist()))
            follow(self._margin, gate[3])

    def _set_gate(self, wanted: bool) -> None:
        index = int(self._chosen.value)
        self._editor.edit(lambda request: with_gate(request, index, wanted))

    def _set_size(self, size: tuple[float, float]) -> None:
        index = int(self._chosen.value)

        def change(request: PlanRequest) -> PlanRequest:
            corners = next((np.array(gate[1]) for gate in request.openings if gate[0] == index), None)
            return request if corners is None else reshape_gate(request, index, sized(corners, *size))

        self._editor.edit(change, f"gate {index}")

    def _set_margin(self, margin: float) -> None:
        index = int(self._chosen.value)

        def change(request: PlanRequest) -> PlanRequest:
            openings = tuple((*g[:3], float(margin)) if g[0] == index else g for g in request.openings)
            return replace(request, openings=openings)

        self._editor.edit(change, f"margin {index}")

    def delete(self) -> None:
        """Delete the chosen waypoint."""
        index = int(self._chosen.value)
        self._editor.edit(lambda request: delete_waypoint(request, _within(request, index)))

    def _turn(self, index: int) -> tuple[Any]:
        def change(request: PlanRequest, angle: float) -> PlanRequest:
            return replace(request, yaw=(*request.turns[:index], radians(angle), *request.turns[index + 1 :]))

        turn = editing(self._editor, change, f"heading {index}")
        return (when_changed(self._gui.add_number(f"{index}", 0.0, step=1.0), turn),)


def _closed(request: PlanRequest, wanted: bool) -> PlanRequest:
    return request.as_lap() if wanted else replace(request, closed=False)


def _headed(request: PlanRequest, kind: str) -> PlanRequest:
    fixed = request.yaw if isinstance(request.yaw, float) else 0.0
    chosen: dict[str, Any] = {"fixed": fixed, "per waypoint": (fixed,) * len(request.waypoints)}
    return replace(request, yaw=chosen.get(kind, kind))


def _heading(request: PlanRequest) -> str:
    if request.turns:
        return HEADINGS[1]
    return request.yaw if isinstance(request.yaw, str) else HEADINGS[0]


def _within(request: PlanRequest, index: int) -> int:
    return min(max(index, 0), len(request.waypoints) - 1)


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
