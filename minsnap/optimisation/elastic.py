r"""Elastic problems: constraints relaxed by slacks, to find the least relaxation at which a solution exists.

Each group of walls gets a slack: :math:`g(z) \le b + \sigma\,\text{width}\,\text{weight}`.  The sum of the slacks is
minimised over all time by the same exchange of rows.  One slack for all limits measures how far given durations are
from feasible; one slack per leg shows which leg is too narrow; a slack below zero gives a curve with room to all walls.

The cost of the curve has no part in it, and neither have its coordinates.  An unknown is a derivative times a power of
the longer of its two pieces' durations, so that it is a difference of control points there.  Where there are
equations and few unknowns, these are coordinates in which the rows to begin with have orthonormal columns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.deadline import NEVER, WORK, Deadline
from minsnap.basics.tolerances import ROUNDING
from minsnap.errors import SolverError
from minsnap.optimisation.linear_rows import DENSE, LinearRows
from minsnap.optimisation.normalised_constraints import Compiled, WallRows
from minsnap.optimisation.qp import ACCURACY as SOLVED
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.optimisation.rows import Curve, RowSet, all_walls_rows, rows_in_unknowns, rows_outside
from minsnap.optimisation.slack_programme import (
    SlackProgramme,
    Solver,
    by_clarabel,
    by_native_core,
    least_sum,
)
from minsnap.polynomials.extrema import maxima

ACCURACY = 3e-4
"""Excess over the relaxed walls, in widths, that ends the exchange, by default."""

ROUNDS = 20

DENSE_WORK = 1e8
"""Entries times columns up to which rows in dense coordinates are solved; solvers take a second or two for that."""

Backend = tuple[bool, Solver]
"""Whether in dense coordinates, and by which solver."""


@dataclass(frozen=True, eq=False)
class Relaxation:
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
    rows : RowSet or None
        None where nothing is free.
    multipliers : ndarray, shape (r,)
        Rate of the sum of slacks with each row's bound.
    rounds : int
    evidence : callable
        Seeks multipliers (r,) with which the same rows contradict each other without slacks; empty where not found.
    """

    knots: FloatArray
    slacks: FloatArray
    rows: RowSet | None
    multipliers: FloatArray
    rounds: int
    evidence: Callable[[], FloatArray]


