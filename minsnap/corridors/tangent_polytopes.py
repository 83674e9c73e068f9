"""Polytopes around a line of points: each as large as planes that touch the nearest obstacles leave it.

The least distance of a polytope to every obstacle and point is proved by its planes: each of these is beyond one of
them by the clearance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import point_text
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.keep_out import Obstacle
from minsnap.corridors.prism import TOUCHING, PartTable
from minsnap.errors import CorridorError
from minsnap.native.half_space_sets import HalfSpaceRows, inner_balls
from minsnap.native.map_ways import tangent_planes


@dataclass(frozen=True)
class TangentSettings:
    """How large polytopes are, and which are left out.

    Parameters
    ----------
    reach : float
        How far a polytope extends beyond its segment, and to its sides [m]. Longer ones have more planes, and flights
        hardly become shorter.
    overlap : float
        Radius of the ball in common, in units of the reach, from which polytopes follow each other directly.
    ahead : int
        Most polytopes that are left out at once.
    """

    reach: float = 3.0
    overlap: float = 0.1
    ahead: int = 6


TANGENT = TangentSettings()

NOTHING = np.zeros((0, 13))
"""No obstacle."""


def numbers_of(obstacles: Sequence[Obstacle]) -> FloatArray:
    """Return the numbers of obstacles, (m, 13)."""
    return np.stack([obstacle.numbers() for obstacle in obstacles]) if obstacles else NOTHING


def polytopes_along(
    path: FloatArray,
    obstacles: FloatArray,
    points: FloatArray,
    clearance: float,
    reach: float = TANGENT.reach,
    box: tuple[FloatArray, FloatArray] | None = None,
    prisms: PartTable | None = None,
) -> list[HalfSpaceRows]:
    """Return (A, b) with A x <= b around each segment of a line, away from all obstacles by the clearance.

    Parameters
    ----------
    path : ndarray, shape (m + 1, dim)
        Corners of the line, two neighbours never the same [m].
    obstacles : ndarray, shape (k, 13)
        See ``numbers_of``.
    points : ndarray, shape (n, dim)
        [m].
    clearance : float
        [m].
    reach : float
        See ``TangentSettings``.
    box : pair of ndarray, shape (dim,), optional
        Lower and upper corner of what the polytopes may have [m].
    prisms : PartTable, optional

    Raises
    ------
    CorridorError
        If a segment is nearer to an obstacle than the clearance.
    """
    found = tangent_planes(path, obstacles, points, clearance, reach)
    near = found.distance < clearance - EXACT * (1.0 + clearance) if clearance else found.distance <= 0.0
    if near.any():
        segment = int(np.argmax(near))
        which = int(found.nearest[segment])
        what = f"obstacle {which}" if which < len(obstacles) else f"point {which - len(obstacles)}"
        raise CorridorError(
            f"the segment from {point_text(path[segment])} to {point_text(path[segment + 1])} m is "
            f"{found.distance[segment]:.3g} m from {what}, and the clearance is {clearance:g} m: move the path, or "
            "lower the clearance",
            leg=segment,
        )
    sets = found.sets if prisms is None else _beside_prisms(path, found.sets, prisms, clearance, reach)
    if box is None:
        return sets
    axes = np.eye(path.shape[1])
    rows, bounds = np.vstack((axes, -axes)), np.concatenate((box[1], -box[0]))
    return [(np.vstack((A, rows)), np.concatenate((b, bounds))) for A, b in sets]


def _beside_prisms(
    path: FloatArray, sets: list[HalfSpaceRows], prisms: PartTable, clearance: float, reach: float
) -> list[HalfSpaceRows]:
    """Bound sets by planes that touch prisms, the nearest first, unless a plane has them beyond already."""
    distances, ways = prisms.from_lines(np.stack((path[:-1], path[1:]), axis=1))
    near = distances < clearance - EXACT * (1.0 + clearance) if clearance else distances <= 0.0
    if near.any():
        segment, part = (int(index) for index in np.argwhere(near)[0])
        raise CorridorError(
            f"the segment from {point_text(path[segment])} to {point_text(path[segment + 1])} m is "
            f"{distances[segment, part]:.3g} m from prism {prisms.which[part]}, and the clearance is {clearance:g} m: "
            "move the path, or lower the clearance",
            leg=segment,
        )
    return [_touching(*each, prisms, clearance, reach) for each in zip(sets, distances, ways, strict=True)]


def _touching(
    rows: HalfSpaceRows, distances: FloatArray, ways: FloatArray, prisms: PartTable, clearance: float, reach: float
) -> HalfSpaceRows:
    """Return the half-spaces of one segment with those that touch prisms, and the heights of fences."""
    (A, b), inset = rows, clearance + 0.5 * TOUCHING
    for part in np.argsort(distances, kind="stable"):
        if distances[part] > 2.0 * reach + clearance:
            break
        if (prisms.supports(A, int(part)) >= b + inset).any():
            continue
        normal = ways[part] / distances[part]
        bound = prisms.supports(normal, int(part)) - inset
        A, b = np.vstack((A, normal)), np.append(b, bound)
    up = np.eye(A.shape[1])[-1:]
    for low, high in prisms.ends():
        A, b = np.vstack((A, up, -up)), np.append(b, (high - inset, -low - inset))
    finite = np.isfinite(b)
    return A[finite], b[finite]


def without_needless(sets: Sequence[HalfSpaceRows], reach: float = TANGENT.reach) -> list[int]:
    """Return which of a sequence of polytopes to keep: those between two that have enough in common go."""
    kept, last = [0], len(sets) - 1
    while kept[-1] < last:
        here = kept[-1]
        further = range(min(here + TANGENT.ahead, last), here + 1, -1)
        radii = inner_balls([_both(sets[here], sets[other]) for other in further])[1] if further else np.zeros(0)
        wide = np.flatnonzero(radii >= TANGENT.overlap * reach)
        kept.append(further[int(wide[0])] if len(wide) else here + 1)
    return kept


def _both(one: HalfSpaceRows, other: HalfSpaceRows) -> HalfSpaceRows:
    return np.vstack((one[0], other[0])), np.concatenate((one[1], other[1]))
