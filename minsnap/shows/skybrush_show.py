"""Whole Skybrush shows, ``.skyc``: a zip of JSON files with the cubics and the lights of every vehicle.

The points are those of ``cubic_segments`` in metres, so that the binary files made of a show hold the same curves. The
server subtracts times in floating seconds and cuts their milliseconds off, which loses one in many intervals; each knot
is written a nanosecond later than the one before is, so that none is lost.
"""

from __future__ import annotations

import base64
import json
import os
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.reading import check_size, reading
from minsnap.errors import FileError
from minsnap.files.formats.light_programme import Lights, light_bytes, lights_of
from minsnap.files.formats.skybrush import CubicSegments, cubic_segments, is_line
from minsnap.fleet.common_clock import Fleet
from minsnap.polynomials.bernstein import elevate
from minsnap.trajectory.trajectory import Trajectory

MOST = 5000
"""Vehicles of a show."""

LATER = 1e-9
"""How much later than it is each knot is written than the one before it [s]."""

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
    lights : tuple of Lights or None
        Of each vehicle.
    """

    fleet: Fleet
    lights: tuple[Lights | None, ...]


def write_skyc(
    fleet: Fleet,
    path: str | os.PathLike[str],
    lights: Sequence[Lights | None] | None = None,
    *,
    title: str = "minsnap",
    clobber: bool = True,
) -> float:
    """Write a show in one atomic step, and return the proved distance of its curves to the fleet's [m].

    Raises
    ------
    FileError
        If there are more than 5,000 vehicles, or one leads too far away.
    """
    if len(fleet) > MOST:
        raise FileError(f"{len(fleet)} vehicles: a show holds {MOST}")
    lamps = lamps_of(fleet, lights)
    curves = [cubic_segments(curve) for curve in fleet]
    files = {f"drones/drone_{i + 1}/trajectory.json": _trajectory_json(curve) for i, curve in enumerate(curves)}
    drones = [_drone(fleet, i, lamp) for i, lamp in enumerate(lamps)]
    files["show.json"] = _show_json(fleet, drones, title)
    files["cues.json"] = {"version": 1, "items": [{"time": 0.0, "name": "start"}]}
    with atomic_write(path, "wb", clobber=clobber) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files, reverse=True):
            archive.writestr(zipfile.ZipInfo(name, STAMP), json.dumps(files[name]), zipfile.ZIP_DEFLATED)
    return max(curve.distance for curve in curves)


def lamps_of(fleet: Fleet, lights: Sequence[Lights | None] | None) -> list[Lights | None]:
    """Return the lights of each vehicle, or raise FileError where they are those of another number."""
    lamps: list[Lights | None] = [None] * len(fleet) if lights is None else list(lights)
    if len(lamps) != len(fleet):
        raise FileError(f"there are lights for {len(lamps)} vehicles of {len(fleet)}: give one for each, or None")
    return lamps


def _show_json(fleet: Fleet, drones: list[dict[str, Any]], title: str) -> dict[str, Any]:
    separation = fleet.separation
    apart = None if separation is None else separation.distance
    validation = {} if apart is None else {"validation": {"minDistance": apart}}
    return {
        "version": 1,
        "environment": {"type": "indoor"},
        "settings": {"cues": {"$ref": "./cues.json#"}, **validation},
        "swarm": {"drones": drones},
        "meta": {"title": title, "segments": {"show": [0.0, fleet.duration]}},
    }


def _drone(fleet: Fleet, number: int, lamp: Lights | None) -> dict[str, Any]:
    curve = fleet[number]
    settings = {
        "name": fleet.name(number),
        "home": np.round(curve(0.0), 3).tolist(),
        "landAt": np.round(curve(curve.duration), 3).tolist(),
        "trajectory": {"$ref": f"./drones/drone_{number + 1}/trajectory.json#"},
        "lights": {"version": 1, "data": base64.b64encode(light_bytes(lamp)).decode()},
    }
    return {"type": "generic", "settings": settings}


def _trajectory_json(curve: CubicSegments) -> dict[str, Any]:
    metres = np.round(curve.points * (curve.scale / 1e3), 3)
    points: list[Any] = [[0.0, metres[0, 0].tolist(), []]]
    seconds = knot_seconds(curve)[1:]
    for instant, piece, line in zip(seconds, metres, is_line(curve.points), strict=True):
        points.append([instant, piece[3].tolist(), [] if line else piece[1:3].tolist()])
    return {"version": 1, "points": points, "takeoffTime": 0.0, "landingTime": seconds[-1]}


def knot_seconds(curve: CubicSegments) -> list[float]:
    """Return the instants of knots as they are written [s]."""
    return [round(end / 1e3 + LATER * i, 9) for i, end in enumerate(curve.breaks.tolist())]


def read_skyc(path: str | os.PathLike[str]) -> SkybrushShow:
    """Read a show, whoever wrote it: lines, quadratics, cubics and curves up to degree 7.

    Raises
    ------
    FileError
        If it is none.
    """
    check_size(path, LARGEST)
    with reading(path, "a Skybrush show"), zipfile.ZipFile(path) as archive:
        show = _load(archive, "show.json")
        settings = [drone["settings"] for drone in show["swarm"]["drones"]]
        if not 1 <= len(settings) <= MOST:
            raise FileError(f"{path} has {len(settings)} vehicles: a show has 1 to {MOST}")
        curves = [_curve(_resolved(archive, entry["trajectory"])) for entry in settings]
        found = [_resolved(archive, entry.get("lights")) for entry in settings]
        lamps = [lights_of(base64.b64decode(each["data"])) if each else None for each in found]
    names = tuple(str(entry.get("name") or f"drone {i + 1}") for i, entry in enumerate(settings))
    return SkybrushShow(Fleet(tuple(curves), names if len(set(names)) == len(names) else None), tuple(lamps))


def _load(archive: zipfile.ZipFile, name: str) -> Any:
    if archive.getinfo(name).file_size > LARGEST:
        raise FileError(f"{name} unpacks to more than {LARGEST} bytes")
    return json.loads(archive.read(name))


def _resolved(archive: zipfile.ZipFile, entry: Any) -> Any:
    """Return the file that an entry refers to, or the entry itself."""
    if not isinstance(entry, dict) or "$ref" not in entry:
        return entry
    return _load(archive, str(entry["$ref"]).removesuffix("#").removeprefix("./"))


def _curve(entry: Any) -> Trajectory:
    """Return the trajectory of its points, with its wait before take-off."""
    points = entry["points"]
    pieces: list[FloatArray] = []
    before = np.array(points[0][1], dtype=np.float64)
    wait = float(entry.get("takeoffTime") or 0.0)
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
