"""Linear programmes of the least sum of slacks, and their solvers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.tolerances import ROUNDING
from minsnap.native.chain_programme import solve_chain
from minsnap.optimisation.qp import ACCURACY, TOLERANCES


@dataclass(frozen=True, eq=False)
class SlackProgramme:
    """Minimise the sum of the last unknowns; rows are at most their sides, the first ones equal to them.

    Parameters
    ----------
    rows : csc_matrix, shape (r, n)
    sides : ndarray, shape (r,)
    equal : int
        Number of rows that are equations.
    piece : ndarray of int, shape (r - equal,)
        Piece to whose unknowns each of the other rows belongs; one more than the last for rows on slacks alone.
    slacks : int
        Number of slacks.
    """

    rows: Any
    sides: FloatArray
    equal: int
    piece: IntArray
    slacks: int

    @property
    def linear(self) -> FloatArray:
        """Cost of each unknown, (n,)."""
        return np.append(np.zeros(self.rows.shape[1] - self.slacks), np.ones(self.slacks))


@dataclass(frozen=True, eq=False)
class SlackSolution:
    """What a solver answers.

    Parameters
    ----------
    x : ndarray, shape (n,)
    multipliers : ndarray, shape (r,)
    broken : float
        Largest violation of a row.
    lost : float
        What all residuals may add to the sum.
    """

    x: FloatArray
    multipliers: FloatArray
    broken: float
    lost: float


Solver = Callable[[SlackProgramme], tuple[FloatArray, FloatArray] | None]
"""Unknowns and multipliers; None where there are none."""


def least_sum(programme: SlackProgramme, solver: Solver) -> SlackSolution | None:
    """Solve a programme; None where the answer is not finite."""
    solution = solver(programme)
    if solution is None or not (np.isfinite(solution[0]).all() and np.isfinite(solution[1]).all()):
        return None
    x, z = solution
    rows, equal = programme.rows, programme.equal
    out = rows @ x - programme.sides
    broken = max(float(np.abs(out[:equal]).max(initial=0.0)), float(out[equal:].max(initial=0.0)))
    lost = np.abs(rows.T @ z + programme.linear) @ np.abs(x) + np.abs(out) @ np.abs(z)
    return SlackSolution(x, z, broken, float(lost))


def by_native_core(programme: SlackProgramme) -> tuple[FloatArray, FloatArray] | None:
    """Solve by the interior point of chains of pieces, without equations: rows of a piece make blocks of a band.

    A small price of the squares of all unknowns holds those that no row determines.  A second solve has the price of
    the distance from the first solution instead, which takes most of its effect away (the proximal point method of
    R. T. Rockafellar, "Monotone operators and the proximal point algorithm", 1976).
    """
    if programme.equal:
        return None
    size, price, order = programme.rows.shape[1], 10.0 * ROUNDING, np.argsort(programme.piece, kind="stable")
    piece, entries = programme.piece[order].astype(np.int64), programme.rows.tocsr()[order].tocoo()
    columns, place = _columns_of_pieces(piece[entries.row], entries.col, size)
    matrix = np.zeros((len(piece), columns.shape[1]))
    matrix[entries.row, place] = entries.data
    hessian, cones = np.zeros((*columns.shape, columns.shape[1])), (piece, np.ones_like(piece))
    x, z = np.zeros(size), None
    for _ in range(2):
        costs = hessian, np.full(size, price), programme.linear - price * x
        solution = solve_chain(columns, costs, cones, (matrix, programme.sides[order]), 0.1 * ACCURACY)
        x, z = (x, z) if solution is None else solution
    if z is None:
        return None
    multipliers = np.empty(len(order))
    multipliers[order] = z
    return x, multipliers


def _columns_of_pieces(piece: IntArray, column: IntArray, size: int) -> tuple[IntArray, IntArray]:
    """Columns (pieces, width) in which each piece has entries, ``size`` for none, and the place of each entry."""
    keys = piece * (size + 1) + column
    used, where = np.unique(keys, return_inverse=True)
    of_piece = used // (size + 1)
    place = np.arange(len(used)) - np.searchsorted(of_piece, of_piece)
    columns = np.full((int(of_piece[-1]) + 1, int(place.max()) + 1), size, dtype=np.int64)
    columns[of_piece, place] = used % (size + 1)
    return columns, place[where]


def by_clarabel(programme: SlackProgramme) -> tuple[FloatArray, FloatArray]:
    """Solve by Clarabel."""
    import clarabel
    from scipy.sparse import csc_matrix

    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_threads, settings.max_iter = False, 1, TOLERANCES["clarabel"]["max_iter"]
    settings.tol_feas = settings.tol_gap_rel = settings.tol_gap_abs = TOLERANCES["clarabel"]["tol_feas"]
    equal, size = programme.equal, programme.rows.shape[1]
    cones = [clarabel.ZeroConeT(equal), clarabel.NonnegativeConeT(len(programme.sides) - equal)]
    problem = csc_matrix((size, size)), programme.linear, programme.rows, programme.sides
    solution = clarabel.DefaultSolver(*problem, cones[not equal :], settings).solve()
    return np.array(solution.x), np.array(solution.z)
