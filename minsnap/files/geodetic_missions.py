"""Missions by latitude and longitude: QGroundControl, ArduPilot, Google Earth, DJI, GPX, Litchi, and tables.

Heights above terrain are refused: a path needs heights above one level. Heights above sea and above the ellipsoid are
taken alike, as differences to a home that is given in the same way.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.messages import shown
from minsnap.basics.storage.text import FileName, beginning, read_text, reading
from minsnap.errors import FileError
from minsnap.files.gpx_missions import read_gpx
from minsnap.files.kml_missions import read_kml, read_kmz
from minsnap.files.mission_items import (
    ABOVE_HOME,
    LARGEST,
    WAYPOINT,
    GeodeticMission,
    MissionItem,
    Place,
    coordinates,
    mission_of,
    places_of,
)
from minsnap.files.sample_columns import GEODETIC, geodetic_columns

WPL = "QGC WPL"
"""How ArduPilot's text begins; versions 110 and 120 are the same but for the name."""

LANDINGS = ("landingApproachCoordinate", "loiterCoordinate", "landCoordinate")
"""Where landing patterns of QGroundControl go, in this order."""

Reader = Callable[[FileName, Sequence[float] | None], GeodeticMission]


def is_mission(path: FileName) -> bool:
    """Whether a file has waypoints by latitude and longitude, by its ending and beginning."""
    ending = Path(path).suffix.lower() if isinstance(path, (str, Path)) else ""
    return ending in READERS or (ending in (".csv", ".txt") and _text_reader(path) is not None)


def read_mission(path: FileName, origin: Sequence[float] | None = None) -> GeodeticMission:
    """Read the waypoints of a mission, as east, north and up of its home or of another origin.

    Every item that flies to a position gives a waypoint (take-off, waypoint, spline waypoint, loiter, land, and those
    of VTOLs); the transects of a survey count as waypoints. Others are left out, as are holds, headings, loitering and
    the fence: ``left_out`` names them. Changes of speed are ``speeds``. Heights are above home or above sea level;
    heights above terrain are refused. The coordinates are in the plane tangent to the ellipsoid of WGS 84 at home, so
    that level ground 1 km away lies 8 cm below zero. Equal consecutive waypoints become one.

    Parameters
    ----------
    path : str or path
        ``.plan``, ``.waypoints`` or other text that begins with QGC WPL, ``.kml``, ``.kmz``, ``.gpx``, or CSV with the
        columns of Litchi or with ``lat``, ``lon`` and ``alt``.
    origin : sequence of 3 float, optional
        Latitude, longitude [degrees] and altitude above sea level [m] of (0, 0, 0). By default home: where the file has
        none, the ground below its first waypoint, or sea level there where its heights are above sea.

    Returns
    -------
    GeodeticMission

    Raises
    ------
    FileError
        If the file is no such mission, has fewer than two positions, or an item that cannot be converted; says which.
    """
    reader = READERS.get(Path(path).suffix.lower()) or _text_reader(path)
    if reader is None:
        raise FileError(f"{path} is no mission: it has no latitudes and longitudes")
    return reader(path, origin)


def _text_reader(path: FileName) -> Reader | None:
    """Return what reads a text without an ending of its own, or None if it is no mission."""
    text = beginning(path).lstrip("\ufeff")
    if text.startswith(WPL):
        return _read_wpl
    header = text.partition("\n")[0].lower()
    return _read_places if "lat" in header and ("lon" in header or "lng" in header) else None


def _read_plan(path: FileName, origin: Sequence[float] | None) -> GeodeticMission:
    """Read a plan of QGroundControl."""
    text = read_text(path, LARGEST)
    with reading(path, "JSON"):
        content = json.loads(text)
    mission = content.get("mission") if isinstance(content, dict) and content.get("fileType") == "Plan" else None
    if not isinstance(mission, dict) or not isinstance(mission.get("items"), list):
        raise FileError(f"{path} is no QGroundControl plan: it has no mission with items")
    home = coordinates(f"{path}: plannedHomePosition", mission.get("plannedHomePosition"))
    places, asked = places_of(_items(f"{path}", mission["items"]), home)
    return mission_of(f"{path}", places, home, origin, asked + _fenced(content.get("geoFence")))


