"""Plans as JSON or YAML: the exact polynomials, and the arguments of the plan.

Numbers are written with enough digits to read back the same float64, so the curve that is read equals the planned one.
World axes, z up; metres, seconds, radians; the file states its units.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from minsnap.basics.arrays import plain
from minsnap.basics.storage.atomic import write_file
from minsnap.basics.storage.text import FileName, beginning, load_yaml, read_text, reading
from minsnap.basics.version import __version__
from minsnap.corridors.gates import Ball, Gate
from minsnap.corridors.given_waypoints import without_gates
from minsnap.corridors.keep_out import Avoided, as_obstacles, name_of, named_obstacle
from minsnap.corridors.named_constraints import CONSTRAINTS
from minsnap.errors import CorridorError, FileError, InputError
from minsnap.files.convert import Format
from minsnap.files.file_request import Opening
from minsnap.files.formats.pieces import headed, polynomials_of, yaw_description
from minsnap.files.limits_yaml import describe_limits, limits_of
from minsnap.files.plan_file import PassedStop, PlanFile
from minsnap.limits.limits import Limits
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import VECTORS
from minsnap.trajectory.trajectory import Trajectory

MARK = "minsnap polynomials"
VERSION = 1
LARGEST_JSON = 1 << 28
"""Bytes of the largest JSON file that is read."""

STATED = (
    *("corridor_margin", "obstacle_margin", "waypoint_error", "max_speed", "max_acceleration", "max_jerk"),
    "continuity",
)
"""What of its certificate a file states."""


def write_polynomials(
    trajectory: Path,
    path: FileName,
    *,
    waypoints: Any = None,
    corridor: Any = None,
    limits: Limits | None = None,
    command: tuple[str, ...] = (),
    gates: Mapping[int, Gate] | None = None,
    avoid: Any = None,
    tolerance: Any = None,
    pins: Mapping[int, Mapping[str, Any]] | None = None,
    stops: Sequence[PassedStop] = (),
    clobber: bool = True,
) -> None:
    """Write a trajectory with what it was planned with, as YAML by the endings ``.yaml`` and ``.yml``, else as JSON.

    Parameters
    ----------
    trajectory : Path
        A trajectory, or a shape: its polynomials are within 1e-6 m of it. The heading is constant, planned, along
        the velocity, from the tilt, towards a point, or a polynomial to a milliradian on every piece.
    path : str or path
        Destination.
    waypoints, corridor, limits, tolerance, avoid
        As :func:`minsnap.certify` takes them; the certificate over them is written too.
    command : tuple of str
        The command line, if there was one.
    gates : mapping of int to Gate, optional
        By the numbers of the waypoints in whose place they are; when and how fast each is passed is written too. By
        default those among the waypoints.
    pins : mapping of int to mapping, optional
        Derivatives at waypoints, as ``plan`` takes them, those of both ends among them.
    stops : sequence of PassedStop
        Of a course, in place of waypoints.
    clobber : bool
        False: a destination that exists is an error.

    Raises
    ------
    FileError
        If a constraint, an obstacle or the limits have no description.
    YawError
        If the heading is no polynomial.
    """
    curve = polynomials_of(trajectory)[0]
    known: dict[str, Any] = {
        "avoid": as_obstacles(avoid),
        "tolerance": tolerance,
        "pins": pins or {},
        "stops": tuple(stops),
    }
    known["gates"] = (gates if gates is not None else without_gates(waypoints)[1]) or {}
    content = _description(PlanFile(curve, waypoints, corridor, limits, command, **known))
    if FilePath(path).suffix.lower() in (".yaml", ".yml"):
        import yaml

        text = yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=100_000)
    else:
        text = json.dumps(content, indent=1, allow_nan=False) + "\n"
    write_file(path, text, clobber=clobber)


def _description(plan: PlanFile) -> dict[str, Any]:
    """Return the file's content as plain numbers, text, lists and mappings; see :func:`write_polynomials`."""
    trajectory, limits, certificate = plan.trajectory, plan.limits, plan.proof
    names = ("ok", *STATED)
    return {
        "format": MARK,
        "version": VERSION,
        "made_by": f"minsnap {__version__}",
        "command": list(plan.command),
        "frame": "enu",
        "units": "m, s, rad",
        "pieces_per_leg": trajectory.pieces,
        "durations": trajectory.durations.tolist(),
        "control_points": trajectory.control_points.tolist(),
        "yaw": yaw_description(trajectory),
        "waypoints": None if plan.waypoints is None else plan.points.tolist(),
        "waypoint_tolerance": _tolerance(plan.tolerance),
        "stops": [_numbers(stop._asdict()) for stop in plan.stops],
        "pins": [{"waypoint": number} | _numbers(state) for number, state in plan.pins.items()],
        "corridor": _corridor(plan.corridor),
        "avoid": _obstacles(plan.avoid),
        "openings": [Opening.of(i, gate)._asdict() for i, gate in plan.gates.items() if len(gate.center) == 3],
        "limits": None if limits is None else describe_limits(limits),
        "certificate": {name: getattr(certificate, name) for name in names}
        | {"limits": [asdict(used) for used in certificate.utilisation]}
        | {"gates": [asdict(passed) for passed in plan.passages]},
    }


