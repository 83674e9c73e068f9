"""Skybrush shows, ``.skyc``: a zip of JSON files with the cubics, the heading and the lights of every vehicle.

The points are those of ``cubic_segments`` in metres, so that the binary files that Skybrush's server makes of a show
hold the same curves. It cuts coordinates off at whole units and durations at whole milliseconds, in floating numbers:
coordinates are written a trace farther from zero than they are, each knot a nanosecond later than the one before, and
durations are those of which no way of cutting takes a millisecond.
"""

from __future__ import annotations

import base64
import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import atomic_write, make_folder
from minsnap.basics.storage.text import FileName, reading
from minsnap.errors import FileError
from minsnap.files.formats import CubicSegments, YawSetpoints, as_cubic_segments, skybrush
from minsnap.fleet import Fleet
from minsnap.limits import Limits
from minsnap.polynomials import elevate
from minsnap.shows.returns import Returns
from minsnap.shows.site import ShowOrigin
from minsnap.trajectory import Trajectory

Lamp = skybrush.Lights | None

MOST_DRONES = 5000
"""Vehicles of a show."""

LATER = 1e-9
"""How much later than it is each knot is written than the one before it [s]."""

FARTHER = 1e-9
"""How much farther from zero than it is each coordinate is written [m]."""

LEVEL = 1e-3
"""How far a flight that is level may change its height [m]."""

MOST_BETWEEN = 6
"""Inner control points of a segment: a curve of degree 7."""

LARGEST = 1 << 28
"""Bytes that a file of a show unpacks to at most."""

STAMP = (1980, 1, 1, 0, 0, 0)
"""Date of the files in the archive: the same show gives the same bytes."""


@dataclass(frozen=True)
class SkybrushShow:
    """What a show holds.

    Parameters
    ----------
    fleet : Fleet
        On the show's clock.
    programmes : tuple of bytes
        Of the lights of each vehicle.
    origin : ShowOrigin or None
        Where on the earth it is flown.
    """

    fleet: Fleet
    programmes: tuple[bytes, ...]
    origin: ShowOrigin | None = None

    @property
    def lights(self) -> tuple[Lamp, ...]:
        """Lights of each vehicle; raises FileError if a programme has a command that is not read."""
        return tuple(map(skybrush.lights_of, self.programmes))


@dataclass(frozen=True)
class ShowSheet:
    """What a Skybrush show says of itself besides its curves and lights.

    Parameters
    ----------
    title : str
    environment : {"outdoor", "indoor"}
        Skybrush's viewer checks shows by thresholds of its own for each.
    limits : Limits, optional
        What its programs are to check a show by.
    highest : float, optional
        Highest altitude, checked too [m].
    cues : sequence of (float, str)
        When what happens [s].
    segments : mapping of str to (float, float)
        From when to when the show takes off, plays and lands (``takeoff``, ``show``, ``landing``) [s]; by default all
        of it is the show.
    origin : ShowOrigin, optional
        Where on the earth it is flown.
    """

    title: str = "minsnap"
    environment: str = "outdoor"
    limits: Limits | None = None
    highest: float | None = None
    cues: Sequence[tuple[float, str]] = ((0.0, "start"),)
    segments: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    origin: ShowOrigin | None = None

    def checks(self, fleet: Fleet) -> dict[str, float]:
        """Return by which numbers a show is checked, in Skybrush's names."""
        given = {} if self.limits is None else self.limits.given()
        axes = 1.0 if self.limits is None or self.limits.norm == "euclidean" else np.sqrt(2.0)

        def least(*names: str, factor: float = 1.0) -> float | None:
            known = [given[name] * (factor if name == names[0] else 1.0) for name in names if name in given]
            return min(known, default=None)

        values = {
            "maxAltitude": self.highest,
            "maxVelocityXY": least("speed", "horizontal_speed", factor=axes),
            "maxVelocityZ": least("speed", "vertical_speed", "descent_speed"),
            "maxVelocityZUp": least("speed", "vertical_speed", "climb_speed"),
            "maxAccelerationXY": least("acceleration", "horizontal_acceleration", factor=axes),
            "maxAccelerationZ": least("acceleration", "vertical_acceleration"),
            "maxYawRate": None if "yaw_rate" not in given else float(np.degrees(given["yaw_rate"])),
            "minDistance": None if fleet.separation is None else fleet.separation.distance,
        }
        return {name: float(value) for name, value in values.items() if value is not None and np.isfinite(value)}


