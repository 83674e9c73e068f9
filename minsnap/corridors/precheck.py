"""Refuse, before any solve, waypoints and pinned states outside the walls of their legs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.checks import DERIVATIVES, point_text
from minsnap.basics.tolerances import ROUNDING
from minsnap.corridors.constraint import Walls
from minsnap.corridors.knot_regions import Placement
from minsnap.errors import CorridorError, SolverError, WaypointError
from minsnap.native.half_space_sets import flatness, inner_balls, reach

Pins = Mapping[int, Mapping[int, FloatArray]]


def check_reach(placement: Placement, pins: Pins, walls: Sequence[Walls]) -> None:
    """Raise unless every waypoint, with its box, and every pinned derivative can be inside the walls of its legs.

    Raises
    ------
    CorridorError
        If a waypoint, or the whole box, ball or gate around it, is outside a wall of a leg that it belongs to, or a
        gate's crossing leads out of all that a leg may reach.
    WaypointError
        If a pinned derivative is.
    """
    places = [wall for wall in walls if wall.order == 0]
    outside = [_check_points(placement, wall) for wall in places]
    for wall in walls:
        if wall.order:
            _check_pins(pins, wall)
    for waypoint in sorted({waypoint for rows in outside for waypoint in rows.tolist()}):
        _check_box(placement, places, waypoint)
    planes = [wall for wall in places if wall.flat]
    for waypoint in placement.regions if planes else ():
        _check_crossing(placement, planes, waypoint)


def _check_points(placement: Placement, wall: Walls) -> IntArray:
    """Refuse waypoints that are outside a wall with their boxes; return free ones that are outside without."""
    ends = wall.leg[:, None] + np.array([0, 1])
    points, low, high = placement.points[ends], placement.lower[ends], placement.upper[ends]
    outside, free = wall.slack(points) < 0.0, (high > low).any(axis=2)
    if not outside.any():
        return np.zeros(0, dtype=np.intp)
    nearest = points + np.where(wall.slope[:, None] > 0.0, high, low) if wall.flat else points
    excess = -wall.slack(nearest)
    wrong = np.argwhere(((excess > 0.0) & (wall.flat | ~free)).T)
    if len(wrong):
        end, row = wrong[0].tolist()
        _refuse(placement, wall, int(ends[row, end]), row, float(excess[row, end]))
    return np.asarray(ends[outside & free])


def _refuse(placement: Placement, wall: Walls, waypoint: int, row: int, excess: float) -> None:
    what, place = placement.name(waypoint), f"the {wall.name} of leg {wall.leg[row]}"
    on_it = excess <= ROUNDING * (1.0 + float(np.abs(placement.points[waypoint]).max()))
    raise CorridorError(
        f"{what} lies on {place}, and rounding puts it outside: leave it some room"
        if on_it
        else f"{what} is {excess:.3g} m outside {place}: move it or widen the {wall.name}",
        leg=int(wall.leg[row]),
        waypoint=waypoint,
    )


def _check_pins(pins: Pins, wall: Walls) -> None:
    for waypoint, state in pins.items():
        value = state.get(wall.order)
        if value is None:
            continue
        excess = -wall.slack(value[None, None])[:, 0]
        wrong = [int(row) for row in _rows_at(wall, waypoint) if excess[row] > 0.0]
        if wrong:
            what = f"{DERIVATIVES[wall.order]} {'pinned' if value.any() else 'of rest'}"
            raise WaypointError(
                f"the {what} at waypoint {waypoint} is {excess[wrong[0]]:.3g} outside the {wall.name} of leg "
                f"{wall.leg[wrong[0]]}: change one of them",
                waypoint=waypoint,
                leg=int(wall.leg[wrong[0]]),
            )


def _check_box(placement: Placement, walls: Sequence[Walls], waypoint: int) -> None:
    """Raise unless the box around a waypoint has a point inside all planes and each ball of its legs."""
    low, high = (placement.points[waypoint] + side[waypoint] for side in (placement.lower, placement.upper))
    for wall in walls:
        for row in () if wall.flat or wall.slope.any() else _rows_at(wall, waypoint):
            excess = _box_to_ball(wall, row, low, high)
            if excess > 0.0:
                _refuse(placement, wall, waypoint, row, excess)
    if not _meets(placement, [wall for wall in walls if wall.flat], waypoint):
        names = sorted({wall.name for wall in walls if len(_rows_at(wall, waypoint))})
        raise CorridorError(
            f"{placement.name(waypoint)} has no point inside the {' and the '.join(names)} of its legs: "
            "move it or widen one of them",
            waypoint=waypoint,
        )


def _rows_at(wall: Walls, waypoint: int) -> IntArray:
    return np.flatnonzero((wall.leg == waypoint) | (wall.leg == waypoint - 1))


def _box_to_ball(balls: Walls, row: int, low: FloatArray, high: FloatArray) -> float:
    """Least excess over a ball within a box [m]."""
    from scipy.optimize import lsq_linear

    matrix, anchor = balls.matrix[row], balls.anchor[row]
    fixed = low == high
    point = low.copy()
    if not fixed.all():
        right = matrix @ anchor - matrix[:, fixed] @ low[fixed]
        point[~fixed] = lsq_linear(matrix[:, ~fixed], right, (low[~fixed], high[~fixed]), tol=1e-12).x
    return float(np.linalg.norm(matrix @ (point - anchor)) - balls.radius[row])


def _planes_at(planes: Sequence[Walls], legs: Sequence[int], dim: int) -> tuple[FloatArray, FloatArray]:
    """Half-spaces normal . x <= bound that hold on some legs: (m, dim) and (m,)."""
    parts = [wall.chosen(np.isin(wall.leg, legs)).half_spaces for wall in planes]
    normals, bounds = zip(*[(np.zeros((0, dim)), np.zeros(0)), *parts], strict=True)
    return np.concatenate(normals), np.concatenate(bounds)


def _meets(placement: Placement, planes: Sequence[Walls], waypoint: int) -> bool:
    """Whether some point of a waypoint's box, ball or gate is inside all planes of its legs."""
    point, region = placement.points[waypoint], placement.regions.get(waypoint)
    normals, bounds = _planes_at(planes, (waypoint - 1, waypoint), len(point))
    bounds = bounds - normals @ point
    if region is not None and np.isfinite(region.radius):
        return _distance(normals, bounds) <= region.radius
    axes = np.eye(len(point))
    rows = [(normals, bounds), (axes, placement.upper[waypoint]), (-axes, -placement.lower[waypoint])]
    if region is not None:
        rows.append((region.normals, region.bounds))
        rows += [(side * region.plane[None], np.zeros(1)) for side in (1.0, -1.0) if region.plane is not None]
    stacked = np.concatenate([normal for normal, _ in rows]), np.concatenate([bound for _, bound in rows])
    return float(inner_balls([stacked])[1][0]) >= -flatness(stacked)


