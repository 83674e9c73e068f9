"""Splines in exact rationals: no rounding before the end, so that rounding elsewhere can be measured."""

from fractions import Fraction
from functools import cache
from math import comb, perm

import numpy as np


def solve(matrix, right):
    """Gauss-Jordan elimination on rationals: matrix (n, n), right (n, m), lists of lists."""
    rows = [[*map(Fraction, a), *map(Fraction, b)] for a, b in zip(matrix, right, strict=True)]
    size = len(rows)
    for column in range(size):
        pivot = next(row for row in range(column, size) if rows[row][column] != 0)
        rows[column], rows[pivot] = rows[pivot], rows[column]
        head = rows[column]
        inverse = 1 / head[column]
        rows[column] = head = [value * inverse for value in head]
        for row in range(size):
            factor = rows[row][column]
            if row != column and factor != 0:
                rows[row] = [a - factor * b for a, b in zip(rows[row], head, strict=True)]
    return [row[size:] for row in rows]


def derivative_row(size, order, s):
    """Factors of coefficients 1, s, s², … in a derivative at s."""
    return [perm(j, order) * Fraction(s) ** (j - order) if j >= order else Fraction(0) for j in range(size)]


@cache
def ends_to_powers(degree):
    """Matrix from derivatives 0 … k - 1 at both ends to the coefficients of 1, s, s², …."""
    half = (degree + 1) // 2
    rows = [derivative_row(degree + 1, order, s) for s in (0, 1) for order in range(half)]
    return solve(rows, [[int(i == j) for j in range(degree + 1)] for i in range(degree + 1)])


@cache
def power_gram(degree, order):
    """Integrals over [0, 1] of products of derivatives of 1, s, s², …."""
    return [
        [
            Fraction(perm(i, order) * perm(j, order), i + j - 2 * order + 1) if min(i, j) >= order else Fraction(0)
            for j in range(degree + 1)
        ]
        for i in range(degree + 1)
    ]