def read_polynomials(path: FileName) -> PlanFile:
    """Read what :func:`write_polynomials` wrote.

    Raises
    ------
    FileError
        If the file is none of these, or of a newer version.
    ImportError
        If it is YAML and PyYAML is not there.
    """
    if FilePath(path).suffix.lower() in (".yaml", ".yml"):
        content = load_yaml(path)
    else:
        text = read_text(path, LARGEST_JSON)
        with reading(path, "JSON"):
            content = json.loads(text)
    if not isinstance(content, dict) or content.get("format") != MARK:
        raise FileError(f"{path} holds no polynomials: its 'format' is not {MARK!r}")
    if content.get("version") != VERSION or content.get("frame") != "enu":
        raise FileError(
            f"{path} is of version {content.get('version')!r}, frame {content.get('frame')!r}: this reads 1, 'enu'"
        )
    with reading(path, "a file of polynomials"):
        return _plan(f"{path}", content)


def _plan(where: str, content: Mapping[str, Any]) -> PlanFile:
    control, times = (np.array(content[name], dtype=np.float64) for name in ("control_points", "durations"))
    trajectory = headed(Trajectory(control, times, pieces=int(content["pieces_per_leg"])), content["yaw"])
    waypoints = content.get("waypoints")
    points = None if waypoints is None else np.array(waypoints, dtype=np.float64)
    limits = None if content.get("limits") is None else limits_of(f"{where}: limits", content["limits"], FilePath())
    words = tuple(str(word) for word in content.get("command", ()))
    gates = {int(gate.pop("waypoint")): Gate.polygon(**gate) for gate in map(dict, content.get("openings", ()))}
    known: dict[str, Any] = {"made_by": str(content.get("made_by", "")), "gates": gates, "command": words}
    known |= {"certificate": _stated(content.get("certificate") or {}), "limits": limits}
    known["avoid"] = tuple(named_obstacle(*named) for entry in content.get("avoid", ()) for named in _named(entry))
    known["tolerance"] = _given_tolerance(content.get("waypoint_tolerance"))
    known["stops"] = tuple(_stop(entry, trajectory) for entry in content.get("stops", ()))
    known["pins"] = dict(_pin(entry, trajectory) for entry in content.get("pins", ()))
    return PlanFile(trajectory, points, _constraint(content.get("corridor")), **known)


