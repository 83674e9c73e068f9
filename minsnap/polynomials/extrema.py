"""Exact maxima of polynomials on [0, 1], by the convex hull of control points and subdivision.

The largest control point bounds a polynomial from above, its end points from below; cutting an interval in
parts makes the two meet quadratically fast (J. M. Lane and R. F. Riesenfeld, "Bounds on a polynomial", BIT 21,
1981).  Only the parts that can still hold the maximum are cut again, and a concave part is bounded by the tangent at
its top, so the result is a proof, not a sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.arrays import FloatArray, IntArray
from minsnap.polynomials.bernstein import subdivide
from minsnap.polynomials.local_maxima import top

PARTS = 8
ROUNDS = 14
RESOLUTION = 64.0 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class Maxima:
    """Where polynomials are largest.

    Parameters
    ----------
    values : ndarray, shape (g,)
        Maximum of each group, attained; the true one exceeds it by rounding alone
        (``RESOLUTION`` times the group's largest control point).
    rows : ndarray of int, shape (g,)
        Which polynomial of the group attains it.
    where : ndarray, shape (g,)
        Where on [0, 1].
    """

    values: FloatArray
    rows: IntArray
    where: FloatArray


def maxima(points: FloatArray) -> Maxima:
    """Find the maximum of each of many polynomials on [0, 1].

    Parameters
    ----------
    points : ndarray, shape (m, n + 1)
        Bernstein control points of m scalar polynomials, finite.
    """
    return _Search(points, np.arange(len(points))).run()


def maximum(points: FloatArray) -> tuple[float, int, float]:
    """Largest value over all the polynomials (m, n + 1): the value, which one takes it, and where on [0, 1]."""
    found = _Search(points, np.zeros(len(points), dtype=np.intp)).run()
    return float(found.values[0]), int(found.rows[0]), float(found.where[0])


class _Search:
    """Branch and bound over pieces of polynomials; a group's polynomials stand together."""

    def __init__(self, points: FloatArray, group: IntArray) -> None:
        groups = int(group[-1]) + 1
        self.values = np.full(groups, -np.inf)
        self.rows = np.zeros(groups, dtype=np.intp)
        self.where = np.zeros(groups)
        self.points, self.group = points, group
        self.row = np.arange(len(points))
        self.low = np.zeros(len(points))
        self.slack = RESOLUTION * np.maximum.reduceat(np.abs(points).max(axis=1), _starts(group))

    def run(self) -> Maxima:
        width = 1.0
        for _ in range(ROUNDS):
            self._attain(width)
            kept = self.points.max(axis=1) > (self.values + self.slack)[self.group]
            if not kept.any():
                break
            width /= PARTS
            self._cut(kept, width)
            if width < 1.0 / PARTS:
                self._climb(width)
            if not len(self.points):
                break
        return Maxima(self.values, self.rows, self.where)

    def _attain(self, width: float) -> None:
        """Raise each group's best value to the largest end point of its pieces."""
        last = self.points[:, -1] > self.points[:, 0]
        ends = np.where(last, self.points[:, -1], self.points[:, 0])
        starts = _starts(self.group)
        present = self.group[starts]
        best = np.maximum.reduceat(ends, starts)
        self.values[present] = np.maximum(self.values[present], best)
        found = np.flatnonzero(ends == self.values[self.group])
        self.rows[self.group[found]] = self.row[found]
        self.where[self.group[found]] = self.low[found] + width * last[found]

    def _climb(self, width: float) -> None:
        """Settle concave parts that rise and fall: Newton's method finds the top, and its tangent bounds the rest."""
        points = self.points
        second = points[:, 2:] - 2.0 * points[:, 1:-1] + points[:, :-2]
        rises, falls = points[:, 1] > points[:, 0], points[:, -2] > points[:, -1]
        part = np.flatnonzero(rises & falls & (second.max(axis=1, initial=-np.inf) <= 0.0))
        if not len(part):
            return
        s, value, slope = top(points[part])
        group = self.group[part]
        np.maximum.at(self.values, group, value)
        best = value == self.values[group]
        self.rows[group[best]] = self.row[part[best]]
        self.where[group[best]] = self.low[part[best]] + width * s[best]
        bound = value + np.maximum(slope * (1.0 - s), -slope * s)
        settled = part[bound <= (self.values + self.slack)[group]]
        kept = np.ones(len(points), dtype=bool)
        kept[settled] = False
        self.points, self.group, self.row, self.low = points[kept], self.group[kept], self.row[kept], self.low[kept]

    def _cut(self, kept: npt.NDArray[np.bool_], width: float) -> None:
        """Replace the pieces kept by their parts."""
        self.points = subdivide(self.points[kept], PARTS).reshape(-1, self.points.shape[1])
        self.group = np.repeat(self.group[kept], PARTS)
        self.row = np.repeat(self.row[kept], PARTS)
        self.low = np.add.outer(self.low[kept], width * np.arange(PARTS)).reshape(-1)


def _starts(group: IntArray) -> IntArray:
    """First index of each run of equal values."""
    first = np.ones(len(group), dtype=bool)
    np.not_equal(group[1:], group[:-1], out=first[1:])
    return np.flatnonzero(first)
