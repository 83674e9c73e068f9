"""A studio: the page of a scene, its planning, and everything in between."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.planning.request import PlanRequest
from minsnap.studio.browser_page import Page, Player, several
from minsnap.studio.charts import Charts, SpeedLegend
from minsnap.studio.file_panel import FilePanel
from minsnap.studio.ground_view import GroundView, Obstacles
from minsnap.studio.page_inputs import Change
from minsnap.studio.page_server import LOOPBACK, PORT
from minsnap.studio.path_view import PathView, VehicleView
from minsnap.studio.plan_drawing import pose_at, profiles_of
from minsnap.studio.plan_worker import PlannedScene
from minsnap.studio.route_panel import CorridorPanel, RoutePanel
from minsnap.studio.status_panel import StatusPanel
from minsnap.studio.time_panel import DRAWN, TimePanel, VehiclePanel
from minsnap.studio.wall_view import WallView
from minsnap.studio.waypoint_view import GateView, WaypointView
from minsnap.studio.workbench import BenchState, Workbench
from minsnap.studio.working_folder import WorkingFolder
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle.named import named_vehicle


class Studio(Page):
    """A page that shows and edits a scene, for every browser that opens its address.

    Parameters
    ----------
    request : PlanRequest
        The scene at first.
    folder : str or path
        Where its files are saved.
    host, port
        Address to listen on; port 0 is any that is free.
    planned : PlannedScene, optional
        A plan of the scene that is there already.
    obstacles : Obstacles, optional
        To be shown.

    Raises
    ------
    LinkError
        If it cannot listen there.
    ImportError
        If viser is not there.
    """

    def __init__(
        self,
        request: PlanRequest,
        folder: str | WorkingFolder = ".",
        host: str = LOOPBACK,
        port: int = PORT,
        planned: PlannedScene | None = None,
        obstacles: Obstacles | None = None,
    ) -> None:
        self._folder = folder if isinstance(folder, WorkingFolder) else WorkingFolder(folder)
        super().__init__(host, port)
        self._bench: Workbench | None = None
        self._shown: BenchState = BenchState(request, planned)
        self._profiled: tuple[Any, ...] = ()
        self._build()
        if obstacles is not None:
            self._ground.show_obstacles(obstacles)
        self._bench = Workbench(request, self._show, planned)

    @property
    def request(self) -> PlanRequest:
        """The scene as it is edited."""
        return self._shown.request

    @property
    def trajectory(self) -> Trajectory | None:
        """The last good plan."""
        return None if self._shown.planned is None else self._shown.planned.trajectory

    @property
    def folder(self) -> Path:
        """Where files are saved."""
        return self._folder.path

    def edit(self, change: Change, subject: str = "", held: bool = False) -> None:
        """Change the scene; what is refused is shown on the page."""
        self.attempt(lambda: self._working.edit(change, subject, held))

    def pause(self) -> None:
        """End a drag: what follows is undone on its own."""
        self._working.pause()

    def undo(self) -> None:
        """Take the last edit back."""
        self._working.undo()

    def redo(self) -> None:
        """Do the edit again that was taken back last."""
        self._working.redo()

    def wait(self, timeout: float = 30.0) -> bool:
        """Wait until the scene is planned or refused; return whether that is so within this time [s]."""
        return self._working.wait(timeout)

    def say(self, text: str) -> None:
        """Show a sentence about the last request; nothing where it is empty."""
        self._status.say(text)

    def _end(self) -> None:
        self._working.close()

    def _seen(self) -> FloatArray:
        points = np.array(self.request.waypoints)
        return points if self.trajectory is None else np.vstack([points, several(self.trajectory)])

    @property
    def _working(self) -> Workbench:
        assert self._bench is not None
        return self._bench

    def _build(self) -> None:
        server, gui = self._server, self._server.gui
        self._ground, self._path = GroundView(server), PathView(server)
        self._walls, self._waypoints = WallView(server, self), WaypointView(server, self)
        self._vehicle, self._gates = VehicleView(server), GateView(server, self)
        self._status, self._player = StatusPanel(gui, self), Player(gui, self._point_at)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Route"):
            self._route = RoutePanel(gui, self, self._waypoints, self._gates)
        with tabs.add_tab("Corridor"):
            self._corridor = CorridorPanel(gui, self, self._walls)
        with tabs.add_tab("Time"):
            self._time = TimePanel(gui, self)
        with tabs.add_tab("Vehicle"):
            self._flying = VehiclePanel(gui, self, self._path, lambda: self._shown)
        with tabs.add_tab("Files"):
            FilePanel(gui, self, self._folder, lambda: self._shown, self._ground.show_obstacles)
            self.add_recording(gui)
        panel = gui.add_panel()
        with panel.add_tab("Plots"):
            self._legend, self._charts = SpeedLegend(gui), Charts(gui)
        self._open(
            panel,
            ("Undo", "Z", "cmd/ctrl", self.undo),
            ("Redo", "Y", "cmd/ctrl", self.redo),
            ("Redo (Shift)", "Z", "cmd/ctrl+shift", self.redo),
            ("Delete the waypoint", "delete", None, self._route.delete),
        )

    def _show(self, state: BenchState) -> None:
        """Show a state on every page; called with one state at a time."""
        with self._lock:
            if self._closed.is_set():
                return
            self._shown = state
            with self._server.atomic():
                self._path.show(state)
                self._status.show(state)
            self._server.flush()
            with self._server.atomic():
                self._show_document(state)
                self._show_plan(state)

    def _show_document(self, state: BenchState) -> None:
        points = np.array(state.request.waypoints)
        self._ground.show(state.request.frame, points)
        self._waypoints.show(state)
        self._walls.show(state)
        self._gates.show(state)
        self._route.show(state)
        self._corridor.show(state)
        self._time.show(state)
        larger = self._vehicle.show(self._flown_vehicle(state), float(np.ptp(points, axis=0).max()))
        self._flying.show(state, larger)

    def _show_plan(self, state: BenchState) -> None:
        if state.planned is None:
            return
        curve, request = state.planned.trajectory, state.request
        key = (curve, request.limits, request.vehicle)
        if len(self._profiled) == len(key) and all(a is b or a == b for a, b in zip(self._profiled, key, strict=True)):
            return
        self._profiled = key
        self._player.show(curve.duration)
        self._legend.show(self._path.top_speed)
        vehicle = self._flown_vehicle(state)
        self._charts.show(profiles_of(curve, vehicle), request, vehicle, self._player.now)
        self._vehicle.place(pose_at(curve, vehicle, self._player.now))

    def _point_at(self, now: float) -> None:
        """Show the vehicle and the cursor at an instant [s]."""
        with self._lock:
            state = self._shown
            if state.planned is None or self._closed.is_set():
                return
            with self._server.atomic():
                self._vehicle.place(pose_at(state.planned.trajectory, self._flown_vehicle(state), now))
                self._charts.point_at(now)

    @staticmethod
    def _flown_vehicle(state: BenchState) -> Any:
        return named_vehicle(state.request.vehicle or DRAWN)
