"""Proved maxima of polynomials on [0, 1], by the convex hull of control points and subdivision; and of their quotients.

The largest control point bounds a polynomial from above, its end points from below; cutting an interval in
parts makes the two meet quadratically fast (J. M. Lane and R. F. Riesenfeld, "Bounds on a polynomial", BIT 21,
1981).  Only the parts that can still hold the maximum are cut again.  Every control point carries a bound on its error,
so the result is a proof, not a sample and not an estimate.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from math import factorial
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.tolerances import ROUNDING
from minsnap.polynomials.bernstein import basis, derivative_basis_map, rising_powers, split, squared_norm, subdivision
from minsnap.polynomials.enclosures import UNIT, Enclosure, above, below

PARTS = 8
"""Into how many parts an interval is cut."""

Maximum = Callable[[FloatArray], tuple[float, int, float]]
"""Gives the largest value of polynomials, which of them has it, and where on [0, 1]."""


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
            self._settle()
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

    def _settle(self) -> None:
        """Give up parts that reach no higher than their group, or seem to than their polynomial, rounding left out."""
        # A part is done when its upper bound is no higher than what its group attains. The second test is for rounding:
        # where a polynomial is flat at its top, no cut brings bound and value together, but the points already agree.
        bound, seeming = self._hull(), (self.parts.points - 3.0 * self.parts.errors).max(axis=1)
        settled = _as_good(self.values[self.group], bound) | _as_good(self.own[self.row], seeming)
        np.maximum.at(self.bounds, self.group[settled], bound[settled])
        self.parts = Enclosure(self.parts.points[~settled], self.parts.errors[~settled])
        self.group, self.row, self.low = self.group[~settled], self.row[~settled], self.low[~settled]

    def _attain_ends(self, width: float) -> None:
        """Raise the value of each group, and of each polynomial, to the largest at the ends of its parts."""
        # The first and last control point of a part are values of the curve, less their rounding: what is found here is
        # attained, and only ever raised. The hull of all control points bounds the maximum from above.
        lower = below(self.parts.points[:, [0, -1]], self.parts.errors[:, [0, -1]])
        last = lower[:, 1] > lower[:, 0]
        values, where = np.where(last, lower[:, 1], lower[:, 0]), self.low + width * last
        before = self.values.copy()
        np.maximum.at(self.own, self.row, values)
        np.maximum.at(self.values, self.group, values)
        best = np.flatnonzero((values == self.values[self.group]) & (values > before[self.group]))
        self.rows[self.group[best]], self.where[self.group[best]] = self.row[best], where[best]

    def _cut(self, width: float) -> None:
        """Replace the parts by theirs; the matrix's entries are rounded once, and its rows are convex combinations."""
        points, matrix = self.parts.points, subdivision(self.parts.points.shape[1] - 1, PARTS).T
        count = points.shape[1]
        # A new point is a convex combination of `count` old ones: it inherits their errors in the same shares, and each
        # of its products and sums, and the matrix's entry, rounds once more. Ends of the old part stay as they are.
        errors = (self.parts.errors + (count + 2) * UNIT * np.abs(points)) @ matrix
        errors = errors.reshape(-1, PARTS, count)
        errors[:, 0, 0], errors[:, -1, -1] = self.parts.errors[:, 0], self.parts.errors[:, -1]
        self.parts = Enclosure((points @ matrix).reshape(-1, count), errors.reshape(-1, count))
        self.group, self.row = np.repeat(self.group, PARTS), np.repeat(self.row, PARTS)
        self.low = np.add.outer(self.low, width * np.arange(PARTS)).reshape(-1)


def _as_good(attained: FloatArray, upper: FloatArray) -> BoolArray:
    """Whether upper bounds are as good as attained: what is left comes from rounding."""
    return np.asarray(upper <= attained + 16.0 * UNIT * np.abs(attained))


@dataclass(frozen=True)
class HalvingSettings:
    """How far curves are halved.

    Parameters
    ----------
    like : float
        Least share of a curve's greatest squared norm on a part: below it rounding hides what is small.
    times : int
        How often at most: then a part is shorter than what rounding tells apart.
    parts : int
        How many at most, so that memory stays small.
    """

    like: float = 3e-3
    times: int = 44
    parts: int = 4096


