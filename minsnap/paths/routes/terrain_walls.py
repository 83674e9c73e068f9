"""Walls above the ground for the legs of a plan: a floor, a ceiling and sides for each."""

from __future__ import annotations

from math import sqrt

import numpy as np

from minsnap.basics.arrays import FloatArray, numbers
from minsnap.basics.checks import check_kind
from minsnap.basics.messages import shown
from minsnap.corridors.half_spaces import Polytopes
from minsnap.errors import WaypointError
from minsnap.paths.routes.terrain import Terrain

BESIDE = 20.0
"""How far to the sides a leg may lead, and past its ends, unless a corridor is narrower [m]."""


def build_terrain_walls(
    ground: Terrain, points: FloatArray, above: float, below: float | None = None, beside: float = BESIDE
) -> Polytopes:
    """Return a polytope around each leg whose points all have a height above the ground, vertically.

    Its sides are ``beside`` the leg. Its floor is a plane as steep as the leg and level across it, which touches the
    ground, raised by the least height, from above: since the ground is bilinear between heights, it is below the plane
    where it is so at the heights around. The ceiling is such a plane from below.

    Parameters
    ----------
    ground : Terrain
    points : ndarray, shape (n, 3)
        Waypoints [m].
    above : float
        Least height above the ground [m].
    below : float, optional
        Greatest height above the ground [m].
    beside : float
        How far to the sides a leg may lead, and past its ends [m].

    Raises
    ------
    WaypointError
        If a leg leads where the ground is not known, or is too low or too high above it; says where.
    """
    check_kind("the ground", ground, Terrain, "what read_terrain returns")
    rows = numbers(points, copy=False)
    if rows is None or rows.ndim != 2 or rows.shape[1] != 3:
        raise WaypointError(f"waypoints over the ground are {shown(points)}: give an array (n, 3) [m]")
    points = rows
    legs = zip(points[:-1], points[1:], strict=True)
    return Polytopes([_leg_walls(ground, leg, a, b, above, below, beside) for leg, (a, b) in enumerate(legs)])


def _leg_walls(
    ground: Terrain, leg: int, a: FloatArray, b: FloatArray, above: float, below: float | None, beside: float
) -> tuple[FloatArray, FloatArray]:
    """Return the rows of a leg: sides, ends, floor, and ceiling if there is one."""
    length = float(np.hypot(*(b - a)[:2]))
    along = (b - a)[:2] / length if length > 0.0 else np.array([1.0, 0.0])
    across = np.array([-along[1], along[0]])
    slope = float(b[2] - a[2]) / length if length > 0.0 else 0.0
    places, heights = _under(ground, leg, a[:2], along, across, length, beside)
    # The floor is parallel to the leg, as high as the ground that comes nearest to it asks for. `drop` takes the leg's
    # rise away from heights, so that all are compared with one number: its height at the start.
    line = min(a[2], b[2]) if length == 0.0 else a[2]
    drop = slope * ((places - a[:2]) @ along)
    floor = heights + above - drop
    low = int(floor.argmax())
    if floor[low] >= line:
        height, where = line - floor[low] + above, ", ".join(f"{value:.5g}" for value in (*places[low], heights[low]))
        raise WaypointError(
            f"leg {leg} is {height:.4g} m above the ground at ({where}) m in {ground.name}, within {beside:g} m of it, "
            f"and {above:g} m are asked for: raise it by more than {floor[low] - line:.4g} m"
        )
    rows = [[*side, 0.0] for side in (across, -across, along, -along)] + [[*(slope * along), -1.0]]
    aside, behind, ahead = (float(direction @ point[:2]) for direction, point in ((across, a), (along, a), (along, b)))
    ends = [aside + beside, beside - aside, ahead + beside, beside - behind, slope * behind - float(floor[low])]
    if below is not None:
        rows.append([*(-slope * along), 1.0])
        top = float(a[2]) if length > 0.0 else float(max(a[2], b[2]))
        ends.append(_ceiling(ground, leg, heights + below - drop, top, below) - slope * behind)
    return np.array(rows), np.array(ends)


def _ceiling(ground: Terrain, leg: int, ceiling: FloatArray, line: float, below: float) -> float:
    """Return the lowest of the heights that a leg must stay below, less its slope."""
    least = float(ceiling.min())
    if least <= line:
        raise WaypointError(
            f"leg {leg} is {line - least + below:.4g} m above the ground in {ground.name}, and at most {below:g} m are "
            f"asked for: lower it by more than {line - least:.4g} m, or divide it where the ground falls"
        )
    return least


def _under(
    ground: Terrain, leg: int, start: FloatArray, along: FloatArray, across: FloatArray, length: float, beside: float
) -> tuple[FloatArray, FloatArray]:
    """Return the places and heights from which the ground below a leg and beside it is interpolated: (k, 2), (k,)."""
    corners = np.array([start + s * along + t * across for s in (-beside, length + beside) for t in (-beside, beside)])
    cells = (corners - ground.middle) / ground.side
    low, high = np.floor(cells.min(axis=0)), np.ceil(cells.max(axis=0))
    last = np.array(ground.heights.shape) - 1
    if not ((low >= 0).all() and (high <= last).all()):
        ends = ", ".join(f"{axis} from {a:.6g} to {b:.6g} m" for axis, (a, b) in zip("xy", ground.reach.T, strict=True))
        raise WaypointError(
            f"leg {leg} and {beside:g} m around it lead beyond the heights of {ground.name}, which are known for {ends}"
        )
    first, behind = low.astype(int), high.astype(int) + 1
    x, y = (ground.middle[i] + ground.side * np.arange(first[i], behind[i]) for i in range(2))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    heights = ground.heights[first[0] : behind[0], first[1] : behind[1]].ravel()
    s, t, far = (places - start) @ along, (places - start) @ across, beside + sqrt(2.0) * ground.side
    near = (np.abs(t) <= far) & (s >= -far) & (s <= length + far)
    places, heights = places[near], heights[near]
    if np.isnan(heights).any():
        where = ", ".join(f"{value:.6g}" for value in places[np.isnan(heights)][0])
        raise WaypointError(f"leg {leg} leads over ground of unknown height, such as at ({where}) m in {ground.name}")
    return places, heights