def _distance(normals: FloatArray, bounds: FloatArray) -> float:
    """Distance of the origin to the set of points with normals . x <= bounds; infinite if the set is empty.

    C. L. Lawson and R. J. Hanson, "Solving least squares problems", 1974, chapter 23.
    """
    from scipy.optimize import nnls

    if not len(bounds):
        return 0.0
    matrix, target = np.vstack((-normals.T, -bounds)), np.append(np.zeros(normals.shape[1]), 1.0)
    residual = matrix @ nnls(matrix, target)[0] - target
    return float(np.linalg.norm(residual[:-1] / residual[-1])) if abs(residual[-1]) > ROUNDING else np.inf


def _check_crossing(placement: Placement, planes: Sequence[Walls], waypoint: int) -> None:
    """Raise if the corridor after a gate is wholly behind it, or the corridor before it wholly beyond it.

    The gate in which a closed lap begins and ends is its first waypoint and its last one.
    """
    crossing, legs = placement.regions[waypoint].crossing, len(placement.points) - 1
    if crossing is None:
        return
    for leg, side, where in ((waypoint, 1.0, "behind"), (waypoint - 1, -1.0, "beyond")):
        if 0 <= leg < legs and _reach(planes, leg, side * crossing, placement.points[waypoint]) <= 0.0:
            raise CorridorError(
                f"{placement.name(waypoint)} is crossed along {point_text(crossing)}, but all of leg {leg}'s corridor "
                f"lies {where} it: turn its crossing round, or move it",
                leg=leg,
                waypoint=waypoint,
            )


def _reach(planes: Sequence[Walls], leg: int, direction: FloatArray, point: FloatArray) -> float:
    """Distance from a point along a direction to a leg's planes [m]; infinite if none is in the way."""
    normals, bounds = _planes_at(planes, (leg,), len(point))
    if not len(bounds):
        return np.inf
    try:
        return float(reach(direction[None], [(normals, bounds - normals @ point)])[0, 0])
    except SolverError:  # planes that only touch: other checks refuse these
        return np.inf
