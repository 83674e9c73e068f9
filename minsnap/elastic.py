r"""Elastic problems: walls that may give way, at a price, to find by how much they must.

Each group of walls gets a slack: :math:`g(z) \le b + \sigma\,\text{width}\,\text{weight}`.  The sum of the slacks is
minimised (with a trace of the snap cost, so that the curve is unique), over all time by the same exchange of rows.
One slack for all limits tells how far given durations are from flyable; one slack a leg tells which leg is too narrow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from minsnap.compiled import Compiled, Rows
from minsnap.components import Component
from minsnap.errors import SolverError
from minsnap.problem import IntArray, Problem
from minsnap.qp import SMALL, solve_qp
from minsnap.rows import RowSet, rows_in_unknowns, sticking_out
from minsnap.samples import FloatArray
from minsnap.space import Whitened

TRACE = 1e-5
"""Weight of the scaled snap cost beside the slacks, unless another is given."""

ACCURACY = 1e-4
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
        self.multipliers = np.zeros(0)
        if seed is not None:
            self._add([seed])

    def run(self) -> Relaxed:
        """Iterate until the relaxed walls hold at every instant, to ``ACCURACY``.

        Raises
        ------
        SolverError
            If no solver answers.
        """
        knots, slacks, rounds = self.base, np.zeros(self.give.slacks), 0
        if self.rows is not None:
            knots, slacks = self._solve()
            rounds = 1
        while rounds < ROUNDS:
            given = self._amounts(slacks)
            found, _ = sticking_out(self.problem, self.compiled.relaxed(given), knots, self.accuracy)
            if not found and rounds:
                break
            self._add([self._unrelaxed(rows, given) for rows in found])
            knots, slacks = self._solve()
            rounds += 1
        return Relaxed(knots, slacks, self.rows, self.multipliers, rounds)

    def _amounts(self, slacks: FloatArray) -> FloatArray:
        """Widths by which every wall moves outwards."""
        return np.asarray(np.append(slacks, 0.0)[self.give.group] * self.give.weight)

    def _add(self, found: list[Rows]) -> None:
        for rows in found:
            fresh = rows_in_unknowns(self.problem, self.base, self.compiled, rows)
            self.rows = fresh if self.rows is None else self.rows.joined(fresh)

    def _unrelaxed(self, rows: Rows, given: FloatArray) -> Rows:
        """Rows of the walls as they were asked for."""
        return replace(rows, bound=rows.bound - given[rows.wall] * self.compiled.widths[rows.wall])

    def _solve(self) -> tuple[FloatArray, FloatArray]:
        part, rows = self.component, self.rows
        assert rows is not None
        G, h, norms = part.matrix(rows, np.arange(len(rows)), 0.0)
        assert h is not None
        size = max(float(-h.min()), 1e-3)
        moves = self.give.weight[rows.source.wall] * rows.width / norms / size
        P, q, G, h = self._extended(G, h / size, moves, rows)
        A, b = part.equalities if part.equalities is not None else (None, None)
        if A is not None:
            A, b = _padded(A, self.give.slacks), b / size
        found, failed = solve_qp(P, q, G, h, A, b, part.names, 1.0)
        if found is None:
            raise SolverError(f"the elastic problem was not solved by {', '.join(failed)}")
        n = len(part.columns)
        self.multipliers = found.multipliers[: len(rows)] / norms / size
        unknowns = np.zeros(self.problem.size)
        unknowns[part.columns] = size * part.space.unknowns(found.x[:n])
        return self.problem.add(self.base, unknowns), found.x[n:]

    def _extended(self, G: object, h: FloatArray, moves: FloatArray, rows: RowSet) -> tuple[object, ...]:
        """Hessian, slope, rows and bounds with the slacks as further unknowns."""
        from scipy.sparse import block_diag, csc_matrix, hstack, vstack

        n, m = len(self.component.columns), self.give.slacks
        group = self.give.group[rows.source.wall]
        gives = np.flatnonzero(group >= 0)
        slack = csc_matrix((-moves[gives], (gives, group[gives])), shape=(len(rows), m))
        P = block_diag((self.trace * csc_matrix(self.component.space.hessian), self.trace * csc_matrix(np.eye(m))))
        q = np.concatenate((np.zeros(n), np.ones(m)))
        rows_and_slacks = hstack((csc_matrix(G), slack))
        rows_and_slacks = vstack((rows_and_slacks, hstack((csc_matrix((m, n)), -csc_matrix(np.eye(m))))))
        h = np.concatenate((h, np.full(m, -self.give.lowest)))
        if isinstance(self.component.space, Whitened):
            return P.toarray(), q, rows_and_slacks.toarray(), h
        return csc_matrix(P), q, csc_matrix(rows_and_slacks), h


def _padded(A: object, slacks: int) -> object:
    from scipy.sparse import csc_matrix, hstack

    return hstack((csc_matrix(A), csc_matrix((A.shape[0], slacks)))).tocsc()  # type: ignore[attr-defined]
