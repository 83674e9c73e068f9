r"""One segment of a trajectory on the unit interval, in the Bernstein basis.

A segment of degree :math:`n` is :math:`x(s) = \sum_j \binom{n}{j} s^j (1-s)^{n-j} p_j` for
:math:`s \in [0, 1]`; the :math:`p_j` are its control points and bound it from all sides (the convex hull
property), which is what makes certificates cheap.  Constant matrices are computed in exact rationals and
rounded once.  Source of the identities: R. T. Farouki, "The Bernstein polynomial basis: a centennial
retrospective", Computer Aided Geometric Design 29 (2012).
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from math import comb, perm
from typing import Any

import numpy as np
from numpy.typing import NDArray

from minsnap.basics.arrays import FloatArray, IntArray, read_only

Rational = NDArray[Any]
"""A matrix of exact rationals: objects, whose sums and products numpy leaves to them."""


def _exact(rows: int, columns: int, entry: Callable[[int, int], Any]) -> Rational:
    """Return the matrix of an entry for each row and column."""
    return np.array([[Fraction(entry(i, j)) for j in range(columns)] for i in range(rows)])


def _rounded(matrix: Rational) -> FloatArray:
    return read_only(matrix.astype(np.float64))


def _difference(degree: int, order: int) -> Rational:
    """Control points of a degree-n polynomial to those of its derivative of that order."""

    def entry(i: int, j: int) -> Any:
        return (-1) ** (order - j + i) * comb(order, j - i) if 0 <= j - i <= order else 0

    return perm(degree, order) * _exact(degree - order + 1, degree + 1, entry)


def _exact_gram(degree: int, order: int) -> Rational:
    difference, n = _difference(degree, order), degree - order
    products = _exact(n + 1, n + 1, lambda i, j: Fraction(comb(n, i) * comb(n, j), (2 * n + 1) * comb(2 * n, i + j)))
    return difference.T @ products @ difference


def _exact_ends_map(degree: int) -> Rational:
    """End derivatives to control points: a block for the start, and its mirror image for the end."""
    half = (degree + 1) // 2
    start = _exact(half, half, lambda j, i: Fraction(comb(j, i), perm(degree, i)))
    whole = np.full((2 * half, 2 * half), Fraction(0))
    whole[:half, :half], whole[half:, half:] = start, start[::-1] * (-1) ** np.arange(half)
    return whole


@cache
def ends_to_points(degree: int) -> FloatArray:
    """Matrix from end derivatives to control points.

    Parameters
    ----------
    degree : int
        Odd, ``2k - 1``.

    Returns
    -------
    ndarray, shape (2k, 2k)
        Takes (x(0), x'(0), …, x^(k-1)(0), x(1), …, x^(k-1)(1)), derivatives in s, to the control points.
        The first k control points depend on the start alone, the last k on the end alone.
    """
    return _rounded(_exact_ends_map(degree))


@cache
def gram(degree: int, order: int) -> FloatArray:
    r"""Gram matrix of a derivative on the unit interval.

    Returns
    -------
    Q : ndarray, shape (degree + 1, degree + 1)
        :math:`\int_0^1 x^{(r)}(s)^2\,ds = p^\top Q p` for control points p; symmetric, positive semidefinite,
        rank ``degree + 1 - order``.
    """
    return _rounded(_exact_gram(degree, order))


@cache
def exact_ends_gram(degree: int) -> Rational:
    """Gram matrix of the k-th derivative in end derivatives, degree 2k - 1: 2k rows of 2k rationals."""
    ends = _exact_ends_map(degree)
    return ends.T @ _exact_gram(degree, (degree + 1) // 2) @ ends


@cache
def ends_gram(degree: int) -> FloatArray:
    """``exact_ends_gram`` rounded once: shape (2k, 2k)."""
    return _rounded(exact_ends_gram(degree))


@cache
def ends_to_highest(degree: int) -> FloatArray:
    """Matrix from end derivatives to the control points of the k-th derivative, degree 2k - 1: shape (k, 2k)."""
    return _rounded(_difference(degree, (degree + 1) // 2) @ _exact_ends_map(degree))


@cache
def gram_root(degree: int) -> FloatArray:
    r"""Upper triangular R with :math:`\int_0^1 x(s)^2\,ds = |R p|^2` for control points p.

    Row i holds the products of all B_j with a polynomial of B_0 ... B_i that is orthogonal to those before B_i: by
    Rodrigues' formula a Jacobi polynomial, so that
    :math:`R_{ij} = \sqrt{2n - 2i + 1} \binom{j}{i} \frac{n!}{(n - j)!} \frac{(2n - i - j)!}{(2n - i + 1)!}`.

    Returns
    -------
    R : ndarray, shape (degree + 1, degree + 1)
    """
    n = degree
    shares = _exact(n + 1, n + 1, lambda i, j: Fraction(comb(j, i) * perm(n, j), perm(2 * n - i + 1, j + 1)))
    return read_only(np.sqrt(2.0 * n + 1.0 - 2.0 * np.arange(n + 1.0))[:, None] * _rounded(shares))


@cache
def points_to_powers(degree: int) -> FloatArray:
    """Matrix from control points to the coefficients of 1, s, s², …: shape (degree + 1, degree + 1)."""
    return _rounded(_exact(degree + 1, degree + 1, lambda i, j: (-1) ** (i + j) * comb(degree, i) * comb(i, j)))


@cache
def powers_to_points(degree: int) -> FloatArray:
    """Matrix from the coefficients of 1, s, s², … to control points: shape (degree + 1, degree + 1)."""
    return _rounded(_exact(degree + 1, degree + 1, lambda j, i: Fraction(comb(j, i), comb(degree, i))))


@cache
def _binomials(degree: int) -> FloatArray:
    return np.array([float(comb(degree, j)) for j in range(degree + 1)])


def mapped(matrix: FloatArray, points: FloatArray) -> FloatArray:
    """Matrix (m, n) times each of points (..., n, dim): (..., m, dim), with sums in one order on every machine."""
    return np.asarray((matrix[:, :, None] * points[..., None, :, :]).sum(axis=-2))


def basis(degree: int, s: FloatArray) -> FloatArray:
    """Values of the Bernstein polynomials.

    Parameters
    ----------
    s : ndarray, shape (m,)
        In [0, 1].

    Returns
    -------
    ndarray, shape (m, degree + 1)
        Non-negative; every row sums to one.
    """
    values = rising_powers(s, 0, degree + 1)
    values *= rising_powers(1.0 - s, 0, degree + 1)[:, ::-1]
    values *= _binomials(degree)
    return values


def differentiate(points: FloatArray, order: int) -> FloatArray:
    """Control points of a derivative in s: (…, n + 1, dim) to (…, n + 1 - order, dim); zero past the degree."""
    for _ in range(order):
        degree = points.shape[-2] - 1
        if degree == 0:
            return np.zeros_like(points)
        points = degree * (points[..., 1:, :] - points[..., :-1, :])
    return points


def careful_differences(points: FloatArray, order: int) -> FloatArray:
    """Differences of that order of control points (…, n + 1, dim), as if computed exactly and rounded once.

    Each carries the rounding of those before along (D. E. Knuth, "The Art of Computer Programming", vol. 2, theorem
    4.2.2B), so that small differences of large numbers keep their digits.
    """
    rounding = np.zeros_like(points)
    for _ in range(order):
        a, b = points[..., :-1, :], points[..., 1:, :]
        points = b - a
        back = b - points
        rounding = rounding[..., 1:, :] - rounding[..., :-1, :] + ((b - (points + back)) - (a - back))
    return np.asarray(points + rounding)


@cache
def derivative_basis_map(degree: int, order: int) -> FloatArray:
    """Matrix of ``differentiate`` on one coordinate: shape (degree + 1 - order, degree + 1)."""
    return _rounded(_difference(degree, order))


@cache
def _square_weights(degree: int) -> FloatArray:
    weights = np.zeros((2 * degree + 1, degree + 1, degree + 1))
    for i, j in np.ndindex(degree + 1, degree + 1):
        weights[i + j, i, j] = comb(degree, i) * comb(degree, j) / comb(2 * degree, i + j)
    return weights


def squared_norm(points: FloatArray) -> FloatArray:
    """Control points of the squared Euclidean norm of a curve: (m, n + 1, dim) to (m, 2n + 1)."""
    degree = points.shape[1] - 1
    products = points @ points.transpose(0, 2, 1)
    return products.reshape(len(points), -1) @ _square_weights(degree).reshape(2 * degree + 1, -1).T


@cache
def subdivision(degree: int, parts: int) -> FloatArray:
    """Stacked matrices from control points on [0, 1] to those on each of ``parts`` equal subintervals.

    Row i of the part from a / m to (a + 1) / m holds the coefficients of z^0, z^1, ... in
    (m - a + a z)^(n - i) (m - a - 1 + (a + 1) z)^i / m^n, by blossoming; integers, rounded once.

    Returns
    -------
    ndarray, shape (parts * (degree + 1), degree + 1)
        Every row is a convex combination.
    """
    whole = parts**degree
    rows = []
    for part in range(parts):
        low, high = _linear_powers(parts, part, degree), _linear_powers(parts, part + 1, degree)
        rows += [[value / whole for value in np.convolve(low[degree - i], high[i])] for i in range(degree + 1)]
    return read_only(np.array(rows))


def _linear_powers(parts: int, part: int, degree: int) -> list[np.ndarray[Any, Any]]:
    """Coefficients of (parts - part + part z)^i for i up to the degree, in integers of any size."""
    return [
        np.array([comb(i, j) * part**j * (parts - part) ** (i - j) for j in range(i + 1)], dtype=object)
        for i in range(degree + 1)
    ]


def subdivide(points: FloatArray, parts: int) -> FloatArray:
    """Split scalar polynomials into equal parts: (m, n + 1) to (m, parts, n + 1)."""
    degree = points.shape[1] - 1
    return (points @ subdivision(degree, parts).T).reshape(len(points), parts, degree + 1)


def split(points: FloatArray, s: Any) -> tuple[FloatArray, FloatArray]:
    """Split curves at s by de Casteljau's algorithm: control points (..., n + 1, dim) of both parts."""
    left, right = [points[..., 0, :]], [points[..., -1, :]]
    while points.shape[-2] > 1:
        points = points[..., :-1, :] + s * (points[..., 1:, :] - points[..., :-1, :])
        left.append(points[..., 0, :])
        right.append(points[..., -1, :])
    return np.stack(left, axis=-2), np.stack(right[::-1], axis=-2)


def cut_points(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the control points of parts of pieces, from s = start to s = end, both of shape (parts,), by blossoms."""
    degree = points.shape[1] - 1
    cut = []
    for j in range(degree + 1):
        reduced = points
        for step in range(degree):
            s = (end if step < j else start)[:, None, None]
            reduced = (1.0 - s) * reduced[:, :-1] + s * reduced[:, 1:]
        cut.append(reduced[:, 0])
    return np.stack(cut, axis=1)


def parted(points: FloatArray, durations: FloatArray) -> tuple[NDArray[Any], float]:
    """Split curves at inner instants in whole numbers of 192 bits: no machine rounds them in its own way.

    Parameters
    ----------
    points : ndarray, shape (m, n + 1, dim)
    durations : ndarray, shape (m, parts)
        Of the parts of each curve, in their order.

    Returns
    -------
    parts : ndarray of int, shape (m, parts, n + 1, dim)
        For :func:`from_whole`.
    unit : float
        Of those numbers.
    """
    bits, parts = 192, []
    unit, tick = (2.0 ** float(np.frexp(np.abs(values).max())[1] - bits) for values in (points, durations))
    rest, times = to_whole(points, unit), to_whole(durations, tick)
    for part in range(times.shape[1] - 1):
        s = ((times[:, part] << bits) // times[:, part:].sum(axis=1))[:, None, None]
        left, right = [rest[:, 0]], [rest[:, -1]]
        while rest.shape[1] > 1:
            rest = rest[:, :-1] + (s * np.diff(rest, axis=1) >> bits)
            left.append(rest[:, 0])
            right.append(rest[:, -1])
        parts.append(np.stack(left, axis=1))
        rest = np.stack(right[::-1], axis=1)
    return np.stack([*parts, rest], axis=1), unit


def divided_pieces(durations: FloatArray, points: FloatArray, counts: IntArray) -> tuple[FloatArray, FloatArray]:
    """Divide polynomials into equal parts each, as exactly as :func:`parted` does.

    Parameters
    ----------
    durations : ndarray, shape (m,)
        [s].
    points : ndarray, shape (m, n + 1, dim)
    counts : ndarray of int, shape (m,)
        Parts of each.

    Returns
    -------
    durations : ndarray, shape (sum of counts,)
    points : ndarray, shape (sum of counts, n + 1, dim)
    """
    last = counts.cumsum()
    divided = np.empty((last[-1], *points.shape[1:]))
    for count in np.unique(counts).tolist():
        which = counts == count
        parts, unit = parted(points[which], np.ones((which.sum(), count)))
        divided[(last[which, None] - count + np.arange(count)).reshape(-1)] = from_whole(
            parts.reshape(-1, *points.shape[1:]), unit
        )
    return np.repeat(durations / counts, counts), divided


def to_whole(values: FloatArray, unit: float) -> NDArray[Any]:
    """Return numbers as whole ones of a unit, which is a power of 2."""
    whole = np.empty(values.size, dtype=object)
    whole[:] = [int(value) for value in (values / unit).ravel().tolist()]
    return whole.reshape(values.shape)


def from_whole(values: NDArray[Any], unit: float) -> FloatArray:
    """Return the numbers that whole ones stand for, each rounded once."""
    return values.astype(np.float64) * unit


def multiply(left: FloatArray, right: FloatArray) -> FloatArray:
    """Control points of products of scalar polynomials: (m, n + 1) and (m, l + 1) to (m, n + l + 1)."""
    n, m = left.shape[1] - 1, right.shape[1] - 1
    weighted = right * _binomials(m)
    product = np.zeros((len(left), n + m + 1))
    for j in range(n + 1):
        product[:, j : j + m + 1] += comb(n, j) * left[:, j, None] * weighted
    return np.asarray(product / _binomials(n + m))


def elevate(points: FloatArray, size: int) -> FloatArray:
    """Control points of the same polynomials, (..., n + 1) to (..., size): degree elevation."""
    rows = points.reshape(-1, points.shape[-1])
    return multiply(rows, np.ones((len(rows), size - rows.shape[1] + 1))).reshape(*points.shape[:-1], size)


def rising_powers(base: FloatArray, lowest: int, count: int) -> FloatArray:
    """Powers lowest, lowest + 1, … of each value of shape (m,): (m, count), by repeated multiplication."""
    powers = np.empty((count, len(base)))  # one power after the other: for many values ten times as fast as by rows
    powers[0] = base ** float(lowest)
    for power in range(1, count):
        np.multiply(powers[power - 1], base, out=powers[power])
    return np.ascontiguousarray(powers.T)
