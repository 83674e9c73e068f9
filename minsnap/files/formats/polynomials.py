"""Plans as JSON or YAML: the exact polynomials, and the arguments of the plan.

Numbers are written with enough digits to read back the same float64, so the curve that is read equals the planned one.
World axes, z up; metres, seconds, radians; the file states its units.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from math import inf
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from minsnap.basics.arrays import plain
from minsnap.basics.storage.atomic import write_file
from minsnap.basics.storage.text import FileName, beginning, load_yaml, read_text, reading
from minsnap.basics.tolerances import EXACT
from minsnap.basics.version import __version__
from minsnap.certificate import Certificate, certify
from minsnap.corridors.gates import Gate
from minsnap.corridors.knot_regions import gate_passages
from minsnap.corridors.named_constraints import CONSTRAINTS
from minsnap.errors import FileError
from minsnap.files.convert import Format
from minsnap.files.formats.pieces import headed, polynomials_of, yaw_description
from minsnap.files.request_yaml import besides_rotors, limits_of
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.planning.request import Opening
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle.quadrotor import description_of, preset_of

MARK = "minsnap polynomials"
VERSION = 1
LARGEST_JSON = 1 << 28
"""Bytes of the largest JSON file that is read."""


@dataclass(frozen=True, eq=False)
class PlanFile:
    """The content of a file of polynomials.

    Parameters
    ----------
    trajectory : Trajectory
    waypoints : ndarray, shape (n, dim), or None
        [m].
    corridor : Constraint, list of them, or None
    limits : Limits or None
    command : tuple of str
        The command line that wrote it; empty for a file written from Python.
    made_by : str
        Program and version.
    certificate : mapping
        What held when it was written.
    gates : mapping of int to Gate
        By their numbers.
    """

    trajectory: Trajectory
    waypoints: Any = None
    corridor: Any = None
    limits: Limits | None = None
    command: tuple[str, ...] = ()
    made_by: str = ""
    certificate: Mapping[str, Any] | None = None
    gates: Mapping[int, Gate] = field(default_factory=dict)

    def certified(self) -> tuple[Certificate, list[str]]:
        """Certify the plan anew: the certificate, and a sentence for all that it keeps less than its file says."""
        certificate = certify(self.trajectory, self.waypoints, self.corridor, self.limits)
        said_margin, said_missed, said_smooth, said_used = _said(self.certificate)
        margin, missed = certificate.corridor_margin, certificate.waypoint_error
        tiny = EXACT * np.abs(self.trajectory.control_points).max()
        problems = []
        if margin is not None and margin < min(0.0, said_margin - tiny):
            problems.append(f"the plan leaves its corridor: its exact margin is {margin:.3g} m")
        if missed is not None and missed > said_missed + tiny:
            problems.append(f"the plan misses a waypoint by {missed:.3g} m, and its file says {said_missed:.3g} m")
        smooth = certificate.continuity
        if smooth < said_smooth:
            problems.append(f"the plan has {smooth} continuous derivatives, and its file says {said_smooth}")
        problems += [
            f"the plan exceeds its limit {used.name}: {used.value:.6g} of {used.limit:.6g} on leg {used.leg} "
            f"at {used.instant:.4g} s"
            for used in certificate.utilisation
            if not used.kept and used.fraction > (1.0 + EXACT) * said_used.get(used.name, 1.0)
        ]
        for quantity, unit in (("speed", "m/s"), ("acceleration", "m/s^2"), ("jerk", "m/s^3")):
            most, said = getattr(certificate, f"max_{quantity}"), (self.certificate or {}).get(f"max_{quantity}")
            if isinstance(said, int | float) and most > said * (1.0 + 1e-6) + tiny:
                problems.append(f"the plan reaches {most:.6g} {unit}, and its file says {said:.6g}")
        return certificate, problems


def _said(certificate: Mapping[str, Any] | None) -> tuple[float, float, int, dict[str, float]]:
    """Read margin and largest distance to a waypoint [m], continuity, use of limits; what is not said binds nothing."""
    stated = certificate or {}
    said: dict[str, Any] = {"corridor_margin": 0.0, "waypoint_error": inf, "continuity": -1}
    said |= {name: value for name, value in stated.items() if value is not None}
    shares = {str(used["name"]): float(used["fraction"]) for used in stated.get("limits", ())}
    return float(said["corridor_margin"]), float(said["waypoint_error"]), int(said["continuity"]), shares


def write_polynomials(
    trajectory: Path,
    path: FileName,
    *,
    waypoints: Any = None,
    corridor: Any = None,
    limits: Limits | None = None,
    command: tuple[str, ...] = (),
    gates: Mapping[int, Gate] | None = None,
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
    waypoints, corridor, limits
        As :func:`minsnap.certify` takes them; the certificate over them is written too.
    command : tuple of str
        The command line, if there was one.
    gates : mapping of int to Gate, optional
        By the numbers of the waypoints in whose place they are; when and how fast each is passed is written too.
    clobber : bool
        False: a destination that exists is an error.

    Raises
    ------
    FileError
        If a constraint or the limits have no description.
    YawError
        If the heading is no polynomial.
    """
    curve = polynomials_of(trajectory)[0]
    content = _description(PlanFile(curve, waypoints, corridor, limits, command, gates=gates or {}))
    if FilePath(path).suffix.lower() in (".yaml", ".yml"):
        import yaml

        text = yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=100_000)
    else:
        text = json.dumps(content, indent=1, allow_nan=False) + "\n"
    write_file(path, text, clobber=clobber)


