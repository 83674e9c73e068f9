"""Tracks of lsy_drone_racing (TOML) as the content of our own course files.

The file has the poses of gates and the places of poles; their sizes stand in the package's models: an opening of 0.4 m
in a frame 0.72 m wide, which stands on a post, and poles of 1.5 cm. A gate is passed along the x of its pose.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, hypot, sin
from typing import Any

from minsnap.basics.checks import is_number
from minsnap.basics.messages import shown
from minsnap.errors import FileError

OPENING, BAR, DEPTH, POST, POLE = 0.4, 0.16, 0.04, 0.05, 0.015
"""Side of the opening, width and depth of the bars, half-width of the post below, radius of a pole [m]."""

RADIUS = 0.08
"""How far from frames, posts and poles the center of a Crazyflie stays: it reaches 0.07 m with its rotors [m]."""

RUN_OUT = 0.5
"""How far behind the last gate the flight stops [m]."""

THROUGH = DEPTH / 2.0 + RADIUS
"""How far before and behind a gate the path is straight, so that it does not touch its plane and turn back [m]."""

UPRIGHT = 1e-6
"""Roll and pitch above which a gate does not stand upright [rad]."""


def translated_track(where: str, content: Any) -> dict[str, Any]:
    """Return the content of our own course file for that of a configuration of lsy_drone_racing.

    Raises
    ------
    FileError
        If it has no track, or the track is malformed; says where.
    """
    track = content.get("env", {}).get("track") if isinstance(content.get("env", {}), Mapping) else None
    if not isinstance(track, Mapping) or not track.get("gates"):
        raise FileError(f"{where} has no [[env.track.gates]]: a course in TOML is one of lsy_drone_racing")
    where = f"{where}: env.track"
    size = track.get("gate_size", {})
    width, height = (_number(f"{where}.gate_size.{name}", size.get(name, OPENING)) for name in ("width", "height"))
    gates, posts, poles = [], list[dict[str, Any]](), list[dict[str, Any]]()
    for number, gate in enumerate(_rows(where, track, "gates")):
        named = f"{where}.gates {number}"
        center, (roll, pitch, yaw) = _three(f"{named}: pos", gate.get("pos")), _three(f"{named}: rpy", gate.get("rpy"))
        if max(abs(roll), abs(pitch)) > UPRIGHT:
            raise FileError(f"{named} has roll or pitch: gates that stand upright are read")
        gates.append(
            {
                "center": center,
                "normal": [cos(yaw), sin(yaw), 0.0],
                "crossing": 1,
                "straight": THROUGH,
                "width": width,
                "height": height,
            }
        )
        foot = center[2] - height / 2.0 - BAR
        posts += [{"cylinder": [*center[:2], hypot(POST, POST) + RADIUS, -1.0, foot]}] * (foot > -1.0)
    for number, pole in enumerate(_rows(where, track, "obstacles")):
        place = _three(f"{where}.obstacles {number}: pos", pole.get("pos"))
        poles.append({"cylinder": [*place[:2], POLE + RADIUS, -1.0, place[2] + POLE + RADIUS]})
    drones = _rows(where, track, "drones")
    starts = [
        {"x": x, "y": y, "z": z} for x, y, z in (_three(f"{where}.drones 0: pos", one.get("pos")) for one in drones[:1])
    ]
    return {
        "waypoints": [*starts, *gates, _behind(gates[-1], track.get("safety_limits"), where)],
        "frame": BAR,
        "frame_depth": DEPTH,
        "margin": RADIUS,
        "avoid": poles + posts + _fence(where, track),
    }


def _behind(gate: Mapping[str, Any], bounds: Any, where: str) -> dict[str, float]:
    """Return where the flight stops: behind the last gate, and inside the bounds."""
    place = [middle + RUN_OUT * along for middle, along in zip(gate["center"], gate["normal"], strict=True)]
    if isinstance(bounds, Mapping):
        low, high = _bounds(where, bounds)
        place = [min(max(x, a + RADIUS), b - RADIUS) for x, a, b in zip(place, low, high, strict=True)]
    return dict(zip("xyz", place, strict=True))


def _bounds(where: str, bounds: Mapping[str, Any]) -> tuple[list[float], list[float]]:
    """Return the corners of the box beyond which a race ends."""
    low, high = (_three(f"{where}.safety_limits.{n}", bounds.get(n)) for n in ("pos_limit_low", "pos_limit_high"))
    return low, high


def _fence(where: str, track: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the bounds beyond which a race ends."""
    bounds = track.get("safety_limits")
    if not isinstance(bounds, Mapping):
        return []
    low, high = _bounds(where, bounds)
    corners = [low[0], low[1], high[0], low[1], high[0], high[1], low[0], high[1]]
    return [{"fence": [4, *corners, low[2], high[2]]}]


def _rows(where: str, track: Mapping[str, Any], name: str) -> list[Mapping[str, Any]]:
    rows = track.get(name, [])
    if not isinstance(rows, list) or not all(isinstance(row, Mapping) for row in rows):
        raise FileError(f"{where}.{name} is {shown(rows)}: give [[env.track.{name}]]")
    return rows


def _three(where: str, value: Any) -> list[float]:
    if not (isinstance(value, list) and len(value) == 3 and all(map(is_number, value))):
        raise FileError(f"{where} is {shown(value)}: give three numbers")
    return [float(number) for number in value]


def _number(where: str, value: Any) -> float:
    if not is_number(value) or not value > 0.0:
        raise FileError(f"{where} is {shown(value)}: give a positive number [m]")
    return float(value)
