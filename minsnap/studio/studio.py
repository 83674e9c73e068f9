"""A studio: the page of a scene, its planning, and everything in between; show, which opens a plan in one line."""

from __future__ import annotations

import os
import sys
import webbrowser
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.basics.storage.text import FileName
from minsnap.certificate import certify
from minsnap.corridors import Avoided, as_obstacles, named_obstacles
from minsnap.errors import InputError
from minsnap.files import FileRequest
from minsnap.fleet import Fleet
from minsnap.paths.routes import Route
from minsnap.studio.browser_page import LOOPBACK, PORT, Page, Player, several
from minsnap.studio.documents import WorkingFolder, scene_of
from minsnap.studio.edit_panels import DRAWN, CorridorPanel, RoutePanel, TimePanel, VehiclePanel
from minsnap.studio.file_panel import FilePanel, StatusPanel, add_welcome
from minsnap.studio.fleet_studio import FleetStudio
from minsnap.studio.ground_view import BY_DAY, BY_NIGHT, GroundView, Obstacles, cloud, grid
from minsnap.studio.obstacle_view import CLEARANCE, ObstacleView, avoiding
from minsnap.studio.page_inputs import Change, Inputs
from minsnap.studio.path_view import GateView, PathView, VehicleView, WaypointView
from minsnap.studio.plan_drawing import Charts, pose_at, profiles_of
from minsnap.studio.route_studio import RouteStudio
from minsnap.studio.wall_view import WallView
from minsnap.studio.workbench import BenchState, PlannedScene, Workbench
from minsnap.trajectory import Trajectory
from minsnap.vehicle import named_vehicle


