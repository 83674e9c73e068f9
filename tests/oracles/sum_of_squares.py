"""The exact optimum inside a corridor, as a semidefinite programme without any exchange of rows.

A polynomial of odd degree 2m + 1 is non-negative on [0, 1] exactly when it is s A(s) + (1 - s) B(s) with A and B sums
of squares of degree 2m, and the same is true of symmetric matrices of polynomials (H. Dette and W. J. Studden, "Matrix
measures, moment spaces and Favard's theorem on the interval [0,1] and [0,infinity)", Linear Algebra Appl. 345, 2002).
A tube in the infinity norm needs scalars, a round tube the arrow matrix of its Lorentz cone.  Everything here is
written down anew, in directions that exact rationals make orthonormal: nothing of the library is used.
"""

from math import comb

import clarabel
import numpy as np
import scipy.sparse as sparse
from oracles.exact import Spline


def optimum(*question, **further):
    """Least cost of all curves inside at every instant; see ``enclosed``."""
    return enclosed(*question, **further)[1]


def enclosed(
    points,
    durations,
    half_width=None,
    radius=None,
    tolerance=None,
    degree=7,
    states=None,
    pieces=1,
    planes=None,
):
    """Lower and upper bound of the least cost of all curves inside tubes (one half-width, or one per leg), round tubes
    (radius) or planes at every instant: value of the dual programme, and of the primal one.

    ``states`` are derivatives by waypoint and order; ``tolerance`` lets inner waypoints move in a box; ``planes`` are
    for every leg a matrix A and offsets b with A r <= b; every leg has some pieces of equal duration.
    """
    points = np.array(points, float)
    knots = np.repeat(points, pieces, axis=0)[: (len(points) - 1) * pieces + 1]
    times = np.repeat(np.array(durations, float) / pieces, pieces)
    states = {knot * pieces: state for knot, state in (states or {}).items()}
    inner = {knot for knot in range(1, len(times)) if knot % pieces}
    passed = set(range(pieces, len(times), pieces)) if tolerance is not None else set()
    spline = Spline(knots, times, degree, states, inner | passed)
    base, directions = spline.points(), spline.directions()
    free, dim = directions.shape[2], points.shape[1]
    curve = np.zeros((len(times), dim, degree + 1, 1 + dim * free))
    curve[:, :, :, 0] = base.transpose(0, 2, 1)
    for axis in range(dim):
        curve[:, axis, :, 1 + axis * free : 1 + (axis + 1) * free] = directions
    rows, bounds = _boxes(curve[::pieces], points, tolerance)
    starts, steps = (np.repeat(part, pieces, axis=0) for part in (points[:-1], np.diff(points, axis=0)))
    constraints, widths = [], half_width if radius is None else radius
    if widths is not None:
        build = _tube if radius is None else _round_tube
        spread = np.repeat(np.broadcast_to(np.asarray(widths, float), len(points) - 1), pieces)
        constraints = build(curve, starts, steps, spread)
    for leg, (matrix, offsets) in enumerate(planes or ()):
        constraints += _planes(curve[leg * pieces : (leg + 1) * pieces], matrix, offsets)
    typical = max(Spline(knots, times, degree, states, inner).cost(), 1e-300)
    return _solve(spline.cost(), typical, dim * free, rows, bounds, constraints)


def _planes(curve, matrix, offsets):
    """Slack of planes over pieces, in units of the largest slack of their free optimum."""
    constraints = []
    for normal, offset in zip(matrix, offsets, strict=True):
        slack = -np.einsum("a,laiz->liz", normal, curve)
        slack[:, :, 0] += offset
        constraints += [piece[:, None, None, :] / np.abs(slack[:, :, 0]).max() for piece in slack]
    return constraints


def _boxes(curve, points, tolerance):
    """Rows z <= bounds that keep inner waypoints in their boxes, in units of the tolerance."""
    if tolerance is None:
        return np.zeros((0, curve.shape[3] - 1)), np.zeros(0)
    passed = curve[1:, :, 0].reshape(-1, curve.shape[3])
    offset = (passed[:, 0] - points[1:-1].reshape(-1)) / tolerance
    rows = passed[:, 1:] / tolerance
    return np.concatenate((rows, -rows)), np.concatenate((1.0 - offset, 1.0 + offset))


def _offsets(curve, starts, steps):
    """Perpendicular offsets from each piece's line: (pieces, dim, degree + 1, 1 + len(z)), and the projections."""
    relative = curve.copy()
    relative[:, :, :, 0] -= starts[:, :, None]
    unit = steps / np.linalg.norm(steps, axis=1)[:, None]
    projection = np.eye(starts.shape[1]) - unit[:, :, None] * unit[:, None, :]
    return np.einsum("lab,lbiz->laiz", projection, relative), projection


