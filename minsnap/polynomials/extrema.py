"""Proved maxima of polynomials on [0, 1], by the convex hull of control points and subdivision.

The largest control point bounds a polynomial from above, its end points from below; cutting an interval in
parts makes the two meet quadratically fast (J. M. Lane and R. F. Riesenfeld, "Bounds on a polynomial", BIT 21,
1981).  Only the parts that can still hold the maximum are cut again.  A part that is concave but for rounding is
settled sooner, by Taylor's theorem at a point s that Newton's method finds,

    p(t) <= p(s) + p'(s) (t - s) + max(0, max p'') (t - s)^2 / 2.

Every control point carries a bound on its error, so the result is a proof, not a sample and not an estimate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.polynomials.bernstein import basis, subdivision
from minsnap.polynomials.enclosures import UNIT, Enclosure, above, below
from minsnap.polynomials.local_maxima import STEPS

PARTS = 8
"""Into how many parts an interval is cut."""


@dataclass(frozen=True, eq=False)
class Maxima:
    """Where polynomials are largest.

    Parameters
    ----------
    values : ndarray, shape (g,)
        A value that each group attains, whatever the rounding.
    bounds : ndarray, shape (g,)
        A value that it never exceeds, whatever the rounding; above ``values`` by rounding alone.
    rows : ndarray of int, shape (g,)
        Which polynomial of the group attains it.
    where : ndarray, shape (g,)
        Where on [0, 1].
    """

    values: FloatArray
    bounds: FloatArray
    rows: IntArray
    where: FloatArray


def maxima(points: FloatArray, errors: FloatArray | None = None) -> Maxima:
    """Find the maximum of each of many polynomials on [0, 1].

    Parameters
    ----------
    points : ndarray, shape (m, n + 1)
        Bernstein control points of m scalar polynomials, finite.
    errors : ndarray, shape (m, n + 1), optional
        How far each may be off; by default zero.
    """
    return _Search(points, errors, np.arange(len(points))).run()


def maximum(points: FloatArray, errors: FloatArray | None = None) -> tuple[float, int, float]:
    """Largest value over all the polynomials (m, n + 1): a proved bound, which one comes nearest, where on [0, 1]."""
    largest = _Search(points, errors, np.zeros(len(points), dtype=np.intp)).run()
    return float(largest.bounds[0]), int(largest.rows[0]), float(largest.where[0])


class _Search:
    """Branch and bound over parts of polynomials; a group's polynomials stand together.

    A part needs no closer look if it is proved to be no higher than what its group attains, or if it differs from what
    its own polynomial attains by rounding alone.
    """

    def __init__(self, points: FloatArray, errors: FloatArray | None, group: IntArray) -> None:
        groups = int(group[-1]) + 1
        self.values, self.bounds = np.full(groups, -np.inf), np.full(groups, -np.inf)
        self.rows, self.where = np.zeros(groups, dtype=np.intp), np.zeros(groups)
        self.parts = Enclosure(points, np.zeros_like(points) if errors is None else errors)
        self.group = group
        self.row = np.arange(len(points))
        self.own = np.full(len(points), -np.inf)
        self.low = np.zeros(len(points))

    def run(self) -> Maxima:
        width = 1.0
        while width > UNIT:
            self._attain_ends(width)
            self._settle(self._core(), self._hull())
            if len(self.group) and width < 1.0:
                self._climb(width)
            if not len(self.group):
                break
            width /= PARTS
            self._cut(width)
        else:
            np.maximum.at(self.bounds, self.group, self._hull())
        return Maxima(self.values, self.bounds, self.rows, self.where)

    def _hull(self) -> FloatArray:
        """Return what no part exceeds."""
        return np.asarray(above(self.parts.points, self.parts.errors).max(axis=1))

    def _core(self) -> FloatArray:
        """Return how high a part seems to reach, rounding left out: no finer part can be told from it."""
        return np.asarray((self.parts.points - 3.0 * self.parts.errors).max(axis=1))

    def _settle(self, core: FloatArray, bound: FloatArray, which: IntArray | None = None) -> None:
        """Give up parts (all unless named) that reach no higher than their group, or seem to than their polynomial."""
        which = np.arange(len(self.group)) if which is None else which
        settled = _as_good(self.values[self.group[which]], bound) | _as_good(self.own[self.row[which]], core)
        np.maximum.at(self.bounds, self.group[which[settled]], bound[settled])
        kept = np.ones(len(self.group), dtype=bool)
        kept[which[settled]] = False
        self._keep(kept)

    def _keep(self, kept: BoolArray) -> None:
        self.parts = Enclosure(self.parts.points[kept], self.parts.errors[kept])
        self.group, self.row, self.low = self.group[kept], self.row[kept], self.low[kept]

    def _attain_ends(self, width: float) -> None:
        lower = below(self.parts.points[:, [0, -1]], self.parts.errors[:, [0, -1]])
        last = lower[:, 1] > lower[:, 0]
        self._attain(np.where(last, lower[:, 1], lower[:, 0]), self.row, self.low + width * last, self.group)

    def _attain(self, values: FloatArray, row: IntArray, where: FloatArray, group: IntArray) -> None:
        """Raise the value of each group, and of each polynomial, to the largest that its parts attain."""
        before = self.values.copy()
        np.maximum.at(self.own, row, values)
        np.maximum.at(self.values, group, values)
        best = np.flatnonzero((values == self.values[group]) & (values > before[group]))
        self.rows[group[best]], self.where[group[best]] = row[best], where[best]

    def _climb(self, width: float) -> None:
        """Settle parts that are concave but for rounding and that rise and fall."""
        points = self.parts.points
        if points.shape[1] < 3:
            return
        bend, concave = _bend(self.parts)
        part = np.flatnonzero(concave & (points[:, 1] > points[:, 0]) & (points[:, -2] > points[:, -1]))
        if not len(part):
            return
        chosen = Enclosure(points[part], self.parts.errors[part])
        s = _top(chosen.points)
        value, error, slope, off = _expansion(chosen, s)
        self._attain(below(value, error), self.row[part], self.low[part] + width * s, self.group[part])
        n, away = points.shape[1] - 1, np.maximum(s, 1.0 - s)
        excess = np.abs(slope) * away + 0.5 * n * (n - 1) * bend[part] * away**2
        core = value + excess - 4.0 * (error + off)
        self._settle(core, above(value, error + off * away + excess), part)

    def _cut(self, width: float) -> None:
        """Replace the parts by theirs; the matrix's entries are rounded once, and its rows are convex combinations."""
        points, matrix = self.parts.points, subdivision(self.parts.points.shape[1] - 1, PARTS).T
        count = points.shape[1]
        errors = (self.parts.errors + (count + 2) * UNIT * np.abs(points)) @ matrix
        errors = errors.reshape(-1, PARTS, count)
        errors[:, 0, 0], errors[:, -1, -1] = self.parts.errors[:, 0], self.parts.errors[:, -1]
        self.parts = Enclosure((points @ matrix).reshape(-1, count), errors.reshape(-1, count))
        self.group, self.row = np.repeat(self.group, PARTS), np.repeat(self.row, PARTS)
        self.low = np.add.outer(self.low, width * np.arange(PARTS)).reshape(-1)