@cache
def ends_gram(degree):
    """Gram matrix of the k-th derivative in end derivatives."""
    C, Q, size = ends_to_powers(degree), power_gram(degree, (degree + 1) // 2), degree + 1
    half = [[sum(Q[i][j] * C[j][b] for j in range(size)) for b in range(size)] for i in range(size)]
    return [[sum(C[i][a] * half[i][b] for i in range(size)) for b in range(size)] for a in range(size)]


class Spline:
    """All curves through waypoints with given states at the ends and at waypoints, k-th derivative's cost, exactly.

    Unknowns are derivatives 1 … k - 1 at inner waypoints that no pin fixes, and the positions of those that are free.
    """

    def __init__(self, points, durations, degree=7, states=None, free_positions=()):
        self.degree, self.half, self.legs = degree, (degree + 1) // 2, len(durations)
        self.X = [[Fraction(float(value)) for value in point] for point in points]
        self.T = [Fraction(float(value)) for value in durations]
        self.dim = len(self.X[0])
        zero = [Fraction(0)] * self.dim
        rest = {order: zero for order in range(1, self.half)}
        states = {0: {}, self.legs: {}} | (states or {})
        self.known = {(knot, 0): self.X[knot] for knot in range(self.legs + 1)}
        for knot, state in states.items():
            given = {order: [Fraction(float(v)) for v in value] for order, value in state.items()}
            for order, value in ((rest if knot in (0, self.legs) else {}) | given).items():
                self.known[knot, order] = value
        keys = [(knot, order) for knot in range(1, self.legs) for order in range(self.half)]
        self.free = [key for key in keys if (key[0] in free_positions if key[1] == 0 else key not in self.known)]
        for key in self.free:
            self.known.pop(key, None)
        self.number = {key: index for index, key in enumerate(self.free)}
        self.H, self.f, self.constant = self._assemble()
        self.optimum = solve(self.H, self.f) if self.free else []

    def _keys(self, leg):
        return [(leg + side, order) for side in (0, 1) for order in range(self.half)]

    def _assemble(self):
        size, Q = len(self.free), ends_gram(self.degree)
        H = [[Fraction(0)] * size for _ in range(size)]
        f = [[Fraction(0)] * self.dim for _ in range(size)]
        constant = Fraction(0)
        for leg in range(self.legs):
            keys = self._keys(leg)
            for a, key in enumerate(keys):
                for b, other in enumerate(keys):
                    weight = self.T[leg] ** (1 - 2 * self.half + key[1] + other[1]) * Q[a][b]
                    if key in self.number and other in self.number:
                        H[self.number[key]][self.number[other]] += weight
                    elif key in self.number:
                        row = f[self.number[key]]
                        for axis in range(self.dim):
                            row[axis] -= weight * self.known[other][axis]
                    elif other not in self.number:
                        pairs = zip(self.known[key], self.known[other], strict=True)
                        constant += weight * sum(one * two for one, two in pairs)
        return H, f, constant

    def cost(self):
        """Least cost without walls."""
        pairs = zip(self.optimum, self.f, strict=True)
        return float(self.constant - sum(x * f for xs, fs in pairs for x, f in zip(xs, fs, strict=True)))

    def points(self):
        """Control points of the optimum without walls: (legs, degree + 1, dim)."""
        values = dict(self.known) | {key: self.optimum[index] for key, index in self.number.items()}
        return self._control_points(values, self.dim)

    def directions(self):
        """Control points of directions in which the cost grows by the squared norm: (legs, degree + 1, unknowns)."""
        size = len(self.free)
        inverse, scales = self._whitening()
        columns = {key: [inverse[column][index] for column in range(size)] for key, index in self.number.items()}
        zero = [Fraction(0)] * size
        values = {key: columns.get(key, zero) for leg in range(self.legs) for key in self._keys(leg)}
        return self._control_points(values, size) / np.sqrt(np.array(scales, float))

    def _whitening(self):
        """L^-1 and D of H = L D L'."""
        size = len(self.free)
        rows = [[*row, *[Fraction(int(i == j)) for j in range(size)]] for i, row in enumerate(self.H)]
        for column in range(size):
            for row in range(column + 1, size):
                factor = rows[row][column] / rows[column][column]
                if factor:
                    rows[row] = [a - factor * b for a, b in zip(rows[row], rows[column], strict=True)]
        return [row[size:] for row in rows], [rows[i][i] for i in range(size)]

    def _control_points(self, values, width):
        C = ends_to_points(self.degree)
        result = np.empty((self.legs, self.degree + 1, width))
        for leg in range(self.legs):
            keys = self._keys(leg)
            powers = [self.T[leg] ** order for _, order in keys]
            for j, row in enumerate(C):
                for column in range(width):
                    terms = zip(row, powers, keys, strict=True)
                    result[leg, j, column] = float(sum(c * p * values[key][column] for c, p, key in terms if c))
        return result


@cache
def ends_to_points(degree):
    """Matrix from derivatives 0 … k - 1 at both ends to control points."""
    to_points = [
        [Fraction(comb(j, i), comb(degree, i)) if i <= j else Fraction(0) for i in range(degree + 1)]
        for j in range(degree + 1)
    ]
    C = ends_to_powers(degree)
    return [[sum(row[i] * C[i][b] for i in range(degree + 1)) for b in range(degree + 1)] for row in to_points]


def curve_cost(control_points, durations, order):
    """Integral of the squared norm of a derivative of pieces as they are stored, exactly: (pieces, n + 1, dim)."""
    degree = np.shape(control_points)[1] - 1
    left = degree - order
    gram = [
        [Fraction(comb(left, i) * comb(left, j), (2 * left + 1) * comb(2 * left, i + j)) for j in range(left + 1)]
        for i in range(left + 1)
    ]
    total = Fraction(0)
    for piece, duration in zip(control_points, durations, strict=True):
        for axis in np.asarray(piece).T.tolist():
            values = [Fraction(value) for value in axis]
            for _ in range(order):
                values = [b - a for a, b in zip(values, values[1:], strict=False)]
            values = [perm(degree, order) * value for value in values]
            pairs = sum(a * b * gram[i][j] for i, a in enumerate(values) for j, b in enumerate(values))
            total += pairs * Fraction(float(duration)) ** (1 - 2 * order)
    return total