def _stated(certificate: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a file says of its plan, as numbers."""
    said = {name: float(certificate[name]) for name in STATED if certificate.get(name) is not None}
    uses = [
        used | {"name": str(used["name"]), "fraction": float(used["fraction"])}
        for used in certificate.get("limits", ())
    ]
    gates = [passed | {"gate": int(passed["gate"])} for passed in certificate.get("gates", ())]
    return dict(certificate) | said | {"limits": uses, "gates": gates}


def _obstacles(avoid: Sequence[Avoided]) -> list[dict[str, Any]]:
    """Return obstacles by their names, as files of requests have them."""
    try:
        return [{name: plain(numbers)} for name, numbers in map(name_of, avoid)]
    except CorridorError as error:
        raise FileError(f"{error}") from None


def _named(entry: Mapping[str, Any]) -> list[tuple[str, list[float]]]:
    return [(str(name), [float(value) for value in numbers]) for name, numbers in entry.items()]


def _tolerance(tolerance: Any) -> Any:
    """Return the tolerance of waypoints as plain numbers, that of balls under their name."""
    if isinstance(tolerance, Ball):
        return {"ball": tolerance.radius.tolist()}
    return None if tolerance is None else np.asarray(tolerance, dtype=np.float64).tolist()


def _given_tolerance(content: Any) -> Any:
    return Ball(content["ball"]) if isinstance(content, dict) else content


def _numbers(state: Mapping[str, Any]) -> dict[str, Any]:
    return {name: np.asarray(values, dtype=np.float64).tolist() for name, values in state.items()}


def _stop(entry: Mapping[str, Any], trajectory: Trajectory) -> PassedStop:
    position = np.array(entry["position"], dtype=np.float64)
    if position.shape != (trajectory.dim,):
        raise InputError(f"a stop has {position.size} coordinates, and the trajectory {trajectory.dim}")
    return PassedStop(position, float(entry.get("ball", 0.0)), float(entry.get("box", 0.0)))


def _pin(entry: Mapping[str, Any], trajectory: Trajectory) -> tuple[int, dict[str, Any]]:
    """Return the number of a waypoint, and the derivatives that are pinned there."""
    number = int(entry["waypoint"])
    state = {name: np.array(values, dtype=np.float64) for name, values in entry.items() if name != "waypoint"}
    if not 0 <= number <= trajectory.legs or any(values.shape != (trajectory.dim,) for values in state.values()):
        raise InputError(f"pins of waypoint {number}: there is none, or their vectors have other coordinates")
    if state.keys() - set(VECTORS[:5]):
        raise InputError(f"pins of waypoint {number}: choose from {', '.join(VECTORS[:5])}")
    return number, state


def _corridor(corridor: Any) -> Any:
    """Return half-widths unchanged, constraints as mappings with their kind."""
    if corridor is None or not hasattr(corridor, "walls"):
        parts = corridor if isinstance(corridor, (list, tuple)) else ()
        if any(hasattr(part, "walls") for part in parts):
            return [_corridor(part) for part in parts]
        return None if corridor is None else plain(np.asarray(corridor, dtype=np.float64))
    kind = type(corridor).__name__
    if CONSTRAINTS.get(kind) is not type(corridor):
        raise FileError(f"a constraint of kind {kind} has no description in a file: leave the corridor out")
    return {"kind": kind, **plain(corridor)}


def _constraint(content: Any) -> Any:
    if isinstance(content, list) and any(isinstance(part, dict) for part in content):
        return [_constraint(part) for part in content]
    if isinstance(content, list):
        return [np.inf if width == "inf" else width for width in content]
    if not isinstance(content, dict):
        return content
    values = {name: value for name, value in content.items() if name != "kind"}
    if content.get("kind") not in CONSTRAINTS:
        raise FileError(
            f"no constraint is of kind {str(content.get('kind'))[:40]!r}: there are {', '.join(CONSTRAINTS)}"
        )
    return CONSTRAINTS[content["kind"]](**values)


def is_polynomials(path: FileName) -> bool:
    """Whether a file has the ending of a file of polynomials and begins like one."""
    return MARK in beginning(path)[:200] and FilePath(path).suffix.lower() in ENDINGS


ENDINGS = (".json", ".yaml", ".yml")
_READ_WRITE = (ENDINGS, write_polynomials, ENDINGS, lambda path: read_polynomials(path).trajectory, is_polynomials)
FORMATS = (Format("polynomials", "polynomials", *_READ_WRITE, facts=True),)
