"""Rows and equations in unknowns that are differences of control points, whatever the durations are."""

from __future__ import annotations

from functools import cached_property
from math import perm
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.optimisation.equalities import joined as joined_equalities
from minsnap.optimisation.equalities import jump_rows, plane_rows
from minsnap.optimisation.reduced_qp import ReducedProblem

DENSE = 300
"""Unknowns up to which rows and equations are dense, and the Hessian of a QP is made the identity."""


class LinearRows:
    """Matrices of rows and equations in deviations from a base.

    Parameters
    ----------
    problem : ReducedProblem
    base : ndarray, shape (knots, slots, dim)
    scale : ndarray, shape (size + 1,), optional
        Value of each unknown in its own unit, and a zero; unless given, unknowns are differences of control points of
        the longer pieces.
    """

    def __init__(self, problem: ReducedProblem, base: FloatArray, scale: FloatArray | None = None) -> None:
        self.problem = problem
        self._scale = scale
        self.size = problem.size
        axes, local = np.ones(problem.dim, dtype=bool), np.arange(problem.size + 1)
        self.equations = joined_equalities(
            [jump_rows(problem, base, axes, local), plane_rows(problem, base, axes, local)], problem.size
        )

    @cached_property
    def scale(self) -> FloatArray:
        """Value of each unknown in its own unit, and a zero: (size + 1,)."""
        if self._scale is not None:
            return self._scale
        problem, T = self.problem, self.problem.durations
        before, after = np.append(T[-1] if problem.closed else 0.0, T), np.append(T, T[0] if problem.closed else 0.0)
        order = np.zeros(problem.slots.count, dtype=np.intp)
        for slots in (problem.slots.start, problem.slots.end):
            order[slots] = np.arange(problem.half)
        factors = np.array([perm(problem.degree, int(p)) for p in order])
        values = factors / np.maximum(before, after)[:, None] ** order
        scale = np.zeros(self.size + 1)
        scale[problem.columns] = values[:, :, None]
        scale[-1] = 0.0
        return scale

    def matrix(self, columns: IntArray, values: FloatArray) -> Any:
        """Sparse rows (r, size), from columns that are -1 or ``size`` for none."""
        from scipy.sparse import csr_matrix

        places = np.where(columns < 0, self.size, columns)
        row = np.broadcast_to(np.arange(len(columns))[:, None], columns.shape)
        scaled = values * self.scale[places]
        used = scaled != 0.0
        return csr_matrix((scaled[used], (row[used], places[used])), shape=(len(columns), self.size))

    @cached_property
    def equality_rows(self) -> tuple[Any, FloatArray]:
        """Equations with rows of unit length, and their right-hand sides."""
        from scipy.sparse import csr_matrix

        if self.equations is None:
            return csr_matrix((0, self.size)), np.zeros(0)
        matrix, norms = of_unit_length(self.matrix(self.equations.columns, self.equations.values))
        return matrix, self.equations.sides / norms


def of_unit_length(matrix: Any) -> tuple[Any, FloatArray]:
    """Return rows of length 1, but for those that are zero, and the lengths by which they were divided."""
    from scipy.sparse import csr_matrix, diags

    norms = np.sqrt(np.asarray(matrix.multiply(matrix).sum(axis=1)).reshape(-1))
    norms[norms == 0.0] = 1.0
    return csr_matrix(diags(1.0 / norms) @ matrix), norms


def joined_exactly(problem: ReducedProblem, knots: FloatArray) -> FloatArray:
    """Remove what a solver left of jumps above k - 1 and of distances to gates' planes, by the least change."""
    if not (problem.jumps or problem.planes) or not 0 < problem.size <= DENSE:
        return knots
    for _ in range(2):
        linear = LinearRows(problem, knots)
        A, b = linear.equality_rows
        if len(b):
            knots = problem.add(knots, np.linalg.lstsq(A.toarray(), b, rcond=None)[0] * linear.scale[:-1])
    return knots
