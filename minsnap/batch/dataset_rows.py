"""One row of a dataset: a problem planned and certified, or what was wrong with it."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, numbers
from minsnap.basics.checks import is_number
from minsnap.batch.ranges import seed_of
from minsnap.batch.requests import DrawnProblem, request
from minsnap.batch.spec import LIMITS, Spec
from minsnap.certificate import certify
from minsnap.corridors.boxes import Boxes
from minsnap.corridors.gates import Gate, center_of
from minsnap.errors import InfeasibleError, InputError, MinsnapError, UnprovedError
from minsnap.limits.limits import Limits
from minsnap.planning.planner import plan
from minsnap.planning.request import PlanRequest
from minsnap.trajectory.trajectory import Trajectory

STATUSES = ("done", "infeasible", "unsolved", "invalid", "timeout", "crashed")
"""Planned; no curve meets everything; the solvers failed; malformed; too slow; the process or the code failed."""

SENTENCE = 500
"""Characters of an error's sentence that are kept."""

REQUESTED = ("waypoint_tolerance", "total_time", "time_weight")
"""Numbers in a problem's request, as columns."""

Row = dict[str, Any]
"""Values by column; a column that is not named is null."""


def planned_row(spec: Spec, number: int) -> Row:
    """Plan a problem and return its columns; whatever fails becomes its status and sentence."""
    row: Row = {"problem": number, "seed": seed_of(spec.seed, number)}
    try:
        problem = request(spec, number)
        row |= _question(problem)
        asked = PlanRequest(None).changed(**problem.arguments)
        row |= _answer(asked, plan(**asked.arguments()))
    except MinsnapError as error:
        row |= {"status": _status(error), "error": str(error)[:SENTENCE]}
    except Exception as error:
        row |= {"status": "crashed", "error": f"{type(error).__name__}: {error}"[:SENTENCE]}
    return row


def stopped_row(spec: Spec, number: int, status: str, error: str) -> Row:
    """Return the row of a problem whose process had to be stopped, or ended by itself."""
    return {"problem": number, "seed": seed_of(spec.seed, number), "status": status, "error": error}


def _status(error: MinsnapError) -> str:
    if isinstance(error, InfeasibleError):
        return "unsolved" if isinstance(error, UnprovedError) else "infeasible"
    return "invalid" if isinstance(error, InputError) else "unsolved"


def _question(problem: DrawnProblem) -> Row:
    """Columns of the problem itself, as far as it is one of numbers."""
    arguments = problem.arguments
    row: Row = {"vehicle": problem.vehicle}
    row |= {name: arguments[name] for name in REQUESTED if is_number(arguments.get(name))}
    if isinstance(arguments.get("limits"), Limits):
        row |= {f"limit_{name}": getattr(arguments["limits"], name) for name in LIMITS}
    waypoints = _points(arguments.get("waypoints"))
    if waypoints is not None:
        row |= {"waypoints": waypoints, "dim": waypoints.shape[1], "legs": len(waypoints) - 1}
        row["gates"] = _corners(arguments["waypoints"], waypoints.shape[1])
    corridor = arguments.get("corridor")
    if isinstance(corridor, Boxes):
        row["boxes"] = np.stack((corridor.lower, corridor.upper), axis=1)
    elif corridor is not None:
        row["corridor"] = numbers(corridor)
    return row


def _points(waypoints: Any) -> FloatArray | None:
    """Waypoints as (n, dim), a gate by its center; None where they are malformed or the corridor's."""
    if not isinstance(waypoints, (list, np.ndarray)) or not len(waypoints):
        return None
    points = numbers(list(map(center_of, waypoints)))
    return points if points is not None and points.ndim == 2 else None


def _corners(waypoints: Any, dim: int) -> FloatArray | None:
    """Corners of gates (waypoints, corners, dim), not numbers at points; None without gates."""
    gates = [point.corners if isinstance(point, Gate) else None for point in waypoints]
    if all(gate is None for gate in gates):
        return None
    blank = np.full((4 if dim == 3 else 2, dim), np.nan)
    return np.array([blank if gate is None else gate for gate in gates])


def _answer(asked: PlanRequest, curve: Trajectory) -> Row:
    tolerance = 0.0 if asked.waypoint_tolerance is None else asked.waypoint_tolerance
    proof = certify(curve, asked.places, asked.walls, asked.bounds, tolerance)
    return {
        "status": "done",
        "dim": curve.dim,
        "legs": curve.legs,
        "degree": curve.degree,
        "pieces": curve.pieces,
        "durations": curve.durations,
        "control_points": curve.control_points,
        "cost": curve.cost(),
        "duration": curve.duration,
        "certified": proof.ok,
        "corridor_margin": proof.corridor_margin,
        "max_speed": proof.max_speed,
        "max_acceleration": proof.max_acceleration,
        "max_jerk": proof.max_jerk,
        "max_snap": proof.max_snap,
    }
