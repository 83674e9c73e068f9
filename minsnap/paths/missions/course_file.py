"""Courses in YAML."""

from __future__ import annotations

import os
from collections.abc import Mapping
from math import cos, pi, radians, sin
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.schema import ANYTHING, FLAG, NUMBER, POINT, TEXT, WHOLE, Key, either, mapping, several
from minsnap.basics.storage.reading import reading
from minsnap.basics.storage.text import load_yaml
from minsnap.corridors.boxes import Boxes
from minsnap.corridors.gates import Gate
from minsnap.errors import FileError
from minsnap.files.limits_in_files import DESCRIBED, complete, limits_of, vehicle_of, without_null
from minsnap.files.request_yaml import PLAIN, SHARED, is_request
from minsnap.files.waypoints import COLUMNS
from minsnap.limits.limits import Limits
from minsnap.paths.missions.course import Course, Stop

MOST_TURNED = 2.0 * pi
"""Heading of a gate above which it is refused as one in degrees [rad]."""

LENGTH = Key(NUMBER, "[m]")
PASSED = {
    "ball": Key(NUMBER, "radius within which the point is passed [m]"),
    "hold": Key(NUMBER, "time at rest there [s]"),
    "straight": Key(NUMBER, "how far before and behind a gate the path stays in the prism over its opening [m]"),
}
LISTED = several(NUMBER, "a list of numbers")
EDGES = {
    "corners": Key(several(LISTED, "a list of points"), "[m]; in place of all that follows"),
    "margin": Key(NUMBER, "how far the path stays from the edges [m]"),
    "crossing": Key(WHOLE, "1: along the normal, -1: against it, 0: either way"),
}
GATE = mapping(
    {"center": Key(LISTED, "[m]")}
    | EDGES
    | {
        "normal": Key(LISTED, "direction through the opening"),
        "heading": Key(NUMBER, "direction of flight through it [rad]"),
        "heading_deg": Key(NUMBER, "the same [degrees]"),
        "width": LENGTH,
        "height": LENGTH,
        "up": Key(LISTED, "direction of the height"),
        "radius": LENGTH,
    }
    | PASSED,
    "a gate",
    marks=("center", "corners"),
)
ENTRY = mapping(
    {"x": Key(NUMBER, needed=True), "y": Key(NUMBER, needed=True), "z": LENGTH} | PASSED, "a mapping of x, y and z"
)
STOP = either(POINT, GATE, ENTRY)
GROUND = either(FLAG, several(NUMBER, "where on the ground, [x, y, z]", 3, 3))
STATE = mapping(
    {name: Key(LISTED) for name in ("position", "velocity", "acceleration", "jerk", "snap")}, "derivatives by name"
)
CORNERS = Key(several(LISTED, "a list of corners"), "[m]", needed=True)
COURSE = mapping(
    {
        "name": Key(TEXT),
        "waypoints": Key(several(STOP, "a list of waypoints and gates")),
        "gates": Key(several(GATE, "a list of gates")),
        "boxes": Key(mapping({"lower": CORNERS, "upper": CORNERS}, "their corners as lower and upper, a list of each")),
        "start": Key(STATE),
        "end": Key(STATE),
        "closed": SHARED["closed"],
        "laps": Key(WHOLE, "how often it is flown"),
        "takeoff": Key(GROUND, "from the ground below the start, or from a point"),
        "land": Key(GROUND, "on the ground below the end, or at a point"),
        "tube": Key(NUMBER, "half-width around the legs [m]"),
        "ball": Key(either(NUMBER, LISTED), "of all waypoints, or of each [m]"),
        "margin": Key(NUMBER, "of all gates [m]"),
        "tolerance": Key(NUMBER, "half-width of the boxes around inner waypoints [m]"),
        "yaw": PLAIN["yaw"],
        "limits": SHARED["limits"],
        "vehicle": Key(DESCRIBED),
        "best": Key(ANYTHING, "a remark"),
        "published": Key(ANYTHING, "a remark"),
    },
    "a mapping with waypoints",
)
"""The whole file."""


