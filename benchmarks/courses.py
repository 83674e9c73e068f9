"""Courses as data: what ``benchmarks/courses/*.yaml`` says, as arguments of ``minsnap.plan``.

A file holds ``name`` and, as far as they apply: ``waypoints`` (points) or ``gates`` (each with the arguments of
``minsnap.Gate``; the first is also the last where ``closed`` is true) or ``boxes`` (``lower`` and ``upper`` corners,
with ``start`` and ``end`` states); ``ball`` and ``tolerance`` around the waypoints [m]; ``tube`` half-width [m];
``yaw``; ``limits`` by their names in ``minsnap.Limits``; ``vehicle`` (its rotors' limits are then limits too, without
reserve); ``best`` (the least time known for the course, and who found it how) and ``published`` (other figures of
others).
All in SI units.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import sqrt
from pathlib import Path
from typing import Any

import yaml

from minsnap import Ball, Boxes, Gate, Limits
from minsnap.vehicle import Quadrotor

FOLDER = Path(__file__).parent / "courses"


@dataclass(frozen=True)
class Figure:
    """A time that somebody found for a course."""

    seconds: float
    what: str


@dataclass(frozen=True, eq=False)
class Course:
    """A race: the arguments of its plan, its vehicle if it has one, and the times known of it."""

    name: str
    arguments: Mapping[str, Any]
    vehicle: Quadrotor | None
    best: Figure | None
    published: tuple[Figure, ...] = field(default=())

    @property
    def limits(self) -> Limits:
        return self.arguments["limits"]

    @property
    def checks(self) -> dict[str, Any]:
        """What ``minsnap.certify`` is to check of a plan."""
        found = {"corridor": self.arguments.get("corridor"), "limits": self.limits}
        if self.arguments["waypoints"] is not None:
            found["waypoints"] = self.arguments["waypoints"]
            found["tolerance"] = self.arguments.get("waypoint_tolerance", 0.0)
        return found


def names() -> list[str]:
    return sorted(path.stem for path in FOLDER.glob("*.yaml"))


def read_course(name: str) -> Course:
    """Read one of the courses by the name of its file."""
    data = yaml.safe_load((FOLDER / f"{name}.yaml").read_text(encoding="utf-8"))
    vehicle = _vehicle(data["vehicle"], data["name"]) if "vehicle" in data else None
    given = data["limits"]
    limits = Limits(**given) if vehicle is None else Limits.of(vehicle, reserve=0.0, **given)
    arguments = {"waypoints": _waypoints(data), "limits": limits}
    arguments |= {key: data[key] for key in ("start", "end", "yaw", "closed") if key in data}
    if "boxes" in data:
        arguments["corridor"] = Boxes(**data["boxes"])
    if "tube" in data:
        arguments["corridor"] = data["tube"]
    if "ball" in data:
        arguments["waypoint_tolerance"] = Ball(data["ball"])
    if "tolerance" in data:
        arguments["waypoint_tolerance"] = data["tolerance"]
    best = Figure(**data["best"]) if "best" in data else None
    return Course(data["name"], arguments, vehicle, best, tuple(Figure(**entry) for entry in data.get("published", ())))


def _waypoints(data: Mapping[str, Any]) -> list[Any] | None:
    gates = [Gate(**gate) for gate in data.get("gates", ())]
    if gates:
        return [*gates, gates[0]] if data.get("closed") else gates
    return data.get("waypoints")


def _vehicle(data: Mapping[str, Any], name: str) -> Quadrotor:
    least, most = data["rotor_thrust"]
    rest = {key: value for key, value in data.items() if key != "rotor_thrust"}
    speeds = (sqrt(thrust / data["thrust_coefficient"]) for thrust in (most, least))
    top, bottom = speeds
    return Quadrotor(**rest, rotor_speed_max=top, rotor_speed_min=bottom, name=name)
