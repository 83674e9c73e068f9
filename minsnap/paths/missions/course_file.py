"""Courses in YAML."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import fields
from math import cos, pi, radians, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.checks import is_number
from minsnap.basics.messages import shown
from minsnap.basics.storage.reading import reading
from minsnap.basics.storage.text import load_yaml
from minsnap.corridors.boxes import Boxes
from minsnap.corridors.gates import Gate
from minsnap.errors import FileError, VehicleError
from minsnap.files.plan_request import SHORT_NAMES, VEHICLES, named_vehicle
from minsnap.files.waypoints import COLUMNS
from minsnap.limits.limits import Limits
from minsnap.limits.ordinary import completed_in_file
from minsnap.paths.missions.course import Course, Stop
from minsnap.vehicle import Quadrotor
from minsnap.vehicle.yaml import vehicle_from

MOST_TURNED = 2.0 * pi
"""Heading of a gate in radians beyond which it is taken for degrees."""

PLAIN = ("waypoints", "yaw", "durations")
"""Keys of a waypoint file, which is no course."""

KEYS = (
    "name",
    "waypoints",
    "gates",
    "boxes",
    "start",
    "end",
    "closed",
    "laps",
    "takeoff",
    "land",
    "tube",
    "ball",
    "margin",
)
FURTHER = ("tolerance", "yaw", "limits", "vehicle", "best", "published")

OF_STOPS = ("ball", "hold", "straight")
OF_GATES = (
    "center",
    "normal",
    "heading",
    "heading_deg",
    "width",
    "height",
    "up",
    "radius",
    "corners",
    "crossing",
    "margin",
    *OF_STOPS,
)

OF_POINTS = ("x", "y", "z", *OF_STOPS)


def is_course(path: str | os.PathLike[str]) -> bool:
    """Whether a YAML file describes a course: more than a list of waypoints with headings and durations."""
    said = load_yaml(path)
    if isinstance(said, dict) and set(said) - set(PLAIN):
        return True
    entries = said.get("waypoints") if isinstance(said, dict) else said
    mappings = [entry for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []
    return any(set(entry) - set(COLUMNS) for entry in mappings)


def read_course(path: str | os.PathLike[str]) -> Course:
    """Read a course from YAML; all in SI units, angles in radians.

    ``waypoints`` are points ``[x, y, z]``; mappings with ``x``, ``y``, ``z`` and optionally ``ball`` (radius within
    which the point is passed) and ``hold`` (seconds at rest); or gates: mappings with ``center``, ``heading``
    (direction in which it is flown through; or ``heading_deg``, or ``normal`` and ``crossing``), ``width``, ``height``
    or a ``radius`` (or ``corners`` alone), and optionally ``margin`` (how far the path stays from the edges; beside the
    waypoints, for all) and ``straight`` (metres before and behind it over which the path stays inside its prism).
    ``gates`` alone is the same.

    Further keys: ``closed``, ``laps``, ``takeoff`` and ``land`` (true, or a point on the ground), ``limits`` by the
    names of :class:`minsnap.Limits`; ``ball``, ``tolerance`` and ``tube`` for all; ``boxes`` with ``start`` and
    ``end``; ``yaw``, ``vehicle``, ``name``; ``best`` and ``published`` are remarks.

    Raises
    ------
    FileError
        If the file is malformed; says where.
    ImportError
        If PyYAML is not there.
    """
    said = load_yaml(path)
    said = said if isinstance(said, dict) else {"waypoints": said}
    unknown = [key for key in said if key not in KEYS + FURTHER]
    if unknown:
        raise FileError(f"{path}: {shown(unknown[0])} is not known; a course has {', '.join(KEYS + FURTHER)}")
    with reading(path, "a course"):
        return _course(f"{path}", said, Path(path).stem)


def _course(where: str, said: Mapping[str, Any], stem: str) -> Course:
    entries = [*said.get("waypoints", ()), *said.get("gates", ())]
    stops = [
        stop_of(f"{where}, waypoint {i}", entry, said.get("ball", 0.0), said.get("margin", 0.0), i)
        for i, entry in enumerate(entries)
    ]
    closed = said.get("closed", False)
    if closed and len(stops) > 2 and np.array_equal(stops[0].center, stops[-1].center):
        stops.pop()
    given = {key: said[key] for key in ("laps", "tube", "start", "end", "tolerance", "yaw") if key in said}
    given |= {key: _ground(where, key, said[key]) for key in ("takeoff", "land") if key in said}
    boxes = _boxes(where, said["boxes"]) if "boxes" in said else None
    name = str(said.get("name", stem))
    return Course(tuple(stops), bool(closed), limits=_limits(where, said), boxes=boxes, name=name, **given)


def _boxes(where: str, said: Any) -> Boxes:
    if not isinstance(said, dict) or set(said) != {"lower", "upper"}:
        raise FileError(f"{where}: boxes are {shown(said)}: give their corners as lower and upper, a list of each")
    return Boxes(**said)


def stop_of(where: str, entry: Any, balls: Any = 0.0, margin: Any = 0.0, index: int = 0) -> Stop:
    """Return one entry of a course: a point, or a gate."""
    if isinstance(entry, list):
        entry = dict(zip("xyz", entry, strict=False)) if len(entry) in (2, 3) else {}
    is_gate = isinstance(entry, dict) and bool({"center", "corners"} & entry.keys())
    keys = OF_GATES if is_gate else OF_POINTS
    if not isinstance(entry, dict) or set(entry) - set(keys) or not (is_gate or {"x", "y"} <= set(entry)):
        raise FileError(
            f"{where}: give [x, y, z], a mapping of {', '.join(OF_POINTS)}, or a gate of {', '.join(OF_GATES)}, "
            f"not {shown(entry)}"
        )
    further = {name: entry[name] for name in OF_STOPS if name in entry}
    if is_gate:
        return Stop(_gate(where, {"margin": margin} | entry), **further)
    ball = balls[index] if isinstance(balls, list) else balls
    values = [entry[axis] for axis in "xyz" if axis in entry]
    if not all(map(is_number, values)):
        raise FileError(f"{where}: {shown(values)} are not finite numbers")
    return Stop(np.array(values, dtype=np.float64), **{"ball": ball} | further)


def _gate(where: str, entry: Mapping[str, Any]) -> Gate:
    how = {name: entry[name] for name in ("crossing", "margin") if name in entry}
    if "corners" in entry:
        if set(entry) - {"corners", *how, *OF_STOPS}:
            raise FileError(f"{where}: a gate with corners has no center, direction or size besides")
        return Gate.polygon(entry["corners"], **how)
    directions = [name for name in ("normal", "heading", "heading_deg") if name in entry]
    if len(directions) != 1 or ("width" in entry) == ("radius" in entry):
        raise FileError(
            f"{where}: a gate has a center, a width or a radius, and one of normal, heading and heading_deg"
        )
    made = Gate.circle if "radius" in entry else Gate
    given = how | {name: entry[name] for name in ("center", "radius", "width", "height", "up") if name in entry}
    if directions[0] == "normal":
        return made(normal=entry["normal"], **given)
    angle = entry[directions[0]]
    if not is_number(angle):
        raise FileError(f"{where}: {directions[0]} is {shown(angle)}: give an angle")
    if directions[0] == "heading" and abs(angle) > MOST_TURNED:
        raise FileError(f"{where}: heading is {angle:g} rad, beyond a turn: write heading_deg: {angle:g} for degrees")
    angle = radians(angle) if directions[0] == "heading_deg" else float(angle)
    flat = [cos(angle), sin(angle), 0.0][: len(given["center"])]
    return made(normal=flat, **{"crossing": 1} | given)


def _ground(where: str, key: str, value: Any) -> Any:
    if isinstance(value, bool):
        return value
    if isinstance(value, list) and len(value) == 3 and all(map(is_number, value)):
        return tuple(float(entry) for entry in value)
    raise FileError(f"{where}: {key} is {shown(value)}: give true, or where on the ground, [x, y, z]")


def _limits(where: str, said: Mapping[str, Any]) -> Limits | None:
    given = said.get("limits", {})
    if not isinstance(given, dict):
        raise FileError(f"{where}: limits are {shown(given)}: give them by name, such as {{speed: 3}}")
    known = [entry.name for entry in fields(Limits)]
    unknown = [name for name in given if name not in known]
    if unknown:
        raise FileError(f"{where}: no limit is called {shown(unknown[0])}: there are {', '.join(known)}")
    if "vehicle" in said:
        vehicle = _vehicle(Path(where).parent, said["vehicle"], str(said.get("name", "vehicle")))
        return Limits.of(vehicle, reserve=0.0, **given)
    if not given:
        return None
    how: dict[str, Any] = {name: given[name] for name in ("norm", "gravity") if name in given}
    kept: dict[str, Any] = completed_in_file({name: value for name, value in given.items() if name not in how})
    return Limits(**kept, **how)


def _vehicle(folder: Path, said: Any, name: str) -> Quadrotor:
    """Return the vehicle of a mapping, whose rotors may be described by their least and largest thrust [N], or file."""
    if isinstance(said, str):
        if said in VEHICLES or said in SHORT_NAMES or not Path(said).suffix:
            return named_vehicle(said)
        return Quadrotor.from_yaml(folder / said)
    if not isinstance(said, dict):
        raise VehicleError(f"vehicle is {shown(said)}: give its fields by name, or a YAML file that does")
    rest = {key: value for key, value in said.items() if key != "rotor_thrust"}
    if "rotor_thrust" in said and "thrust_coefficient" in said:
        least, most = (sqrt(thrust / said["thrust_coefficient"]) for thrust in said["rotor_thrust"])
        rest |= {"rotor_speed_min": least, "rotor_speed_max": most}
    return vehicle_from(Quadrotor, {"name": name} | rest)
