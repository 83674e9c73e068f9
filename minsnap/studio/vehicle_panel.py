"""The part of the panel about the vehicle: which one, the frame of files, and simulated flights."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.errors import FileError
from minsnap.files.frames import FRAMES
from minsnap.flight.simulation.controllers import GeometricController
from minsnap.flight.simulation.simulated_flight import Flight, simulate
from minsnap.studio.page_inputs import Editor, editing, follow, sentence, table, when_changed, when_clicked
from minsnap.studio.path_view import PathView
from minsnap.studio.workbench import BenchState
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle.named import VEHICLES, named_vehicle

DRAWN = "dji_f330"
"""The vehicle of a scene that names none."""


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
