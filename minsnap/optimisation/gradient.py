r"""Gradient of the optimal cost in the durations, by the envelope theorem.

At the optimum the cost's derivative in a duration is that of the Lagrangian with the physical knot derivatives and
the multipliers held: no finite differences, no second solve (J. M. Danskin, "The theory of max-min", 1967).
"""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.optimisation.normalised_constraints import WallRows
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.polynomials.bernstein import ends_to_highest, gram_root


def cost_gradient(solved: SolvedTask) -> FloatArray:
    r"""Return the derivative of the optimal cost in each piece's duration, shape (pieces in all,) [cost/s].

    With :math:`c_i = T_i^{1-2k} e_i^\top Q e_i` and :math:`A` the orders of the end derivatives,
    :math:`T_i \, \partial c_i / \partial T_i = (1 - 2k) c_i + 2 T_i^{1-2k} e_i^\top A Q e_i`; every active row adds
    its multiplier times its own derivative.
    """
    problem, knots = solved.problem, solved.optimum.knots
    relative = _cost_slopes(problem, knots)
    rows, multipliers = solved.active
    if rows is not None and len(multipliers):
        relative += row_slopes(problem, knots, rows, multipliers)
    unit = solved.units.length**2 * solved.units.time ** (-2.0 * problem.half)
    return np.asarray(relative / problem.durations * unit)


def row_slopes(problem: ReducedProblem, knots: FloatArray, rows: WallRows, multipliers: FloatArray) -> FloatArray:
    """Sum over rows of multiplier times T dg/dT, by piece: shape (pieces in all,), normalised."""
    used = np.flatnonzero(multipliers > 0.0)
    slopes = multipliers[used] * _row_values(problem, knots, rows, used)
    return np.bincount(rows.piece[used], slopes, len(problem.durations)).astype(np.float64)


def _cost_slopes(problem: ReducedProblem, knots: FloatArray) -> FloatArray:
    """T dc/dT of every piece at fixed knot derivatives, from the same squares as the cost."""
    k = problem.half
    ends = problem.moved_ends(knots)
    orders = np.tile(np.arange(k), 2)[:, None]
    root, highest = gram_root(k - 1), ends_to_highest(problem.degree)
    value = np.matmul(root, np.matmul(highest, ends))
    slope = np.matmul(root, np.matmul(highest, ((1.0 - 2.0 * k) + 2.0 * orders) * ends))
    return np.asarray((value * slope).sum(axis=(1, 2)) * problem.durations ** (1.0 - 2.0 * k))


def _row_values(problem: ReducedProblem, knots: FloatArray, rows: WallRows, used: np.ndarray) -> FloatArray:
    """T dg/dT of the rows used: each end derivative of order a counts (a - order) times."""
    orders = np.tile(np.arange(problem.half), 2)
    values, plain = np.empty(len(used)), problem.plain_ends(knots)
    for order in np.unique(rows.order[used]):
        chosen = rows.order[used] == order
        index = used[chosen]
        factors = problem.row_factors(rows.piece[index], rows.s[index], int(order)) * (orders - order)
        ends = plain[rows.piece[index]]
        values[chosen] = np.einsum("rj,rjd,rd->r", factors, ends, rows.normal[index])
    return values
