r"""Elastic problems: constraints relaxed by slacks, to find the least relaxation at which a solution exists.

Each group of walls gets a slack: :math:`g(z) \le b + \sigma\,\text{width}\,\text{weight}`.  The sum of the slacks is
minimised (plus a small weight on the snap cost, so that the curve is unique), over all time by the same exchange of
rows. One slack for all limits measures how far given durations are from feasible; one slack per leg shows which leg is
too narrow.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from minsnap.arrays import FloatArray, IntArray
from minsnap.errors import SolverError
from minsnap.optimisation.axis_group import AxisGroup, axis_group
from minsnap.optimisation.normalised_constraints import Compiled, WallRows
from minsnap.optimisation.qp import ACCURACY as SOLVED
from minsnap.optimisation.qp import DENSE, Programme, solve_qp
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.rows import Curve, RowSet, momentary_rows, rows_in_unknowns, rows_outside
from minsnap.polynomials.extrema import maxima

TRACE = 1e-5
"""Weight of the scaled snap cost beside the slacks, unless another is given."""

ACCURACY = 3e-4
"""Excess over the relaxed walls, in widths, that ends the exchange, unless another is given."""

ROUNDS = 30

ACCEPTED = (SOLVED, 1e-4)
"""Relative duality gaps of a solution that are accepted in turn: multipliers of 1e6 leave a larger one."""

DENSELY, SPARSELY = ("daqp", "nnls", "piqp", "clarabel"), ("piqp", "clarabel")
"""Solvers to try in turn, by coordinates."""


@dataclass(frozen=True, eq=False)
class Give:
    """How constraints may be relaxed.

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
    """Result of an elastic solve.

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
        seed: WallRows | None = None,
        trace: float = TRACE,
        accuracy: float = ACCURACY,
    ) -> None:
        self.problem, self.base, self.compiled, self.give = problem, base, compiled, give
        self.trace, self.accuracy = trace, accuracy
        self.solver = solver
        self._made: dict[bool, AxisGroup] = {}
        self.rows: RowSet | None = None
        self.ends = problem.plain_ends(base)
        self.multipliers = np.zeros(0)
        for rows in (*momentary_rows(Curve(problem, compiled, base)), *([] if seed is None else [seed])):
            self._add([rows] if len(rows.s) else [])

    def run(self) -> Relaxed:
        """Iterate until the relaxed walls hold at every instant, to the accuracy asked for.

        If the base satisfies them with every slack at its lower bound, no solve is needed and there are no rows.

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
            curve = Curve(self.problem, self.compiled.relaxed(given), knots)
            found, _ = rows_outside(curve, self.rows, self.multipliers, self.accuracy)
            if not found:
                break
            self._add([self._unrelaxed(rows, given) for rows in found])
            knots, slacks = self._solve()
            rounds += 1
        return Relaxed(knots, slacks, self.rows, self.multipliers, rounds)

    def _least_slacks(self) -> FloatArray:
        """Least slacks for a curve without unknowns."""
        excess = self.compiled.excess(self.problem, self.problem.relative_points(self.base))
        blocks = zip(self.compiled.blocks, excess, strict=True)
        out = np.concatenate([block.relaxation(maxima(points).values) for block, points in blocks])
        slacks = np.full(self.give.slacks, self.give.lowest)
        gives = self.give.group >= 0
        np.maximum.at(slacks, self.give.group[gives], (out / np.maximum(self.give.weight, 1e-300))[gives])
        return slacks

    def _amounts(self, slacks: FloatArray) -> FloatArray:
        """Widths by which every wall moves outwards."""
        return np.asarray(np.append(slacks, 0.0)[self.give.group] * self.give.weight)

    def _add(self, found: list[WallRows]) -> None:
        for rows in found:
            fresh = rows_in_unknowns(self.problem, self.ends, self.compiled, rows)
            self.rows = fresh if self.rows is None else self.rows.joined(fresh)

    def _unrelaxed(self, rows: WallRows, given: FloatArray) -> WallRows:
        """Rows of the walls without relaxation."""
        return replace(rows, bound=rows.bound - given[rows.wall] * self.compiled.widths[rows.wall])

    @property
    def _known(self) -> RowSet:
        if self.rows is None:
            raise SolverError("the elastic problem has no rows")
        return self.rows

    def _solve(self) -> tuple[FloatArray, FloatArray]:
        for accuracy in ACCEPTED:
            for group in self._groups():
                usual = DENSELY if group.whitened else SPARSELY
                for solver in (*(() if self.solver == "auto" else (self.solver,)), *usual):
                    found = self._attempt(group, solver, accuracy)
                    if found is not None:
                        return found
        raise SolverError("no solver found how much wider the walls must be: change units or durations")

    def _groups(self) -> Iterator[AxisGroup]:
        """Coordinates of all axes together, dense ones first where the unknowns are few."""
        if self.problem.size <= DENSE:
            yield self._coordinates(True)
        yield self._coordinates(False)

    def _coordinates(self, whitened: bool) -> AxisGroup:
        if whitened not in self._made:
            axes = np.ones(self.problem.dim, dtype=bool)
            self._made[whitened] = axis_group(self.problem, self.base, axes, whitened)
        return self._made[whitened]

    def _attempt(self, group: AxisGroup, solver: str, accuracy: float) -> tuple[FloatArray, FloatArray] | None:
        rows = self._known
        G, bound, norms = group.matrix(rows, np.arange(len(rows)), 0.0)
        size = max(float(-bound.min()), 1e-3)
        moves = self.give.weight[rows.source.wall] * self.compiled.widths[rows.source.wall] / norms / size
        unit = 1.0 / float(moves[self.give.group[rows.source.wall] >= 0].max(initial=0.0) or 1.0)
        asked, weight = self._programme(group, G, bound / size, moves * unit, unit, size)
        found = solve_qp(asked, solver, 1.0, weight=weight, accuracy=accuracy)
        if found is None:
            return None
        n = len(group.columns)
        self.multipliers = found.multipliers[: len(rows)] * unit / norms / size
        unknowns = np.zeros(self.problem.size)
        unknowns[group.columns] = group.unknowns(size * found.x[:n])
        return self.problem.add(self.base, unknowns), found.x[n:] * unit

    def _programme(
        self, group: AxisGroup, G: Any, h: FloatArray, moves: FloatArray, unit: float, size: float
    ) -> tuple[Programme, float]:
        """Return the QP with the slacks, in that unit, as further unknowns, and the weight of the snap cost in it."""
        from scipy.sparse import coo_matrix, csc_matrix, identity

        n, m, weight = len(group.columns), self.give.slacks, self.trace
        slack_of = self.give.group[self._known.source.wall]
        gives = np.flatnonzero(slack_of >= 0)
        moved = coo_matrix((-moves[gives], (gives, slack_of[gives])), shape=(len(h), m))
        P = _blocks([[weight * csc_matrix(group.space.hessian), None], [None, weight * identity(m)]])
        G = _blocks([[csc_matrix(G), moved], [csc_matrix((m, n)), -identity(m)]])
        h = np.concatenate((h, np.full(m, -self.give.lowest / unit)))
        A, b = group.equality_rows()
        A, b = (
            (None, None) if A is None or b is None else (_blocks([[csc_matrix(A), csc_matrix((len(b), m))]]), b / size)
        )
        if group.whitened:
            P, G, A = (None if matrix is None else matrix.toarray() for matrix in (P, G, A))
        return Programme(P, np.concatenate((np.zeros(n), np.ones(m))), G, h, A, b), weight


def _blocks(parts: list[list[Any]]) -> Any:
    from scipy.sparse import bmat

    return bmat(parts, format="csc")
