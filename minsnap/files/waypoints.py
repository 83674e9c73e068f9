"""Waypoint files in CSV or YAML: positions, and optional headings and durations."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, ReadOnly, own_arrays
from minsnap.basics.messages import shown
from minsnap.basics.storage.loose_table import LooseColumns, read_loose_table
from minsnap.basics.storage.reading import finite_number
from minsnap.basics.storage.text import load_yaml, read_text
from minsnap.errors import FileError

COLUMNS = ("x", "y", "z", "yaw", "duration")
"""Columns of a waypoint file; the first two must be there."""

LENGTHS, TIMES, ANGLES = ("m",), ("s",), ("rad", "deg", "°")
"""Units that a header may say."""

TABLE = LooseColumns(
    known={"x": LENGTHS, "y": LENGTHS, "z": LENGTHS, "yaw": ANGLES, "duration": TIMES, "t": TIMES, "time": TIMES},
    blank=("duration",),
    headerless=(("x", "y"), ("x", "y", "z")),
    ambiguous=": two are x,y and three x,y,z, more could be times or headings; name the columns in a first line",
)
"""Columns of waypoints as text."""


@dataclass(frozen=True, eq=False)
class Waypoints(ReadOnly):
    """The content of a waypoint file; its fields are arguments of :func:`minsnap.plan`.

    Parameters
    ----------
    points : ndarray, shape (n, 2) or (n, 3)
        Waypoints [m].
    yaw : ndarray, shape (n,), or None
        Heading at each [rad].
    durations : ndarray, shape (n - 1,), or None
        Seconds of each leg.
    """

    points: FloatArray
    yaw: FloatArray | None = None
    durations: FloatArray | None = None

    def __post_init__(self) -> None:
        own_arrays(self)

    def closed(self) -> Waypoints:
        """Return the waypoints of a lap: those that do not end where they begin go on to the first one again.

        Durations are left out then, since none is known for the leg that closes the lap.
        """
        if np.array_equal(self.points[0], self.points[-1]):
            return self
        yaw = None if self.yaw is None else np.append(self.yaw, self.yaw[0])
        return Waypoints(np.concatenate((self.points, self.points[:1])), yaw)


def read_waypoints(path: str | os.PathLike[str]) -> Waypoints:
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
        from minsnap.files.ground_control import read_mission

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


def _refuse_degrees(path: str | os.PathLike[str]) -> None:
    """Raise FileError where the columns of a file are latitudes and longitudes."""
    header = re.split(r"[,;\t ]+", next(iter(read_text(path).lower().splitlines()), ""))
    named = [name.strip(' "') for name in header]
    if any(name.startswith(("lat", "lon", "lng")) for name in named):
        raise FileError(
            f"{path} has latitudes and longitudes: waypoints are metres from an origin. Write them as a QGroundControl "
            "mission (.plan), whose home is the origin, or convert them to x,y,z around an origin of your own"
        )


def _from_columns(where: str, table: Mapping[str, FloatArray]) -> Waypoints:
    points = np.stack([table[name] for name in COLUMNS[:3] if name in table], axis=-1)
    timed = [name for name in ("duration", "t", "time") if name in table]
    if len(timed) > 1:
        raise FileError(f"{where}: {' and '.join(timed)} both say when waypoints are passed: leave one out")
    if timed in ([], ["duration"]):
        durations = _leg_durations(where, table["duration"]) if timed else None
    else:
        durations = durations_of_times(where, table[timed[0]])
    return Waypoints(points, table.get("yaw"), durations)


def durations_of_times(where: str, t: FloatArray) -> FloatArray:
    """Return the durations of the legs between increasing times (n,) [s], or raise FileError."""
    late = np.flatnonzero(np.diff(t) <= 0.0)
    if len(late):
        i = int(late[0])
        raise FileError(
            f"{where}: waypoint {i + 1} is passed at t = {t[i + 1]:g} s, not after waypoint {i} at {t[i]:g} s"
        )
    return np.diff(t)


def _leg_durations(where: str, cells: FloatArray) -> FloatArray | None:
    """Return the durations of the legs from one cell per waypoint, of which the first or the last is empty."""
    blank = np.isnan(cells)
    if blank.all():
        return None
    if blank.sum() == 1 and (blank[0] or blank[-1]):
        return cells[~blank]
    raise FileError(
        f"{where}: {len(cells)} waypoints have {len(cells) - 1} legs, so the duration of one of them, the last or the "
        f"first, stays empty; {int(blank.sum())} are"
    )


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
        _check_complete(f"{path}, waypoint {i}", row, names)
    waypoints = _from_columns(f"{path}", {name: np.array([row.get(name, np.nan) for row in rows]) for name in names})
    yaw = _listed(path, keys, "yaw", waypoints.yaw)
    return Waypoints(waypoints.points, yaw, _listed(path, keys, "durations", waypoints.durations))


def _waypoint(where: str, item: Any) -> dict[str, float]:
    """Return one waypoint of a YAML file as a mapping of columns."""
    if isinstance(item, list) and len(item) in (2, 3):
        item = dict(zip(COLUMNS, item, strict=False))
    if not isinstance(item, dict) or not {"x", "y"} <= item.keys() <= set(COLUMNS):
        raise FileError(f"{where}: give [x, y], [x, y, z] or a mapping of {', '.join(COLUMNS)}, not {shown(item)}")
    return {name: finite_number(f"{where}: {name}", value) for name, value in item.items() if value is not None}


def _check_complete(where: str, row: Mapping[str, float], names: list[str]) -> None:
    missing = [name for name in names if name not in row and name != "duration"]
    if missing:
        raise FileError(f"{where}: {', '.join(missing)} is missing, which other waypoints have")


def _listed(
    path: str | os.PathLike[str], keys: Mapping[str, Any], name: str, column: FloatArray | None
) -> FloatArray | None:
    """Return a list for all waypoints or legs at once, or raise an error if they have such entries too."""
    values = keys.get(name)
    if values is None:
        return column
    if column is not None or not isinstance(values, list):
        raise FileError(f"{path}: {name} is one list of numbers, or a value with each waypoint, not both")
    return np.array([finite_number(f"{path}: {name} {i}", value) for i, value in enumerate(values)])
