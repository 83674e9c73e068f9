"""The parts of the panel about how it is flown: time, limits and polynomials; the vehicle, and simulated flights."""

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
from minsnap.planning.request import RESERVE, PlanRequest
from minsnap.studio.edits import set_duration, set_limit, set_reserve, straight_durations, with_time
from minsnap.studio.page_inputs import Editor, InputRows, editing, follow, sentence, table, when_changed, when_clicked
from minsnap.studio.path_view import PathView
from minsnap.studio.workbench import BenchState
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle.named import VEHICLES, named_vehicle

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
