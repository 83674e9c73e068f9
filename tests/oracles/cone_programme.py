r"""A cone programme whose rows and costs belong to pieces of a chain, and its solution by Clarabel.

.. math:: \min_x \tfrac12 \sum_i x_i^\top H_i x_i + q^\top x \quad\text{subject to}\quad b_r - A_r x_{i(r)} \in K_r

with :math:`x_i` the unknowns that piece i touches and :math:`K_r` a half-line or a second-order cone (P. Goulart and
Y. Chen, "Clarabel: an interior-point solver for conic programs with quadratic objectives", 2024).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.chain_programme import solve_chain

ACCURACY = 1e-6
"""Gap and residuals, relative to the cost, at which the solver stops."""

USABLE = ("Solved", "AlmostSolved")


@dataclass(frozen=True, eq=False)
class Rows:
    """Cones of one size, each on the unknowns of one piece.

    Parameters
    ----------
    piece : ndarray of int, shape (n,)
    matrix : ndarray, shape (n, c, width)
    bound : ndarray, shape (n, c)
    """

    piece: IntArray
    matrix: FloatArray
    bound: FloatArray


@dataclass(frozen=True, eq=False)
class ConeProgramme:
    """The programme.

    Parameters
    ----------
    size : int
        Number of unknowns.
    columns : ndarray of int, shape (pieces, width)
        Unknowns of each piece, ``size`` for none; one may be named twice.
    hessian : ndarray, shape (pieces, width, width)
        Symmetric; what falls on the same unknowns adds up.
    diagonal, linear : ndarray, shape (size,)
        Further Hessian, positive; and q.
    rows : sequence of Rows
    places : ndarray of int, shape (size + 1,)
        Place of every unknown, and of none at the end, in an order in which the unknowns of a piece are neighbours.
    """

    size: int
    columns: IntArray
    hessian: FloatArray
    diagonal: FloatArray
    linear: FloatArray
    rows: Sequence[Rows]
    places: IntArray


@dataclass(frozen=True, eq=False)
class ConeSolution:
    """Unknowns (size,) and the multipliers of each group of rows, (n, c)."""

    x: FloatArray
    multipliers: list[FloatArray]


def solve_programme(programme: ConeProgramme) -> ConeSolution | None:
    """Solve by the native core, or else by Clarabel; None where both find no solution."""
    solution = solve_natively(programme)
    return solution if solution is not None else solve_by_clarabel(programme)


def solve_natively(programme: ConeProgramme) -> ConeSolution | None:
    """Solve by the native core; None where it is not in use or finds no solution."""
    place, groups = programme.places, programme.rows
    unknown = np.argsort(place[:-1])
    row_piece = np.concatenate([np.repeat(group.piece, group.bound.shape[1]) for group in groups])
    cone_piece = np.concatenate([group.piece for group in groups])
    cone_size = np.concatenate([np.full(len(group.piece), group.bound.shape[1]) for group in groups])
    order, cones = np.argsort(row_piece, kind="stable"), np.argsort(cone_piece, kind="stable")
    matrix = np.concatenate([group.matrix.reshape(-1, group.matrix.shape[2]) for group in groups])[order]
    bound = np.concatenate([group.bound.reshape(-1) for group in groups])
    solution = solve_chain(
        place[programme.columns],
        (programme.hessian, programme.diagonal[unknown], programme.linear[unknown]),
        (cone_piece[cones], cone_size[cones]),
        (matrix, bound[order]),
        ACCURACY,
    )
    if solution is None:
        return None
    multipliers = np.empty(len(order))
    multipliers[order] = solution[1]
    ends = np.cumsum([group.bound.size for group in groups])[:-1]
    parts = [part.reshape(group.bound.shape) for group, part in zip(groups, np.split(multipliers, ends), strict=True)]
    return ConeSolution(solution[0][place[:-1]], parts)


def solve_by_clarabel(programme: ConeProgramme) -> ConeSolution | None:
    """Solve by Clarabel; None where it finds no solution."""
    import clarabel

    order = np.argsort([rows.matrix.shape[1] > 1 for rows in programme.rows], kind="stable")
    groups = [programme.rows[k] for k in order]
    matrix, bound = _stacked(programme, groups)
    cones = [clarabel.NonnegativeConeT(sum(len(g.bound) for g in groups if g.bound.shape[1] == 1))]
    for group in groups:
        if group.bound.shape[1] > 1:
            cones += [clarabel.SecondOrderConeT(group.bound.shape[1])] * len(group.bound)
    solver = clarabel.DefaultSolver(_hessian(programme), programme.linear, matrix, bound, cones, _settings())
    solution = solver.solve()
    if str(solution.status) not in USABLE:
        return None
    multipliers: list[FloatArray] = [np.zeros((0, 1))] * len(groups)
    ends = np.cumsum([group.bound.size for group in groups])
    for k, group, part in zip(order, groups, np.split(np.array(solution.z), ends[:-1]), strict=True):
        multipliers[k] = part.reshape(group.bound.shape)
    return ConeSolution(np.array(solution.x), multipliers)


def _settings() -> Any:
    import clarabel

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = ACCURACY
    settings.max_threads = 1
    return settings


def _stacked(programme: ConeProgramme, groups: list[Rows]) -> tuple[Any, FloatArray]:
    """All rows as one sparse matrix, and their bounds."""
    from scipy.sparse import csc_matrix

    columns = np.concatenate([np.repeat(programme.columns[g.piece], g.matrix.shape[1], axis=0) for g in groups])
    values = np.concatenate([g.matrix.reshape(-1, g.matrix.shape[2]) for g in groups])
    used = (columns < programme.size) & (values != 0.0)
    row = np.broadcast_to(np.arange(len(columns))[:, None], columns.shape)
    matrix = csc_matrix((values[used], (row[used], columns[used])), shape=(len(columns), programme.size))
    return matrix, np.concatenate([g.bound.reshape(-1) for g in groups])


def _hessian(programme: ConeProgramme) -> Any:
    """Upper triangle of the whole Hessian, sparse."""
    from scipy.sparse import csc_matrix

    shape = programme.hessian.shape
    row = np.broadcast_to(programme.columns[:, :, None], shape)
    column = np.broadcast_to(programme.columns[:, None, :], shape)
    used = (row <= column) & (column < programme.size) & (programme.hessian != 0.0)
    every = np.arange(programme.size)
    entries = np.concatenate((programme.hessian[used], programme.diagonal))
    places = (np.concatenate((row[used], every)), np.concatenate((column[used], every)))
    return csc_matrix((entries, places), shape=(programme.size, programme.size))
