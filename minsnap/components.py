"""Components: groups of axes that no wall couples, each a QP of its own with a scaled Hessian."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from minsnap.compiled import Compiled
from minsnap.polynomial import ends_gram
from minsnap.problem import IntArray, Problem
from minsnap.qp import SMALL, solve_qp, solver_names
from minsnap.samples import FloatArray

if TYPE_CHECKING:
    from minsnap.rows import RowSet

BoolArray = npt.NDArray[np.bool_]


def split_axes(compiled: Compiled, problem: Problem) -> list[BoolArray]:
    """Partition the axes into groups that no wall couples: masks of shape (dim,)."""
    coupled = np.eye(problem.dim, dtype=bool)
    for block in compiled.blocks:
        touched = block.touched().astype(np.float64)
        coupled |= touched.T @ touched > 0.0
    for _ in range(problem.dim):
        coupled = coupled.astype(np.float64) @ coupled > 0.0
    return [np.asarray(mask) for mask in np.unique(coupled, axis=0)]


class Component:
    """One group of axes: its unknowns, their scaled Hessian, and how to solve over given rows.

    The unknowns are divided by the square root of the Hessian's diagonal and by the largest violation, rows are
    normalised: the QP that a solver sees has a unit diagonal, unit rows and bounds of order one.
    """

    def __init__(self, problem: Problem, base: FloatArray, axes: BoolArray, solver: str) -> None:
        self.problem, self.base, self.axes = problem, base, axes
        mine = problem.columns[:, :, axes]
        self.columns = np.unique(mine[mine >= 0])
        self.names = solver_names(solver, len(self.columns))
        self.solver = ""
        self.failed: tuple[str, ...] = ()
        self.gain = 0.0

    @cached_property
    def local(self) -> IntArray:
        """Position of every unknown in ``columns``, their number for those of other components."""
        local = np.full(self.problem.size + 1, len(self.columns), dtype=np.intp)
        local[self.columns] = np.arange(len(self.columns))
        return local

    @cached_property
    def _scaled(self) -> tuple[Any, FloatArray]:
        return _scaled_hessian(self.problem, self.axes, self.local, len(self.columns))

    @property
    def hessian(self) -> Any:
        """Hessian with a unit diagonal, dense when small."""
        return self._scaled[0]

    @property
    def scale(self) -> FloatArray:
        """Unknowns = scale times scaled unknowns."""
        return self._scaled[1]

    @cached_property
    def slope(self) -> FloatArray:
        """Half the gradient at the base, scaled."""
        return _slope(self.problem, self.base, self.columns) * self.scale

    @cached_property
    def equalities(self) -> tuple[Any, FloatArray] | None:
        """Rows of the continuity above k - 1."""
        return _jump_rows(self.problem, self.base, self.axes, self.local, self.scale) if self.problem.jumps else None

    @property
    def always(self) -> bool:
        """Whether it needs a solve even without rows."""
        return bool(self.problem.jumps) or bool(self.problem.held.any())

    def solve(self, rows: RowSet | None, chosen: IntArray, shrink: float) -> tuple[FloatArray, FloatArray] | None:
        """Solve over the chosen rows, walls moved inwards by ``shrink`` widths: unknowns and multipliers."""
        G, h, norms = self.matrix(rows, chosen, shrink)
        A, b = self.equalities if self.equalities is not None else (None, None)
        size = _largest(-h if h is not None else None, np.abs(self.slope), np.abs(b) if b is not None else None)
        h, b = (None if side is None else side / size for side in (h, b))
        found, failed = solve_qp(self.hessian, self.slope / size, G, h, A, b, self.names)
        self.failed = tuple(dict.fromkeys(self.failed + failed)) if found is not None else failed
        if found is None:
            return None
        self.solver = found.solver
        x = size * found.x
        self.gain = float(x @ (self.hessian @ x) + 2.0 * self.slope @ x)
        return self.scale * x, 2.0 * size * found.multipliers / norms

    def matrix(self, rows: RowSet | None, chosen: IntArray, shrink: float) -> tuple[Any, FloatArray | None, FloatArray]:
        n = len(self.columns)
        if rows is None or not len(chosen):
            return None, None, np.ones(0)
        columns = self.local[rows.columns[chosen]]
        values = rows.values[chosen] * np.append(self.scale, 0.0)[columns]
        norms = np.sqrt((values * values).sum(axis=1))
        norms[norms == 0.0] = 1.0
        values /= norms[:, None]
        bound = (rows.bound[chosen] - shrink * rows.width[chosen]) / norms
        if isinstance(self.hessian, np.ndarray):
            dense = np.zeros((len(chosen), n + 1))
            dense[np.arange(len(chosen))[:, None], columns] = values
            return np.ascontiguousarray(dense[:, :n]), bound, norms
        return _sparse_rows(columns, values, n), bound, norms


def _largest(*arrays: FloatArray | None) -> float:
    """Largest positive entry of all, 1 if there is none."""
    return max((float(array.max(initial=0.0)) for array in arrays if array is not None), default=0.0) or 1.0


def _sparse_rows(columns: IntArray, values: FloatArray, n: int) -> Any:
    from scipy.sparse import csc_matrix

    row = np.broadcast_to(np.arange(len(columns))[:, None], columns.shape)
    used = (columns < n) & (values != 0.0)
    return csc_matrix((values[used], (row[used], columns[used])), shape=(len(columns), n))


def _scaled_hessian(problem: Problem, axes: BoolArray, local: IntArray, n: int) -> tuple[Any, FloatArray]:
    """Hessian over some axes scaled to a unit diagonal, dense when small; and the scale of the unknowns."""
    powers = np.concatenate((problem.powers, problem.powers), axis=1)
    weights = problem.durations ** (1.0 - 2.0 * problem.half)
    blocks = powers[:, :, None] * powers[:, None, :] * (weights[:, None, None] * ends_gram(problem.degree))
    columns = local[problem.piece_columns[:, axes]]
    row, column = np.broadcast_arrays(columns[:, :, :, None], columns[:, :, None, :])
    value = np.broadcast_to(blocks[:, None], row.shape)
    used = (row < n) & (column < n)
    row, column, value = row[used], column[used], value[used]
    diagonal = np.bincount(row[row == column], value[row == column], n)
    scale = 1.0 / np.sqrt(diagonal)
    value = value * scale[row] * scale[column]
    if n <= SMALL:
        return np.bincount(row * n + column, value, n * n).reshape(n, n), scale
    from scipy.sparse import csc_matrix

    return csc_matrix((value, (row, column)), shape=(n, n)), scale


def _slope(problem: Problem, base: FloatArray, columns: IntArray) -> FloatArray:
    """Half the gradient at the base where it does not vanish: at positions that the base holds."""
    if not problem.held.any():
        return np.zeros(len(columns))
    gradient = problem.gradient(base)
    if problem.closed:
        gradient[0] += gradient[-1]
    flat = np.zeros(problem.size)
    held = np.zeros(problem.free.shape, dtype=bool)
    held[problem.held, 0] = True
    place = held & (problem.columns >= 0)
    flat[problem.columns[place]] = gradient[place]
    return np.asarray(flat[columns])


def _jump_rows(
    problem: Problem, base: FloatArray, axes: BoolArray, local: IntArray, scale: FloatArray
) -> tuple[Any, FloatArray] | None:
    """Equality rows that make higher derivatives continuous at the knots, normalised."""
    n, pieces = len(scale), len(problem.durations)
    left = np.arange(pieces) if problem.closed else np.arange(pieces - 1)
    right = (left + 1) % pieces
    if not len(left):
        return None
    ends = problem.plain_ends(base, np.arange(pieces))
    blocks, bounds = [], []
    for order in problem.jumps:
        before = problem.row_factors(left, np.ones(len(left)), order)
        after = problem.row_factors(right, np.zeros(len(right)), order)
        for axis in np.flatnonzero(axes):
            columns = local[
                np.concatenate((problem.piece_columns[left, axis], problem.piece_columns[right, axis]), axis=1)
            ]
            values = np.concatenate((before, -after), axis=1) * np.append(scale, 0.0)[columns]
            dense = _sparse_rows(columns, values, n)
            norms = np.sqrt(np.asarray(dense.multiply(dense).sum(axis=1)).reshape(-1))
            norms[norms == 0.0] = 1.0
            jump = np.einsum("rj,rj->r", before, ends[left, :, axis]) - np.einsum(
                "rj,rj->r", after, ends[right, :, axis]
            )
            blocks.append(dense.multiply(1.0 / norms[:, None]))
            bounds.append(-jump / norms)
    from scipy.sparse import vstack

    A = vstack(blocks).tocsc()
    return (A.toarray() if n <= SMALL else A), np.concatenate(bounds)
