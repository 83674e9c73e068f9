"""The scene of a plan that is there: waypoints, durations, walls and limits as plain numbers that a page can edit."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import GRAVITY
from minsnap.corridors.boxes import Boxes, Room
from minsnap.corridors.constraint import Constraint
from minsnap.corridors.tubes import Tube, as_constraints
from minsnap.errors import CorridorError, LimitError, WaypointError
from minsnap.files.limits_in_files import besides_rotors
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.planning.request import PlanRequest
from minsnap.vehicle.named import VEHICLES, preset_of


def scene_of(curve: Any, waypoints: Any = None, corridor: Any = None, limits: Limits | None = None) -> PlanRequest:
    """Return the scene of a plan.

    Parameters
    ----------
    curve : Trajectory
    waypoints : array_like, shape (legs + 1, 3), optional
        By default its own [m].
    corridor, limits
        What it is to keep, as ``plan`` takes them.

    Raises
    ------
    WaypointError
        If it is not in space, or its waypoints are not as many as its legs need.
    CorridorError
        If a wall is none that a scene has.
    LimitError
        If the limits are none that a scene has.
    """
    points = np.array(curve(curve.leg_breaks) if waypoints is None else waypoints, dtype=np.float64)
    if points.shape != (curve.legs + 1, 3):
        raise WaypointError(
            f"the waypoints have shape {points.shape}: a path of {curve.legs} legs in space has ({curve.legs + 1}, 3)"
        )
    return PlanRequest(
        tuple(tuple(row) for row in points.tolist()),
        tuple(np.diff(curve.leg_breaks).tolist()),
        degree=curve.degree,
        pieces=curve.pieces,
        **_walls(as_constraints(corridor), curve.legs),
        **bounds_of(limits),
    )


def _walls(parts: list[Constraint], legs: int) -> dict[str, Any]:
    """Return walls as fields of a scene."""
    walls: dict[str, Any] = {}
    for part in parts:
        name, value = _wall(part, legs)
        if name in walls:
            raise CorridorError("a scene has one tube or box per leg and one room at most: give one of each kind")
        walls[name] = value
    return walls


def _wall(part: Constraint, legs: int) -> tuple[str, Any]:
    if isinstance(part, Tube) and part.half_width.shape in ((), (legs,)):
        return "corridor", tuple(np.broadcast_to(part.half_width, (legs,)).tolist())
    if isinstance(part, Boxes) and part.lower.shape == (legs, 3):
        corners = np.stack((part.lower, part.upper), axis=1).tolist()
        return "boxes", tuple((tuple(low), tuple(high)) for low, high in corners)
    if isinstance(part, Room) and np.isfinite([part.lower, part.upper]).all():
        return "room", (tuple(part.lower.tolist()), tuple(part.upper.tolist()))
    raise CorridorError(
        f"a scene of {legs} legs cannot hold this {type(part).__name__}: its walls are a half-width per leg, a box per "
        "leg and a room with six sides; leave it out, and certify the plan with it"
    )


def bounds_of(limits: Limits | None) -> dict[str, Any]:
    """Return limits as fields of a scene; those of the rotors of a preset are its name and the reserve."""
    if limits is None:
        return {}
    if limits.norm != "euclidean" or limits.gravity != GRAVITY:
        raise LimitError("a scene holds limits of the Euclidean norm under standard gravity: leave these out")
    if not isinstance(limits, VehicleLimits):
        return {"limits": tuple(limits.given().items())}
    name = preset_of(limits.vehicle)
    if name is None:
        raise LimitError(f"a scene holds the rotors of {', '.join(VEHICLES)}: leave those of another vehicle out")
    return {"limits": tuple(besides_rotors(limits).items()), "rotors": limits.reserve, "vehicle": name}
