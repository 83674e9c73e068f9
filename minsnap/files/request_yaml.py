"""Requests of plans in YAML: the file that ``minsnap plan`` and the studio read, and that the studio writes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from minsnap.basics.arrays import plain
from minsnap.basics.schema import (
    BOX,
    FLAG,
    HEADING,
    NUMBER,
    POINT,
    TEXT,
    WHOLE,
    Form,
    Key,
    either,
    mapping,
    several,
    word,
)
from minsnap.basics.storage.atomic import write_file
from minsnap.basics.storage.text import FileName, load_yaml
from minsnap.corridors.given_waypoints import Waypoints
from minsnap.corridors.keep_out import NAMED
from minsnap.durations.search_options import USUAL, WORDS
from minsnap.errors import FileError, FrameError
from minsnap.files.file_request import FileRequest, Opening
from minsnap.files.frames import FRAMES, get_frame, map_vectors, map_yaw
from minsnap.files.limits_yaml import LIMITS, PRESET, RESERVE, limit_fields
from minsnap.files.waypoints import COLUMNS, ENTRY, read_waypoints, waypoints_of
from minsnap.limits.ordinary import written_in_file
from minsnap.planning.request import plan_arguments

LOOP = Form(
    "px4, ardupilot, a YAML file of a loop, or its fields by name",
    lambda value: isinstance(value, (str, dict)),
    lambda where, value: value,
    {"type": ["string", "object"]},
)
"""A control loop: a preset, a file beside the one that names it, or the fields of a Loop."""


def tracking_of(where: str, content: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return the loop that a file names under ``tracking`` as a field; nothing where it names none.

    Raises
    ------
    FileError, VehicleError
        As :func:`minsnap.vehicle.loop_of`.
    """
    from minsnap.vehicle.loop import loop_of

    named = content.get("tracking")
    return {} if named is None else {"tracking": loop_of(named, where, folder)}


WIDTHS = either(NUMBER, several(NUMBER, "one number per leg"))

CORNERS = BOX.then(lambda corners: [number for corner in corners for number in corner])
"""A cuboid by two corners, as a room is."""


def _obstacle_form(name: str) -> Form:
    _, what, counts = NAMED[name]
    numbers = several(NUMBER, what, min(counts, default=5), max(counts, default=None))
    return either(numbers, CORNERS) if name == "cuboid" else numbers


OBSTACLE = mapping(
    {name: Key(_obstacle_form(name), f"{what} [m]") for name, (_, what, _) in NAMED.items()},
    f"a mapping of {', '.join(NAMED)} to numbers",
)
OBSTACLES = several(OBSTACLE, "a list of obstacles").then(
    lambda entries: tuple(named for entry in entries for named in entry.items())
)

OPENING = mapping(
    {
        "waypoint": Key(WHOLE, "which one, from 0", needed=True),
        "corners": Key(several(POINT, "three corners or more", 3), "of a convex polygon, in order [m]", needed=True),
        "crossing": Key(WHOLE, "1 along the normal, -1 against it, 0 either way"),
        "margin": Key(NUMBER, "how far the path stays from the edges [m]"),
    },
    "a mapping of waypoint, corners, crossing and margin",
).then(lambda gate: Opening(**gate))

SEARCHED = {
    "split": Key(word(*WORDS["split"]), "how a total time is divided among the legs"),
    "time_weight": Key(NUMBER, "price of a second"),
    "time_limit": Key(NUMBER, "after which the search ends with its best plan [s]"),
}
"""Fields of ``Search``."""

FURTHER = {
    "total_time": Key(NUMBER, "of all legs together [s]"),
    "limits": Key(LIMITS, "where they choose the time, the ordinary ones hold too unless they are null"),
    "corridor": Key(WIDTHS, "half-width around each leg [m], one for all or one per leg"),
    "boxes": Key(several(BOX, "two corners for each leg"), "in which each leg stays [m]"),
    "room": Key(BOX, "in which all legs stay [m]"),
    "avoid": Key(OBSTACLES, "what the path keeps out of"),
    "openings": Key(several(OPENING, "a list of gates"), "gates in the place of waypoints, which are their centers"),
    "waypoint_tolerance": Key(NUMBER, "half-width of the box around each inner waypoint [m]"),
    "degree": Key(WHOLE, "of the polynomials"),
    "continuity": Key(WHOLE, "derivatives that are continuous at the waypoints"),
    "pieces": Key(either(word("auto"), WHOLE), "polynomials per leg"),
    "closed": Key(FLAG, "a lap"),
    "solver": Key(TEXT, "by its qpsolvers name, or auto"),
    "tracking": Key(LOOP, "of the vehicle, which then keeps what the plan keeps"),
    "wind": Key(NUMBER, "with tracking: by how much it changes at most [m/s]"),
    **SEARCHED,
    "view": Key(
        mapping({"frame": Key(word(*FRAMES)), "vehicle": Key(PRESET)}, "a mapping of frame and vehicle"),
        "axes and vehicle of the studio, which do not change the plan",
    ),
}
"""Keys of a request beyond those of a waypoint file: fields of ``FileRequest``, which batches have too."""

