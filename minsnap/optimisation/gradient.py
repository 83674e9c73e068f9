r"""Gradient of the optimal cost in the durations, by the envelope theorem.

At the optimum the cost's derivative in a duration is that of the Lagrangian with the physical knot derivatives and
the multipliers held: no finite differences, no second solve (J. M. Danskin, "The theory of max-min", 1967).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task_walls import all_walls
from minsnap.polynomials.bernstein import basis, differentiate, ends_to_highest, gram_root, mapped


class PressingRows(NamedTuple):
    """Contacts of a block of walls that hold a curve back: normal . r^(order)(s) <= bound on pieces.

    Parameters
    ----------
    block : int
        Which of ``all_walls``.
    order : int
    wall : ndarray of int, shape (r,)
        In its block.
    piece : ndarray of int, shape (r,)
    s : ndarray, shape (r,)
    normal : ndarray, shape (r, dim)
    multiplier : ndarray, shape (r,)
        Positive, for the normalised cost without 1/2.
    """

    block: int
    order: int
    wall: IntArray
    piece: IntArray
    s: FloatArray
    normal: FloatArray
    multiplier: FloatArray


def pressing_rows(solved: SolvedTask) -> list[PressingRows]:
    """Return the contacts with positive multipliers of all blocks that have some."""
    (wall, s, multiplier), curve, every = solved.optimum.contacts, solved.trajectory, all_walls(solved.task)
    pressing = []
    for block, (walls, first) in enumerate(zip(every.blocks, every.first[:-1], strict=True)):
        mine = (wall >= first) & (wall < first + len(walls.leg)) & (multiplier > 0.0)
        if mine.any() and not walls.equal:
            index, order = wall[mine] - first, walls.order
            own = walls.chosen(index)
            places = s[mine] if own.at is None else own.at.astype(np.float64)
            points = differentiate(curve.control_points[own.leg], order)
            values = np.einsum("rj,rjd->rd", basis(curve.degree - order, places), points)
            normal, _ = own.tangents_at(values / curve.durations[own.leg, None] ** order)
            pressing.append(PressingRows(block, order, index, own.leg, places, normal, multiplier[mine]))
    return pressing


def cost_gradient(solved: SolvedTask) -> FloatArray:
    r"""Return the derivative of the optimal cost in each piece's duration, shape (pieces in all,) [cost/s].

    With :math:`c_i = T_i^{1-2k} e_i^\top Q e_i` and :math:`A` the orders of the end derivatives,
    :math:`T_i \, \partial c_i / \partial T_i = (1 - 2k) c_i + 2 T_i^{1-2k} e_i^\top A Q e_i`; every contact adds
    its multiplier times its own derivative, in which each end derivative of order a counts (a - order) times.
    """
    problem, knots = solved.problem, solved.optimum.knots
    slopes, ends = np.zeros(len(problem.durations)), problem.plain_ends(knots)
    orders = np.tile(np.arange(problem.half), 2)
    for rows in pressing_rows(solved):
        factors = problem.row_factors(rows.piece, rows.s, rows.order) * (orders - rows.order)
        values = np.einsum("rj,rjd,rd->r", factors, ends[rows.piece], rows.normal)
        np.add.at(slopes, rows.piece, rows.multiplier * values)
    unit = solved.units.length**2 * solved.units.time ** (-2.0 * problem.half)
    return np.asarray((_cost_slopes(problem, knots) + slopes) / problem.durations * unit)


def _cost_slopes(problem: ReducedProblem, knots: FloatArray) -> FloatArray:
    """T dc/dT of every piece at fixed knot derivatives, from the same squares as the cost."""
    k = problem.half
    ends = problem.moved_ends(knots)
    orders = np.tile(np.arange(k), 2)[:, None]
    root, highest = gram_root(k - 1), ends_to_highest(problem.degree)
    value = mapped(root, mapped(highest, ends))
    slope = mapped(root, mapped(highest, ((1.0 - 2.0 * k) + 2.0 * orders) * ends))
    return np.asarray((value * slope).sum(axis=(1, 2)) * problem.weights)
