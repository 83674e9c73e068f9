"""Groups of axes that no constraint couples: one QP per group, in coordinates with a scaled Hessian."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.tolerances import EXACT
from minsnap.optimisation.equalities import Equalities, joined, jump_rows, onto, plane_rows
from minsnap.optimisation.normalised_constraints import Compiled
from minsnap.optimisation.preconditioning import Space, Whitened, make_space
from minsnap.optimisation.qp import Programme
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.rows import RowSet

REACH = 4
"""Pieces on either side of new rows for which a QP is solved again, where these are few."""


def split_axes(compiled: Compiled, problem: Problem) -> list[BoolArray]:
    """Partition the axes into groups that no constraint couples: masks of shape (dim,)."""
    coupled = np.eye(problem.dim, dtype=bool)
    for block in compiled.blocks:
        touched = block.touched().astype(np.float64)
        coupled |= touched.T @ touched > 0.0
    for _ in range(problem.dim):
        coupled = coupled.astype(np.float64) @ coupled > 0.0
    return [np.asarray(mask) for mask in np.unique(coupled, axis=0)]


@dataclass(frozen=True, eq=False)
class AxisGroup:
    """One group of axes and its coordinates; made by :func:`axis_group`.

    Parameters
    ----------
    problem : Problem
    axes : ndarray of bool, shape (dim,)
    columns : ndarray of int, shape (n,)
        Its unknowns, among those of the problem.
    local : ndarray of int, shape (size + 1,)
        Position of every unknown of the problem in ``columns``; n for those of other groups.
    space : Space
        Coordinates in which its Hessian is the identity (``Whitened``) or has a unit diagonal (``Scaled``).
    slope : ndarray, shape (n,)
        Half the gradient at the base, in these coordinates.
    equalities, planes : Equalities or None
        All equality rows; those of gates' planes again.
    """

    problem: Problem
    axes: BoolArray
    columns: IntArray
    local: IntArray
    space: Space
    slope: FloatArray
    equalities: Equalities | None
    planes: Equalities

    @property
    def whitened(self) -> bool:
        """Whether its Hessian is the identity, so that its QP is a least-distance problem."""
        return isinstance(self.space, Whitened)

    @property
    def always(self) -> bool:
        """Whether its optimum without inequality rows differs from the base, so that it always needs a solve.

        Without unknowns: whether equality rows do not hold, so that a solve refuses it.
        """
        if not len(self.columns):
            return self.equalities is not None and not np.allclose(self.equalities.sides, 0.0, atol=EXACT)
        return self.equalities is not None or bool(self.slope.any())

    def matrix(self, rows: RowSet, chosen: IntArray, shift: float) -> tuple[Any, FloatArray, FloatArray]:
        """Normalised rows (r, n), their bounds with walls moved inwards by ``shift`` widths, and their norms."""
        matrix, norms = self.space.rows(self.local[rows.columns[chosen]], rows.values[chosen])
        return matrix, (rows.bound[chosen] - shift * rows.width[chosen]) / norms, norms

    def equality_rows(self) -> tuple[Any, FloatArray | None]:
        """Normalised equality rows and their right-hand sides; None, None where there are none."""
        if self.equalities is None:
            return None, None
        matrix, norms = self.space.rows(self.equalities.columns, self.equalities.values)
        return matrix, self.equalities.sides / norms

    def near(self, pieces: IntArray) -> IntArray:
        """Return its unknowns within ``REACH`` pieces of some."""
        count = len(self.problem.durations)
        around = pieces[:, None] + np.arange(-REACH, REACH + 1)
        around = around % count if self.problem.closed else np.clip(around, 0, count - 1)
        found = np.unique(self.local[self.problem.piece_columns[np.unique(around)]])
        return found[found < len(self.columns)]

    def unknowns(self, x: FloatArray) -> FloatArray:
        """Return the unknowns at a point of these coordinates, positions exactly in their planes."""
        return onto(self.planes, self.space.unknowns(x))


def axis_group(problem: Problem, base: FloatArray, axes: BoolArray, whitened: bool) -> AxisGroup:
    """Choose coordinates for a group of axes.

    Parameters
    ----------
    base : ndarray, shape (knots, slots, dim)
        Values from which the unknowns are deviations.
    axes : ndarray of bool, shape (dim,)
    whitened : bool
        Whether the Hessian shall become the identity; a singular one only gets a unit diagonal.
    """
    mine = problem.columns[:, :, axes]
    columns = np.flatnonzero(np.bincount(mine[mine >= 0], minlength=problem.size))
    n = len(columns)
    local = np.full(problem.size + 1, n, dtype=np.intp)
    local[columns] = np.arange(n)
    dense = whitened and not floating(problem, axes)
    space = make_space(problem, local[problem.piece_columns[:, axes]], n, dense)
    planes = plane_rows(problem, base, axes, local)
    equalities = joined([jump_rows(problem, base, axes, local), planes], n)
    slope = space.gradient(_slope(problem, base, columns))
    return AxisGroup(problem, axes, columns, local, space, slope, equalities, planes)


def floating(problem: Problem, axes: BoolArray) -> bool:
    """Whether a translation of the curve along an axis costs nothing, so that the Hessian is singular."""
    return bool((problem.free[:, 0].all(axis=0) & axes).any())


def programme(
    group: AxisGroup, rows: RowSet | None, chosen: IntArray, shift: float
) -> tuple[Programme, float, FloatArray]:
    """Return the group's QP over the chosen rows in scaled units, the size of one unit, and the norms of the rows."""
    G, h, norms = None, None, np.ones(0)
    if rows is not None and len(chosen):
        G, h, norms = group.matrix(rows, chosen, shift)
    A, b = group.equality_rows()
    sizes = [np.abs(group.slope), np.zeros(1) if h is None else -h, np.zeros(1) if b is None else np.abs(b)]
    size = max(float(part.max(initial=0.0)) for part in sizes) or 1.0
    h, b = (None if side is None else side / size for side in (h, b))
    return Programme(group.space.hessian, group.slope / size, G, h, A, b), size, norms


def _slope(problem: Problem, base: FloatArray, columns: IntArray) -> FloatArray:
    """Half the gradient at the base; non-zero only at positions that the base keeps fixed."""
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
