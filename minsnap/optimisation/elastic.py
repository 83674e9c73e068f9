r"""Elastic problems: walls that may give way, at a price, to find by how much they must.

Each group of walls gets a slack: :math:`g(z) \le b + \sigma\,\text{width}\,\text{weight}`.  The sum of the slacks is
minimised (with a trace of the snap cost, so that the curve is unique), over all time by the same exchange of rows.
One slack for all limits tells how far given durations are from flyable; one slack a leg tells which leg is too narrow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from minsnap.arrays import FloatArray, IntArray
from minsnap.errors import SolverError
from minsnap.optimisation.axis_group import Component
from minsnap.optimisation.normalised_constraints import Compiled, Rows
from minsnap.optimisation.preconditioning import Whitened
from minsnap.optimisation.qp import MIDDLE, SMALL, solve_qp
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.rows import Curve, RowSet, momentary_rows, rows_in_unknowns, sticking_out
from minsnap.polynomials.extrema import maxima

TRACE = 1e-5
"""Weight of the scaled snap cost beside the slacks, unless another is given."""

SPARSE_TRACE = 1e-3
"""The same where the Hessian only has a unit diagonal."""

ACCURACY = 3e-4
"""Excess over the relaxed walls, in widths, that ends the exchange, unless another is given."""

ROUNDS = 30


@dataclass(frozen=True, eq=False)
class Give:
    """How walls may give way.

    Parameters
    ----------
    group : ndarray of int, shape (walls,)
        Slack of each one-sided wall in the common count; -1 for a wall that stands.
    weight : ndarray, shape (walls,)
        Widths by which a wall moves for a slack of 1.
    slacks : int
        Number of slacks.
    lowest : float
        Least value of a slack, not positive: below zero walls are closer than asked.
    """

    group: IntArray
    weight: FloatArray
    slacks: int
    lowest: float = 0.0


@dataclass(frozen=True, eq=False)
class Relaxed:
    """What an elastic solve found.

    Parameters
    ----------
    knots : ndarray, shape (knots, slots, dim)
    slacks : ndarray, shape (slacks,)
    rows : RowSet
    multipliers : ndarray, shape (r,)
        Rate of the sum of slacks with each row's bound.
    rounds : int
    """

    knots: FloatArray
    slacks: FloatArray
    rows: RowSet | None
    multipliers: FloatArray
    rounds: int


class Elastic:
    """State of one elastic run."""

    def __init__(
        self,
        problem: Problem,
        base: FloatArray,
        compiled: Compiled,
        solver: str,
        give: Give,
        seed: Rows | None = None,
        trace: float = TRACE,
        accuracy: float = ACCURACY,
    ) -> None:
        self.problem, self.base, self.compiled, self.give = problem, base, compiled, give
        self.trace, self.accuracy = trace, accuracy
        self.component = Component(problem, base, np.ones(problem.dim, dtype=bool), solver, SMALL)
        self.rows: RowSet | None = None
        self.ends = problem.plain_ends(base)
        self.multipliers = np.zeros(0)
        for rows in (*momentary_rows(Curve(problem, compiled, base)), *([] if seed is None else [seed])):
            self._add([rows] if len(rows.s) else [])

    def run(self) -> Relaxed:
        """Iterate until the relaxed walls hold at every instant, to the accuracy asked for.

        Where the base holds them with every slack at its lowest there is nothing to solve, and no rows.

        Raises
        ------
        SolverError
            If no solver answers.
        """
        if not self.problem.size and self.give.lowest == 0.0:
            return Relaxed(self.base, self._least_slacks(), None, self.multipliers, 0)
        knots, slacks, rounds = self.base, np.full(self.give.slacks, self.give.lowest), 0
        if self.rows is not None:
            knots, slacks = self._solve()
            rounds = 1
        while rounds < ROUNDS:
            given = self._amounts(slacks)
            found, _ = sticking_out(Curve(self.problem, self.compiled.relaxed(given), knots), self.accuracy)
            if not found:
                break
            self._add([self._unrelaxed(rows, given) for rows in found])
            knots, slacks = self._solve()
            rounds += 1
        return Relaxed(knots, slacks, self.rows, self.multipliers, rounds)

    def _least_slacks(self) -> FloatArray:
        """Slacks that a curve without unknowns needs."""
        excess = self.compiled.excess(self.problem, self.problem.relative_points(self.base))
        out = np.concatenate([maxima(points).values for points in excess])
        slacks = np.full(self.give.slacks, self.give.lowest)
        gives = self.give.group >= 0
        np.maximum.at(slacks, self.give.group[gives], (out / np.maximum(self.give.weight, 1e-300))[gives])
        return slacks

    def _amounts(self, slacks: FloatArray) -> FloatArray:
        """Widths by which every wall moves outwards."""
        return np.asarray(np.append(slacks, 0.0)[self.give.group] * self.give.weight)

    def _add(self, found: list[Rows]) -> None:
        for rows in found:
            fresh = rows_in_unknowns(self.problem, self.ends, self.compiled, rows)
            self.rows = fresh if self.rows is None else self.rows.joined(fresh)

    def _unrelaxed(self, rows: Rows, given: FloatArray) -> Rows:
        """Rows of the walls as they were asked for."""
        return replace(rows, bound=rows.bound - given[rows.wall] * self.compiled.widths[rows.wall])

    def _solve(self) -> tuple[FloatArray, FloatArray]:
        part, rows = self.component, self.rows
        if rows is None:
            raise SolverError("the elastic problem has no rows")
        G, bound, norms = part.matrix(rows, np.arange(len(rows)), 0.0)
        size = max(float(-bound.min()), 1e-3)
        moves = self.give.weight[rows.source.wall] * self.compiled.widths[rows.source.wall] / norms / size
        P, q = self._costs
        unit = 1.0 / float(moves[self.give.group[rows.source.wall] >= 0].max(initial=0.0) or 1.0)
        G, h = self._extended(G, bound / size, moves * unit, rows, unit)
        A, b = None, None
        if part.equalities is not None:
            A, b = _padded(part.equalities[0], self.give.slacks), part.equalities[1] / size
        found, failed = solve_qp(P, q, G, h, A, b, part.names, 1.0)
        if found is None and not self._dense and len(part.columns) <= MIDDLE:
            part.whiten()
            self.__dict__.pop("_costs", None)
            return self._solve()
        if found is None:
            raise SolverError(f"the elastic problem was not solved by {', '.join(failed)}")
        n = len(part.columns)
        self.multipliers = found.multipliers[: len(rows)] * unit / norms / size
        unknowns = np.zeros(self.problem.size)
        unknowns[part.columns] = size * part.space.unknowns(found.x[:n])
        return self.problem.add(self.base, unknowns), found.x[n:] * unit

    @cached_property
    def _costs(self) -> tuple[Any, FloatArray]:
        """Hessian and slope with the slacks as further unknowns."""
        from scipy.sparse import block_diag, csc_matrix

        n, m = len(self.component.columns), self.give.slacks
        q = np.concatenate((np.zeros(n), np.ones(m)))
        hessian = self.component.space.hessian
        if self._dense:
            P = np.zeros((n + m, n + m))
            P[:n, :n] = self._trace * hessian
            P[n:, n:] = self._trace * np.eye(m)
            return P, q
        return csc_matrix(block_diag((self._trace * hessian, self._trace * csc_matrix(np.eye(m))))), q

    @property
    def _dense(self) -> bool:
        return isinstance(self.component.space, Whitened)

    @property
    def _trace(self) -> float:
        return self.trace if self._dense else SPARSE_TRACE / TRACE * self.trace

    def _extended(self, G: Any, h: FloatArray, moves: FloatArray, rows: RowSet, unit: float) -> tuple[Any, FloatArray]:
        """Rows and bounds with the slacks, in that unit, as further unknowns; and the slacks' lower bounds."""
        n, m = len(self.component.columns), self.give.slacks
        group = self.give.group[rows.source.wall]
        gives = np.flatnonzero(group >= 0)
        h = np.concatenate((h, np.full(m, -self.give.lowest / unit)))
        row = np.concatenate((gives, len(rows) + np.arange(m)))
        column = n + np.concatenate((group[gives], np.arange(m)))
        value = np.concatenate((-moves[gives], np.full(m, -1.0)))
        if self._dense:
            dense = np.zeros((len(rows) + m, n + m))
            dense[: len(rows), :n] = G
            dense[row, column] = value
            return dense, h
        from scipy.sparse import csc_matrix

        G = G.tocoo()
        entries = tuple(np.concatenate(pair) for pair in ((G.data, value), (G.row, row), (G.col, column)))
        return csc_matrix((entries[0], entries[1:]), shape=(len(rows) + m, n + m)), h


def _padded(A: Any, slacks: int) -> Any:
    from scipy.sparse import csc_matrix, hstack

    return hstack((csc_matrix(A), csc_matrix((A.shape[0], slacks)))).tocsc()
