"""The parts of the panel that edit: waypoints, gates, heading; corridor and room; time and polynomials; the vehicle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import degrees, radians
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import DEGREES
from minsnap.basics.limit_kinds import KIND
from minsnap.errors import FileError
from minsnap.files import FRAMES, RESERVE, FileRequest, Opening
from minsnap.flight.simulation.controllers import GeometricController
from minsnap.flight.simulation.simulated_flight import Flight, simulate
from minsnap.limits import completed
from minsnap.studio import edits
from minsnap.studio.page_inputs import InputRows, Inputs, follow, sentence, table, when_changed, when_clicked
from minsnap.studio.path_view import GateView, WaypointView
from minsnap.studio.wall_view import NO_FACES, WallView
from minsnap.studio.workbench import BenchState, Present
from minsnap.trajectory import Trajectory
from minsnap.vehicle import VEHICLES, named_vehicle

HEADINGS = ("fixed", "per waypoint", "velocity", "tilt", "free")
"""Ways to give the heading."""

ORDER: dict[str, tuple[Callable[[FileRequest, int], FileRequest], int]] = {
    "Add": (edits.insert_waypoint, 1),
    "Delete": (edits.delete_waypoint, 0),
    "↑": (partial(edits.move_in_order, step=-1), -1),
    "↓": (partial(edits.move_in_order, step=1), 1),
}
"""What can be done with the chosen waypoint, and how far after it the one is that is chosen then."""


NARROWEST, WIDEST = 0.01, 3.0
"""Ends of the sliders of half-widths [m]."""


class RoutePanel:
    """Rows of waypoints, buttons that change their number and order, gates, heading.

    Parameters
    ----------
    inputs : Inputs
        Its own.
    view : WaypointView
        Where the chosen waypoint is marked, and can be clicked.
    gates : GateView
        Where the gate at the chosen waypoint has a handle.
    """

    def __init__(self, inputs: Inputs, view: WaypointView, gates: GateView) -> None:
        self._inputs, self._view, self._gates = inputs, view, gates
        gui, bind = inputs.gui, inputs.bind
        view.when_clicked(self.choose)
        self._rows = InputRows(gui.add_folder("Waypoints [m]"), self._row)
        self._chosen = when_changed(gui.add_number("Waypoint", 0, min=0, step=1), self.choose)
        acts = "Add one after the chosen waypoint, delete it, or fly through it earlier or later"
        when_changed(gui.add_button_group("Chosen one", tuple(ORDER), hint=acts), self.reorder)
        self._gate, gated = gui.add_checkbox("Gate", False), lambda request: self._opening(request) is not None
        bind(self._gate, gated, self._at(gate_with_room))
        self._size = gui.add_vector2("Width, height [m]", (1.0, 1.0), min=(0.05, 0.05), step=0.05, visible=False)
        bind(self._size, self._size_of_gate, self._at(edits.resize_gate), "gate")
        room = "How far from its edges the gate is passed: the reach of the vehicle, and what its control needs"
        self._margin = gui.add_number("Margin [m]", 0.0, min=0.0, step=0.05, hint=room, visible=False)
        bind(self._margin, lambda r: (self._opening(r) or (None,))[-1], self._at(edits.set_margin), "margin")
        bind(gui.add_checkbox("Closed lap", False), lambda request: request.closed, _closed)
        bind(gui.add_dropdown("Heading", HEADINGS), _heading, _headed)
        turned = lambda request, angle: replace(request, yaw=radians(angle))  # noqa: E731
        bind(gui.add_number("Angle [degrees]", 0.0, step=1.0), _fixed_angle, turned, "heading")
        self._turns = InputRows(gui.add_folder("Headings [degrees]", visible=False), self._turn)

    def show(self, state: BenchState) -> None:
        """Show the waypoints and the heading of the document."""
        self._inputs.request = request = state.request
        self._rows.show(request.waypoints)
        self._turns.show([round(degrees(angle), 9) for angle in request.turns])
        self.choose(self._index)

    @property
    def _index(self) -> int:
        return int(self._chosen.value)

    def _row(self, index: int) -> tuple[Any]:
        point = self._inputs.gui.add_vector3(f"{index}", (0.0, 0.0, 0.0), step=0.05)
        move = lambda request, place: edits.move_waypoint(request, index, place)  # noqa: E731
        return (self._inputs.edits(point, move, f"waypoint {index}"),)

    def reorder(self, what: str) -> None:
        """Do one of :data:`ORDER` with the chosen waypoint."""
        index, (change, step) = self._index, ORDER[what]
        self._inputs.editor.edit(lambda request: change(request, min(max(index, 0), request.legs)))
        self.choose(index + step)

    def choose(self, index: int) -> None:
        """Choose the waypoint that buttons and keys act on."""
        follow(self._chosen, min(max(index, 0), len(self._rows.handles) - 1))
        self._view.choose(self._index)
        self._gates.choose(self._index)
        self._inputs.show()

    def _at(self, change: Callable[[FileRequest, int, Any], FileRequest]) -> Callable[[FileRequest, Any], FileRequest]:
        """Return an edit of the chosen waypoint as one of the request."""
        return lambda request, value: change(request, self._index, value)

    def _opening(self, request: FileRequest) -> Opening | None:
        """Return the gate at the chosen waypoint."""
        return next((gate for gate in request.openings if gate.waypoint == self._index), None)

    def _size_of_gate(self, request: FileRequest) -> tuple[float, ...] | None:
        gate = self._opening(request)
        return None if gate is None else tuple(edits.size_of(np.array(gate.corners)).round(6).tolist())

    def _turn(self, index: int) -> tuple[Any]:
        def change(request: FileRequest, angle: float) -> FileRequest:
            return replace(request, yaw=(*request.turns[:index], radians(angle), *request.turns[index + 1 :]))

        return (self._inputs.edits(self._inputs.gui.add_number(f"{index}", 0.0, step=1.0), change, f"heading {index}"),)


def gate_with_room(request: FileRequest, index: int, wanted: bool) -> FileRequest:
    """Return the request with a gate at a waypoint that the vehicle's reach fits through, or without it."""
    craft = named_vehicle(request.vehicle or DRAWN)
    return edits.with_gate(request, index, wanted, float(np.ceil(20.0 * craft.arm_length) / 20.0))