HALVING = HalvingSettings()


class CurveParts(NamedTuple):
    """Parts of curves, each (m, n + 1, dim), and of each its row (m,), where on [0, 1] it begins, and its width."""

    curves: list[FloatArray]
    row: IntArray
    low: FloatArray
    width: FloatArray

    def chosen(self, which: IntArray | BoolArray) -> CurveParts:
        """Return some of them."""
        curves = [curve[which] for curve in self.curves]
        return CurveParts(curves, self.row[which], self.low[which], self.width[which])

    def halved(self) -> CurveParts:
        """Return the first halves of all, and then the second ones."""
        width = 0.5 * self.width
        low = np.concatenate((self.low, self.low + width))
        halves = [np.concatenate(split(curve, 0.5)) for curve in self.curves]
        return CurveParts(halves, np.tile(self.row, 2), low, np.tile(width, 2))

    @classmethod
    def joined(cls, parts: Sequence[CurveParts]) -> CurveParts:
        """Return all of several."""
        curves, *columns = zip(*parts, strict=True)
        return cls([np.concatenate(one) for one in zip(*curves, strict=True)], *map(np.concatenate, columns))


def halved_to_like_sizes(*curves: FloatArray) -> CurveParts:
    """Halve curves until the first one has values of like size on each part.

    Where it nearly vanishes inside a part, the rounding of its large values there would be larger than the small ones.
    """
    count, done = len(curves[0]), []
    rest = CurveParts([*curves], np.arange(count), np.zeros(count), np.ones(count))
    for halving in range(HALVING.times + 1):
        square = squared_norm(rest.curves[0])
        most = square.max(axis=1)
        unlike = (square.min(axis=1) < HALVING.like * most) & (most > ROUNDING**2)
        unlike &= halving < HALVING.times and len(square) < HALVING.parts
        if unlike.any():
            unlike[unlike] = -maxima(-square[unlike]).bounds < HALVING.like * most[unlike]
        done.append(rest.chosen(~unlike))
        if not unlike.any():
            break
        rest = rest.chosen(unlike).halved()
    return CurveParts.joined(done)


def largest_ratio(top: FloatArray, bottom: FloatArray, largest: Maximum = maximum) -> tuple[float, int, float]:
    """Largest p/q over many pairs of polynomials on [0, 1], q not negative, by Dinkelbach's method.

    The largest p/q is the root t of max(p - t q) = 0; each step sets t to p/q where p - t q is largest and converges
    superlinearly (W. Dinkelbach, "On nonlinear fractional programming", Management Science 13, 1967).

    Parameters
    ----------
    top, bottom : ndarray, shape (m, n + 1)
        Control points of p and q, of the same degree.
    largest : callable, optional
        By default the Python one.

    Returns
    -------
    value : float
        Infinite where q vanishes and p does not.
    row : int
        Which pair.
    where : float
        Instant in [0, 1].
    """
    size = np.ldexp(1.0, np.frexp(np.abs(bottom).max(axis=1, keepdims=True))[1])  # rounding of one pair hides no other
    top, bottom = top / size, bottom / size
    with np.errstate(over="ignore"):
        first = top[:, 0] / np.maximum(bottom[:, 0], np.finfo(np.float64).tiny)
    row, where = int(np.argmax(first)), 0.0
    trial = float(first[row])
    while np.isfinite(trial):
        _, row, where = largest(top - trial * bottom)
        weights = basis(top.shape[1] - 1, np.array([where]))[0]
        p, q = float(weights @ top[row]), float(weights @ bottom[row])
        # p/q never falls from one trial to the next. Where it no longer rises by more than rounding, the maximum of
        # p - t q is zero to rounding, and the trial is the largest ratio.
        ratio = p / q if q > 0.0 else np.inf
        if not ratio > trial + 4.0 * np.finfo(np.float64).eps * abs(trial):
            return max(ratio, trial), row, where
        trial = ratio
    return trial, row, where


