"""Tracks of TOGT-Planner (YAML) as the content of our own course files.

Gates are polygons across the third axis of their frame, or balls; their margins are taken off the whole width, as the
planner's sources do (``src/shape``, ``src/corridor``). A gate of some ``length`` is a prism, entered where that axis
points.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, pi, radians, sin
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import is_number
from minsnap.basics.messages import shown
from minsnap.errors import FileError

STATES = {"vel": "velocity", "acc": "acceleration", "jer": "jerk"}
"""Derivatives at both ends, by TOGT-Planner's names and ours."""

SHORTEST = 1e-3
"""Length from which a gate is a prism [m]."""

KNOWN = {
    "TrianglePrisma": ("width", "height", "margin"),
    "RectanglePrisma": ("width", "height", "marginW", "marginH"),
    "PentagonPrisma": ("radius", "margin"),
    "HexagonPrisma": ("side", "margin"),
    "SingleBall": ("radius", "margin"),
}
"""Types of gates, and their sizes."""

PLACED = {"type", "name", "position", "rpy", "length", "midpoints", "stationary"}
"""What any gate has; ``midpoints`` are those of TOGT-Planner's polynomials."""


def is_togt_track(content: Mapping[str, Any]) -> bool:
    """Whether the content of a file is a track of TOGT-Planner."""
    return isinstance(content.get("orders"), list) and "initState" in content


def translated_togt(where: str, content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of our own course file: gates in their order, and the states at both ends.

    Raises
    ------
    FileError
        If it is malformed, or has what is not flown; says where.
    """
    ends: list[Any] = []
    states: dict[str, Any] = {}
    for ours, name in (("start", "initState"), ("end", "endState")):
        state = content.get(name)
        if not isinstance(state, Mapping):
            raise FileError(f"{where} has no {name}: give it")
        ends.append(_three(f"{where}: {name}: pos", state.get("pos")))
        known = {STATES[key]: _three(f"{where}: {name}: {key}", state[key]) for key in STATES if key in state}
        moving = {key: value for key, value in known.items() if any(value)}
        states |= {ours: moving} if moving else {}
    gates = [_gate(f"{where}: {name}", content.get(name)) for name in content["orders"]]
    return {"waypoints": [ends[0], *gates, ends[1]]} | states


def _gate(where: str, gate: Any) -> dict[str, Any]:
    """Return one gate: a ball, or the corners of its opening."""
    if not isinstance(gate, Mapping) or "position" not in gate:
        raise FileError(f"{where} is {shown(gate)}: give its type and its position")
    kind = str(gate.get("type"))
    if kind not in KNOWN:
        raise FileError(f"{where}: type is {shown(kind)}: {', '.join(KNOWN)} are read")
    for key in gate:
        if key not in PLACED and key not in KNOWN[kind]:
            raise FileError(f"{where}: {key} is not known of a {kind}: give {', '.join(KNOWN[kind])}")
    if gate.get("stationary", True) is not True:
        raise FileError(f"{where}: stationary is {shown(gate['stationary'])}: gates that stand still are read")
    center = _three(f"{where}: position", gate["position"])
    size = {key: _number(where, gate, key) for key in (*KNOWN[kind], "length")}
    for key in KNOWN[kind]:
        margin = f"margin{key[0].upper()}" if f"margin{key[0].upper()}" in size else "margin"
        if not key.startswith("margin") and not size[key] > size[margin]:
            raise FileError(
                f"{where}: {key} is {shown(gate.get(key))}: give one above the {margin} of {size[margin]:g} m"
            )
    if kind == "SingleBall":
        if size["length"]:
            raise FileError(f"{where}: length is {shown(gate['length'])}: a ball has none")
        return dict(zip("xyz", center, strict=True)) | {"ball": size["radius"] - size["margin"] / 2.0}
    opening = _opening(kind, size)
    turned = _rotation(*map(radians, _three(f"{where}: rpy", gate.get("rpy", [0.0, 0.0, 0.0]))))
    corners = np.array(center) + opening.corners @ turned[:, :2].T
    passed = {"crossing": -1, "straight": size["length"] / 2.0} if size["length"] > SHORTEST else {}
    return {"corners": np.round(corners, 12).tolist(), "margin": opening.margin} | passed


class _Opening(NamedTuple):
    """Corners of an opening in its plane, counter-clockwise, (n, 2), and how far a path stays from its edges [m]."""

    corners: FloatArray
    margin: float


def _opening(kind: str, size: Mapping[str, float]) -> _Opening:
    if kind == "PentagonPrisma":
        return _regular(5, size["radius"], 0.0, size["margin"])
    if kind == "HexagonPrisma":
        return _regular(6, size["side"], pi / 2.0, size["margin"])
    if kind == "TrianglePrisma":  # its sides move in unevenly
        height, width = ((size[key] - size["margin"]) / 2.0 for key in ("height", "width"))
        return _Opening(np.array([(-height, width), (-height, -width), (height, 0.0)]), 0.0)
    margin = min(size["marginW"], size["marginH"])
    width = (size["width"] - size["marginW"] + margin) / 2.0
    height = (size["height"] - size["marginH"] + margin) / 2.0
    corners = [(-height, width), (-height, -width), (height, -width), (height, width)]
    return _Opening(np.array(corners), margin / 2.0)


def _regular(count: int, radius: float, first: float, margin: float) -> _Opening:
    """Return a regular polygon whose corners move in by a margin, and with them its edges."""
    angles = first + 2.0 * pi * np.arange(count) / count
    return _Opening(radius * np.stack((np.cos(angles), np.sin(angles)), axis=1), margin * cos(pi / count))


def _rotation(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return the axes of a frame that is turned by yaw, pitch and roll, as columns."""
    about_z = np.array([(cos(yaw), -sin(yaw), 0.0), (sin(yaw), cos(yaw), 0.0), (0.0, 0.0, 1.0)])
    about_y = np.array([(cos(pitch), 0.0, sin(pitch)), (0.0, 1.0, 0.0), (-sin(pitch), 0.0, cos(pitch))])
    about_x = np.array([(1.0, 0.0, 0.0), (0.0, cos(roll), -sin(roll)), (0.0, sin(roll), cos(roll))])
    return np.asarray(about_z @ about_y @ about_x)


def _three(where: str, value: Any) -> list[float]:
    if not (isinstance(value, list) and len(value) == 3 and all(map(is_number, value))):
        raise FileError(f"{where} is {shown(value)}: give three numbers")
    return [float(number) for number in value]


def _number(where: str, gate: Mapping[str, Any], key: str) -> float:
    value = gate.get(key, 0.0)
    if not is_number(value) or value < 0.0:
        raise FileError(f"{where}: {key} is {shown(value)}: give a number, not negative [m]")
    return float(value)