def write_skyc(
    fleet: Fleet,
    path: FileName,
    lights: Sequence[Lamp] | None = None,
    *,
    sheet: ShowSheet | None = None,
    returns: Returns | None = None,
    clobber: bool = True,
) -> float:
    """Write a show in one atomic step, and return the proved distance of its curves to the fleet's [m].

    ``returns`` are those in which all keep their heights.

    Raises
    ------
    FileError
        If there are more than 5,000 vehicles, returns are not level, or a vehicle leads too far away or has a longer
        curve than Skybrush's binary files hold; says which.
    """
    if len(fleet) > MOST_DRONES:
        raise FileError(f"{len(fleet)} vehicles: a show holds {MOST_DRONES}")
    lamps, sheet = lamps_of(fleet, lights), sheet or ShowSheet()
    curves = [_segments(fleet, i) for i in range(len(fleet))]
    files = {f"drones/drone_{i + 1}/trajectory.json": _trajectory_json(curve) for i, curve in enumerate(curves)}
    drones = [_drone(fleet, i, lamp) for i, lamp in enumerate(lamps)]
    for i, drone in enumerate(drones if returns is not None else []):
        drone["settings"]["rthPlan"] = _level_plan(returns, i)
    files["show.json"] = _show_json(fleet, drones, sheet)
    files["cues.json"] = {"version": 1, "items": [{"time": time, "name": name} for time, name in sheet.cues]}
    make_folder(Path(path).parent)
    with atomic_write(path, "wb", clobber=clobber) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files, reverse=True):
            archive.writestr(zipfile.ZipInfo(name, STAMP), json.dumps(files[name]), zipfile.ZIP_DEFLATED)
    return max(map(_distance, curves))


def _level_plan(returns: Returns | None, vehicle: int) -> dict[str, Any]:
    """Return the plan of a vehicle; a FileError says that it changes its height."""
    assert returns is not None
    for plan in returns.plans:
        if plan.homes is not None and abs(plan.goals[vehicle, 2] - plan.starts[vehicle, 2]) > LEVEL:
            text = f"the return from {plan.second} s changes heights, and a .skyc holds level flights"
            raise FileError(f"{text}: plan returns with level=True, or write skyb")
    return returns.level_plan(vehicle)


def _segments(fleet: Fleet, vehicle: int) -> CubicSegments:
    """Return the cubics of a vehicle; a FileError says of which it is."""
    try:
        segments = as_cubic_segments(fleet[vehicle])
        skybrush.check_size(segments)
    except FileError as error:
        error.args = (f"{fleet.name(vehicle)}: {error}",)
        raise
    return segments


def _distance(curve: CubicSegments) -> float:
    """Return the proved distance of a curve with its points and knots as they are written [m]."""
    late = LATER * len(curve.breaks) * curve.trajectory().max_norm(1)[0]
    return float(curve.distance + late + np.sqrt(3.0) * FARTHER * curve.points.any())


def lamps_of(fleet: Fleet, lights: Sequence[Lamp] | None) -> list[Lamp]:
    """Return the lights of each vehicle, or raise FileError where they are those of another number."""
    lamps: list[Lamp] = [None] * len(fleet) if lights is None else list(lights)
    if len(lamps) != len(fleet):
        raise FileError(f"there are lights for {len(lamps)} vehicles of {len(fleet)}: give one for each, or None")
    return lamps


def _show_json(fleet: Fleet, drones: list[dict[str, Any]], sheet: ShowSheet) -> dict[str, Any]:
    checks = sheet.checks(fleet)
    segments = dict(sheet.segments) or {"show": (0.0, fleet.duration)}
    return {
        "version": 1,
        "environment": {"type": sheet.environment, **_location(sheet.origin)},
        "settings": {"cues": {"$ref": "./cues.json#"}, **({"validation": checks} if checks else {})},
        "swarm": {"drones": drones},
        "meta": {"title": sheet.title, "segments": {name: list(ends) for name, ends in segments.items()}},
    }


def _location(origin: ShowOrigin | None) -> dict[str, Any]:
    if origin is None:
        return {}
    place = [origin.latitude, origin.longitude, *([] if origin.altitude is None else [origin.altitude])]
    return {"location": {"origin": place, "orientation": origin.orientation % 360.0}}


def _origin(environment: Any) -> ShowOrigin | None:
    """Return the origin of an environment; None where it has none."""
    location = (environment or {}).get("location")
    if not location:
        return None
    latitude, longitude, *altitude = map(float, location["origin"][:3])
    return ShowOrigin(latitude, longitude, altitude[0] if altitude else None, float(location.get("orientation") or 0.0))


def _drone(fleet: Fleet, number: int, lamp: Lamp) -> dict[str, Any]:
    curve = fleet[number]
    settings = {
        "name": fleet.name(number),
        "home": np.round(curve(0.0), 3).tolist(),
        "landAt": np.round(curve(curve.duration), 3).tolist(),
        "trajectory": {"$ref": f"./drones/drone_{number + 1}/trajectory.json#"},
        "lights": {"version": 1, "data": base64.b64encode(skybrush.light_bytes(lamp)).decode()},
    }
    yaw = YawSetpoints.of(curve)
    if yaw is not None:
        setpoints = np.column_stack((yaw.instants / 1e3, yaw.angles / 10.0)).tolist()
        settings["yawControl"] = {"version": 1, "setpoints": setpoints, "autoYaw": False}
    return {"type": "generic", "settings": settings}


