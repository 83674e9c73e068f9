"""Requests of plans in YAML: the file that ``minsnap plan`` and the studio read, and that the studio writes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import sqrt
from pathlib import Path
from typing import Any

from minsnap.basics.arrays import plain
from minsnap.basics.limit_kinds import KINDS
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
from minsnap.files.frames import FRAMES, get_frame, map_vectors, map_yaw
from minsnap.files.waypoints import COLUMNS, ENTRY, read_waypoints, waypoints_of
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.limits.ordinary import POWER, completed, written_in_file
from minsnap.planning.request import RESERVE, Opening, PlanRequest
from minsnap.vehicle.quadrotor import SHORT_NAMES, VEHICLES, Quadrotor, named_vehicle, vehicle_from

PRESET = word(*VEHICLES, short=SHORT_NAMES)
"""How a file names a preset of a vehicle."""

DESCRIBED = Form(
    "its fields by name, or a YAML file that does, or one of " + ", ".join(VEHICLES),
    lambda value: isinstance(value, (str, dict)),
    lambda where, value: value,
    {"type": ["string", "object"]},
)
"""A vehicle: a preset, a file beside the one that names it, the fields of a Quadrotor, or those of ``THRUST``."""

THRUST = mapping(
    {
        "mass": Key(NUMBER, "[kg]", needed=True),
        "max_thrust": Key(NUMBER, "of all rotors together [N]", needed=True),
        "min_thrust": Key(NUMBER, "the least [N]"),
        "body_rate": Key(NUMBER, "roll and pitch rate together [rad/s]"),
        "yaw_rate": Key(NUMBER, "[rad/s]"),
    },
    "a mapping of mass, max_thrust and rates",
)
"""A vehicle of which no more is known than what it lifts, and how fast it turns."""

ROTORS = mapping(
    {
        "vehicle": Key(either(PRESET, DESCRIBED), "whose rotors", needed=True),
        "reserve": Key(NUMBER, "share of their room that is left to feedback, in [0, 1)"),
    },
    "a mapping of vehicle and reserve",
)

OFF = Form("null, which takes a limit off", lambda value: value is None, lambda where, value: None, {"type": "null"})

SPEED = either(NUMBER, several(NUMBER, "one of each leg", 1), OFF)

LIMIT_KEYS = {
    kind.name: Key(SPEED if kind.name == "speed" else either(NUMBER, OFF), f"[{kind.typed_unit}]")
    for kind in KINDS
    if kind.measure != "rotors"
}
"""The limits that are numbers, and the speed of each leg."""

HOW = {"norm": Key(word("euclidean", "axis")), "gravity": Key(NUMBER, "[m/s^2]")}

LIMITS = mapping(
    LIMIT_KEYS | HOW | {"rotors": Key(ROTORS, "keep the thrust of each rotor within its range")},
    "a mapping of limits by name, such as {speed: 3}",
)
"""How a file says limits: those of ``LIMIT_KEYS``, and how they are kept."""


def complete(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return limits that choose the time with the ordinary ones that are neither named nor null."""
    options = {name: value for name, value in content.items() if name in HOW}
    return completed({name: value for name, value in content.items() if name not in HOW}, (POWER,)) | options


