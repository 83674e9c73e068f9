"""The parts of the panel that edit: waypoints, gates, heading; corridor and room; time and polynomials; the vehicle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import degrees, radians
from typing import Any

import numpy as np

from minsnap.basics.checks import DEGREES
from minsnap.basics.limit_kinds import KIND
from minsnap.errors import FileError
from minsnap.files.frames import FRAMES
from minsnap.flight.simulation.controllers import GeometricController
from minsnap.flight.simulation.simulated_flight import Flight, simulate
from minsnap.planning.request import RESERVE, Box, PlanRequest
from minsnap.studio.edits import (
    WIDTH,
    axes_of,
    delete_waypoint,
    insert_waypoint,
    move_in_order,
    move_waypoint,
    replace_box,
    reshape_gate,
    set_duration,
    set_limit,
    set_reserve,
    set_width,
    sized,
    straight_durations,
    with_boxes,
    with_gate,
    with_room,
    with_time,
    with_tube,
)
from minsnap.studio.page_inputs import (
    Change,
    Editor,
    InputRows,
    editing,
    follow,
    sentence,
    table,
    when_changed,
    when_clicked,
)
from minsnap.studio.path_view import GateView, PathView, WaypointView
from minsnap.studio.wall_view import NO_FACES, ROOM_FACES, WallView
from minsnap.studio.workbench import BenchState
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle.quadrotor import VEHICLES, named_vehicle

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


MODES = ("durations", "total time", "limits")
"""Ways to give the time."""

SLIDERS = {
    "speed": (0.1, 15.0, 3.0),
    "acceleration": (0.1, 30.0, 6.0),
    "jerk": (0.5, 200.0, 40.0),
    "horizontal_speed": (0.1, 15.0, 3.0),
    "vertical_speed": (0.1, 10.0, 2.0),
    "max_thrust": (1.05, 5.0, 2.0),
    "tilt": (1.0, 85.0, 35.0),
    "body_rate": (0.2, 20.0, 6.0),
    "yaw_rate": (0.1, 10.0, 2.0),
}
"""Limits of the panel: ends of the slider and the value at first, angles in degrees."""

USUAL = {"speed": 3.0, "acceleration": 6.0}
"""Limits of a scene that had none."""

AUTOMATIC = "automatic"


DRAWN = "dji_f330"
"""The vehicle of a scene that names none."""


class TimePanel:
    """How the time is set, and the polynomials.

    Parameters
    ----------
    gui : viser.GuiApi
        Where it is added, in the present container.
    editor : Editor
        What inputs edit.
    """

    def __init__(self, gui: Any, editor: Editor) -> None:
        self._gui, self._editor = gui, editor
        self._mode = when_changed(gui.add_dropdown("Time from", MODES), editing(editor, self._timed))
        self._total = gui.add_slider("Total [s]", min=0.5, max=60.0, step=0.1, initial_value=12.0)
        when_changed(self._total, editing(editor, _with_total, "total time"))
        self._rows = InputRows(gui.add_folder("Duration per leg [s]"), self._row)
        self._limits = gui.add_folder("Limits")
        with self._limits:
            self._sliders = {name: self._limit_row(name) for name in SLIDERS}
            self._rotors = when_changed(gui.add_checkbox("rotors of the vehicle", False), editing(editor, _with_rotors))
            reserve = gui.add_slider("reserve", min=0.0, max=0.9, step=0.01, initial_value=RESERVE, visible=False)
            self._reserve = when_changed(reserve, editing(editor, set_reserve, "reserve"))
        with gui.add_folder("Polynomials"):
            self._add_polynomials()
        self._durations: tuple[float, ...] = ()

    def show(self, state: BenchState) -> None:
        """Show the times of the document."""
        request, planned = state.request, state.planned
        if planned is not None and planned.trajectory.legs == request.legs:
            breaks = planned.trajectory.leg_breaks.tolist()
            self._durations = tuple(b - a for a, b in zip(breaks[:-1], breaks[1:], strict=True))
        mode = _mode(request)
        follow(self._mode, mode)
        self._total.visible, self._rows.folder.visible = mode == MODES[1], mode == MODES[0]
        self._limits.visible = mode == MODES[2]
        if request.total_time is not None:
            follow(self._total, request.total_time)
        self._rows.show(request.durations or ())
        self._show_limits(request)
        self._show_polynomials(request)

    def _timed(self, request: PlanRequest, mode: str) -> PlanRequest:
        known = self._durations if len(self._durations) == request.legs else straight_durations(request)
        return with_time(request, mode, known, USUAL)

    def _row(self, leg: int) -> tuple[Any]:
        slider = self._gui.add_slider(f"Leg {leg} ", min=0.1, max=20.0, step=0.05, initial_value=1.0)
        change = editing(self._editor, lambda request, seconds: set_duration(request, leg, seconds), f"duration {leg}")
        return (when_changed(slider, change),)

    def _limit_row(self, name: str) -> tuple[Any, Any]:
        low, high, first = SLIDERS[name]
        kind = KIND[name]
        label = f"{kind.label} [{kind.typed_unit}]".replace("^2", "²").replace("^3", "³")

        def choose(wanted: bool) -> None:
            value = _inner(name, slider.value) if wanted else None
            self._editor.edit(lambda request: set_limit(request, name, value))

        box = when_changed(self._gui.add_checkbox(label, False), choose)
        slider = self._gui.add_slider(
            f"≤ {kind.label}", min=low, max=high, step=0.05, initial_value=first, visible=False
        )
        change = editing(
            self._editor, lambda request, value: set_limit(request, name, _inner(name, value)), f"limit {name}"
        )
        return box, when_changed(slider, change)

    def _show_limits(self, request: PlanRequest) -> None:
        values = dict(request.limits)
        for name, (box, slider) in self._sliders.items():
            follow(box, name in values)
            slider.visible = name in values
            if name in values:
                value = degrees(values[name]) if KIND[name].degrees else values[name]
                follow(slider, round(value, 9))
        follow(self._rotors, request.rotors is not None)
        self._reserve.visible = request.rotors is not None
        if request.rotors is not None:
            follow(self._reserve, request.rotors)

    def _add_polynomials(self) -> None:
        gui, editor = self._gui, self._editor
        self._degree = gui.add_dropdown("Degree", tuple(map(str, DEGREES)), initial_value="7")
        when_changed(self._degree, editing(editor, lambda r, text: replace(r, degree=int(text), continuity=None)))
        self._continuity = gui.add_dropdown("Continuous derivatives", (AUTOMATIC, *map(str, range(2, 11))))
        when_changed(self._continuity, editing(editor, lambda r, text: replace(r, continuity=_whole(text))))
        self._pieces = gui.add_dropdown("Pieces per leg", ("1", "2", "3", "4", "5", "6", "auto"))
        when_changed(
            self._pieces, editing(editor, lambda r, text: replace(r, pieces=text if text == "auto" else int(text)))
        )

    def _show_polynomials(self, request: PlanRequest) -> None:
        follow(self._degree, str(request.degree))
        follow(self._continuity, AUTOMATIC if request.continuity is None else str(request.continuity))
        follow(self._pieces, str(request.pieces))


def _with_total(request: PlanRequest, seconds: float) -> PlanRequest:
    return replace(request, total_time=float(seconds), durations=None)


def _with_rotors(request: PlanRequest, wanted: bool) -> PlanRequest:
    if wanted:
        return replace(request, rotors=RESERVE, vehicle=request.vehicle or "dji_f330")
    return replace(request, rotors=None, limits=request.limits or tuple(USUAL.items()))


def _mode(request: PlanRequest) -> str:
    if request.durations is not None:
        return MODES[0]
    return MODES[1] if request.total_time is not None else MODES[2]


def _inner(name: str, value: float) -> float:
    return radians(value) if KIND[name].degrees else float(value)


def _whole(text: str) -> int | None:
    return None if text == AUTOMATIC else int(text)


class VehiclePanel:
    """Vehicle, frame and simulation.

    Parameters
    ----------
    gui : viser.GuiApi
        Where it is added, in the present container.
    editor : Editor
        What inputs edit.
    path : PathView
        Where simulated flights are drawn.
    state : callable
        Returns what is shown.
    """

    def __init__(self, gui: Any, editor: Editor, path: PathView, state: Callable[[], BenchState]) -> None:
        self._path, self._state = path, state
        self._vehicle = gui.add_dropdown("Vehicle", VEHICLES, initial_value=DRAWN)
        when_changed(self._vehicle, editing(editor, lambda request, name: replace(request, vehicle=name)))
        self._size = gui.add_html("")
        self._frame = gui.add_dropdown("Frame of files", tuple(FRAMES))
        when_changed(self._frame, editing(editor, lambda request, name: replace(request, frame=name)))
        when_clicked(gui.add_button("Fly in simulation"), lambda client: editor.later(self._fly))
        self._flown = gui.add_html("")
        self._flight_of: Trajectory | None = None

    def show(self, state: BenchState, larger: float) -> None:
        """Show vehicle and frame of the document; ``larger`` is how many times its size the vehicle is drawn."""
        follow(self._vehicle, state.request.vehicle or DRAWN)
        follow(self._frame, state.request.frame)
        self._size.content = sentence(
            f"drawn {larger:.3g} times as large as it is" if larger > 1.0 else "drawn to scale"
        )
        if (
            self._flight_of is not None
            and state.planned is not None
            and state.planned.trajectory is not self._flight_of
        ):
            self._flight_of = None
            self._path.overlay(None)
            self._flown.content = ""

    def _fly(self) -> None:
        planned = self._state().planned
        if planned is None:
            raise FileError("there is no plan to fly yet")
        self._flown.content = sentence("flying ...")
        try:
            flight = simulate(
                named_vehicle(planned.request.vehicle or DRAWN), GeometricController(), planned.trajectory
            )
        except Exception:
            self._flown.content = ""
            raise
        self._flight_of = planned.trajectory
        self._path.overlay(flight.position)
        self._flown.content = table(flown(flight))


def flown(flight: Flight) -> list[tuple[str, str]]:
    """Return names and values of a simulated flight: errors of position, and whether rotors were at their limits."""
    error = np.linalg.norm(flight.error, axis=1)
    return [
        ("simulated flight", "geometric control, still air"),
        ("root mean square error", f"{np.sqrt((error**2).mean()):.3f} m"),
        ("greatest error", f"{error.max():.3f} m"),
        ("rotors at their limits", f"{100.0 * flight.saturated.mean():.1f} % of the time"),
    ]
