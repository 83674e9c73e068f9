"""Requests of plans in YAML: the file that ``minsnap plan`` and the studio read, and that the studio writes."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from minsnap.basics.checks import is_whole
from minsnap.basics.messages import shown
from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.reading import finite_number
from minsnap.basics.storage.text import load_yaml
from minsnap.errors import FileError
from minsnap.files.frames import FRAMES
from minsnap.files.plan_request import RESERVE, SHORT_NAMES, VEHICLES, Box, Point, SceneRequest
from minsnap.files.waypoints import Waypoints, read_waypoints, waypoints_of
from minsnap.limits.kinds import KIND
from minsnap.limits.ordinary import completed_in_file, written_in_file

FURTHER = ("total_time", "limits", "corridor", "boxes", "room", "degree", "continuity", "pieces", "closed", "view")
"""Keys of a request beyond those of a waypoint file."""

LIMITS = tuple(name for name, kind in KIND.items() if kind.measure != "rotors")
"""Names under ``limits``, besides ``rotors``."""


ITS_OWN = ("total_time", "corridor", "room", "degree", "continuity", "pieces", "view")
"""Keys that only requests have, and courses do not."""


def is_request(path: str | os.PathLike[str]) -> bool:
    """Whether a YAML file says how to plan, as the studio writes it, with a key that no course has."""
    said = load_yaml(path)
    return isinstance(said, dict) and any(key in said for key in ITS_OWN)


def read_request(path: str | os.PathLike[str]) -> SceneRequest:
    """Read a waypoint file, or a YAML file that says how to plan through its waypoints, too.

    Beside ``waypoints``, ``yaw`` and ``durations`` such a file may have: ``total_time`` [s]; ``limits``, a mapping of
    the fields of :class:`~minsnap.Limits`, and ``rotors: {vehicle: crazyflie, reserve: 0.1}``; where they choose the
    time, the ordinary ones hold too unless they are ``null`` (:mod:`minsnap.limits.ordinary`); ``corridor``, one
    half-width or one per leg [m]; ``boxes``, two corners per leg; ``room``, two corners; ``degree``, ``continuity``,
    ``pieces``, ``closed``; and ``view`` with the ``frame`` and the ``vehicle`` of the studio, which do not change the
    plan. ``yaw`` may also be one angle [rad], ``velocity`` or ``tilt``.

    Parameters
    ----------
    path : str or path
        CSV, YAML or a QGroundControl plan, by its ending.

    Returns
    -------
    SceneRequest
        With the waypoints of the file; durations are None where it has none.

    Raises
    ------
    FileError
        If the file is malformed; says where.
    """
    if Path(path).suffix.lower() not in (".yaml", ".yml"):
        return _from_waypoints(read_waypoints(path))
    content = load_yaml(path)
    if not isinstance(content, dict):
        return _from_waypoints(waypoints_of(f"{path}", content))
    plain = {key: value for key, value in content.items() if key not in FURTHER}
    word = plain.pop("yaw") if _is_one_heading(plain.get("yaw")) else None
    found = _from_waypoints(waypoints_of(f"{path}", plain))
    found = found if word is None else replace(found, yaw=word if isinstance(word, str) else float(word))
    return _with_further(f"{path}", found, content)


def write_request(request: SceneRequest, path: str | os.PathLike[str], *, clobber: bool = True) -> None:
    """Write a request as YAML in one atomic step; reading it returns an equal request.

    Raises
    ------
    FileError
        If the destination cannot be written.
    """
    text = request_text(request)
    with atomic_write(path, clobber=clobber) as file:
        file.write(text)


def request_text(request: SceneRequest) -> str:
    """Return a request as YAML text; numbers are written so that they read back exactly."""
    import yaml

    return str(yaml.safe_dump(_described(request), sort_keys=False, default_flow_style=None, width=120))


def _described(request: SceneRequest) -> dict[str, Any]:
    """Return what a request says, without what is left to its defaults."""
    limits: dict[str, Any] = dict(request.limits)
    if request.rotors is None and request.durations is None and request.total_time is None:
        limits = written_in_file(limits)
    if request.rotors is not None:
        limits["rotors"] = {"vehicle": request.vehicle, "reserve": request.rotors}
    boxes = None if request.boxes is None else _lists(request.boxes)
    room = None if request.room is None else _lists(request.room)
    corridor = None if request.corridor is None else list(request.corridor)
    told: dict[str, Any] = {"waypoints": _lists(request.waypoints), "yaw": _lists(request.yaw)}
    told |= {"durations": _lists(request.durations), "total_time": request.total_time, "limits": limits or None}
    told |= {"corridor": corridor, "boxes": boxes, "room": room, "degree": request.degree}
    told |= {"continuity": request.continuity, "pieces": request.pieces, "closed": request.closed}
    told["view"] = {"frame": request.frame} | ({"vehicle": request.vehicle} if request.vehicle else {})
    return {name: value for name, value in told.items() if value is not None}


def _lists(value: Any) -> Any:
    return [_lists(entry) for entry in value] if isinstance(value, tuple) else value


def _from_waypoints(found: Waypoints) -> SceneRequest:
    rows = tuple(tuple(row) for row in found.points.tolist())
    durations = None if found.durations is None else tuple(found.durations.tolist())
    return SceneRequest(rows, durations, yaw=None if found.yaw is None else tuple(found.yaw.tolist()))


def _is_one_heading(value: Any) -> bool:
    return value in ("velocity", "tilt") or (isinstance(value, (int, float)) and not isinstance(value, bool))


def _with_further(where: str, found: SceneRequest, content: Mapping[str, Any]) -> SceneRequest:
    """Return the request with the keys of ``FURTHER``, each checked for its form."""
    given = {key: content[key] for key in FURTHER if content.get(key) is not None}
    changes: dict[str, Any] = {}
    if "total_time" in given:
        changes["total_time"] = finite_number(f"{where}: total_time", given["total_time"])
    if "limits" in given:
        timed = found.durations is not None or "total_time" in given
        changes |= _limits(f"{where}: limits", given["limits"], timed)
    if "corridor" in given:
        changes["corridor"] = _widths(f"{where}: corridor", given["corridor"], found.legs)
    if "boxes" in given:
        changes["boxes"] = tuple(_box(f"{where}: box {i}", box) for i, box in enumerate(_list(where, given["boxes"])))
    if "room" in given:
        changes["room"] = _box(f"{where}: room", given["room"])
    changes |= {name: _whole(f"{where}: {name}", given[name]) for name in ("degree", "continuity") if name in given}
    if "pieces" in given:
        changes["pieces"] = "auto" if given["pieces"] == "auto" else _whole(f"{where}: pieces", given["pieces"])
    if "closed" in given:
        changes["closed"] = _truth(f"{where}: closed", given["closed"])
    return replace(found, **_view(f"{where}: view", given.get("view", {})) | changes)


def _limits(where: str, given: Any, timed: bool) -> dict[str, Any]:
    """Return the limits of a request, completed where they choose the time."""
    if not isinstance(given, dict) or not set(given) <= {*LIMITS, "rotors"}:
        raise FileError(f"{where} is {shown(given)}: give a mapping of {', '.join(LIMITS)} or rotors")
    plain = {str(k): v if v is None else finite_number(f"{where}: {k}", v) for k, v in given.items() if k != "rotors"}
    if "rotors" in given or timed:
        found: dict[str, Any] = {"limits": tuple((name, value) for name, value in plain.items() if value is not None)}
        return found | (_rotors(f"{where}: rotors", given["rotors"]) if "rotors" in given else {})
    return {"limits": tuple(completed_in_file(plain).items())}


def _rotors(where: str, given: Any) -> dict[str, Any]:
    if not isinstance(given, dict) or not set(given) <= {"vehicle", "reserve"} or "vehicle" not in given:
        raise FileError(f"{where} is {shown(given)}: give a mapping of vehicle and reserve")
    reserve = finite_number(f"{where}: reserve", given.get("reserve", RESERVE))
    return {"vehicle": _preset(f"{where}: vehicle", given["vehicle"]), "rotors": reserve}


def _preset(where: str, given: Any) -> str:
    short = SHORT_NAMES.get(given, given) if isinstance(given, str) else given
    return _one_of(where, short, VEHICLES)


def _view(where: str, given: Any) -> dict[str, Any]:
    if not isinstance(given, dict) or not set(given) <= {"frame", "vehicle"}:
        raise FileError(f"{where} is {shown(given)}: give a mapping of frame and vehicle")
    known = {"frame": tuple(FRAMES), "vehicle": VEHICLES}
    return {name: _one_of(f"{where}: {name}", value, known[name]) for name, value in given.items()}


def _widths(where: str, given: Any, legs: int) -> tuple[float, ...]:
    if isinstance(given, list):
        return tuple(finite_number(f"{where} {i}", width) for i, width in enumerate(given))
    return (finite_number(where, given),) * max(legs, 1)


def _box(where: str, given: Any) -> Box:
    if not isinstance(given, list) or len(given) != 2:
        raise FileError(f"{where} is {shown(given)}: give two corners, such as [[0, 0, 0], [4, 4, 3]]")
    lower, upper = (_point(where, corner) for corner in given)
    return lower, upper


def _point(where: str, given: Any) -> Point:
    return tuple(finite_number(where, value) for value in _list(where, given))


def _list(where: str, given: Any) -> list[Any]:
    if not isinstance(given, list):
        raise FileError(f"{where}: {shown(given)} is not a list")
    return given


def _one_of(where: str, given: Any, known: tuple[str, ...]) -> str:
    if given not in known:
        raise FileError(f"{where} is {shown(given)}: choose one of {', '.join(known)}")
    return str(given)


def _whole(where: str, given: Any) -> int:
    if not is_whole(given):
        raise FileError(f"{where} is {shown(given)}, not a whole number")
    return int(given)


def _truth(where: str, given: Any) -> bool:
    if not isinstance(given, bool):
        raise FileError(f"{where} is {shown(given)}: write true or false")
    return given