PLAIN = {
    "yaw": Key(either(HEADING, several(NUMBER, "one number per waypoint")), "[rad], or velocity, tilt or free"),
    "durations": Key(several(NUMBER, "one number per leg"), "of the legs [s]"),
}
"""Keys that a waypoint file has too."""

POINTS = Key(several(either(POINT, ENTRY), "a list of waypoints"), "[m]", needed=True)
REQUEST = mapping({"waypoints": POINTS, **PLAIN, **FURTHER}, "a mapping with waypoints")
"""The whole file."""

SHARED = {name: FURTHER[name] for name in ("limits", "closed", "avoid", "degree", "pieces", "tracking", "wind")}
"""Keys that courses have too; theirs of the name ``boxes`` is a mapping."""


def vehicle_files(path: FileName) -> tuple[Path, ...]:
    """Return the files that a YAML file names beside it: of vehicles, for its rotors or its course, and of a loop."""
    content = load_yaml(path) if Path(path).suffix.lower() in (".yaml", ".yml") else None
    if not isinstance(content, dict):
        return ()
    limits = content.get("limits")
    rotors = limits.get("rotors") if isinstance(limits, dict) else None
    named = [content.get("vehicle"), rotors.get("vehicle") if isinstance(rotors, dict) else None]
    named.append(content.get("tracking"))
    return tuple(Path(path).parent / name for name in named if isinstance(name, str))


def is_request(content: Any) -> bool:
    """Whether the content of a YAML file says how to plan, as the studio writes it, with a key that no course has.

    With obstacles, a degree or pieces it does so, too, where it has nothing that only courses have.
    """
    if not isinstance(content, dict):
        return False
    known = content.keys() & (FURTHER.keys() - SHARED.keys())
    if known:
        return known != {"boxes"} or isinstance(content["boxes"], list)
    either = content.keys() & (SHARED.keys() - {"limits", "closed"})
    return bool(either) and content.keys() <= REQUEST.json["properties"].keys() and has_points(content["waypoints"])


def has_points(waypoints: Any) -> bool:
    """Whether waypoints are points, with a heading and a duration perhaps, and none is a gate or a stop."""
    entries = waypoints if isinstance(waypoints, list) else []
    return all(set(entry) <= set(COLUMNS) for entry in entries if isinstance(entry, dict))


def read_request(path: FileName, origin: Sequence[float] | None = None) -> FileRequest:
    """Read a waypoint file, or a YAML file that says how to plan through its waypoints, too.

    The keys of such a file are those of :data:`REQUEST`; ``limits`` that choose the time are completed by the ordinary
    ones (:mod:`minsnap.limits.ordinary`), and their ``rotors`` are ``{vehicle: crazyflie, reserve: 0.1}``.

    Parameters
    ----------
    path : str or path
        CSV, YAML or a mission, by its ending.
    origin : sequence of 3 float, optional
        Latitude, longitude [degrees] and altitude [m] of (0, 0, 0), for files by latitude and longitude.

    Returns
    -------
    FileRequest
        With the waypoints of the file; durations are None where it has none.

    Raises
    ------
    FileError
        If the file is malformed; says where.
    """
    if Path(path).suffix.lower() not in (".yaml", ".yml"):
        return _from_waypoints(read_waypoints(path, origin))
    content = load_yaml(path)
    if not isinstance(content, dict):
        return _from_waypoints(waypoints_of(f"{path}", content))
    plain = {key: value for key, value in content.items() if key not in FURTHER}
    heading = plain.pop("yaw") if HEADING.fits(plain.get("yaw")) else None
    request = _from_waypoints(waypoints_of(f"{path}", plain))
    request = request if heading is None else replace(request, yaw=HEADING.read("yaw", heading))
    return _with_further(f"{path}", request, content, Path(path).parent)


def write_request(request: FileRequest, path: FileName, *, clobber: bool = True) -> None:
    """Write a request as YAML in one atomic step; reading it returns an equal request.

    Raises
    ------
    FileError
        If the destination cannot be written.
    """
    write_file(path, request_text(request), clobber=clobber)


