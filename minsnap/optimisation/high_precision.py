"""The optimum without walls in 60 decimal digits, for durations that double precision cannot resolve.

Durations that differ by a factor r put r^(2k - 1) into the Hessian: at high degrees, or with r of many decades, its
small eigenvalues are lost in rounding.  The standard library's decimal numbers in numpy's object arrays are slow (a
millisecond per leg), but accurate enough for any input that double precision can represent.
"""

from __future__ import annotations

from decimal import Context, Decimal, localcontext
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.errors import SolverError
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.polynomials.bernstein import exact_ends_gram

DIGITS = 60

RESOLVED = {2: np.inf, 3: 1e6, 4: 300.0, 5: 20.0, 6: 4.0}
"""By k: the ratio of durations up to which double precision gives the optimum to about 1e-9."""

Decimals = npt.NDArray[Any]


def is_extreme(problem: ReducedProblem) -> bool:
    """Whether durations differ too much for double precision."""
    durations = problem.durations
    if len(durations) == 1:
        return False
    return bool(durations.max() > RESOLVED[problem.half] * durations.min())


@cache
def _gram(degree: int) -> Decimals:
    with localcontext(Context(prec=DIGITS)):
        rows = [[Decimal(v.numerator) / Decimal(v.denominator) for v in row] for row in exact_ends_gram(degree)]
    return np.array(rows, dtype=object)


def _decimals(values: FloatArray) -> Decimals:
    """Exact decimals of doubles, in the same shape."""
    flat = [Decimal(float(value)) for value in values.reshape(-1)]
    return np.array(flat, dtype=object).reshape(values.shape)


def _piece_blocks(problem: ReducedProblem) -> Decimals:
    """Hessian of every piece in its unscaled end derivatives, (pieces, 2k, 2k)."""
    k = problem.half
    durations = _decimals(problem.durations)
    orders = np.tile(np.arange(k), 2)
    powers = np.stack([durations ** int(p) for p in range(1 - 2 * k, 1)], axis=1)
    return np.asarray(powers[:, orders[:, None] + orders[None, :]] * _gram(problem.degree))


def decimal_optimum(problem: ReducedProblem, free: BoolArray, values: FloatArray) -> FloatArray:
    """Knot values of least cost, as ``banded`` finds them, for one pattern of free values per axis.

    Parameters
    ----------
    free : ndarray of bool, shape (knots, slots, dim)
    values : ndarray, shape (knots, slots, dim)
        Pinned values.

    Returns
    -------
    ndarray, shape (knots, slots, dim)

    Raises
    ------
    SolverError
        If even these digits do not resolve the durations.
    """
    with localcontext(Context(prec=DIGITS)):
        blocks, knots = _piece_blocks(problem), values.copy()
        pull = _pull(problem, blocks, values)
        for axis in np.flatnonzero(pull.astype(bool).any(axis=(0, 1))):
            try:
                columns = _chain(problem, blocks, free[:, :, axis], -pull[:, :, axis])
            except ArithmeticError:
                raise SolverError("the system is singular to working precision: durations are too extreme") from None
            knots[:, :, axis] += np.where(free[:, :, axis], columns.astype(np.float64), 0.0)
    return knots


def _pull(problem: ReducedProblem, blocks: Decimals, values: FloatArray) -> Decimals:
    """Half the gradient at the pinned values: (knots, slots, dim)."""
    slots, k = problem.slots, problem.half
    ends = _decimals(np.concatenate((values[:-1, slots.start], values[1:, slots.end]), axis=1))
    ends[:, k] += _decimals(problem.steps)
    forces = np.matmul(blocks, ends)
    pull = np.full(values.shape, Decimal(0), dtype=object)
    pull[:-1, slots.start] += forces[:, :k]
    pull[1:, slots.end] += forces[:, k:]
    return pull


def _chain(problem: ReducedProblem, blocks: Decimals, free: BoolArray, right: Decimals) -> Decimals:
    """Solve the block tridiagonal system knot by knot: right (knots, slots) to the same shape."""
    slots, k, width = problem.slots, problem.half, problem.slots.count
    diagonal = np.full((len(free), width, width), Decimal(0), dtype=object)
    below = np.full((len(free) - 1, width, width), Decimal(0), dtype=object)
    start, end = np.ix_(slots.start, slots.start), np.ix_(slots.end, slots.end)
    for i, block in enumerate(blocks):
        diagonal[i][start] += block[:k, :k]
        diagonal[i + 1][end] += block[k:, k:]
        below[i][np.ix_(slots.end, slots.start)] += block[k:, :k]
    right = right.copy()
    right[~free] = Decimal(0)
    return _block_solve(diagonal, below, right, free)


def _block_solve(diagonal: Decimals, below: Decimals, right: Decimals, free: BoolArray) -> Decimals:
    solution = right.copy()
    picks = [np.flatnonzero(row) for row in free]
    factors: list[Decimals] = []
    for i, pick in enumerate(picks):
        matrix = diagonal[i][np.ix_(pick, pick)]
        if i and len(picks[i - 1]):
            link = below[i - 1][np.ix_(pick, picks[i - 1])]
            half = _forward(factors[-1], link.T)
            matrix = matrix - half.T @ half
            solution[i, pick] -= half.T @ _forward(factors[-1], solution[i - 1, picks[i - 1], None])[:, 0]
        factors.append(cholesky(matrix))
    for i in reversed(range(len(picks))):
        pick, value = picks[i], solution[i, picks[i], None]
        if i + 1 < len(picks) and len(picks[i + 1]):
            value = value - below[i][np.ix_(picks[i + 1], pick)].T @ solution[i + 1, picks[i + 1], None]
        solution[i, pick] = _backward(factors[i], _forward(factors[i], value))[:, 0]
    return solution


def cholesky(matrix: Decimals) -> Decimals:
    """Lower Cholesky factor of a positive definite matrix of decimals, (n, n)."""
    left = matrix.copy()
    factor = np.full(matrix.shape, Decimal(0), dtype=object)
    for j in range(len(matrix)):
        factor[j, j] = left[j, j].sqrt()
        factor[j + 1 :, j] = left[j + 1 :, j] / factor[j, j]
        left[j + 1 :, j + 1 :] -= np.outer(factor[j + 1 :, j], factor[j + 1 :, j])
    return factor


def _forward(factor: Decimals, right: Decimals) -> Decimals:
    """Solve factor x = right, (n, m)."""
    solution = right.copy()
    for j in range(len(factor)):
        solution[j] = solution[j] / factor[j, j]
        solution[j + 1 :] -= np.outer(factor[j + 1 :, j], solution[j])
    return solution


def _backward(factor: Decimals, right: Decimals) -> Decimals:
    """Solve factor' x = right, (n, m)."""
    solution = right.copy()
    for j in reversed(range(len(factor))):
        solution[j] = solution[j] / factor[j, j]
        solution[:j] -= np.outer(factor[j, :j], solution[j])
    return solution