def _closed(request: FileRequest, wanted: bool) -> FileRequest:
    return request.as_lap() if wanted else replace(request, closed=False)


def _headed(request: FileRequest, kind: str) -> FileRequest:
    fixed = request.yaw if isinstance(request.yaw, float) else 0.0
    chosen: dict[str, Any] = {"fixed": fixed, "per waypoint": (fixed,) * len(request.waypoints)}
    return replace(request, yaw=chosen.get(kind, kind))


def _heading(request: FileRequest) -> str:
    if request.turns:
        return HEADINGS[1]
    return request.yaw if isinstance(request.yaw, str) else HEADINGS[0]


def _fixed_angle(request: FileRequest) -> float | None:
    if _heading(request) != HEADINGS[0]:
        return None
    return round(degrees(request.yaw), 9) if isinstance(request.yaw, float) else 0.0


class CorridorPanel:
    """Half-widths of the legs, boxes and room.

    Parameters
    ----------
    inputs : Inputs
        Its own.
    view : WallView
        Where faces can be dragged.
    """

    def __init__(self, inputs: Inputs, view: WallView) -> None:
        self._inputs, self._view, gui = inputs, view, inputs.gui
        self._checkbox("Corridor: a tube around each leg", "corridor", edits.with_tube)
        self._rows = InputRows(gui.add_folder("Half-width per leg [m]"), self._row)
        self._checkbox("Corridor: a box around each leg", "boxes", edits.with_boxes)
        self._checkbox("Room around all legs", "room", edits.with_room)
        shown = "Shows handles in the scene, one on each face of the room or of a box"
        self._faces = when_changed(gui.add_dropdown("Drag faces of", (NO_FACES,), hint=shown), self._choose)
        for side, label in enumerate(("Lower corner", "Upper corner")):
            corner = gui.add_vector3(label, (float(side),) * 3, step=0.05, visible=False)
            self._inputs.bind(corner, partial(self._corner, side), partial(self._with_corner, side), f"corner {side}")

    def show(self, state: BenchState) -> None:
        """Show the walls of the document, and beside its leg why one is too narrow."""
        request = state.request
        self._rows.show(request.corridor or ())
        for leg, (_, note) in enumerate(self._rows.handles):
            note.visible = bool(state.refusal) and state.leg == leg
            if note.visible:
                note.content = sentence(state.refusal, "refusal")
        options = (NO_FACES, *edits.named_boxes(request))
        if tuple(self._faces.options) != options:
            kept = self._faces.value if self._faces.value in options else NO_FACES
            self._faces.options = options
            follow(self._faces, kept)
            self._view.choose(kept)
        self._inputs.show(request)

    def _checkbox(self, label: str, walls: str, change: Callable[[FileRequest, bool], FileRequest]) -> None:
        box = self._inputs.gui.add_checkbox(label, False)
        self._inputs.bind(box, lambda request: getattr(request, walls) is not None, change)

    def _row(self, leg: int) -> tuple[Any, Any]:
        gui, how = self._inputs.gui, {"min": NARROWEST, "max": WIDEST, "step": 0.01, "initial_value": edits.WIDTH}
        widen = lambda request, width: edits.set_width(request, leg, width)  # noqa: E731
        slider = self._inputs.edits(gui.add_slider(f"Leg {leg}", **how), widen, f"width {leg}")
        return slider, gui.add_html("", visible=False)

    def _choose(self, which: str) -> None:
        self._view.choose(which)
        self._inputs.show()

    def _corner(self, side: int, request: FileRequest) -> Any:
        return edits.named_boxes(request).get(self._faces.value, (None, None))[side]

    def _with_corner(self, side: int, request: FileRequest, value: Any) -> FileRequest:
        changed = lambda box: (value, box[1]) if side == 0 else (box[0], value)  # noqa: E731
        return edits.change_box(request, self._faces.value, changed)