def _as_good(attained: FloatArray, upper: FloatArray) -> BoolArray:
    """Whether upper bounds are as good as attained: what is left comes from rounding."""
    return np.asarray(upper <= attained + 16.0 * UNIT * np.abs(attained))


def _bend(parts: Enclosure) -> tuple[FloatArray, BoolArray]:
    """Upper bounds, at least zero, on second differences, and whether none is certainly positive."""
    first = np.diff(parts.points, axis=1)
    second = np.diff(first, axis=1)
    errors = parts.errors[:, 2:] + 2.0 * parts.errors[:, 1:-1] + parts.errors[:, :-2]
    errors = errors + UNIT * (np.abs(first[:, 1:]) + np.abs(first[:, :-1]) + np.abs(second))
    bend = np.maximum(above(second, errors).max(axis=1), 0.0)
    return bend, np.asarray((second <= 2.0 * errors).all(axis=1))


def _top(points: FloatArray) -> FloatArray:
    """Highest places of concave polynomials (m, n + 1) that rise and fall, by Newton's method on the slope."""
    first = np.diff(points, axis=1)
    second, degree = np.diff(first, axis=1), points.shape[1] - 1
    s = first[:, 0] / (first[:, 0] - first[:, -1])
    for _ in range(STEPS):
        slope = np.einsum("rj,rj->r", basis(degree - 1, s), first)
        curve = (degree - 1) * np.einsum("rj,rj->r", basis(degree - 2, s), second)
        s = np.clip(s - slope / np.where(curve < 0.0, curve, np.inf), 0.0, 1.0)
    return s


def _expansion(parts: Enclosure, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Values and slopes at s, each with its error: at most 2 n + 10 roundings of each term, and those of their sum."""
    degree = parts.points.shape[1] - 1
    weights, lower = basis(degree, s), basis(degree - 1, s)
    first = np.diff(parts.points, axis=1)
    off = parts.errors[:, 1:] + parts.errors[:, :-1] + UNIT * np.abs(first)
    share = (3 * degree + 12) * UNIT
    value = np.einsum("rj,rj->r", weights, parts.points)
    error = np.einsum("rj,rj->r", weights, parts.errors + share * np.abs(parts.points))
    slope = degree * np.einsum("rj,rj->r", lower, first)
    return value, error, slope, degree * np.einsum("rj,rj->r", lower, off + share * np.abs(first))
