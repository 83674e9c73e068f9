"""The page of a route: its map or obstacles, its polytopes, the flight through them, and what is proved of it."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.certificate import Certificate, certify
from minsnap.paths.routes import Route
from minsnap.studio.browser_page import LOOPBACK, PORT, Page, Player, several
from minsnap.studio.edit_panels import DRAWN
from minsnap.studio.file_panel import add_views, facts_of
from minsnap.studio.ground_view import BY_DAY, BY_NIGHT, GroundView
from minsnap.studio.map_view import MapView, in_space
from minsnap.studio.page_inputs import sentence, table
from minsnap.studio.path_view import PathView, VehicleView
from minsnap.studio.plan_drawing import Charts, legend, pose_at, profiles_of
from minsnap.vehicle import named_vehicle


class RouteStudio(Page):
    """A page that shows and plays a route.

    Parameters
    ----------
    route : Route
        As :func:`minsnap.routes.plan_through` returns it; a plane one is drawn half a metre above the ground.
    host, port
        Address to listen on; port 0 is any that is free.

    Raises
    ------
    LinkError
        If it cannot listen there.
    ImportError
        If viser is not there.
    """

    def __init__(self, route: Route, host: str = LOOPBACK, port: int = PORT) -> None:
        self.route, self._curve = route, in_space(route.trajectory)
        self.certificate = certify(route.trajectory, corridor=route.corridor, limits=route.limits)
        self._vehicle_flown = named_vehicle(DRAWN)
        self._places = several(self._curve)
        super().__init__(host, port)
        self._build()
        self._show(0.0)

    def darken(self) -> None:
        """Make the page dark, or light again."""
        super().darken()
        self._ground.show("enu", self._places, BY_NIGHT if self._dark else BY_DAY)

    def _seen(self) -> FloatArray:
        return self._places

    def _build(self) -> None:
        server, gui = self._server, self._server.gui
        self._ground, path = GroundView(server), PathView(server)
        self._ground.show("enu", self._places)
        surroundings = MapView(server, self.route)
        path.draw(self._curve)
        self._vehicle = VehicleView(server)
        larger = self._vehicle.show(self._vehicle_flown, float(np.ptp(self._places, axis=0).max()))
        gui.add_html(table(facts(self.route, self.certificate)) + verdict(self.route, self.certificate))
        self._message = gui.add_html("")
        add_views(gui, self)
        gui.add_html(legend(path.top_speed))
        self._player = Player(gui, self._show)
        self._player.show(self._curve.duration)
        self.add_recording(gui)
        flat = "the plan is plane: it is drawn half a metre above the ground" if self.route.dim == 2 else ""
        sized = f"the vehicle is drawn {larger:.3g} times as large as it is" if larger > 1.0 else ""
        for note in filter(None, (surroundings.note, flat, sized)):
            gui.add_html(sentence(note))
        panel = gui.add_panel()
        with panel.add_tab("Plots"):
            self._charts = Charts(gui)
        limits = {} if self.route.limits is None else self.route.limits.given()
        self._charts.show(profiles_of(self._curve, self._vehicle_flown), limits, self._vehicle_flown, 0.0)
        self._open(panel)

    def _show(self, now: float) -> None:
        """Show the vehicle and the cursor at an instant [s]."""
        with self._lock:
            if self._closed.is_set():
                return
            with self._server.atomic():
                self._vehicle.place(pose_at(self._curve, self._vehicle_flown, now))
                self._charts.point_at(now)


def facts(route: Route, holds: Certificate) -> list[tuple[str, str]]:
    """Return names and values of a route: time, cost, distance to what is occupied, use of limits."""
    nearest = f"{route.distance:.3f} m" if np.isfinite(route.distance) else "nothing is occupied"
    kept = [("obstacle distance", nearest), ("clearance asked", f"{route.clearance:g} m")]
    first, *rest = facts_of(route.trajectory, holds)
    return [first, *kept, *rest]


def verdict(route: Route, holds: Certificate) -> str:
    """Return as HTML whether the route keeps its polytopes, its clearance and its limits."""
    if holds.ok and route.distance >= route.clearance:
        return sentence("certified at every instant", "good")
    return sentence("the certificate does not hold: see its figures", "refusal")