MODES = ("durations", "total time", "limits")
"""Ways to give the time."""

SLIDERS = {
    "speed": (0.1, 15.0, 3.0),
    "acceleration": (0.1, 30.0, 6.0),
    "jerk": (0.5, 200.0, 30.0),
    "horizontal_speed": (0.1, 15.0, 3.0),
    "vertical_speed": (0.1, 10.0, 2.0),
    "max_thrust": (1.05, 5.0, 2.0),
    "tilt": (1.0, 85.0, 35.0),
    "body_rate": (0.2, 20.0, 6.0),
    "yaw_rate": (0.1, 10.0, 2.0),
}
"""Limits of the panel: ends of the slider and the value at first, angles in degrees."""

USUAL = completed({})
"""Limits of a scene that had none."""

AUTOMATIC = "automatic"


DRAWN = "dji_f330"
"""The vehicle of a scene that names none."""


class TimePanel:
    """How the time is set, and the polynomials.

    Parameters
    ----------
    inputs : Inputs
        Its own.
    """

    def __init__(self, inputs: Inputs) -> None:
        self._inputs, gui, bind = inputs, inputs.gui, inputs.bind
        given = "Durations of legs; a total, split for the least cost; or limits: the shortest time that keeps them"
        bind(gui.add_dropdown("Time set by", MODES, hint=given), _mode, self._timed)
        total = gui.add_slider("Total [s]", min=0.5, max=60.0, step=0.1, initial_value=12.0)
        timed = lambda request, seconds: replace(request, total_time=float(seconds), durations=None)  # noqa: E731
        bind(total, lambda request: request.total_time, timed, "total time")
        self._rows = InputRows(gui.add_folder("Duration per leg [s]"), self._row)
        self._limits = gui.add_folder("Limits")
        with self._limits:
            for name in SLIDERS:
                self._add_limit(name)
            rotors = gui.add_checkbox("rotors of the vehicle", False)
            bind(rotors, lambda request: request.rotors is not None, _with_rotors)
            reserve = gui.add_slider("reserve", min=0.0, max=0.9, step=0.01, initial_value=RESERVE, visible=False)
            self._reserve = bind(reserve, lambda request: request.rotors, edits.set_reserve, "reserve")
        with gui.add_folder("Polynomials"):
            self._add_polynomials()
        self._durations: tuple[float, ...] = ()

    def show(self, state: BenchState) -> None:
        """Show the times of the document."""
        request, planned = state.request, state.planned
        if planned is not None and planned.trajectory.legs == request.legs:
            self._durations = tuple(np.diff(planned.trajectory.leg_breaks).tolist())
        self._limits.visible = _mode(request) == MODES[2]
        self._rows.show(request.durations or ())
        self._inputs.show(request)

    def _timed(self, request: FileRequest, mode: str) -> FileRequest:
        known = self._durations if len(self._durations) == request.legs else edits.straight_durations(request)
        return edits.with_time(request, mode, known, USUAL)

    def _row(self, leg: int) -> tuple[Any]:
        slider = self._inputs.gui.add_slider(f"Leg {leg} ", min=0.1, max=20.0, step=0.05, initial_value=1.0)
        change = lambda request, seconds: edits.set_duration(request, leg, seconds)  # noqa: E731
        return (self._inputs.edits(slider, change, f"duration {leg}"),)

    def _add_limit(self, name: str) -> None:
        """Add the box that sets a limit, and the slider of its value; angles are in degrees there."""
        (low, high, first), kind, gui = SLIDERS[name], KIND[name], self._inputs.gui
        label = f"{kind.label} [{kind.typed_unit}]".replace("^2", "²").replace("^3", "³")
        how: dict[str, Any] = {"min": low, "max": high, "step": 0.05, "initial_value": first, "visible": False}
        box, slider = gui.add_checkbox(label, False), gui.add_slider(f"≤ {kind.label}", **how)

        def shown(request: FileRequest) -> float | None:
            value = dict(request.limits).get(name)
            return None if value is None else round(degrees(value) if kind.degrees else value, 9)

        def change(request: FileRequest, value: float) -> FileRequest:
            return edits.set_limit(request, name, radians(value) if kind.degrees else value)

        def switch(request: FileRequest, wanted: bool) -> FileRequest:
            return change(request, slider.value) if wanted else edits.set_limit(request, name, None)

        self._inputs.bind(box, lambda request: shown(request) is not None, switch)
        self._inputs.bind(slider, shown, change, f"limit {name}")

    def _add_polynomials(self) -> None:
        gui, bind = self._inputs.gui, self._inputs.bind
        degree = gui.add_dropdown("Degree", tuple(map(str, DEGREES)), initial_value="7")
        bind(degree, lambda r: str(r.degree), lambda r, text: replace(r, degree=int(text), continuity=None))
        continuity = gui.add_dropdown("Continuous derivatives", (AUTOMATIC, *map(str, range(2, 11))))
        bind(continuity, lambda r: str(r.continuity or AUTOMATIC), lambda r, text: replace(r, continuity=_whole(text)))
        pieces = gui.add_dropdown("Pieces per leg", ("1", "2", "3", "4", "5", "6", "auto"))
        bind(
            pieces,
            lambda r: str(r.request().polynomials),
            lambda r, text: replace(r, pieces=text if text == "auto" else int(text)),
        )


