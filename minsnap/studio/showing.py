"""show: one line that opens a plan in the studio."""

from __future__ import annotations

import os
import sys
import webbrowser
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.certificate import certify
from minsnap.errors import InputError
from minsnap.fleet.common_clock import Fleet
from minsnap.planning.request import PlanRequest
from minsnap.studio.browser_page import Page
from minsnap.studio.documents import scene_of
from minsnap.studio.fleet_studio import FleetStudio
from minsnap.studio.ground_view import cloud, grid
from minsnap.studio.page_server import LOOPBACK
from minsnap.studio.plan_worker import PlannedScene
from minsnap.studio.studio import Studio
from minsnap.trajectory.trajectory import Trajectory


def show(
    traj: Trajectory | Fleet,
    *,
    waypoints: npt.ArrayLike | None = None,
    corridor: Any = None,
    limits: Any = None,
    yaw: float | str | npt.ArrayLike | None = None,
    vehicle: str = "",
    points: npt.ArrayLike | None = None,
    occupancy: npt.ArrayLike | None = None,
    resolution: npt.ArrayLike = 1.0,
    origin: npt.ArrayLike | None = None,
    folder: str | os.PathLike[str] = ".",
    host: str = LOOPBACK,
    port: int = 0,
    browser: bool = True,
    block: bool | None = None,
) -> Studio | FleetStudio:
    """Open a plan in the studio: a page in the browser where it can be seen, edited and saved.

    The plan is shown as it is; after an edit the scene is planned again with its waypoints, durations and walls.
    Needs ``minsnap[studio]``.

    Parameters
    ----------
    traj : Trajectory or Fleet
        In space. A fleet is shown and played; it takes ``host``, ``port``, ``browser`` and ``block`` alone.
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
    points : array_like, shape (n, 3), optional
        Point cloud to be shown [m].
    occupancy, resolution, origin
        Occupancy grid to be shown, as :func:`minsnap.corridor_from_grid` takes it.
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
    Studio or FleetStudio
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
    block = not _is_interactive() if block is None else block
    if isinstance(traj, Fleet):
        page = FleetStudio(traj, host, port)
        _present(page, browser, block)
        return page
    if not isinstance(traj, Trajectory):
        raise InputError(f"the studio shows a Trajectory or a Fleet, not {type(traj).__name__}")
    request = _scene(scene_of(traj, waypoints, corridor, limits), yaw, vehicle)
    certificate = certify(traj, waypoints=request.places, corridor=request.walls, limits=request.bounds)
    planned = PlannedScene(request, traj, certificate, True, 0.0)
    seen = cloud(points) if points is not None else None
    seen = grid(occupancy, resolution, origin) if occupancy is not None else seen
    studio = Studio(request, os.fspath(folder), host, port, planned, seen)
    _present(studio, browser, block)
    return studio


def _scene(request: PlanRequest, yaw: Any, vehicle: str) -> PlanRequest:
    if vehicle and request.rotors is not None and vehicle != request.vehicle:
        raise InputError(f"the limits are those of {request.vehicle}, not of {vehicle}: give one vehicle")
    request = replace(request, vehicle=vehicle or request.vehicle)
    if yaw is None or isinstance(yaw, str):
        return replace(request, yaw=yaw)
    angles = np.asarray(yaw, dtype=np.float64)
    return replace(request, yaw=float(angles) if angles.ndim == 0 else tuple(angles.tolist()))


def _present(studio: Page, browser: bool, block: bool) -> None:
    print(f"studio: {studio.url}", flush=True)
    if browser:
        webbrowser.open(studio.url)
    if not block:
        return
    try:
        studio.wait_until_closed()
    except KeyboardInterrupt:
        studio.close()


def _is_interactive() -> bool:
    """Whether somebody types Python: at its prompt, in IPython or in a notebook."""
    return hasattr(sys, "ps1") or "IPython" in sys.modules