def _description(plan: PlanFile) -> dict[str, Any]:
    """Return the file's content as plain numbers, text, lists and mappings; see :func:`write_polynomials`."""
    trajectory, waypoints, limits = plan.trajectory, plan.waypoints, plan.limits
    certificate = certify(trajectory, waypoints, plan.corridor, limits)
    names = ("ok", "corridor_margin", "waypoint_error", "max_speed", "max_acceleration", "max_jerk", "continuity")
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
        "waypoints": None if waypoints is None else np.asarray(waypoints, dtype=np.float64).tolist(),
        "corridor": _corridor(plan.corridor),
        "openings": [Opening.of(i, gate)._asdict() for i, gate in plan.gates.items() if len(gate.center) == 3],
        "limits": None if limits is None else _limits(limits),
        "certificate": {name: getattr(certificate, name) for name in names}
        | {"limits": [asdict(used) for used in certificate.utilisation]}
        | {"gates": [asdict(passed) for passed in gate_passages(trajectory, plan.gates)]},
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
    made_by, certificate = str(content.get("made_by", "")), dict(content.get("certificate") or {})
    _said(certificate)
    corridor = _constraint(content.get("corridor"))
    return PlanFile(trajectory, points, corridor, limits, words, made_by, certificate, gates)


def _corridor(corridor: Any) -> Any:
    """Return half-widths unchanged, constraints as mappings with their kind."""
    if corridor is None or not hasattr(corridor, "walls"):
        parts = corridor if isinstance(corridor, (list, tuple)) else ()
        if any(hasattr(part, "walls") for part in parts):
            return [_corridor(part) for part in parts]
        return None if corridor is None else np.asarray(corridor, dtype=np.float64).tolist()
    kind = type(corridor).__name__
    if CONSTRAINTS.get(kind) is not type(corridor):
        raise FileError(f"a constraint of kind {kind} has no description in a file: leave the corridor out")
    return {"kind": kind, **plain(corridor)}


def _constraint(content: Any) -> Any:
    if isinstance(content, list) and any(isinstance(part, dict) for part in content):
        return [_constraint(part) for part in content]
    if not isinstance(content, dict):
        return content
    values = {name: value for name, value in content.items() if name != "kind"}
    if content.get("kind") not in CONSTRAINTS:
        raise FileError(
            f"no constraint is of kind {str(content.get('kind'))[:40]!r}: there are {', '.join(CONSTRAINTS)}"
        )
    return CONSTRAINTS[content["kind"]](**values)


def _limits(limits: Limits) -> dict[str, Any]:
    if not isinstance(limits, VehicleLimits):
        return {"norm": limits.norm, "gravity": limits.gravity} | limits.given()
    vehicle = preset_of(limits.vehicle) or description_of(limits.vehicle)
    return {"norm": limits.norm, "rotors": {"vehicle": vehicle, "reserve": limits.reserve}} | besides_rotors(limits)


def is_polynomials(path: FileName) -> bool:
    """Whether a file has the ending of a file of polynomials and begins like one."""
    return MARK in beginning(path)[:200] and FilePath(path).suffix.lower() in ENDINGS


ENDINGS = (".json", ".yaml", ".yml")
_READ_WRITE = (ENDINGS, write_polynomials, ENDINGS, lambda path: read_polynomials(path).trajectory, is_polynomials)
FORMATS = (Format("polynomials", "polynomials", *_READ_WRITE, facts=True),)