def is_course(path: str | os.PathLike[str], wanted: bool = True) -> bool:
    """Whether a file describes a course: YAML with more than waypoints, headings and durations, and no request.

    Points with ``limits`` alone may be either, and are a course where one is wanted.
    """
    if Path(path).suffix.lower() not in (".yaml", ".yml"):
        return False
    content = load_yaml(path)
    if is_request(content):
        return False
    if isinstance(content, dict) and set(content) - {"waypoints", *PLAIN, *(() if wanted else ("limits",))}:
        return True
    entries = content.get("waypoints") if isinstance(content, dict) else content
    mappings = [entry for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []
    return any(set(entry) - set(COLUMNS) for entry in mappings)


def read_course(path: str | os.PathLike[str]) -> Course:
    """Read a course from YAML; all in SI units, angles in radians.

    The keys are those of :data:`COURSE`. ``waypoints`` are points, mappings with ``x``, ``y``, ``z``, or gates:
    mappings with ``center``, a direction (``heading``, ``heading_deg``, or ``normal`` and ``crossing``) and ``width``,
    ``height`` or a ``radius``; or ``corners`` alone. ``gates`` alone is the same.

    Raises
    ------
    FileError
        If the file is malformed; says where.
    ImportError
        If PyYAML is not there.
    """
    content = load_yaml(path)
    content = content if isinstance(content, dict) else {"waypoints": content}
    with reading(path, "a course"):
        return _course(f"{path}", COURSE.read(f"{path}", content), Path(path))


def _course(where: str, content: Mapping[str, Any], path: Path) -> Course:
    entries = [*content.get("waypoints", ()), *content.get("gates", ())]
    balls, margin = content.get("ball", 0.0), content.get("margin", 0.0)
    if isinstance(balls, tuple) and len(balls) != len(entries):
        raise FileError(f"{where}: {len(balls)} balls for {len(entries)} waypoints: give one, or one for each")
    balls = balls if isinstance(balls, tuple) else (balls,) * len(entries)
    named = [f"{where}: {key} {i}" for key in ("waypoints", "gates") for i in range(len(content.get(key, ())))]
    stops = [_stop(name, entry, ball, margin) for name, entry, ball in zip(named, entries, balls, strict=True)]
    closed = content.get("closed", False)
    if closed and len(stops) > 2 and np.array_equal(stops[0].center, stops[-1].center):
        stops.pop()
    optional = ("laps", "tube", "start", "end", "tolerance", "yaw", "takeoff", "land")
    values = {key: content[key] for key in optional if key in content}
    boxes = Boxes(**content["boxes"]) if "boxes" in content else None
    limits = _limits(path.parent, content)
    return Course(tuple(stops), closed, limits=limits, boxes=boxes, name=content.get("name", path.stem), **values)


def stop_of(where: str, content: Any) -> Stop:
    """Return one entry of a course, or raise FileError, which says where it stands."""
    return _stop(where, STOP.read(where, content), 0.0, 0.0)


def _stop(where: str, entry: Any, ball: float, margin: float) -> Stop:
    if isinstance(entry, tuple):
        return Stop(np.array(entry), ball)
    options = {name: entry[name] for name in PASSED if name in entry}
    if GATE.fits(entry):
        return Stop(_gate(where, {"margin": margin} | entry), **options)
    point = np.array([entry[axis] for axis in "xyz" if axis in entry])
    return Stop(point, **{"ball": ball} | options)


def _gate(where: str, entry: Mapping[str, Any]) -> Gate:
    how = {name: entry[name] for name in ("crossing", "margin") if name in entry}
    if "corners" in entry:
        if set(entry) - {"corners", *how, *PASSED}:
            raise FileError(f"{where}: a gate with corners has no center, direction or size besides")
        return Gate.polygon(entry["corners"], **how)
    directions = [name for name in ("normal", "heading", "heading_deg") if name in entry]
    if len(directions) != 1 or ("width" in entry) == ("radius" in entry):
        raise FileError(
            f"{where}: a gate has a center, a width or a radius, and one of normal, heading and heading_deg"
        )
    made = Gate.circle if "radius" in entry else Gate
    values = how | {name: entry[name] for name in ("center", "radius", "width", "height", "up") if name in entry}
    if directions[0] == "normal":
        return made(normal=entry["normal"], **values)
    angle = entry[directions[0]]
    if directions[0] == "heading" and abs(angle) > MOST_TURNED:
        raise FileError(f"{where}: heading is {angle:g} rad, beyond a turn: write heading_deg: {angle:g} for degrees")
    angle = radians(angle) if directions[0] == "heading_deg" else angle
    flat = [cos(angle), sin(angle), 0.0][: len(values["center"])]
    return made(normal=flat, **{"crossing": 1} | values)


def _limits(folder: Path, content: Mapping[str, Any]) -> Limits | None:
    named = content.get("limits", {})
    if "vehicle" in content:
        vehicle = vehicle_of(content["vehicle"], folder, content.get("name", "vehicle"))
        return Limits.of(vehicle, **{"reserve": 0.0} | without_null(named))
    if "rotors" in named:
        return limits_of("limits", named, folder)
    return Limits(**complete(named)) if named else None