def _items(where: str, items: list[Any], depth: int = 0) -> Iterator[MissionItem]:
    """Yield the items that are single commands, those inside of complex ones too."""
    for i, item in enumerate(items):
        name = f"{where}, item {i}"
        if not isinstance(item, dict):
            raise FileError(f"{name} is {shown(item)}, not an item of a mission")
        if item.get("type") == "SimpleItem":
            params = item.get("params")
            yield MissionItem(name, item.get("command"), item.get("frame"), params if isinstance(params, list) else [])
            continue
        if str(item.get("complexItemType", "")).endswith("LandingPattern"):
            yield from _landing(name, item)
            continue
        inner = (item.get("TransectStyleComplexItem") or {}).get("Items") or item.get("Items")
        if not isinstance(inner, list) or depth:
            kind = shown(item.get("complexItemType", item.get("type")))
            raise FileError(f"{name} is of type {kind}, which has no list of waypoints: convert it to waypoints first")
        yield from _items(name, inner, depth + 1)


def _landing(where: str, item: dict[str, Any]) -> Iterator[MissionItem]:
    """Yield the approach and the landing of a pattern of a fixed wing or a VTOL."""
    places = [item[name] for name in LANDINGS if item.get(name) is not None]
    if not places:
        raise FileError(f"{where} is a landing without coordinates: convert it to waypoints first")
    frame = ABOVE_HOME[0] if item.get("altitudesAreRelative", True) else 0
    for place in places:
        yield MissionItem(where, WAYPOINT, frame, [0, 0, 0, None, *coordinates(where, place).tolist()])


def _fenced(fence: Any) -> list[str]:
    return ["geofence"] if isinstance(fence, dict) and (fence.get("circles") or fence.get("polygons")) else []


def _read_wpl(path: FileName, origin: Sequence[float] | None) -> GeodeticMission:
    """Read the text of ArduPilot's ground stations: https://mavlink.io/en/file_formats/.

    Its first row, number 0, is home where it is a plain waypoint above sea level; home is the place of the first
    position, at height 0, where that row is all zeros or no waypoint.
    """
    lines = [(number, line) for number, line in enumerate(read_text(path, LARGEST).splitlines(), 1) if line.strip()]
    if not lines or not lines[0][1].lstrip("\ufeff").startswith(WPL):
        raise FileError(f"{path} is no mission of ArduPilot: its first line is not {WPL} 110")
    items = [_row(f"{path}, line {number}", line) for number, line in lines[1:] if not line.lstrip().startswith("#")]
    home = None
    if items and items[0].command == WAYPOINT and items[0].frame == 0:
        first = items.pop(0)
        home = coordinates(first.where, list(first.params[4:])) if any(first.params[4:6]) else None
    if home is None:
        known = (item.params[4:6] for item in items if item.frame in (*ABOVE_HOME, 0, 5) and any(item.params[4:6]))
        place = next(known, None)
        if place is None:
            raise FileError(f"{path} has 0 different positions: a path needs two at least")
        home = coordinates(f"{path}", [*place, 0.0])
    places, asked = places_of(items, home)
    return mission_of(f"{path}", places, home, origin, asked)


def _row(where: str, line: str) -> MissionItem:
    """Return the item of a line: index, current, frame, command, seven parameters, autocontinue."""
    cells = line.split()
    try:
        numbers = [float(cell) for cell in cells]
    except ValueError:
        numbers = []
    if len(numbers) != 12 or "_" in line:
        raise FileError(f"{where} is no item of a mission: it has to be twelve numbers")
    return MissionItem(where, int(numbers[3]), int(numbers[2]), numbers[4:11])


def _read_places(path: FileName, origin: Sequence[float] | None) -> GeodeticMission:
    """Read a table by latitude and longitude, such as a mission of Litchi."""
    columns, modes = geodetic_columns(path)
    if modes is not None and (modes == 1.0).any():
        row = int(np.flatnonzero(modes == 1.0)[0])
        raise FileError(f"{path}: waypoint {row} gives its altitude above the ground: use altitudes above the start")
    rows = np.column_stack([columns[name] for name in GEODETIC])
    checked = [coordinates(f"{path}, place {i}", row.tolist()) for i, row in enumerate(rows)]
    speeds = columns.get("speed", np.full(len(rows), np.nan))
    arriving = np.concatenate([[np.nan], np.where(speeds > 0.0, speeds, np.nan)[:-1]])  # a speed is from its place on
    base = float(origin[2]) if modes is not None and origin is not None else 0.0
    rows[:, 2] += base
    places = [Place(row[0], row[1], row[2], speed) for row, speed in zip(rows.tolist(), arriving.tolist(), strict=True)]
    return mission_of(f"{path}", places, np.array([*checked[0][:2], 0.0]), origin, ())


READERS: dict[str, Reader] = {
    ".plan": _read_plan,
    ".waypoints": _read_wpl,
    ".kml": read_kml,
    ".kmz": read_kmz,
    ".gpx": read_gpx,
}
"""By the ending of a file."""
