"""Rows and equations over the unknowns of a reduced problem, as sparse matrices."""

from __future__ import annotations

from math import perm
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.optimisation.reduced_qp import ReducedProblem

DENSE = 300
"""Unknowns up to which rows and equations are dense, and the Hessian of a QP is made the identity."""


def sparse_rows(size: int, columns: IntArray, values: FloatArray) -> Any:
    """Sparse rows (r, size) of values (r, m) in columns (r, m), -1 for none."""
    from scipy.sparse import csr_matrix

    used = (columns >= 0) & (values != 0.0)
    row = np.broadcast_to(np.arange(len(columns))[:, None], columns.shape)
    return csr_matrix((values[used], (row[used], columns[used])), shape=(len(columns), size))


def rows_on_pieces(problem: ReducedProblem, piece: IntArray, factors: FloatArray, normal: FloatArray) -> Any:
    """Sparse rows (r, size) of normals (r, dim) times what factors (r, 2k) make of the end derivatives of pieces."""
    shape = (len(piece), problem.dim * 2 * problem.half)
    values = normal[:, :, None] * factors[:, None, :]
    return sparse_rows(problem.size, problem.piece_columns[piece].reshape(shape), values.reshape(shape))


def equations(problem: ReducedProblem, base: FloatArray, scale: FloatArray | None = None) -> tuple[Any, FloatArray]:
    """Rows (e, size) of unit length and sides (e,) of all equations, in deviations from knot values.

    The derivatives of the orders ``problem.joined_orders`` are continuous at the knots, and knots lie in the planes of
    their gates.

    Parameters
    ----------
    base : ndarray, shape (knots, slots, dim)
        Knot values.
    scale : ndarray, shape (size,), optional
        Value of each unknown in its own unit; that of ``point_scale`` unless given.
    """
    from scipy.sparse import vstack

    knots, normals = [knot for knot, _ in problem.planes], [normal for _, normal in problem.planes]
    normal, pieces, dim = np.array(normals).reshape(-1, problem.dim), len(problem.durations), problem.dim
    rows = [sparse_rows(problem.size, problem.columns[knots, 0], normal)]
    sides = [-(normal * base[knots, 0]).sum(axis=1)]
    left = np.arange(pieces if problem.closed else pieces - 1)
    ends, axes = problem.plain_ends(base), np.repeat(np.eye(dim), len(left), axis=0)
    for order in problem.joined_orders if len(left) else ():
        both = []
        for piece, s in ((left, np.ones(len(left))), ((left + 1) % pieces, np.zeros(len(left)))):
            factors = problem.row_factors(piece, s, order)
            matrix = rows_on_pieces(problem, np.tile(piece, dim), np.tile(factors, (dim, 1)), axes)
            both.append((matrix, np.einsum("rj,rjd->dr", factors, ends[piece]).reshape(-1)))
        rows.append(both[0][0] - both[1][0])
        sides.append(both[1][1] - both[0][1])
    matrix, norms = of_unit_length(vstack(rows).multiply(point_scale(problem) if scale is None else scale))
    return matrix, np.concatenate(sides) / norms


def point_scale(problem: ReducedProblem) -> FloatArray:
    """Value of each unknown, (size,), that moves control points of the longer of its pieces by about 1."""
    T = problem.durations
    before, after = np.append(T[-1] if problem.closed else 0.0, T), np.append(T, T[0] if problem.closed else 0.0)
    order = problem.slots.order
    factors = np.array([perm(problem.degree, q) for q in order.tolist()])
    values = np.broadcast_to((factors / np.maximum(before, after)[:, None] ** order)[:, :, None], problem.columns.shape)
    scale, free = np.zeros(problem.size), problem.columns >= 0
    scale[problem.columns[free]] = values[free]
    return scale


def of_unit_length(matrix: Any) -> tuple[Any, FloatArray]:
    """Return rows of length 1, but for those that are zero, and the lengths by which they were divided."""
    from scipy.sparse import csr_matrix, diags

    norms = np.sqrt(np.asarray(matrix.multiply(matrix).sum(axis=1)).reshape(-1))
    norms[norms == 0.0] = 1.0
    return csr_matrix(diags(1.0 / norms) @ matrix), norms


def joined_exactly(problem: ReducedProblem, knots: FloatArray) -> FloatArray:
    """Remove what a solver left of jumps above k - 1 and of distances to gates' planes, by the least change."""
    if not (problem.joined_orders or problem.planes) or not 0 < problem.size <= DENSE:
        return knots
    scale = point_scale(problem)
    for _ in range(2):
        rows, sides = equations(problem, knots, scale)
        if len(sides):
            knots = problem.add(knots, np.linalg.lstsq(rows.toarray(), sides, rcond=None)[0] * scale)
    return knots
