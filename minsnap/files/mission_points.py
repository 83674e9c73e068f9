"""Few points whose straight lines stay near a curve: what a mission of waypoints can hold of it.

The curve is cut into short parts. A line between two of their ends serves if all control points of the parts between
lie within the tolerance of it: what is within a distance of a line is convex, so the curve is, too, at every instant.
Of the ends that k lines reach the farthest ones go on, so that the least number is found but where a farther end
leads to fewer choices later than all that were kept. Where the curve rests is a point in any case.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice, pairwise

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, NDArray
from minsnap.errors import FileError
from minsnap.polynomials.bernstein import cut_points
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class ThinSettings:
    """How points are chosen.

    Parameters
    ----------
    parts : int
        Parts of the whole curve, about.
    least : int
        Parts of each polynomial at least.
    kept : int
        Ends that go on after each line.
    still, shortest : float
        Length of a piece below which it is a hold [m], and time above which that is one [s].
    slow : float
        Speed below which a knot is a point of the mission [m/s].
    """

    parts: int = 1200
    least: int = 6
    kept: int = 16
    still: float = 1e-3
    shortest: float = 0.5
    slow: float = 0.01


THIN = ThinSettings()


@dataclass(frozen=True, eq=False)
class MissionPoints:
    """Points for a curve.

    Parameters
    ----------
    t : ndarray, shape (n,)
        When the curve passes each, and leaves it if it holds there [s].
    points : ndarray, shape (n, dim)
        [m].
    distance : float
        No point of the curve is farther than this from the line of its stretch [m]; proved.
    speeds : ndarray, shape (n - 1,)
        Greatest speed of the curve on the way to each point but the first, at samples [m/s].
    holds : ndarray, shape (n,)
        How long the curve rests at each [s].
    """

    t: FloatArray
    points: FloatArray
    distance: float
    speeds: FloatArray
    holds: FloatArray


def few_points(curve: Trajectory, tolerance: float) -> MissionPoints:
    """Return few points between which straight lines stay within a distance of a curve [m], stretch by stretch.

    Raises
    ------
    FileError
        If the tolerance is finer than the parts that the curve is cut into.
    """
    stops, holds = _holds(curve)
    chosen = [0.0]
    distance = 0.0
    at_rest = curve.breaks[np.linalg.norm(curve(curve.breaks, 1), axis=1) <= THIN.slow]
    for start, end in pairwise(np.unique([0.0, *at_rest, curve.duration]).tolist()):
        if end - start > 0.0 and np.ptp(curve(np.linspace(start, end, 5)), axis=0).max() > THIN.still:
            times, apart = _thinned(curve, start, end, tolerance)
            chosen += times[1:].tolist()
            distance = max(distance, apart)
    t = np.array(chosen)
    rest = np.zeros(len(t))
    for start, length in zip(stops[:, 0], holds, strict=True):
        rest[np.abs(t - start).argmin()] += length
    speeds = np.array([_fastest(curve, *pair) for pair in pairwise(t.tolist())])
    return MissionPoints(t, curve(t), distance, speeds, rest)


def _holds(curve: Trajectory) -> tuple[FloatArray, FloatArray]:
    """Return when the curve rests at a place, shape (holds, 2), and for how long."""
    still = np.ptp(curve.control_points, axis=1).max(axis=1) <= THIN.still
    edges = np.diff(np.concatenate([[False], still, [False]]).astype(int))
    starts, ends = curve.breaks[np.flatnonzero(edges == 1)], curve.breaks[np.flatnonzero(edges == -1)]
    long = ends - starts >= THIN.shortest
    return np.column_stack([starts, ends])[long], (ends - starts)[long]


def _fastest(curve: Trajectory, start: float, end: float) -> float:
    return float(np.linalg.norm(curve(np.linspace(start, end, 33), 1), axis=1).max())


def _thinned(curve: Trajectory, start: float, end: float, tolerance: float) -> tuple[FloatArray, float]:
    """Return the instants of points from one instant to another, and the proved distance of their lines."""
    t = _ends(curve, start, end)
    middles = 0.5 * (t[1:] + t[:-1])
    piece = np.clip(np.searchsorted(curve.breaks, middles, side="right") - 1, 0, len(curve.durations) - 1)
    s = [np.clip((at - curve.breaks[piece]) / curve.durations[piece], 0.0, 1.0) for at in (t[:-1], t[1:])]
    hulls, places = cut_points(curve.control_points[piece], *s), curve(t)
    before: dict[int, int] = {0: -1}
    front, last = [0], len(t) - 1
    while last not in before:
        reached: dict[int, int] = {}
        for i in front:
            for j in _reach(hulls, places, i, tolerance):
                if j not in before:
                    reached.setdefault(j, i)
        if not reached:
            finest = _apart(hulls[front[0]][None], places[front[0]], places[front[0] + 1])[0]
            raise FileError(f"lines within {tolerance:g} m of the curve need more points: {finest:.2g} m would do")
        before |= reached
        front = sorted(reached, reverse=True)[: THIN.kept]
    chosen = [last]
    while chosen[-1] > 0:
        chosen.append(before[chosen[-1]])
    chosen = chosen[::-1]
    apart = [
        float(_apart(hulls[i:j], places[i], places[j]).max()) for i, j in zip(chosen[:-1], chosen[1:], strict=True)
    ]
    return t[chosen], max(apart)


def _ends(curve: Trajectory, start: float, end: float) -> FloatArray:
    """Return the instants that cut the curve into short parts, its knots among them."""
    knots = np.unique(np.clip(curve.breaks, start, end))
    lengths = np.linalg.norm(np.diff(curve(knots), axis=0), axis=1)
    shares = np.maximum(np.ceil(THIN.parts * lengths / max(lengths.sum(), 1e-9)), THIN.least).astype(int)
    cuts = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(knots[:-1], knots[1:], shares, strict=True)]
    return np.concatenate([*cuts, knots[-1:]])


def _reach(hulls: FloatArray, places: FloatArray, i: int, tolerance: float) -> list[int]:
    """Return the farthest ends j to which a line from end i stays within the tolerance of the parts between."""
    found: list[int] = []
    block, last, j = 16, len(places) - 1, i + 1
    while j <= last:
        stop = min(last, j + block - 1)
        ends = np.arange(j, stop + 1)
        serving = ends[_near(places[i : stop + 1], ends - i, tolerance)]
        found += serving.tolist()
        if not len(serving):
            break
        j, block = stop + 1, 2 * block
    proved = (k for k in reversed(found) if _apart(hulls[i:k], places[i], places[k]).max() <= tolerance)
    return list(islice(proved, THIN.kept))


def _near(places: FloatArray, ends: NDArray[np.intp], tolerance: float) -> BoolArray:
    """Whether the line from the first place to each of some others stays near the places between, shape (ends,)."""
    away = places - places[0]
    along = away[ends]
    square = np.maximum(np.einsum("ed,ed->e", along, along), 1e-30)
    share = np.clip(along @ away.T / square[:, None], 0.0, 1.0)
    apart = np.linalg.norm(away[None] - share[..., None] * along[:, None], axis=2)
    between = np.arange(len(places)) < ends[:, None]
    return np.asarray(np.where(between, apart, 0.0).max(axis=1) <= tolerance)


def _apart(hulls: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the greatest distance of the control points (parts, n, dim) of each part from the line of two points."""
    along = end - start
    square = float(along @ along)
    away = hulls - start
    share = np.clip(away @ along / square, 0.0, 1.0) if square > 0.0 else np.zeros(away.shape[:2])
    return np.asarray(np.linalg.norm(away - share[..., None] * along, axis=2).max(axis=1))