REFINED_BELOW = 0.05
"""How far below zero, as a share of its range, a polynomial's maximum on the grid may be and still be refined.

Between grid points 1/(4n) apart a polynomial of degree n rises by less than 0.04 of its range."""

STEPS = 2
"""Newton steps after the one from the grid point."""


@cache
def _grid(degree: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return grid points, the steps down and up to the next ones, and the matrix from control points to values."""
    s = np.linspace(0.0, 1.0, 4 * degree + 1)
    return s, -np.diff(s, prepend=0.0), np.diff(s, append=1.0), np.ascontiguousarray(basis(degree, s).T)


@cache
def _expansions(degree: int) -> FloatArray:
    """Taylor coefficients of value, slope and second derivative around every grid point, from control points.

    Shape (grid, 3 (degree + 1), degree + 1): three rows of coefficients one after the other, ended by zeros.
    """
    s = _grid(degree)[0]
    matrices = np.zeros((len(s), 3, degree + 1, degree + 1))
    for order in range(3):
        for k in range(degree + 1 - order):
            values = basis(degree - order - k, s) @ derivative_basis_map(degree, order + k)
            matrices[:, order, k] = values / factorial(k)
    return matrices.reshape(len(s), 3 * (degree + 1), degree + 1)


def peaks(points: FloatArray, above: float) -> tuple[IntArray, FloatArray, FloatArray]:
    """Local maxima higher than ``above``, for polynomials with control points of shape (m, n + 1).

    Returns
    -------
    row : ndarray of int, shape (p,)
        Which polynomial.
    s : ndarray, shape (p,)
        Where on [0, 1].
    value : ndarray, shape (p,)
        How high.
    """
    highest = points.max(axis=1)
    may = np.flatnonzero(highest > above)
    if not len(may):
        return may, np.zeros(0), np.zeros(0)
    if points.shape[1] == 1:
        return may, np.zeros(len(may)), points[may, 0]
    points = points[may]
    values = points @ _grid(points.shape[1] - 1)[3]
    row, column = _summits(values, above - REFINED_BELOW * (highest[may] - points.min(axis=1))[:, None])
    s, value = _refine(points[row], values, row, column)
    kept = value > above
    return may[row[kept]], s[kept], value[kept]


def _summits(values: FloatArray, floor: FloatArray) -> tuple[IntArray, IntArray]:
    high = values > floor
    rising = values[:, 1:] >= values[:, :-1]
    # Not below the left neighbour and above the right one: a plateau counts once, at its right end.
    high[:, 1:] &= rising
    high[:, :-1] &= ~rising
    row, column = np.nonzero(high)
    return row, column


def _refine(points: FloatArray, values: FloatArray, row: IntArray, column: IntArray) -> tuple[FloatArray, FloatArray]:
    """Take Newton steps on the derivative, no further than the next grid points; never to a lower value."""
    value, degree = values[row, column], points.shape[1] - 1
    s, low, high = (grid[column] for grid in _grid(degree)[:3])
    if degree < 2 or not len(s):
        return s, value
    taylor = np.matmul(_expansions(degree)[column], points[:, :, None]).reshape(len(s), 3, degree + 1)
    step = np.clip(_newton(taylor[:, 1, 0], taylor[:, 2, 0]), low, high)
    for _ in range(STEPS):
        local = _at(taylor[:, 1:], step)
        step = np.clip(step + _newton(local[:, 0], local[:, 1]), low, high)
    refined = _at(taylor[:, :1], step)[:, 0]
    better = refined > value
    return np.where(better, s + step, s), np.where(better, refined, value)


def _at(taylor: FloatArray, step: FloatArray) -> FloatArray:
    """Values of polynomials (p, q, n + 1) a step (p,) away: (p, q)."""
    return np.asarray(np.matmul(taylor, rising_powers(step, 0, taylor.shape[2])[:, :, None])[:, :, 0])


def _newton(slope: FloatArray, curve: FloatArray) -> FloatArray:
    """Step to a maximum; none where the curve is not concave."""
    return np.asarray(slope / np.where(curve < 0.0, -curve, np.inf))
