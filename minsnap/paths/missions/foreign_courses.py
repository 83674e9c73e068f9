"""Courses in the YAML of other planners, as the content of our own course files.

rpg_time_optimal (``gates`` with ``initial`` and ``end``), pmm_uav_planner (``start`` and ``end`` beside ``waypoints``),
waypoint_navigator (``easting``, ``northing``, ``height``), and TOGT-Planner, in ``togt_track``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import radians
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import is_number
from minsnap.basics.messages import shown
from minsnap.errors import FileError
from minsnap.files.geodesy import local_positions
from minsnap.paths.missions.togt_track import is_togt_track, translated_togt

NAVIGATOR = ("easting", "northing", "height")
RESTING = ("velocity", "acceleration")


def translated(where: str, content: Any) -> dict[str, Any] | None:
    """Return the content of our own course file for that of another planner, or None where it is of none of them.

    Raises
    ------
    FileError
        If it is of one of them, and malformed; says where.
    """
    if not isinstance(content, Mapping):
        return None
    if is_togt_track(content):
        return translated_togt(where, content)
    if all(isinstance(content.get(name), list) for name in NAVIGATOR):
        return _navigator(where, content)
    if isinstance(content.get("initial"), Mapping) and isinstance(content.get("gates"), list):
        return _between(where, content, "initial", "gates")
    start, points = content.get("start"), content.get("waypoints")
    if isinstance(start, Mapping) and "position" in start and isinstance(content.get("end"), Mapping) and points:
        first = points[0] if isinstance(points, list) else None
        if "position" in content["end"] and first != start["position"]:
            return _between(where, content, "start", "waypoints")
    return None


def _point(where: str, value: Any) -> list[float]:
    if not (isinstance(value, list) and len(value) == 3 and all(map(is_number, value))):
        raise FileError(f"{where} is {shown(value)}: give three numbers [m]")
    return [float(number) for number in value]


def _between(where: str, content: Mapping[str, Any], start: str, inner: str) -> dict[str, Any]:
    """Return a course from the position of a start through points to that of an end, with their states."""
    states: dict[str, Any] = {}
    ends = []
    for ours, name in (("start", start), ("end", "end")):
        state = content.get(name)
        if not isinstance(state, Mapping) or "position" not in state:
            raise FileError(f"{where} has no position of its {name}: give it")
        ends.append(_point(f"{where}: {name}: position", state["position"]))
        moving = {key: _point(f"{where}: {name}: {key}", state[key]) for key in RESTING if state.get(key) is not None}
        states[ours] = {key: value for key, value in moving.items() if any(value)}
    points = [_point(f"{where}: {inner} {i}", point) for i, point in enumerate(content[inner])]
    rest = {name: value for name, value in content.items() if name in ("limits", "vehicle", "yaw", "ball", "name")}
    return {"waypoints": [ends[0], *points, ends[1]]} | {name: state for name, state in states.items() if state} | rest


def _navigator(where: str, content: Mapping[str, Any]) -> dict[str, Any]:
    """Return a course of waypoint_navigator: places, headings in degrees, and its speed and acceleration."""
    columns = [content[name] for name in NAVIGATOR]
    if len({len(column) for column in columns}) > 1:
        counts = ", ".join(f"{len(column)} of {name}" for name, column in zip(NAVIGATOR, columns, strict=True))
        raise FileError(f"{where} has {counts}: give as many of each")
    rows = [_point(f"{where}: place {i}", list(row)) for i, row in enumerate(zip(*columns, strict=True))]
    points = np.array(rows).reshape(-1, 3)
    if content.get("coordinate_type") == "gps":
        places = points[:, [1, 0, 2]]
        points = local_positions(places, [*places[0, :2], 0.0])
    named = (("speed", "reference_speed"), ("acceleration", "reference_acceleration"))
    limits = {ours: content[name] for ours, name in named if content.get(name) is not None}
    headings, mode = content.get("heading"), content.get("heading_mode")
    yaw: dict[str, Any] = {"yaw": "velocity"} if mode == "auto" else {}
    if mode == "manual" and isinstance(headings, Sequence):
        yaw = {"yaw": [radians(angle) for angle in headings]}
    return {"waypoints": _with_waits(where, points, content), **({"limits": limits} if limits else {}), **yaw}


def _with_waits(where: str, points: FloatArray, content: Mapping[str, Any]) -> list[Any]:
    """Return the places of waypoint_navigator, at rest at inner ones for their waiting times."""
    waits = content.get("waiting_time")
    if not isinstance(waits, Sequence):
        waits = [0.0 if waits is None else waits] * len(points)
    if len(waits) != len(points) or not all(is_number(wait) and wait >= 0.0 for wait in waits):
        raise FileError(f"{where}: waiting_time is {shown(waits)}: give a time for each of {len(points)} places [s]")
    held = [0.0, *waits[1:-1], 0.0]
    return [
        dict(zip("xyz", place, strict=True)) | {"hold": float(wait)} if wait else place
        for place, wait in zip(points.tolist(), held, strict=False)
    ]
