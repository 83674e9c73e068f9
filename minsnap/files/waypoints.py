"""Waypoint files in CSV or YAML, with headings and durations, and missions of QGroundControl (``.plan``)."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, ReadOnly
from minsnap.basics.messages import shown
from minsnap.basics.schema import NUMBER, Key, mapping, several
from minsnap.basics.storage.table import LooseColumns, read_loose_table
from minsnap.basics.storage.text import FileName, load_yaml, read_text, reading
from minsnap.corridors.given_waypoints import Waypoints
from minsnap.errors import FileError
from minsnap.files.geodesy import local_positions

LARGEST = 64_000_000
"""Bytes of the largest mission that is read."""

WAYPOINTS = (16, 17, 18, 19, 21, 31, 82)
"""MAV_CMD_NAV_* that go to a position: waypoint, loiters, land, loiter to altitude, spline waypoint."""

TAKEOFF = 22
"""MAV_CMD_NAV_TAKEOFF: above home where it gives no position."""

LOITERS = (17, 18, 19, 31)
"""Those of them that circle, or wait, at their position."""

PARAMETERS = {
    **dict.fromkeys((16, 82), ("hold", "acceptance radius", "pass radius", "yaw")),
    21: ("abort altitude", "precision landing", "", "yaw"),
    TAKEOFF: ("", "", "", "yaw"),
}
"""What the first four parameters of the others ask of a multicopter."""

OTHERS = {
    20: "RTL",
    93: "DELAY",
    115: "CONDITION_YAW",
    177: "DO_JUMP",
    178: "DO_CHANGE_SPEED",
    195: "DO_SET_ROI_LOCATION",
    201: "DO_SET_ROI",
    206: "DO_SET_CAM_TRIGG_DIST",
}
"""Common commands that go to no position."""

ABOVE_SEA, ABOVE_HOME = (0, 5), (3, 6)
"""MAV_FRAME_GLOBAL and MAV_FRAME_GLOBAL_RELATIVE_ALT, and their integer forms."""


@dataclass(frozen=True, eq=False)
class GroundControlMission(ReadOnly):
    """Waypoints of a mission.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        East, north and up of home [m].
    home : ndarray, shape (3,)
        Latitude and longitude [degrees], altitude above sea level [m].
    left_out : str
        A sentence on what else the mission asks for, which the waypoints do not say; empty where there is nothing.
    """

    points: FloatArray
    home: FloatArray
    left_out: str = ""


def read_mission(path: FileName) -> GroundControlMission:
    """Read the waypoints of a QGroundControl plan, as east, north and up of its planned home position.

    Every item that flies to a position gives a waypoint (take-off, waypoint, spline waypoint, loiter, land); the
    transects of a survey count as waypoints. Others, such as changes of speed, are left out, as are holds, headings,
    loitering and the fence: ``left_out`` names them. Heights are above home or above sea level; heights above terrain
    are refused. The coordinates are in the plane tangent to the ellipsoid of WGS 84 at home, so that level ground 1 km
    away lies 8 cm below zero. Equal consecutive waypoints become one.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    GroundControlMission

    Raises
    ------
    FileError
        If the file is no such plan, has fewer than two positions, or an item that cannot be converted; says which.
    """
    text = read_text(path, LARGEST)
    with reading(path, "JSON"):
        content = json.loads(text)
    mission = content.get("mission") if isinstance(content, dict) and content.get("fileType") == "Plan" else None
    if not isinstance(mission, dict) or not isinstance(mission.get("items"), list):
        raise FileError(f"{path} is no QGroundControl plan: it has no mission with items")
    home = _coordinates(f"{path}: plannedHomePosition", mission.get("plannedHomePosition"))
    items = list(_simple_items(f"{path}", mission["items"]))
    rows = [row for where, item in items for row in _positions(where, item, home)]
    points = local_positions(np.array(rows), home) if rows else np.zeros((0, 3))
    points = points[np.concatenate(([True], (np.diff(points, axis=0) != 0.0).any(axis=1)))] if len(points) else points
    if len(points) < 2:
        raise FileError(f"{path} has {len(points)} different positions: a path needs two at least")
    asked = [what for _, item in items for what in _unflown(item)] + _fenced(content.get("geoFence"))
    listed = ", ".join(what if count == 1 else f"{what} ({count} times)" for what, count in Counter(asked).items())
    return GroundControlMission(points, home, listed and f"the path leaves out of the mission: {listed}")


def _simple_items(where: str, items: list[Any], depth: int = 0) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the items that are single commands, those inside of complex ones too, with what errors call them."""
    for i, item in enumerate(items):
        name = f"{where}, item {i}"
        if not isinstance(item, dict):
            raise FileError(f"{name} is {shown(item)}, not an item of a mission")
        if item.get("type") == "SimpleItem":
            yield name, item
            continue
        inner = (item.get("TransectStyleComplexItem") or {}).get("Items") or item.get("Items")
        if not isinstance(inner, list) or depth:
            kind = shown(item.get("complexItemType", item.get("type")))
            raise FileError(f"{name} is of type {kind}, which has no list of waypoints: convert it to waypoints first")
        yield from _simple_items(name, inner, depth + 1)