class Studio(Page):
    """A page that shows and edits a scene, for every browser that opens its address.

    Parameters
    ----------
    request : FileRequest
        The scene at first.
    folder : str or path
        Where its files are saved.
    host, port
        Address to listen on; port 0 is any that is free.
    planned : PlannedScene, optional
        A plan of the scene that is there already.
    obstacles : Obstacles, optional
        Of a file; its cells and points are kept out of.
    clearance : float
        Room around these [m].
    welcome : bool
        Begin with examples, and a button that opens a file.
    """

    def __init__(
        self,
        request: FileRequest,
        folder: str | WorkingFolder = ".",
        host: str = LOOPBACK,
        port: int = PORT,
        planned: PlannedScene | None = None,
        obstacles: Obstacles | None = None,
        clearance: float = CLEARANCE,
        welcome: bool = False,
    ) -> None:
        self._folder = folder if isinstance(folder, WorkingFolder) else WorkingFolder(folder)
        super().__init__(host, port)
        if obstacles is not None and planned is None:
            request = avoiding(obstacles, clearance)(request)
        self._shown: BenchState = BenchState(request, planned)
        self._profiled: tuple[Any, ...] = ()
        self._build(welcome)
        if obstacles is not None:
            self._ground.show_obstacles(obstacles)
        self._working = Workbench(request, self._show, planned)

    @property
    def request(self) -> FileRequest:
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
        """Change the scene; what is refused is shown on the page, whose inputs follow the document again."""

        def change_it() -> None:
            try:
                self._working.edit(change, subject, held)
            except Exception:
                with self._lock:
                    self._show(self._shown)
                raise

        self.attempt(change_it)

    def avoid(self, obstacles: Obstacles, clearance: float) -> None:
        """Keep out of what a file holds, and of some room around it [m], and show it."""
        self.edit(avoiding(obstacles, clearance))
        self._ground.show_obstacles(obstacles)

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

    def _build(self, welcome: bool) -> None:
        server, gui = self._server, self._server.gui
        self._ground, self._path = GroundView(server), PathView(server)
        self._walls, self._waypoints = WallView(server, self), WaypointView(server, self)
        self._vehicle, self._gates = VehicleView(server), GateView(server, self)
        self._avoided = ObstacleView(server)
        self._status, self._player = StatusPanel(gui, self), Player(gui, self._point_at)
        tabs = gui.add_tab_group()
        if welcome:
            with tabs.add_tab("Start"):
                add_welcome(gui, self, self._folder)
        with tabs.add_tab("Route"):
            self._route = RoutePanel(Inputs(gui, self), self._waypoints, self._gates)
        with tabs.add_tab("Corridor"):
            self._corridor = CorridorPanel(Inputs(gui, self), self._walls)
        with tabs.add_tab("Time"):
            self._time = TimePanel(Inputs(gui, self))
        with tabs.add_tab("Vehicle"):
            self._flying = VehiclePanel(Inputs(gui, self), self._overlay, lambda: self._shown)
        with tabs.add_tab("Files"):
            FilePanel(gui, self, self._folder, lambda: self._shown, self.avoid)
            self.add_recording(gui)
        panel = gui.add_panel()
        with panel.add_tab("Plots"):
            self._charts = Charts(gui)
        self._open(
            panel,
            ("Undo", "Z", "cmd/ctrl", self.undo),
            ("Redo", "Y", "cmd/ctrl", self.redo),
            ("Redo (Shift)", "Z", "cmd/ctrl+shift", self.redo),
            ("Delete the waypoint", "delete", None, partial(self._route.reorder, "Delete")),
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
                self._status.explain(*self._path.drawn)
            self._server.flush()
            with self._server.atomic():
                self._show_document(state)
                self._show_plan(state)

    def _show_document(self, state: BenchState) -> None:
        points = np.array(state.request.waypoints)
        self._ground.show(state.request.frame, points, BY_NIGHT if self._dark else BY_DAY)
        self._ground.hide_obstacles(not state.request.avoid)
        drawn = self._waypoints, self._walls, self._gates, self._avoided
        for shown in (*drawn, self._route, self._corridor, self._time):
            shown.show(state)
        larger = self._vehicle.show(self._flown_vehicle(state), float(np.ptp(points, axis=0).max()))
        self._flying.show(state, larger)

    def _show_plan(self, state: BenchState) -> None:
        if state.planned is None:
            return
        curve, request = state.planned.trajectory, state.request
        key = (curve, request.limits, request.vehicle)
        if self._profiled == key:
            return
        self._profiled = key
        self._player.show(curve.duration)
        vehicle = self._flown_vehicle(state)
        self._charts.show(profiles_of(curve, vehicle), dict(request.limits), vehicle, self._player.now)
        self._vehicle.place(pose_at(curve, vehicle, self._player.now))

    def darken(self) -> None:
        """Make the page dark, or light again."""
        super().darken()
        with self._lock:
            self._show(self._shown)

    def _overlay(self, positions: FloatArray | None) -> None:
        """Draw a simulated flight, positions of shape (m, 3) [m]; or remove it."""
        self._path.overlay(positions)
        self._status.explain(*self._path.drawn)

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


def show(
    traj: Trajectory | Fleet | Route,
    *,
    waypoints: ArrayLike | None = None,
    corridor: Any = None,
    limits: Any = None,
    yaw: float | str | ArrayLike | None = None,
    vehicle: str = "",
    avoid: Avoided | Sequence[Avoided] | None = None,
    points: ArrayLike | None = None,
    occupancy: ArrayLike | None = None,
    resolution: ArrayLike = 1.0,
    origin: ArrayLike | None = None,
    clearance: float = CLEARANCE,
    folder: FileName = ".",
    host: str = LOOPBACK,
    port: int = 0,
    browser: bool = True,
    block: bool | None = None,
) -> Studio | FleetStudio | RouteStudio:
    """Open a plan in the studio: a page in the browser where it can be seen, edited and saved.

    The plan is shown as it is; after an edit the scene is planned again with its waypoints, durations and walls.
    Needs ``minsnap[studio]``.

    Parameters
    ----------
    traj : Trajectory, Fleet or Route
        In space. A fleet is shown and played, and so is a route with its map and polytopes, also a plane one; they
        take ``host``, ``port``, ``browser`` and ``block`` alone.
    waypoints : array_like, shape (legs + 1, 3), optional
        By default its own [m].
    corridor : float, array_like of shape (legs,), Tube, Boxes, Room, or sequence of these, optional
        Half-widths, one box per leg, a room with six sides [m]; other walls cannot be edited and are refused.
    limits : Limits, optional
        What it is to keep; rotors are those of a vehicle that ``vehicle`` can name.
    yaw : float, array_like of shape (legs + 1,), "velocity" or "tilt", optional
        Heading after an edit, as :func:`minsnap.plan` takes it.
    vehicle : {"crazyflie", "dji_f330", "px4_sih"}, optional
        What flies.
    avoid : obstacle or sequence of obstacles, optional
        What it keeps out of, as :func:`minsnap.plan` takes it.
    points : array_like, shape (n, 3), optional
        Point cloud to keep out of too [m]: by at most 64 boxes that cover it.
    occupancy, resolution, origin
        Occupancy grid to keep out of, as :func:`minsnap.corridor_from_grid` takes it; by boxes as well.
    clearance : float
        Room around points and occupied cells [m].
    folder : str or path
        Where the page saves files.
    host : str
        Address to listen on; by default only this machine can connect.
    port : int
        0 for any that is free.
    browser : bool
        Open the page in the browser.
    block : bool, optional
        Return only when the studio is closed (Ctrl-C). True in a script, False in a notebook or at a prompt unless
        given.

    Returns
    -------
    Studio, FleetStudio or RouteStudio
        With ``url``, ``request`` and ``trajectory`` as they are edited, and ``close()``.

    Raises
    ------
    InputError
        If the plan, its walls or its limits cannot be shown.
    LinkError
        If it cannot listen on the address.
    ImportError
        If viser is not there.
    """
    if block is None:  # not at the prompt of Python, in IPython or in a notebook
        block = not (hasattr(sys, "ps1") or "IPython" in sys.modules)
    if isinstance(traj, Fleet | Route):
        page = FleetStudio(traj, host, port) if isinstance(traj, Fleet) else RouteStudio(traj, host, port)
        _present(page, browser, block)
        return page
    if not isinstance(traj, Trajectory):
        raise InputError(f"the studio shows a Trajectory, a Fleet or a Route, not {type(traj).__name__}")
    request = _scene(scene_of(traj, waypoints, corridor, limits), yaw, vehicle)
    request = replace(request, avoid=named_obstacles(as_obstacles(avoid)))
    seen = cloud(points) if points is not None else None
    seen = grid(occupancy, resolution, origin) if occupancy is not None else seen
    request = request if seen is None else avoiding(seen, clearance)(request)
    proof = certify(traj, request.places, request.walls, request.bounds, avoid=request.obstacles)
    planned = PlannedScene(request, traj, proof, True, 0.0)
    studio = Studio(request, os.fspath(folder), host, port, planned, seen)
    _present(studio, browser, block)
    return studio


def _scene(request: FileRequest, yaw: Any, vehicle: str) -> FileRequest:
    if vehicle and request.rotors is not None and vehicle != request.vehicle:
        raise InputError(f"the limits are those of {request.vehicle}, not of {vehicle}: give one vehicle")
    request = replace(request, vehicle=vehicle or request.vehicle)
    if yaw is None or isinstance(yaw, str):
        return replace(request, yaw=yaw)
    angles = np.asarray(yaw, dtype=np.float64)
    return replace(request, yaw=float(angles) if angles.ndim == 0 else tuple(angles.tolist()))


def _present(studio: Page, browser: bool, block: bool) -> None:
    try:
        print(f"studio: {studio.url}{'  (Ctrl-C ends it)' if block else ''}", flush=True)
        if browser:
            webbrowser.open(studio.url)
        if block:
            studio.wait_until_closed()
    except KeyboardInterrupt:
        studio.close()
