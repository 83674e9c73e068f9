"""Opening and saving: files, uploads and plans as requests that a page can edit, plans as files of every kind.

A studio writes to one folder, and names from the page never lead out of it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from minsnap.basics.arrays import GRAVITY
from minsnap.basics.storage.atomic import refuse_source
from minsnap.basics.storage.text import FileName
from minsnap.corridors import Boxes, Constraint, Room, Tube, as_constraints, named_obstacles
from minsnap.errors import CorridorError, FileError, LimitError, MinsnapError, WaypointError, YawError
from minsnap.files import RATE, RESERVE, FileRequest, Opening, besides_rotors, read_request, write_any, write_request
from minsnap.limits import Limits, VehicleLimits, check_one_speed, completed
from minsnap.paths.missions import Course, is_course, read_course
from minsnap.studio.edits import with_gate
from minsnap.studio.workbench import BenchState, PlannedScene
from minsnap.trajectory import Trajectory
from minsnap.vehicle import VEHICLES, preset_of

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}")
"""Names of files: letters, digits, blanks, dots, dashes; no separators, no leading dot."""

SAME = 1e-3
"""Share of the greatest of a plan below which a derivative at an end is the rounding of its file."""


class WorkingFolder:
    """A folder with files of plain names.

    Parameters
    ----------
    path : str or path
        An existing folder.
    *read : str, path or None
        Files that the studio was opened with: none is replaced by another kind of document. None is no file.

    Raises
    ------
    FileError
        If it is none.
    """

    def __init__(self, path: FileName = ".", *read: FileName | None) -> None:
        self.path = Path(os.path.realpath(path))
        if not self.path.is_dir():
            raise FileError(f"{path} is no folder: give one that exists")
        self._read = {Path(file): kind_of(file) for file in read if file is not None}

    def target(self, kind: str, name: str) -> Path:
        """Return where a document of one of :data:`EXPORTS` is to be saved.

        Raises
        ------
        FileError
            If the name is none of :meth:`destination`, or that of a file that was read and holds another kind.
        """
        place = self.destination(name, EXPORTS[kind][0])
        refuse_source(place, *(file for file, held in self._read.items() if held != kind))
        return place

    def destination(self, name: str, ending: str) -> Path:
        """Return where a file of this name is to be written.

        Parameters
        ----------
        name : str
            As typed; the ending is added if it is missing.
        ending : str
            Such as ``".csv"``.

        Raises
        ------
        FileError
            If the name could lead out of the folder: it has a separator, a leading dot or other characters than those
            of plain names, or is a link.
        """
        full = name if name.endswith(ending) else f"{name}{ending}"
        if not NAME.fullmatch(full):
            raise FileError(
                f"{name[:60]!r} is no name of a file in the working folder: use letters, digits, dots and dashes"
            )
        target = self.path / full
        if target.is_symlink() or (target.exists() and not target.is_file()):
            raise FileError(f"{full} in the working folder is a link or no file: choose another name")
        return target

    @contextmanager
    def scratch(self, ending: str, name: str = "") -> Iterator[Path]:
        """Yield the path of a file with that ending, in a folder of its own inside, which is removed afterwards.

        Errors say the name that the user knows instead.

        Raises
        ------
        FileError
            If nothing can be written here.
        """
        try:
            folder = TemporaryDirectory(prefix=".studio-", dir=self.path)
        except OSError as error:
            raise FileError(f"the working folder {self.path} cannot be written: {error.strerror}") from error
        with folder as place:
            path = Path(place) / (name if NAME.fullmatch(name) else f"file{ending}")
            try:
                yield path
            except MinsnapError as error:
                error.args = (f"{error}".replace(f"{path}", name or path.name), *error.args[1:])
                raise

    @contextmanager
    def uploaded(self, name: str, ending: str, content: bytes) -> Iterator[Path]:
        """Yield the path of an uploaded file while it is read; the same file in the folder is then one that was read.

        Raises
        ------
        FileError
            If nothing can be written here.
        """
        with self.scratch(ending, Path(name).name) as path:
            path.write_bytes(content)
            yield path
        own = self.path / path.name
        if own.is_file() and own.read_bytes() == content:
            self._read[own] = kind_of(own)


ENDINGS = (".yaml", ".yml", ".csv", ".plan", ".json")
"""Of the files that can be opened as a scene."""

MOST = 200
"""Waypoints of the largest scene that a page can show."""


EXPORTS = {
    "setpoints (CSV)": (".csv", "setpoints"),
    "request (YAML)": (".yaml", ""),
    "Crazyflie (CSV)": (".csv", "crazyflie"),
    "plan (JSON)": (".json", "polynomials"),
    "figure (PNG)": (".png", ""),
    "figure (SVG)": (".svg", ""),
}
"""Ending, and name of the format for :func:`minsnap.files.convert.write_any`, if any, by the words of the page."""


def kind_of(path: FileName) -> str:
    """Return which of :data:`EXPORTS` a file that can be opened is; empty where it is another one."""
    from minsnap.files.formats import is_polynomials

    if is_polynomials(path):
        return "plan (JSON)"
    is_yaml = Path(path).suffix.lower() in (".yaml", ".yml")
    return "request (YAML)" if is_yaml and not is_course(path) else ""


def example_scene() -> FileRequest:
    """Return the scene of a studio without a file: the rectangle of 8 by 4 m in 12 s, 0.3 m to each side."""
    corners = ((0.0, 0.0, 1.0), (8.0, 0.0, 1.0), (8.0, 4.0, 1.0), (0.0, 4.0, 1.0), (0.0, 0.0, 1.0))
    return FileRequest(corners, total_time=12.0, corridor=(0.3,) * 4, vehicle="dji_f330")


def _example_gates() -> FileRequest:
    """Return a lap through four gates, in the shortest time within limits."""
    points = ((0.0, 0.0, 1.5), (6.0, -1.5, 2.0), (10.0, 3.0, 1.2), (4.0, 6.0, 2.4), (0.0, 0.0, 1.5))
    scene = FileRequest(points, limits=tuple(completed({"speed": 6.0, "acceleration": 12.0}).items()), pieces="auto")
    for gate in (1, 2, 3):
        scene = with_gate(scene, gate, True, 0.2)
    return replace(scene, vehicle="dji_f330", yaw="velocity")


def _example_obstacles() -> FileRequest:
    """Return an inspection among pillars and a wall, in a room."""
    pillars = (("cylinder", (3.0, 0.2, 0.5)), ("cylinder", (6.5, 2.2, 0.6)), ("cuboid", (3.0, 3.6, 0.0, 5.0, 4.4, 2.6)))
    points = ((0.0, 0.0, 1.2), (8.0, 0.5, 1.6), (7.0, 5.0, 2.0), (0.5, 4.0, 1.2))
    room = ((-2.0, -2.0, 0.2), (10.0, 7.0, 4.0))
    return FileRequest(points, avoid=pillars, room=room, vehicle="dji_f330").within_ordinary()


def _example_rotors() -> FileRequest:
    """Return three legs as quickly as the rotors of a Crazyflie allow."""
    points = ((0.0, 0.0, 0.5), (2.0, 0.0, 1.2), (2.0, 2.0, 0.8), (0.0, 2.0, 1.5))
    return FileRequest(points, rotors=RESERVE, vehicle="crazyflie", pieces="auto")


EXAMPLES: dict[str, Callable[[], FileRequest]] = {
    "A rectangle in a corridor": example_scene,
    "Gates, as quickly as limits allow": _example_gates,
    "Around obstacles, in a room": _example_obstacles,
    "What the rotors of a Crazyflie can": _example_rotors,
}
"""Scenes that a page offers which was opened without a file."""


def open_scene(path: FileName) -> FileRequest:
    """Return the scene of a file: a request or waypoints in YAML, waypoints in CSV, or a QGroundControl plan.

    A plan that was written as JSON or YAML gives its waypoints, durations, walls, limits and heading. What has no
    times is planned within ordinary limits.

    Raises
    ------
    FileError
        If the file cannot be read, its ending is not known, or it has more waypoints than a page can show.
    WaypointError
        If its waypoints have two coordinates.
    InputError
        If it is a plan with walls, limits or a heading that a scene cannot hold.
    """
    from minsnap.files.formats import is_polynomials

    if Path(path).suffix.lower() not in ENDINGS:
        raise FileError(f"{Path(path).name} cannot be opened by its ending: it must be one of {', '.join(ENDINGS)}")
    if is_course(path):
        request = _of_course(read_course(path))
    else:
        request = _of_plan(path) if is_polynomials(path) else read_request(path)
        if request.limits:
            check_one_speed(request.bounds, "a scene")
    if len(request.waypoints) > MOST:
        raise FileError(f"{Path(path).name} has {len(request.waypoints)} waypoints: the studio shows up to {MOST}")
    if len(request.waypoints[0]) != 3:
        raise WaypointError(f"the waypoints of {Path(path).name} have no z: the studio shows three coordinates")
    return request.within_ordinary()


def open_upload(name: str, content: bytes, folder: WorkingFolder) -> FileRequest:
    """Return the scene of an uploaded file.

    Parameters
    ----------
    name : str
        As the browser says; only its ending is used.
    content : bytes
        Of the file.
    folder : WorkingFolder
        Where it lies while it is read.
    """
    ending = Path(name).suffix.lower()
    if ending not in ENDINGS:
        raise FileError(f"a file that ends in {ending[:20]!r} cannot be opened: it must end in {', '.join(ENDINGS)}")
    with folder.uploaded(name, ending, content) as path:
        return open_scene(path)


def save_as(kind: str, state: BenchState, path: Path) -> str:
    """Write a file of one of :data:`EXPORTS`; return a sentence on what it cannot hold, or nothing.

    Raises
    ------
    FileError
        If there is no plan of the document yet, or the file cannot be written.
    """
    request, scene = state.request, state.planned
    if kind.startswith("request"):
        write_request(request, path)
        return ""
    if scene is None or not state.is_plan_of_document:
        raise FileError("there is no final plan of this scene yet: wait for it, or mend what cannot be planned")
    if kind.startswith("figure"):
        _draw(scene, path)
        return ""
    facts: dict[str, Any] = {"waypoints": request.places, "corridor": request.walls, "gates": request.gates}
    facts |= {"avoid": request.obstacles, "tolerance": request.waypoint_tolerance}
    facts |= {"limits": request.bounds, "command": ("minsnap", "studio")}
    return write_any(scene.trajectory, path, EXPORTS[kind][1], RATE, request.frame, facts=facts)[1] or ""


def _draw(scene: PlannedScene, path: Path) -> None:
    from minsnap.plot.figures import plot_overview, save_figure

    request = scene.request
    points = request.places if request.openings else np.array(request.waypoints)
    how: dict[str, Any] = {"corridor": request.walls, "waypoints": points, "avoid": request.obstacles}
    save_figure(plot_overview(scene.trajectory, limits=request.bounds, **how), path)


def _of_course(course: Course) -> FileRequest:
    """Return the scene of a course: points and gates, tube, limits, lap and heading.

    Raises
    ------
    FileError
        If it has more.
    """
    extras = (course.laps > 1, course.boxes, course.start, course.end, course.tolerance, course.takeoff, course.land)
    if any(extras) or any(stop.ball or stop.hold or stop.straight for stop in course.stops):
        raise FileError(
            f"{course.name} has laps, boxes, states, tolerances, holds or take-off: the studio holds points, gates, a "
            "tube and limits of a course; minsnap plan flies all of it"
        )
    openings = tuple(Opening.of(i, stop.gate) for i, stop in enumerate(course.stops) if stop.gate is not None)
    points = tuple(tuple(stop.center.tolist()) for stop in course.stops)
    yaw = tuple(course.yaw) if isinstance(course.yaw, (list, tuple)) else course.yaw
    how = {"degree": course.degree, "pieces": course.pieces, "avoid": course.avoid}
    scene = FileRequest(points, openings=openings, yaw=yaw, **how, **bounds_of(course.bounds))
    if course.tube is not None:
        scene = replace(scene, corridor=(course.tube,) * scene.legs)
    return scene.as_lap() if course.closed else scene


def _of_plan(path: FileName) -> FileRequest:
    from minsnap.files.formats import read_polynomials

    stored = read_polynomials(path)
    scene = scene_of(stored.trajectory, stored.waypoints, stored.corridor, stored.limits)
    scene = replace(scene, yaw=_heading(stored.trajectory), closed=_is_lap(stored.trajectory))
    scene = replace(scene, avoid=named_obstacles(stored.avoid), waypoint_tolerance=_tolerance(stored.tolerance))
    if stored.waypoints is None or not stored.gates:
        return scene
    centers = {number: tuple(gate.center.tolist()) for number, gate in stored.gates.items()}
    points = tuple(centers.get(number, point) for number, point in enumerate(scene.waypoints))
    return replace(scene, waypoints=points, openings=tuple(Opening.of(*item) for item in stored.gates.items()))


def _tolerance(tolerance: Any) -> float | None:
    """Return the tolerance of a stored plan as a scene holds it, one number.

    Raises
    ------
    WaypointError
        If it is another.
    """
    if tolerance is None or isinstance(tolerance, (int, float)):
        return tolerance
    raise WaypointError("a scene has one tolerance for all waypoints: minsnap plot shows a plan with others")


def _is_lap(curve: Trajectory) -> bool:
    """Return whether a plan ends in the motion that it begins with; False from rest to rest.

    Raises
    ------
    WaypointError
        If it begins or ends in another motion.
    """
    start, end = curve.states(np.array([0.0, curve.duration]), curve.cost_order)
    extent = np.ptp(curve.control_points, axis=(0, 1)).max()
    rounding = SAME * np.array([[extent], *([curve.max_norm(order)[0]] for order in range(1, len(start)))])
    if (np.abs([start[1:], end[1:]]) <= rounding[1:]).all():
        return False
    if (np.abs(start - end) <= rounding).all():
        return True
    raise WaypointError(
        "the plan begins or ends in motion: the studio plans from rest to rest, or laps; minsnap plot shows this one"
    )


def _heading(curve: Trajectory) -> float | str | tuple[float, ...] | None:
    """Return the heading of a plan as ``plan`` takes it: one that follows from no rule by its angles at waypoints.

    Raises
    ------
    YawError
        If it looks at a point.
    """
    if curve.yaw.constant is not None:
        return curve.yaw.constant or None
    rule = curve.yaw.rule(curve)
    if rule is None:
        return tuple(curve.yaw(curve.leg_breaks).tolist())
    if rule["rule"] in ("velocity", "tilt"):
        return str(rule["rule"])
    raise YawError("a scene has no heading towards a point: its heading is an angle per waypoint, velocity or tilt")


def scene_of(curve: Any, waypoints: Any = None, corridor: Any = None, limits: Limits | None = None) -> FileRequest:
    """Return the scene of a plan.

    Parameters
    ----------
    curve : Trajectory
    waypoints : array_like, shape (legs + 1, 3), optional
        By default its own [m].
    corridor, limits
        What it is to keep, as ``plan`` takes them.

    Raises
    ------
    WaypointError
        If it is not in space, or its waypoints are not as many as its legs need.
    CorridorError
        If a wall is none that a scene has.
    LimitError
        If the limits are none that a scene has.
    """
    points = np.array(curve(curve.leg_breaks) if waypoints is None else waypoints, dtype=np.float64)
    if points.shape != (curve.legs + 1, 3):
        raise WaypointError(
            f"the waypoints have shape {points.shape}: a path of {curve.legs} legs in space has ({curve.legs + 1}, 3)"
        )
    rows, times = tuple(tuple(row) for row in points.tolist()), tuple(np.diff(curve.leg_breaks).tolist())
    bounds = _walls(as_constraints(corridor), curve.legs) | bounds_of(limits)
    return FileRequest(rows, times, degree=curve.degree, pieces=curve.pieces, **bounds)


def _walls(parts: list[Constraint], legs: int) -> dict[str, Any]:
    """Return walls as fields of a scene."""
    walls: dict[str, Any] = {}
    for part in parts:
        name, value = _wall(part, legs)
        if name in walls:
            raise CorridorError("a scene has one tube or box per leg and one room at most: give one of each kind")
        walls[name] = value
    return walls


def _wall(part: Constraint, legs: int) -> tuple[str, Any]:
    if isinstance(part, Tube) and part.half_width.shape in ((), (legs,)):
        return "corridor", tuple(np.broadcast_to(part.half_width, (legs,)).tolist())
    if isinstance(part, Boxes) and part.lower.shape == (legs, 3):
        corners = np.stack((part.lower, part.upper), axis=1).tolist()
        return "boxes", tuple((tuple(low), tuple(high)) for low, high in corners)
    if isinstance(part, Room) and np.isfinite([part.lower, part.upper]).all():
        return "room", (tuple(part.lower.tolist()), tuple(part.upper.tolist()))
    raise CorridorError(
        f"a scene of {legs} legs cannot hold this {type(part).__name__}: its walls are a half-width per leg, a box per "
        "leg and a room with six sides; leave it out, and certify the plan with it"
    )


def bounds_of(limits: Limits | None) -> dict[str, Any]:
    """Return limits as fields of a scene; those of the rotors of a preset are its name and the reserve."""
    if limits is None:
        return {}
    check_one_speed(limits, "a scene")
    if limits.norm != "euclidean" or limits.gravity != GRAVITY:
        raise LimitError("a scene holds limits of the Euclidean norm under standard gravity: leave these out")
    if not isinstance(limits, VehicleLimits):
        return {"limits": tuple(limits.given().items())}
    name = preset_of(limits.vehicle)
    if name is None:
        raise LimitError(f"a scene holds the rotors of {', '.join(VEHICLES)}: leave those of another vehicle out")
    return {"limits": tuple(besides_rotors(limits).items()), "rotors": limits.reserve, "vehicle": name}