def _positions(where: str, item: Mapping[str, Any], home: FloatArray) -> list[tuple[float, float, float]]:
    """Return the position that an item flies to: latitude, longitude [degrees] and height above sea [m]; or nothing."""
    command = item.get("command")
    if command not in (*WAYPOINTS, TAKEOFF):
        return []
    params = item.get("params")
    if not isinstance(params, list) or len(params) != 7:
        raise FileError(f"{where} has parameters {shown(params)}: a waypoint has seven")
    place = home[:2].tolist() if command == TAKEOFF and params[4] in (None, 0) else params[4:6]
    latitude, longitude, altitude = _coordinates(where, [*place, params[6]]).tolist()
    return [(latitude, longitude, altitude + _base(where, item.get("frame"), home))]


def _unflown(item: Mapping[str, Any]) -> list[str]:
    """Return what an item asks for beside a position; a parameter of 0 or null asks for nothing, a heading of 0 too."""
    command = item.get("command")
    if command in LOITERS:
        return ["loitering"]
    if command not in tuple(PARAMETERS):
        known = OTHERS.get(command) if isinstance(command, int) else None
        return [known or f"command {shown(command)}"]
    return [name for name, value in zip(PARAMETERS[command], item["params"], strict=False) if name and value]


def _fenced(fence: Any) -> list[str]:
    return ["geofence"] if isinstance(fence, dict) and (fence.get("circles") or fence.get("polygons")) else []


def _base(where: str, frame: Any, home: FloatArray) -> float:
    """Return the height above sea level that altitudes of a frame are counted from [m]."""
    if frame in ABOVE_HOME:
        return float(home[2])
    if frame in ABOVE_SEA:
        return 0.0
    raise FileError(f"{where} gives its altitude in frame {shown(frame)}: use altitudes above home or above sea level")


def _coordinates(where: str, entry: Any) -> FloatArray:
    """Return latitude, longitude [degrees] and altitude [m] as an array."""
    numbers = isinstance(entry, list) and len(entry) == 3 and all(type(v) in (int, float) for v in entry)
    if not numbers or not all(abs(v) <= most for v, most in zip(entry, (90.0, 180.0, 1e8), strict=True)):
        raise FileError(f"{where} has the coordinates {shown(entry)}: give latitude, longitude and altitude")
    return np.array(entry, dtype=np.float64)


COLUMNS = ("x", "y", "z", "yaw", "duration")
"""Columns of a waypoint file; the first two must be there."""

ENTRY = mapping(
    {name: Key(NUMBER, needed=name in ("x", "y")) for name in COLUMNS},
    f"[x, y], [x, y, z] or a mapping of {', '.join(COLUMNS)}",
)
LISTED = several(NUMBER, "one list of numbers, or a value with each waypoint, not both")

LENGTHS, TIMES, ANGLES = ("m",), ("s",), ("rad", "deg", "°")
"""Units that a header may say."""

TABLE = LooseColumns(
    known={"x": LENGTHS, "y": LENGTHS, "z": LENGTHS, "yaw": ANGLES, "duration": TIMES, "t": TIMES, "time": TIMES},
    blank=("duration",),
    headerless=(("x", "y"), ("x", "y", "z")),
    ambiguous=": two are x,y and three x,y,z, more could be times or headings; name the columns in a first line",
)
"""Columns of waypoints as text."""


