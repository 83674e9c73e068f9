"""Curves through boxes as one programme over all control points: from below by samples, from above by their hull.

Every piece has its own control points; continuity, ends and boxes are rows.  Rows at samples are too few, rows on the
control points of halves, quarters, … of the pieces too many; the optimum of all instants is between the two.
"""

from math import comb

import clarabel
import numpy as np
import scipy.sparse as sparse


def bernstein(degree, s):
    s = np.atleast_1d(s)[:, None]
    j = np.arange(degree + 1)
    return np.array([comb(degree, i) for i in j]) * s**j * (1.0 - s) ** (degree - j)


def differences(degree, order):
    matrix = np.eye(degree + 1)
    for n in range(degree, degree - order, -1):
        matrix = n * (matrix[1:] - matrix[:-1])
    return matrix


def gram(degree, order):
    nodes, weights = np.polynomial.legendre.leggauss(degree + 1)
    values = bernstein(degree - order, (nodes + 1.0) / 2.0) @ differences(degree, order)
    return values.T @ (weights[:, None] / 2.0 * values)


def sub_hulls(degree, parts):
    """Control points of equal parts of a polynomial, from its own: interpolation in the part's Bernstein basis."""
    nodes = np.linspace(0.0, 1.0, degree + 1)
    back = np.linalg.inv(bernstein(degree, nodes))
    return np.vstack([back @ bernstein(degree, (part + nodes) / parts) for part in range(parts)])


def optimum(lower, upper, durations, start, end, degree=7, rows=None):
    """Least cost with boxes imposed on ``rows @ control points`` of every piece, rest to rest; axis by axis."""
    return sum(_axis(lower[:, d], upper[:, d], durations, start[d], end[d], degree, rows) for d in range(len(start)))


def _axis(lower, upper, durations, start, end, degree, rows):
    half, legs = (degree + 1) // 2, len(durations)
    size = legs * (degree + 1)
    P = sparse.block_diag([2.0 * gram(degree, half) / T ** (2 * half - 1) for T in durations], format="csc")
    equal, right = [], []
    for order in range(half):
        d = differences(degree, order)
        for leg in range(legs + 1):
            row = np.zeros(size)
            if leg:
                row[(leg - 1) * (degree + 1) : leg * (degree + 1)] += d[-1] / durations[leg - 1] ** order
            if leg < legs:
                row[leg * (degree + 1) : (leg + 1) * (degree + 1)] -= d[0] / durations[leg] ** order
            equal.append(row)
            right.append(0.0 if order else (-start if leg == 0 else end if leg == legs else 0.0))
    G = sparse.block_diag([rows] * legs)
    high, low = np.repeat(upper, len(rows)), np.repeat(lower, len(rows))
    A = sparse.vstack([sparse.csc_matrix(np.array(equal)), G, -G], format="csc")
    b = np.concatenate((right, high, -low))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    cones = [clarabel.ZeroConeT(len(right)), clarabel.NonnegativeConeT(2 * len(high))]
    solution = clarabel.DefaultSolver(sparse.triu(P, format="csc"), np.zeros(size), A, b, cones, settings).solve()
    if str(solution.status) != "Solved":
        raise RuntimeError(str(solution.status))
    return solution.obj_val
