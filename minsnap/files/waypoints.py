"""Waypoint files in CSV or YAML, with headings and durations, and missions by latitude and longitude."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.messages import explains_names
from minsnap.basics.schema import NUMBER, Key, mapping, refuse_unknown, several
from minsnap.basics.storage.table import LooseColumns, read_loose_table
from minsnap.basics.storage.text import FileName, beginning, load_yaml
from minsnap.corridors.given_waypoints import Waypoints
from minsnap.errors import FileError
from minsnap.files.geodetic_missions import is_mission, read_mission
from minsnap.limits.ordinary import ORDINARY

COLUMNS = ("x", "y", "z", "yaw", "duration", "speed")
"""Columns of a waypoint file; the first two must be there."""

ENTRY = mapping(
    {name: Key(NUMBER, needed=name in ("x", "y")) for name in COLUMNS},
    f"[x, y], [x, y, z] or a mapping of {', '.join(COLUMNS)}",
)
LISTED = several(NUMBER, "one list of numbers, or a value with each waypoint, not both")

LENGTHS, TIMES, ANGLES, SPEEDS = ("m",), ("s",), ("rad", "deg", "°"), ("m/s",)
"""Units that a header may say."""

TABLE = LooseColumns(
    known={"x": LENGTHS, "y": LENGTHS, "z": LENGTHS, "yaw": ANGLES, "duration": TIMES, "t": TIMES, "time": TIMES}
    | {"speed": SPEEDS, "hold": TIMES},
    blank=("duration", "speed", "hold"),
    headerless=(("x", "y"), ("x", "y", "z")),
    ambiguous=": two are x,y and three x,y,z, more could be times or headings; name the columns in a first line",
)
"""Columns of waypoints as text."""


@explains_names({})
def read_waypoints(path: FileName, origin: Sequence[float] | None = None) -> Waypoints:
    """Read waypoints from YAML (``.yaml``, ``.yml``), a mission, or CSV, by the ending.

    Missions are ``.plan`` (QGroundControl), ``.waypoints`` (ArduPilot, and any text that begins with QGC WPL 110),
    ``.kml`` and ``.kmz`` (Google Earth and DJI), ``.gpx`` (receivers and route planners), and CSV by latitude and
    longitude, such as Litchi's: their waypoints are metres east, north and up of an origin
    (:func:`minsnap.files.geodetic_missions.read_mission`).

    CSV has a header with ``x,y`` and optionally ``z``, ``yaw`` [rad] or ``yaw [deg]``, and ``duration`` or ``t`` [s];
    plain numbers without a header are x,y or x,y,z. Commas, semicolons, tabs or spaces separate them; capitals, empty
    lines and ``#`` comments do not matter. A duration is that of the leg to the next waypoint, with the last cell
    empty, or that of the leg from the previous waypoint, with the first cell empty; ``t`` is when each waypoint is
    passed. A ``speed`` [m/s] is the greatest on the leg that begins there. YAML is a list of waypoints, each
    ``[x, y, z]`` or a mapping of the same names; or a mapping with ``waypoints`` and optionally ``yaw`` and
    ``durations``. It is loaded
    safely: tags that construct objects are refused.

    Parameters
    ----------
    path : str or path
        The file.
    origin : sequence of 3 float, optional
        Latitude, longitude [degrees] and altitude [m] of the point (0, 0, 0), for a mission; by default its home.

    Returns
    -------
    Waypoints

    Raises
    ------
    FileError
        If the file is missing, empty or malformed; says which line or waypoint. If an origin is given for what has
        metres.
    """
    if is_mission(path):
        mission = read_mission(path, origin)
        asked = mission.speeds
        speeds = None if asked is None else np.where(np.isnan(asked), ORDINARY["speed"], asked)
        return Waypoints(mission.points, speeds=speeds)
    if origin is not None:
        raise FileError(f"{path} has no latitudes and longitudes: leave the origin out")
    if Path(path).suffix.lower() in (".yaml", ".yml"):
        return waypoints_of(f"{path}", load_yaml(path))
    if Path(path).suffix.lower() == ".json" and beginning(path):
        raise FileError(
            f"{path} is no plan that was written here: give waypoints as .csv or .yaml, whose lists JSON has too"
        )
    table = _table(path)
    if "hold" in table:
        raise FileError(f"{path} has a column hold: it is a course, which minsnap plan and minsnap.read_course take")
    return _from_columns(f"{path}", table)


class HeldWaypoints(NamedTuple):
    """Waypoints (n, dim) [m], and how long the vehicle rests at each, (n,) [s]."""

    points: FloatArray
    holds: FloatArray


def has_holds(path: FileName) -> bool:
    """Whether the first line of a table of waypoints has a column ``hold``."""
    if is_mission(path):
        return False
    header = re.split(r"[,;\t ]+", beginning(path).partition("\n")[0].lower().lstrip("#").strip())
    return "hold" in [name.strip(" '\"") for name in header]


def read_held(path: FileName) -> HeldWaypoints:
    """Read waypoints with the time that the vehicle rests at each: ``x,y[,z],hold``, seconds, empty for none.

    Raises
    ------
    FileError
        As :func:`read_waypoints`, or if there is a yaw or a duration besides.
    """
    table = _table(path)
    beside = [name for name in table if name not in ("x", "y", "z", "hold")]
    if beside:
        raise FileError(
            f"{path} has a column {beside[0]} beside hold: a course goes by limits and one yaw; leave it out"
        )
    points = np.stack([table[axis] for axis in "xyz" if axis in table], axis=-1)
    return HeldWaypoints(points, np.nan_to_num(table.get("hold", np.zeros(len(points)))))


def _table(path: FileName) -> dict[str, FloatArray]:
    """Return the columns of a table of waypoints, headings in radians."""
    table, units = read_loose_table(path, TABLE)
    missing = [name for name in COLUMNS[:2] if name not in table]
    if missing:
        raise FileError(f"{path}, line 1: no column {', '.join(missing)}; the columns are {','.join(table)}")
    if units.get("yaw", "rad") != "rad":
        table["yaw"] = np.deg2rad(table["yaw"])
    return table


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
    if unknown and isinstance(keys.get("waypoints"), list):
        refuse_unknown(path, keys, dict.fromkeys(("waypoints", "yaw", "durations", "limits", "avoid", "total_time")))
    if unknown or not isinstance(keys.get("waypoints"), list) or not keys["waypoints"]:
        raise FileError(f"{path}: needs a list of waypoints, alone or under 'waypoints' beside 'yaw' and 'durations'")
    rows = [_waypoint(f"{path}, waypoint {i}", item) for i, item in enumerate(keys["waypoints"])]
    names = [name for name in COLUMNS if any(name in row for row in rows)]
    for i, row in enumerate(rows):
        missing = [name for name in names if name not in row and name not in TABLE.blank]
        if missing:
            raise FileError(f"{path}, waypoint {i}: {', '.join(missing)} is missing, which other waypoints have")
    waypoints = _from_columns(f"{path}", {name: np.array([row.get(name, np.nan) for row in rows]) for name in names})
    yaw = _listed(path, keys, "yaw", waypoints.yaw)
    return Waypoints(waypoints.points, yaw, _listed(path, keys, "durations", waypoints.durations), waypoints.speeds)


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