def _with_rotors(request: FileRequest, wanted: bool) -> FileRequest:
    if wanted:
        return replace(request, rotors=RESERVE, vehicle=request.vehicle or DRAWN)
    return replace(request, rotors=None, limits=request.limits or tuple(USUAL.items()))


def _mode(request: FileRequest) -> str:
    if request.durations is not None:
        return MODES[0]
    return MODES[1] if request.total_time is not None else MODES[2]


def _whole(text: str) -> int | None:
    return None if text == AUTOMATIC else int(text)


class VehiclePanel:
    """Vehicle, frame and simulation.

    Parameters
    ----------
    inputs : Inputs
        Its own.
    overlay : callable
        Draws the positions of a simulated flight, or removes it.
    state : callable
        Returns what is shown.
    """

    def __init__(self, inputs: Inputs, overlay: Callable[[FloatArray | None], None], state: Present) -> None:
        self._inputs, self._overlay, self._state, gui = inputs, overlay, state, inputs.gui
        vehicle = gui.add_dropdown("Vehicle", VEHICLES, initial_value=DRAWN)
        self._inputs.bind(vehicle, lambda r: r.vehicle or DRAWN, lambda r, name: replace(r, vehicle=name))
        self._size = gui.add_html("")
        frame = gui.add_dropdown("Frame of files", tuple(FRAMES))
        self._inputs.bind(frame, lambda r: r.frame, lambda r, name: replace(r, frame=name))
        when_clicked(gui.add_button("Fly in simulation"), lambda client: inputs.editor.later(self._fly))
        self._flown = gui.add_html("")
        self._flight_of: Trajectory | None = None

    def show(self, state: BenchState, larger: float) -> None:
        """Show vehicle and frame of the document; ``larger`` is how many times its size the vehicle is drawn."""
        self._inputs.show(state.request)
        drawn = f"drawn {larger:.3g} times as large as it is" if larger > 1.0 else "drawn to scale"
        self._size.content = sentence(drawn)
        planned = None if state.planned is None else state.planned.trajectory
        if self._flight_of is not None and planned not in (None, self._flight_of):
            self._flight_of = None
            self._overlay(None)
            self._flown.content = ""

    def _fly(self) -> None:
        planned = self._state().planned
        if planned is None:
            raise FileError("there is no plan to fly yet")
        self._flown.content = sentence("flying ...")
        try:
            craft = named_vehicle(planned.request.vehicle or DRAWN)
            flight = simulate(craft, GeometricController(), planned.trajectory)
        except Exception:
            self._flown.content = ""
            raise
        self._flight_of = planned.trajectory
        self._overlay(flight.position)
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