def _tube(curve, starts, steps, widths):
    offsets, projection = _offsets(curve, starts, steps)
    constraints = []
    for leg, width in enumerate(widths):
        for axis in range(starts.shape[1]):
            if np.abs(projection[leg, axis]).max() < 1e-12:
                continue
            for side in (1.0, -1.0):
                inside = side * offsets[leg, axis] / width
                inside[:, 0] += 1.0
                constraints.append(inside[:, None, None, :])
    return constraints


def _round_tube(curve, starts, steps, widths):
    offsets, _ = _offsets(curve, starts, steps)
    constraints = []
    for leg, width in enumerate(widths):
        size = starts.shape[1] + 1
        arrow = np.zeros((curve.shape[2], size, size, curve.shape[3]))
        arrow[:, range(size), range(size), 0] = 1.0
        for axis in range(size - 1):
            arrow[:, 0, axis + 1] = arrow[:, axis + 1, 0] = offsets[leg, axis] / width
        constraints.append(arrow)
    return constraints


def _product_weights(degree):
    """Where products (i, k) of basis functions in A and B go in the control points of s A(s) + (1 - s) B(s)."""
    m = (degree - 1) // 2
    table = {}
    for i in range(m + 1):
        for k in range(m + 1):
            share = comb(m, i) * comb(m, k) / comb(2 * m, i + k)
            table[0, i, k] = i + k + 1, share * (i + k + 1) / degree
            table[1, i, k] = i + k, share * (degree - i - k) / degree
    return table


def _triangle(size):
    return [(row, column) for column in range(size) for row in range(column + 1)]


def _gram_map(degree, size):
    """Rows (control point, entry of the matrix) over the scaled triangles of both Gram matrices."""
    m, table, entries = (degree - 1) // 2, _product_weights(degree), _triangle(size)
    number = {pair: index for index, pair in enumerate(entries)}
    triangle = _triangle((m + 1) * size)
    matrix = np.zeros(((degree + 1) * len(entries), 2 * len(triangle)))
    for which in range(2):
        for column, (p, q) in enumerate(triangle):
            for a, b in {(p, q), (q, p)}:
                (i, row), (k, col) = divmod(a, size), divmod(b, size)
                if row <= col:
                    j, weight = table[which, i, k]
                    scale = 1.0 if p == q else 1.0 / np.sqrt(2.0)
                    matrix[j * len(entries) + number[row, col], which * len(triangle) + column] += weight * scale
    return matrix


def _solve(base, typical, free, rows, bounds, constraints):
    """Bounds of the least base + the squared norm of z, which is counted in square roots of a typical cost."""
    size = np.sqrt(typical)
    grams = [_gram_map(c.shape[0] - 1, c.shape[1]) for c in constraints]
    total = free + sum(g.shape[1] for g in grams)
    equations, sides, cones, triangles = [], [], [], []
    at = free
    for constraint, gram in zip(constraints, grams, strict=True):
        entries = _triangle(constraint.shape[1])
        polynomial = np.array([[constraint[j, a, b] for a, b in entries] for j in range(constraint.shape[0])])
        polynomial = polynomial.reshape(-1, free + 1)
        block = sparse.lil_matrix((len(polynomial), total))
        block[:, :free] = -polynomial[:, 1:] * size
        block[:, at : at + gram.shape[1]] = gram
        equations.append(block.tocsc())
        sides.append(polynomial[:, 0])
        width = gram.shape[1] // 2
        for part in range(2):
            triangles.append(sparse.eye(width, total, k=at + part * width))
            cones.append(clarabel.PSDTriangleConeT((constraint.shape[0] // 2) * constraint.shape[1]))
        at += gram.shape[1]
    boxes = sparse.csc_matrix(np.pad(rows * size, ((0, 0), (0, total - free))))
    A = sparse.vstack([*equations, boxes, *[-t for t in triangles]]).tocsc()
    b = np.concatenate((*sides, bounds, np.zeros(sum(t.shape[0] for t in triangles))))
    quadratic = sparse.block_diag([sparse.eye(free), sparse.csc_matrix((total - free,) * 2)]).tocsc()
    linear = np.zeros(total)
    cones = [clarabel.ZeroConeT(sum(len(s) for s in sides)), clarabel.NonnegativeConeT(len(bounds)), *cones]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
    settings.max_iter = 300
    found = clarabel.DefaultSolver(sparse.triu(quadratic).tocsc(), linear, A, b, cones, settings).solve()
    if str(found.status) not in ("Solved", "AlmostSolved"):
        raise ArithmeticError(f"the oracle found no optimum: {found.status}")
    z = np.array(found.x[:free])
    return base + 2.0 * typical * found.obj_val_dual, base + typical * z @ z