def _trajectory_json(curve: CubicSegments) -> dict[str, Any]:
    metres = np.round(curve.points * (curve.scale / 1e3), 3)
    metres = np.round(metres + FARTHER * np.sign(metres), 9)
    points: list[Any] = [[0.0, metres[0, 0].tolist(), []]]
    seconds = knot_seconds(curve)[1:]
    for instant, piece, line in zip(seconds, metres, curve.lines, strict=True):
        points.append([instant, piece[3].tolist(), [] if line else piece[1:3].tolist()])
    return {"version": 1, "points": points, "takeoffTime": 0.0, "landingTime": seconds[-1]}


def knot_seconds(curve: CubicSegments) -> list[float]:
    """Return the instants of knots as they are written [s]."""
    return [round(end / 1e3 + LATER * i, 9) for i, end in enumerate(curve.breaks.tolist())]


def read_skyc(path: FileName) -> SkybrushShow:
    """Read a show, whoever wrote it: lines, quadratics, cubics and curves up to degree 7.

    Raises
    ------
    FileError
        If it is none.
    """
    with reading(path, "a Skybrush show", LARGEST), zipfile.ZipFile(path) as archive:
        show = _load(archive, "show.json")
        settings = [drone["settings"] for drone in show["swarm"]["drones"]]
        if not 1 <= len(settings) <= MOST_DRONES:
            raise FileError(f"{path} has {len(settings)} vehicles: a show has 1 to {MOST_DRONES}")
        curves = [_curve(_resolved(archive, entry["trajectory"])) for entry in settings]
        yaws = [_yaw(_resolved(archive, entry.get("yawControl"))) for entry in settings]
        found = [_resolved(archive, entry.get("lights")) for entry in settings]
        programmes = tuple(base64.b64decode(each["data"]) if each else b"" for each in found)
        origin = _origin(show.get("environment"))
    headed = [
        curve if yaw is None else curve.with_yaw(yaw.heading(curve.duration))
        for curve, yaw in zip(curves, yaws, strict=True)
    ]
    names = tuple(str(entry.get("name") or f"drone {i + 1}") for i, entry in enumerate(settings))
    return SkybrushShow(Fleet(tuple(headed), names if len(set(names)) == len(names) else None), programmes, origin)


def _load(archive: zipfile.ZipFile, name: str) -> Any:
    if archive.getinfo(name).file_size > LARGEST:
        raise FileError(f"{name} unpacks to more than {LARGEST} bytes")
    return json.loads(archive.read(name))


def _resolved(archive: zipfile.ZipFile, entry: Any) -> Any:
    """Return the file that an entry refers to, or the entry itself."""
    if not isinstance(entry, dict) or "$ref" not in entry:
        return entry
    return _load(archive, str(entry["$ref"]).removesuffix("#").removeprefix("./"))


def _yaw(entry: Any) -> YawSetpoints | None:
    """Return the setpoints of an entry; None where there are none, or the vehicle turns itself."""
    if not entry or entry.get("autoYaw") or not entry.get("setpoints"):
        return None
    rows = np.array(entry["setpoints"], dtype=np.float64).reshape(-1, 2)
    instants, angles = (np.round(column).astype(np.int64) for column in (rows.T * [[1e3], [10.0]]))
    if not np.isfinite(rows).all() or (np.diff(instants) <= 0).any():
        raise FileError("the instants of a yaw in a show must be numbers that ascend")
    return YawSetpoints(instants, angles)


def _curve(entry: Any) -> Trajectory:
    """Return the trajectory of its points, with its wait before take-off and the first of them."""
    points = entry["points"]
    pieces: list[FloatArray] = []
    before = np.array(points[0][1], dtype=np.float64).reshape(3)
    wait = float(entry.get("takeoffTime") or 0.0) + float(points[0][0])
    if not wait >= 0.0:
        raise FileError(f"a vehicle of a show has its first point at {wait:g} s: shows begin at 0")
    durations = np.diff([float(point[0]) for point in points])
    for _, end, between in points[1:]:
        if len(between) > MOST_BETWEEN:
            raise FileError(f"a segment of a show has {len(between)} inner control points, and {MOST_BETWEEN} are read")
        pieces.append(np.array([before, *between, end], dtype=np.float64))
        before = pieces[-1][-1]
    if wait > 0.0 or not pieces:
        pieces.insert(0, np.array([points[0][1]] * 2, dtype=np.float64))
        durations = np.concatenate([[wait or 1.0], durations])
    size = max(len(piece) for piece in pieces)
    return Trajectory(np.stack([elevate(piece.T, size).T for piece in pieces]), durations)