def without_null(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the limits that are not null."""
    return {name: value for name, value in content.items() if value is not None}


def limits_of(where: str, content: Any, folder: Path) -> Limits:
    """Return exactly the limits that a mapping names, those of a vehicle's rotors among them; its file is in a folder.

    Raises
    ------
    FileError
        If a name is not known, or a value has another form.
    LimitError, VehicleError
        If a limit cannot be kept, or a vehicle cannot fly.
    """
    values = without_null(LIMITS.read(where, content))
    rotors = values.pop("rotors", None)
    if rotors is None:
        return Limits(**values)
    return vehicle_limits(where, rotors["vehicle"], folder, {"reserve": rotors.get("reserve", RESERVE)} | values)


def vehicle_limits(where: str, vehicle: Any, folder: Path, others: Mapping[str, Any], name: str = "vehicle") -> Limits:
    """Return the limits of a described vehicle, combined with others; a mapping with ``max_thrust`` has no rotors.

    Raises
    ------
    FileError, LimitError, VehicleError
        As :func:`limits_of`.
    """
    if isinstance(vehicle, Mapping) and "max_thrust" in vehicle:
        return Limits.of_mass(**{**THRUST.read(f"{where}: vehicle", vehicle), **others})
    return Limits.of(vehicle_of(vehicle, folder, name), **others)


def read_limits(path: FileName) -> Limits:
    """Return exactly the limits that a YAML file names under ``limits``, whatever else it holds.

    Raises
    ------
    FileError
        If it cannot be read, or has none.
    LimitError, VehicleError
        As :func:`limits_of`.
    """
    content = load_yaml(path)
    if not isinstance(content, dict) or not content.get("limits"):
        raise FileError(f"{path} has no limits: give a file as minsnap limits -o writes it")
    return limits_of(f"{path}: limits", content["limits"], Path(path).parent)


def besides_rotors(limits: VehicleLimits) -> dict[str, Any]:
    """Return the limits that a vehicle's own were combined with, by name."""
    own = type(limits).of(limits.vehicle, limits.reserve).given()
    return {name: value for name, value in limits.named().items() if own.get(name) != value}


def vehicle_of(content: Any, folder: Path, name: str = "vehicle") -> Quadrotor:
    """Return the vehicle of a preset, of a file in a folder, or of a mapping of its fields.

    The rotors of a mapping may be described by their least and largest thrust, ``rotor_thrust`` [N].
    """
    if isinstance(content, str):
        preset = content in VEHICLES or content in SHORT_NAMES or not Path(content).suffix
        return named_vehicle(content) if preset else Quadrotor.from_yaml(folder / content)
    rest = {key: value for key, value in content.items() if key != "rotor_thrust"}
    if "rotor_thrust" in content and "thrust_coefficient" in content:
        least, most = (sqrt(thrust / content["thrust_coefficient"]) for thrust in content["rotor_thrust"])
        rest |= {"rotor_speed_min": least, "rotor_speed_max": most}
    return vehicle_from({"name": name} | rest)


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
    return {} if named is None else {"tracking": loop_of(LOOP.read(where, named), where, folder)}


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
"""Keys of a request beyond those of a waypoint file: fields of ``PlanRequest``, which batches have too."""

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


def read_request(path: FileName, origin: Sequence[float] | None = None) -> PlanRequest:
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
    PlanRequest
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


def write_request(request: PlanRequest, path: FileName, *, clobber: bool = True) -> None:
    """Write a request as YAML in one atomic step; reading it returns an equal request.

    Raises
    ------
    FileError
        If the destination cannot be written.
    """
    write_file(path, request_text(request), clobber=clobber)


def request_text(request: PlanRequest) -> str:
    """Return a request as YAML text; numbers are written so that they read back exactly."""
    import yaml

    return str(yaml.safe_dump(_described(request), sort_keys=False, default_flow_style=None, width=120))


def _described(request: PlanRequest) -> dict[str, Any]:
    """Return the keys of a request that differ from their defaults, and what shapes the curve."""
    limits: dict[str, Any] = dict(request.limits)
    if request.rotors is None and request.durations is None and request.total_time is None:
        limits = written_in_file(limits)
    if request.rotors is not None:
        limits["rotors"] = {"vehicle": request.vehicle, "reserve": request.rotors}
    view = {"frame": request.frame} | ({"vehicle": request.vehicle} if request.vehicle else {})
    avoid = [{name: list(numbers)} for name, numbers in request.avoid]
    gates = [gate._asdict() for gate in request.openings]
    usual = vars(PlanRequest(())) | vars(USUAL) | {"limits": {}, "avoid": [], "openings": [], "view": None}
    usual |= {"degree": None, "pieces": None, "closed": None}
    loop = None if request.tracking is None else request.tracking.description()
    own = {"limits": limits, "avoid": avoid, "openings": gates, "view": view, "tracking": loop}
    values = vars(request) | vars(request.search or USUAL) | own
    return {name: plain(values[name]) for name in ("waypoints", *PLAIN, *FURTHER) if values[name] != usual[name]}


def _from_waypoints(points: Waypoints) -> PlanRequest:
    rows = tuple(tuple(row) for row in points.points.tolist())
    durations = None if points.durations is None else tuple(points.durations.tolist())
    yaw, limits = None if points.yaw is None else tuple(points.yaw.tolist()), dict[str, Any]()
    if points.speeds is not None:
        speeds: Any = tuple(points.speeds.tolist())
        limits = {"speed": speeds} if durations is not None else completed({"speed": speeds})
    return PlanRequest(rows, durations, yaw=yaw, limits=tuple(limits.items()))


def _with_further(where: str, request: PlanRequest, content: Mapping[str, Any], folder: Path) -> PlanRequest:
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
    return request.changed(**changes.pop("view", {}) | changes)


def _limits(where: str, content: dict[str, Any], timed: bool) -> dict[str, Any]:
    """Return the limits of a request, completed where they choose the time, and whose rotors are kept."""
    rotors = content.pop("rotors", None)
    kept = without_null(content) if timed or rotors else complete(content)
    fields: dict[str, Any] = {"limits": tuple(kept.items())}
    if rotors is None:
        return fields
    preset = PRESET.read(f"{where}: rotors: vehicle", rotors["vehicle"])
    return fields | {"vehicle": preset, "rotors": rotors.get("reserve", RESERVE)}


def in_enu(request: PlanRequest, frame: str) -> PlanRequest:
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