def request_text(request: FileRequest) -> str:
    """Return a request as YAML text; numbers are written so that they read back exactly."""
    import yaml

    return str(yaml.safe_dump(_described(request), sort_keys=False, default_flow_style=None, width=120))


def _described(request: FileRequest) -> dict[str, Any]:
    """Return the keys of a request that differ from their defaults, and what shapes the curve."""
    limits: dict[str, Any] = dict(request.limits)
    if request.rotors is None and request.durations is None and request.total_time is None:
        limits = written_in_file(limits)
    if request.rotors is not None:
        limits["rotors"] = {"vehicle": request.vehicle, "reserve": request.rotors}
    view = {"frame": request.frame} | ({"vehicle": request.vehicle} if request.vehicle else {})
    avoid = [{name: list(numbers)} for name, numbers in request.avoid]
    gates = [gate._asdict() for gate in request.openings]
    usual = vars(FileRequest(())) | vars(USUAL) | {"limits": {}, "avoid": [], "openings": [], "view": None}
    usual |= {"degree": None, "pieces": None, "closed": None}
    loop = None if request.tracking is None else request.tracking.description()
    own = {"limits": limits, "avoid": avoid, "openings": gates, "view": view, "tracking": loop}
    values = vars(request) | vars(request.search or USUAL) | own
    return {name: plain(values[name]) for name in ("waypoints", *PLAIN, *FURTHER) if values[name] != usual[name]}


def _from_waypoints(points: Waypoints) -> FileRequest:
    rows = tuple(tuple(row) for row in points.points.tolist())
    durations = None if points.durations is None else tuple(points.durations.tolist())
    yaw, limits = None if points.yaw is None else tuple(points.yaw.tolist()), dict[str, Any]()
    if points.speeds is not None:
        limits = limit_fields({"speed": tuple(points.speeds.tolist())}, timed=durations is not None)
    return FileRequest(rows, durations, yaw=yaw, limits=tuple(limits.items()))


def _with_further(where: str, request: FileRequest, content: Mapping[str, Any], folder: Path) -> FileRequest:
    """Return the request with the keys of ``FURTHER``, each checked for its form; files it names are in a folder."""
    changes: dict[str, Any] = {
        key: FURTHER[key].form.read(f"{where}: {key}", content[key]) for key in FURTHER if content.get(key) is not None
    }
    changes |= tracking_of(f"{where}: tracking", changes, folder)
    if "limits" in changes:
        timed = request.durations is not None or "total_time" in changes
        changes |= _limits(f"{where}: limits", changes.pop("limits"), timed)
    widths, ends = changes.get("corridor"), (request.waypoints[0], request.waypoints[-1])
    if isinstance(widths, float):
        changes["corridor"] = (widths,) * max(request.legs, 1)
    elif widths is not None and len(widths) != request.legs and not (changes.get("closed") and ends[0] != ends[1]):
        count = f"{len(widths)} numbers for {request.legs} legs"
        raise FileError(f"{where}: corridor has {count}: give one, or one per leg")
    return replace(request, **plan_arguments({"yaw": request.yaw} | changes.pop("view", {}) | changes))


def _limits(where: str, content: Mapping[str, Any], timed: bool) -> dict[str, Any]:
    """Return the limits of a request, and whose rotors are kept."""
    fields: dict[str, Any] = {"limits": tuple(limit_fields(content, timed=timed).items())}
    rotors = content.get("rotors")
    if rotors is None:
        return fields
    preset = PRESET.read(f"{where}: rotors: vehicle", rotors["vehicle"])
    return fields | {"vehicle": preset, "rotors": rotors.get("reserve", RESERVE)}


def in_enu(request: FileRequest, frame: str) -> FileRequest:
    """Return a request whose waypoints and headings are in the axes of a frame.

    Raises
    ------
    FrameError
        If the frame is unknown, needs three coordinates, or walls would have to be mapped.
    """
    axes = get_frame(frame)
    if axes.name == "enu":
        return request
    if len(request.waypoints[0]) != 3:
        raise FrameError(
            f"waypoints of {len(request.waypoints[0])} coordinates are in ENU: give x, y and z for {frame}"
        )
    if request.boxes is not None or request.room is not None or request.avoid or request.openings:
        raise FrameError(
            "boxes, a room, obstacles and gates are in ENU: give the waypoints in ENU too, or leave the walls out"
        )
    points = tuple(tuple(row) for row in map_vectors(request.waypoints, axes, "enu").tolist())
    yaw = request.yaw
    if yaw is not None and not isinstance(yaw, str):
        mapped = map_yaw(yaw, axes, "enu").tolist()
        yaw = tuple(mapped) if request.turns else mapped
    return replace(request, waypoints=points, yaw=yaw)