def read_waypoints(path: FileName) -> Waypoints:
    """Read waypoints from YAML (``.yaml``, ``.yml``), a QGroundControl mission (``.plan``), or CSV, by the ending.

    CSV has a header with ``x,y`` and optionally ``z``, ``yaw`` [rad] or ``yaw [deg]``, and ``duration`` or ``t`` [s];
    plain numbers without a header are x,y or x,y,z. Commas, semicolons, tabs or spaces separate them; capitals, empty
    lines and ``#`` comments do not matter. A duration is that of the leg to the next waypoint, with the last cell
    empty, or that of the leg from the previous waypoint, with the first cell empty; ``t`` is when each waypoint is
    passed. YAML is a list of waypoints, each ``[x, y, z]`` or a
    mapping of the same names; or a mapping with ``waypoints`` and optionally ``yaw`` and ``durations``. It is loaded
    safely: tags that construct objects are refused.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    Waypoints

    Raises
    ------
    FileError
        If the file is missing, empty or malformed; says which line or waypoint.
    """
    if Path(path).suffix.lower() in (".yaml", ".yml"):
        return waypoints_of(f"{path}", load_yaml(path))
    if Path(path).suffix.lower() == ".plan":
        return Waypoints(read_mission(path).points)
    try:
        table, units = read_loose_table(path, TABLE)
    except FileError:
        _refuse_degrees(path)
        raise
    missing = [name for name in COLUMNS[:2] if name not in table]
    if missing:
        raise FileError(f"{path}, line 1: no column {', '.join(missing)}; the columns are {','.join(table)}")
    if units.get("yaw", "rad") != "rad":
        table["yaw"] = np.deg2rad(table["yaw"])
    return _from_columns(f"{path}", table)


def _refuse_degrees(path: FileName) -> None:
    """Raise FileError where the columns of a file are latitudes and longitudes."""
    header = re.split(r"[,;\t ]+", next(iter(read_text(path).lower().splitlines()), ""))
    named = [name.strip(' "') for name in header]
    if any(name.startswith(("lat", "lon", "lng")) for name in named):
        raise FileError(
            f"{path} has latitudes and longitudes: waypoints are metres from an origin. Write them as a QGroundControl "
            "mission (.plan), whose home is the origin, or convert them to x,y,z around an origin of your own"
        )


def _from_columns(where: str, table: Mapping[str, FloatArray]) -> Waypoints:
    """Return the waypoints of columns, of which an empty duration is left out."""
    columns = {name: cells for name, cells in table.items() if name != "duration" or not np.isnan(cells).all()}
    return Waypoints.of_columns(columns, f"{where}: ", FileError)


def waypoints_of(path: str, content: Any) -> Waypoints:
    """Return the waypoints of the content of a YAML file.

    Parameters
    ----------
    path : str
        What errors name.
    content : list or dict
        As :func:`read_waypoints` describes it.

    Raises
    ------
    FileError
        If it is malformed; says which waypoint.
    """
    keys = content if isinstance(content, dict) else {"waypoints": content}
    unknown = [key for key in keys if key not in ("waypoints", "yaw", "durations")]
    if unknown or not isinstance(keys.get("waypoints"), list) or not keys["waypoints"]:
        raise FileError(f"{path}: needs a list of waypoints, alone or under 'waypoints' beside 'yaw' and 'durations'")
    rows = [_waypoint(f"{path}, waypoint {i}", item) for i, item in enumerate(keys["waypoints"])]
    names = [name for name in COLUMNS if any(name in row for row in rows)]
    for i, row in enumerate(rows):
        missing = [name for name in names if name not in row and name != "duration"]
        if missing:
            raise FileError(f"{path}, waypoint {i}: {', '.join(missing)} is missing, which other waypoints have")
    waypoints = _from_columns(f"{path}", {name: np.array([row.get(name, np.nan) for row in rows]) for name in names})
    yaw = _listed(path, keys, "yaw", waypoints.yaw)
    return Waypoints(waypoints.points, yaw, _listed(path, keys, "durations", waypoints.durations))


def _waypoint(where: str, item: Any) -> dict[str, float]:
    """Return one waypoint of a YAML file as a mapping of columns."""
    named = dict(zip(COLUMNS, item, strict=False)) if isinstance(item, list) and len(item) in (2, 3) else item
    return dict(ENTRY.read(where, named))


def _listed(path: str, keys: Mapping[str, Any], name: str, column: FloatArray | None) -> FloatArray | None:
    """Return a list for all waypoints or legs at once, or raise an error if they have such entries too."""
    if keys.get(name) is None:
        return column
    if column is not None:
        raise FileError(f"{path}: {name} is {LISTED.said}")
    return np.array(LISTED.read(f"{path}: {name}", keys[name]))