@dataclass(frozen=True, eq=False)
class ElasticSolution:
    """Solution of one elastic problem.

    Parameters
    ----------
    knots : ndarray, shape (knots, slots, dim)
    slacks : ndarray, shape (slacks,)
    multipliers : ndarray, shape (r,)
    lost : float
        Duality gap, as a share of one width and the slacks.
    """

    knots: FloatArray
    slacks: FloatArray
    multipliers: FloatArray
    lost: float


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Coordinates x of the unknowns u = origin + basis x, with what is left of the equations.

    Parameters
    ----------
    origin : ndarray, shape (size,)
    basis : ndarray or None
        (size, n); None for the identity.
    A : csr_matrix, shape (e, n)
    b : ndarray, shape (e,)
    """

    origin: FloatArray
    basis: FloatArray | None
    A: Any
    b: FloatArray

    def rows(self, matrix: Any) -> Any:
        """Rows in these coordinates."""
        from scipy.sparse import csr_matrix

        return matrix if self.basis is None else csr_matrix(matrix @ self.basis)

    def unknowns(self, x: FloatArray) -> FloatArray:
        """Return u."""
        return x if self.basis is None else np.asarray(self.origin + self.basis @ x)


class Elastic:
    """State of one elastic run.

    Parameters
    ----------
    problem : ReducedProblem
    compiled : Compiled
    give : Relaxation
    seed : WallRows, optional
        Rows to begin with, beside those of every wall.
    accuracy : float
        Excess over the relaxed walls, in widths, that ends the exchange.
    inward : float
        Widths by which rows are moved inwards once a slack is certain, so that it ends after fewer solves.
    sign : bool
        Whether it is sufficient to know whether the slack is above zero, or of a curve with room to all walls.
    far : float
        Size of a slack above which it ends where the slack grows by less than a hundredth in a round.
    deadline : Deadline
        Checked before each solve.
    """

    def __init__(
        self,
        problem: ReducedProblem,
        compiled: Compiled,
        give: Relaxation,
        seed: WallRows | None = None,
        accuracy: float = ACCURACY,
        inward: float = 0.0,
        sign: bool = False,
        far: float = np.inf,
        deadline: Deadline = NEVER,
    ) -> None:
        self.problem, self.base, self.compiled, self.give = problem, problem.values, compiled, give
        self.accuracy, self.inward, self.sign, self.far, self.deadline = accuracy, inward, sign, far, deadline
        self.linear = LinearRows(problem, self.base)
        self.ends = problem.plain_ends(self.base)
        self.multipliers, self.moved = np.zeros(0), 0.0
        begin = all_walls_rows(Curve(problem, compiled, self.base)) + ([] if seed is None else [seed])
        self.rows = self._expressed(begin)
        self._made: dict[bool, Coordinates] = {}
        self._ways = self._ways_in_turn()

    def run(self) -> Relaxed:
        """Iterate until the relaxed walls hold at every instant, to ``accuracy``.

        After ``ROUNDS`` solves the slacks are from below, or with ``inward`` those that the last curve
        needs, which is also where it ends once the curve sticks out by no more than that.

        Raises
        ------
        SolverError
            If no solver answers; LateError, which is one, after the deadline.
        """
        if not self.problem.size and self.give.lowest == 0.0:
            return Relaxed(self.base, self._needed(self.base), None, self.multipliers, 0, lambda: np.zeros(0))
        knots, slacks = self._solve()
        rounds = 1
        while True:
            amounts = self._amounts(slacks)
            curve = Curve(self.problem, self.compiled.relaxed(amounts), knots)
            violated, excess = rows_outside(curve, self.rows, self.multipliers, self.accuracy)
            if not violated or (self.sign and self._known(slacks, excess)):
                break
            if rounds == ROUNDS or excess <= self.moved:
                slacks = np.maximum(slacks, self._needed(knots)) if self.inward else slacks
                break
            self.rows = self.rows.joined(self._expressed([self._unrelaxed(rows, amounts) for rows in violated]))
            self.moved = self.inward if slacks.max() > ACCURACY else 0.0
            before = slacks
            knots, slacks = self._solve()
            rounds += 1
            if abs(slacks.max()) > self.far and slacks.max() - before.max() < 0.01 * abs(slacks.max()):
                break
        self.moved = 0.0
        return Relaxed(knots, slacks, self.rows, self.multipliers, rounds, self._evidence)

    def _known(self, slacks: FloatArray, excess: float) -> bool:
        """Whether no curve keeps the rows so far, or this one has half of all the room that there can be."""
        return bool(slacks.max() > ACCURACY or excess < -slacks.max() / 2.0)

    def _evidence(self) -> FloatArray:
        """Multipliers of rows that contradict each other, by non-negative least squares; empty where there are none.

        They are sought among the rows that press most, eight for each unknown: those of a least slack are fewer.
        """
        from scipy.optimize import nnls
        from scipy.sparse import vstack

        coordinates = self._coordinates(self.linear.size <= DENSE)
        (matrix, bound), width = self._in_widths, self.compiled.widths[self.rows.source.wall]
        most = np.argsort(-self.multipliers * width, kind="stable")
        chosen = np.sort(most[: 8 * (coordinates.rows(matrix).shape[1] + 1)])
        rows = vstack((coordinates.rows(matrix)[chosen], coordinates.A, -coordinates.A)).tocsr()
        right = np.concatenate(((bound - matrix @ coordinates.origin)[chosen], coordinates.b, -coordinates.b))
        touched = np.flatnonzero(np.abs(rows).sum(axis=0))
        steps = max(1, int(6.0 * DENSE_WORK / len(right) ** 2))  # a step takes the time of that square
        system = np.vstack((rows[:, touched].toarray().T, right / (np.abs(right).max() or 1.0)))
        try:
            solution = nnls(system, np.append(np.zeros(len(touched)), -1.0), maxiter=steps)[0]
        except RuntimeError:
            return np.zeros(0)
        evidence = np.zeros(len(bound))
        evidence[chosen] = solution[: len(chosen)] / width[chosen]
        return evidence

    def _needed(self, knots: FloatArray) -> FloatArray:
        """Least slacks with which a curve keeps all walls that give way."""
        excess = self.compiled.excess(self.problem, self.problem.relative_points(knots))
        blocks = zip(self.compiled.blocks, excess, strict=True)
        out = np.concatenate([block.outward(maxima(points).values) for block, points in blocks])
        slacks = np.full(self.give.slacks, self.give.lowest)
        gives = self.give.group >= 0
        np.maximum.at(slacks, self.give.group[gives], (out / np.maximum(self.give.weight, 1e-300))[gives])
        return slacks

    def _amounts(self, slacks: FloatArray) -> FloatArray:
        """Widths by which every wall moves outwards."""
        return np.asarray(np.append(slacks, 0.0)[self.give.group] * self.give.weight)

    def _expressed(self, rows: list[WallRows]) -> RowSet:
        return rows_in_unknowns(self.problem, self.ends, self.compiled, reduce(WallRows.joined, rows))

    def _unrelaxed(self, rows: WallRows, amounts: FloatArray) -> WallRows:
        """Rows of the walls without relaxation."""
        return replace(rows, bound=rows.bound - amounts[rows.wall] * self.compiled.widths[rows.wall])

    @property
    def _in_widths(self) -> tuple[Any, FloatArray]:
        """Rows, and their bounds, in widths."""
        from scipy.sparse import diags

        widths = self.compiled.widths[self.rows.source.wall]
        bound = self.rows.bound - self.moved * self.rows.width
        return diags(1.0 / widths) @ self.linear.matrix(self.rows.columns, self.rows.values), bound / widths

    def _solve(self) -> tuple[FloatArray, FloatArray]:
        """Solve by the first way whose answer is accurate, which is tried first from then on, or else by the best."""
        self.deadline.require()
        solutions: list[tuple[Backend, ElasticSolution]] = []
        for way in self._ways:
            answer = self._attempt(*way)
            if answer is not None:
                solutions.append((way, answer))
                if answer.lost <= max(SOLVED, 0.01 * answer.slacks.max()):
                    break
        if not solutions:
            raise SolverError("whether a curve keeps all walls is not known: change units, durations or pins")
        way, best = min(solutions, key=lambda one: one[1].lost)
        self._ways = [way, *(other for other in self._ways if other != way)]
        self.multipliers = best.multipliers
        return best.knots, best.slacks

    def _ways_in_turn(self) -> list[Backend]:
        """Return ways: Clarabel, dense for few unknowns too, and the native core, for equations in dense coordinates.

        The native core is first without equations, and where they leave less than a third of the unknowns free.
        """
        size, equations = self.linear.size, self.linear.equations
        sparse, dense = (False, by_clarabel), [(True, by_clarabel)] if size <= 2 * DENSE else []
        if equations is None:
            return [(False, by_native_core), sparse, *dense]
        native = [(True, by_native_core)] if dense else []
        few = 3 * len(equations.sides) > 2 * size
        return [*native, sparse, *dense] if few else [sparse, *native, *dense]

    def _coordinates(self, dense: bool) -> Coordinates:
        if dense not in self._made:
            equalities = self.linear.equality_rows()
            self._made[dense] = (
                orthonormal(self._in_widths[0], *equalities)
                if dense
                else Coordinates(np.zeros(self.linear.size), None, *equalities)
            )
        return self._made[dense]

    def _attempt(self, dense: bool, solver: Solver) -> ElasticSolution | None:
        """Solve one way; None without an accurate answer; with ``sign``, one with room is enough."""
        from scipy.sparse import bmat, coo_matrix, csc_matrix, identity

        coordinates = self._coordinates(dense)
        matrix, bound = self._in_widths
        rows, right = coordinates.rows(matrix), bound - matrix @ coordinates.origin
        if dense and rows.nnz * rows.shape[1] > DENSE_WORK:
            return None
        n, m, wall = rows.shape[1], self.give.slacks, self.rows.source.wall
        gives = np.flatnonzero(self.give.group[wall] >= 0)
        moves = self.give.weight[wall[gives]]
        moved = coo_matrix((-moves, (gives, self.give.group[wall[gives]])), shape=(len(right), m))
        parts = [[coordinates.A, None], [rows, moved], [csc_matrix((m, n)), -identity(m)]]
        sides = np.concatenate((coordinates.b, right, np.full(m, -self.give.lowest)))
        own = np.zeros_like(self.rows.source.piece) if dense else self.rows.source.piece
        piece = np.append(own, np.full(m, own.max(initial=0) + 1))
        system = bmat(parts, format="csc")
        self.deadline.spend(WORK.slacks * system.nnz * system.shape[1])
        solution = least_sum(SlackProgramme(system, sides, len(coordinates.b), piece, m), solver)
        if solution is None:
            return None
        x = solution.x
        size = 1.0 + max(0.0, float(x[n:].max()))
        room = self.sign and x[n:].max() < 0.0
        if solution.broken > 0.1 * self.accuracy * size or (solution.lost > ACCURACY * size and not room):
            return None
        multipliers = solution.multipliers[len(coordinates.b) :][: len(wall)] / self.compiled.widths[wall]
        knots = self.problem.add(self.base, coordinates.unknowns(x[:n]) * self.linear.scale[:-1])
        return ElasticSolution(knots, x[n:], multipliers, solution.lost / size)


def orthonormal(rows: Any, A: Any, b: FloatArray) -> Coordinates:
    """Coordinates of all solutions of A u = b in which rows (r, size) have orthonormal columns.

    The unknowns do not vary in directions in which no row says anything.

    Raises
    ------
    SolverError
        If the equations have no solution.
    """
    from scipy.linalg import null_space

    dense, origin, free = A.toarray(), np.zeros(rows.shape[1]), np.eye(rows.shape[1])
    if len(b):
        origin, free = np.linalg.lstsq(dense, b, rcond=None)[0], null_space(dense)
        if np.abs(dense @ origin - b).max() > ACCURACY * np.abs(b).max():
            raise SolverError(
                "pins and continuity ask for more than the polynomials have free: lower continuity=, or pin less"
            )
    if not free.shape[1]:
        return Coordinates(origin, free, A[:0] @ free, b[:0])
    _, sizes, directions = np.linalg.svd(np.linalg.qr(rows @ free, mode="r"))
    told = sizes > ROUNDING * sizes.max(initial=0.0)
    basis = free @ (directions[: len(sizes)][told] / sizes[told, None]).T
    return Coordinates(origin, basis, A[:0] @ basis, b[:0])
