"""Items of MAVLink missions: which of them fly to a position, which speed and hold they ask for, what is left out.

Commands and frames are those of https://mavlink.io/en/messages/common.html (MAV_CMD, MAV_FRAME).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, ReadOnly
from minsnap.basics.messages import shown
from minsnap.errors import FileError
from minsnap.files.geodesy import local_positions

LARGEST = 64_000_000
"""Bytes of the largest mission that is read, unpacked."""

WAYPOINTS = (16, 17, 18, 19, 21, 31, 82, 84, 85)
"""MAV_CMD_NAV_* that go to a position: waypoint, loiters, land, spline waypoint, take-off and landing of VTOLs."""

TAKEOFF, LAND, WAYPOINT, CHANGE_SPEED = 22, 21, 16, 178
"""MAV_CMD_NAV_TAKEOFF (above home where it gives no position), NAV_LAND, NAV_WAYPOINT, DO_CHANGE_SPEED."""

LOITERS = (17, 18, 19, 31)
"""Those that circle, or wait, at their position."""

PARAMETERS = {
    **dict.fromkeys((WAYPOINT, 82), ("hold", "acceptance radius", "pass radius", "yaw")),
    LAND: ("abort altitude", "precision landing", "", "yaw"),
    TAKEOFF: ("", "", "", "yaw"),
    84: ("", "", "", "yaw"),
    85: ("", "", "", "yaw"),
}
"""What the first four parameters of the others ask of a multicopter."""

OTHERS = {
    20: "RTL",
    93: "DELAY",
    115: "CONDITION_YAW",
    177: "DO_JUMP",
    195: "DO_SET_ROI_LOCATION",
    201: "DO_SET_ROI",
    206: "DO_SET_CAM_TRIGG_DIST",
    2000: "IMAGE_START_CAPTURE",
    3000: "DO_VTOL_TRANSITION",
}
"""Common commands that go to no position."""

ABOVE_SEA, ABOVE_HOME = (0, 5), (3, 6)
"""MAV_FRAME_GLOBAL and MAV_FRAME_GLOBAL_RELATIVE_ALT, and their integer forms."""


@dataclass(frozen=True)
class MissionItem:
    """One item of a mission.

    Parameters
    ----------
    where : str
        What errors call it.
    command, frame : int
        MAV_CMD and MAV_FRAME.
    params : sequence
        Seven numbers, or None for those that are not given: the last three are latitude, longitude and altitude.
    """

    where: str
    command: Any
    frame: Any
    params: Sequence[Any]


@dataclass(frozen=True, eq=False)
class GeodeticMission(ReadOnly):
    """Waypoints of a mission.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        East, north and up of home [m].
    home : ndarray, shape (3,)
        Latitude and longitude [degrees], altitude above sea level [m].
    left_out : str
        A sentence on what else the mission asks for, which the waypoints do not say; empty where there is nothing.
    speeds : ndarray, shape (n - 1,), or None
        Speed that is asked for on the leg to each waypoint but the first [m/s], not a number where none is; None where
        the mission asks for none at all.
    """

    points: FloatArray
    home: FloatArray
    left_out: str = ""
    speeds: FloatArray | None = None


@dataclass(frozen=True)
class Place:
    """A position of a mission: latitude, longitude [degrees], altitude above sea [m]; and the speed to it [m/s]."""

    latitude: float
    longitude: float
    altitude: float
    speed: float = float("nan")


def mission_of(
    path: str, places: Sequence[Place], home: FloatArray, origin: Sequence[float] | None, left_out: Iterable[str]
) -> GeodeticMission:
    """Return the mission of places, of which equal consecutive ones become one.

    Raises
    ------
    FileError
        If fewer than two are different.
    """
    home = home if origin is None else coordinates("the origin", list(origin))
    rows = [(place.latitude, place.longitude, place.altitude) for place in places]
    points = local_positions(np.array(rows), home) if rows else np.zeros((0, 3))
    kept = np.concatenate(([True], (np.diff(points, axis=0) != 0.0).any(axis=1))) if len(points) else np.zeros(0, bool)
    points, speeds = points[kept], np.array([place.speed for place in places])[kept][1:]
    if len(points) < 2:
        raise FileError(f"{path} has {len(points)} different positions: a path needs two at least")
    listed = ", ".join(what if n == 1 else f"{what} ({n} times)" for what, n in Counter(left_out).items())
    said = listed and f"the path leaves out of the mission: {listed}"
    return GeodeticMission(points, home, said, None if np.isnan(speeds).all() else speeds)


def places_of(items: Iterable[MissionItem], home: FloatArray) -> tuple[list[Place], list[str]]:
    """Return the positions that items fly to, and what else they ask for."""
    places: list[Place] = []
    asked: list[str] = []
    speed = float("nan")
    for item in items:
        changed = _speed(item)
        if changed is not None:
            speed = changed
            continue
        asked += _unflown(item)
        if item.command in (*WAYPOINTS, TAKEOFF):
            places.append(_place(item, home, places[-1] if places else None, speed))
    return places, asked


def _speed(item: MissionItem) -> float | None:
    """Return the speed over ground that an item asks for from here on [m/s], or None if it does not."""
    if item.command != CHANGE_SPEED or len(item.params) < 2 or item.params[0] not in (0, 1, None):
        return None
    speed = item.params[1]
    return float(speed) if type(speed) in (int, float) and 0.0 < speed < 1e6 else None


def _place(item: MissionItem, home: FloatArray, before: Place | None, speed: float) -> Place:
    """Return where an item flies to; a position of two zeros, or none, is the one before, or home."""
    if len(item.params) != 7:
        raise FileError(f"{item.where} has parameters {shown(item.params)}: a waypoint has seven")
    latitude, longitude, height = item.params[4:]
    if latitude in (None, 0) and longitude in (None, 0):
        latitude, longitude = home[:2].tolist() if before is None else (before.latitude, before.longitude)
    latitude, longitude, height = coordinates(item.where, [latitude, longitude, height]).tolist()
    return Place(latitude, longitude, height + _base(item.where, item.frame, home), speed)


def _unflown(item: MissionItem) -> list[str]:
    """Return what an item asks for beside a position; a parameter of 0 or null asks for nothing, a heading of 0 too."""
    if item.command in LOITERS:
        return ["loitering"]
    if item.command not in tuple(PARAMETERS):
        known = OTHERS.get(item.command) if isinstance(item.command, int) else None
        known = "DO_CHANGE_SPEED" if item.command == CHANGE_SPEED else known
        return [known or f"command {shown(item.command)}"]
    return [name for name, value in zip(PARAMETERS[item.command], item.params, strict=False) if name and value]


def _base(where: str, frame: Any, home: FloatArray) -> float:
    """Return the height above sea level that altitudes of a frame are counted from [m]."""
    if frame in ABOVE_HOME:
        return float(home[2])
    if frame in ABOVE_SEA:
        return 0.0
    raise FileError(f"{where} gives its altitude in frame {shown(frame)}: use altitudes above home or above sea level")


def coordinates(where: str, entry: Any) -> FloatArray:
    """Return latitude, longitude [degrees] and altitude [m] as an array.

    Raises
    ------
    FileError
        If they are no such numbers.
    """
    numbers = isinstance(entry, list) and len(entry) == 3 and all(type(v) in (int, float) for v in entry)
    beyond = not numbers or not all(abs(v) <= most for v, most in zip(entry, (90.0, 180.0, 1e8), strict=True))
    if beyond or not all(map(isfinite, map(float, entry))):
        raise FileError(f"{where} has the coordinates {shown(entry)}: give latitude, longitude and altitude")
    return np.array(entry, dtype=np.float64)
