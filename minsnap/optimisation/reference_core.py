r"""The reference: one QP after another over the instants where the curve leaves its walls, until it is proved inside.

A corridor that must hold at every instant is a QP with infinitely many rows; only those at the few instants where the
optimum touches a wall matter (R. Hettich and K. O. Kortanek, "Semi-infinite programming: theory, methods, and
applications", SIAM Review 35, 1993).  So:

1. The unknowns are deviations from the optimum without walls, which one banded solve finds.
2. A solver of qpsolvers finds the least cost over the rows so far.  Its answer is a lower bound of the cost.
3. Every wall gets a row at each local maximum of the curve's excess over it.  Back to 2.
4. Once the excess is small the walls are moved inwards by what costs the share ``GAP`` of the optimum, as the
   multipliers tell: a curve that breaks moved walls by less than that is inside the true ones.
5. The curve ends it where exact extrema prove it inside.

Where that fails the nearest curve is blended with one that has room to all walls: stop-and-go along the legs, or the
curve of most room that least slacks find.  Walls are convex, so that the least share of it follows from the
extrema of both.  The native core does the same with an active set of its own, and asks here where it does not end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any

import numpy as np
from scipy.linalg.lapack import dpotrf, dtrtri
from scipy.sparse import csc_matrix, csr_matrix, diags, identity

from minsnap.basics.arrays import FloatArray
from minsnap.basics.deadline import WORK
from minsnap.basics.tolerances import EXACT
from minsnap.certificate import continuity
from minsnap.errors import SolverError
from minsnap.native.status import Status
from minsnap.optimisation.least_slacks import ACCURACY, common_slack, native_slacks, slack_programme
from minsnap.optimisation.linear_rows import DENSE, LinearRows, joined_exactly, of_unit_length
from minsnap.optimisation.native_walls import native_walls
from minsnap.optimisation.normalised_constraints import WallRows, compile_walls
from minsnap.optimisation.optimum import InfeasibleRowsError, Optimum
from minsnap.optimisation.qp import Programme, Solution, solve_qp
from minsnap.optimisation.rows import Curve, RowSet, momentary_rows, proved_rows, rows_in_unknowns, rows_outside
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.stop_and_go import least_share, leg_on_wall, straight, straight_inside
from minsnap.optimisation.task import Task
from minsnap.optimisation.unconstrained import unbounded_optimum
from minsnap.optimisation.units import Units

NEARLY_INSIDE = 0.3
"""Excess, in widths, below which walls are moved inwards, and room that a curve to blend with has at most."""

MOST_INWARD = 1e-3
"""Share of their width by which walls are moved at most, where moving them costs nothing."""

ROUNDS = 80
"""Solves at most."""

STALLED = 10
"""Rounds without a quarter less excess after which walls move inwards: the solver's accuracy is reached."""

NOISE = 1e-13
"""Share of the largest derivative, of its order or of all in normalised units, below which one is rounding."""

SPREAD = 6
"""Instants along each piece at which a wall that the optimum without walls breaks gets its first rows."""


Single = Callable[[], FloatArray | None]


@dataclass(frozen=True, eq=False)
class State:
    """The exchange after some rounds.

    Parameters
    ----------
    curve : Curve
    rows : RowSet or None
        So far.
    answer : Solution or None
        Of the last QP.
    multipliers : ndarray, shape (r,)
        Of the first r rows, for the normalised cost without 1/2.
    shift : float
        Widths by which walls are moved inwards.
    inward : float
        Widths by which they are moved besides, so that rounding leaves the curve inside.
    excess, least : float
        Largest excess over the true walls, in widths, and the least of all rounds.
    idle : int
        Rounds since that became a quarter less.
    rounds : int
        Solves.
    """

    curve: Curve
    rows: RowSet | None = None
    answer: Solution | None = None
    multipliers: FloatArray = field(default_factory=lambda: np.zeros(0))
    shift: float = 0.0
    inward: float = 0.0
    excess: float = np.inf
    least: float = np.inf
    idle: int = 0
    rounds: int = 0


class ReferenceCore:
    """A task at given durations and what all QPs share.

    Parameters
    ----------
    task, durations, units
        As of the ``SolvedTask`` that comes back.
    gap : float
        Share of the cost that may be given away for fewer rounds.
    prove : bool
        Whether the exact margin is checked; a search can do without.
    single : callable, optional
        Finds the knots of a curve of one polynomial per leg, cut into the pieces that were asked for, or none.
    """

    def __init__(
        self, task: Task, durations: FloatArray, units: Units, gap: float, prove: bool, single: Single | None = None
    ) -> None:
        self.single = single
        self.task, self.durations, self.units, self.gap, self.prove = task, durations, units, gap, prove
        self.problem = problem = task.problem(durations, units)
        self.compiled = compile_walls(task, problem, units)
        try:
            self.base, moving = unbounded_optimum(problem), problem.held
        except SolverError:  # durations that differ too much for doubles: begin with stops at all knots
            self.base, moving = problem.values, np.ones_like(problem.held)
        self.ends = problem.plain_ends(self.base)
        scale = 1.0 / np.sqrt(problem.hessian.diagonal())
        self.hessian = csc_matrix(diags(scale) @ problem.hessian @ diags(scale))
        self.linear = LinearRows(problem, self.base, np.append(scale, 0.0))
        self.slope = problem.slope(self.base, moving) * scale
        self.basis = None if problem.free[:, 0].all(axis=0).any() else _whitening(self.hessian)
        usual = ("clarabel",) if self.basis is None else ("daqp", "clarabel")
        self.failed: dict[str, None] = {}
        self.solvers = usual if task.solver == "auto" else tuple(dict.fromkeys((task.solver, *usual)))

    def run(self, samples: int | None) -> SolvedTask:
        """Solve at every instant, or at so many equally spaced ones of each piece.

        Raises
        ------
        InfeasibleRowsError
            If no curve keeps all walls, or none was found.
        CorridorError, LateError, SolverError
            If a leg lies on a wall, or time ran out, or no solver has an answer.
        """
        start = Curve(self.problem, self.compiled, self.base)
        if samples is not None:
            state = self._solved(self._added(State(start), _sampled(start, samples)))
            return self._told(state, ())
        state = nearest = self._added(State(start), momentary_rows(start))
        try:
            while state.rounds < ROUNDS and state.inward < NEARLY_INSIDE and not self.task.deadline.passed:
                state, ended = self._round(state)
                if ended:
                    return self._told(state, ())
                nearest = state if state.excess <= state.least else nearest
        except InfeasibleRowsError:
            pass
        return self._without_noise(nearest) or self._blended(nearest)

    def _round(self, state: State) -> tuple[State, bool]:
        """Solve, look where the curve is outside, and add rows there; whether it is inside instead."""
        if state.rows is not None or self._always:
            state = self._solved(state)
        violated, excess = rows_outside(state.curve, state.rows, state.multipliers)
        idle = 0 if excess < 0.75 * state.least else state.idle + 1
        state = replace(state, excess=excess, least=min(excess, state.least), idle=idle)
        if not violated and state.shift > 2.0 * self._affordable(state):
            return self._tightened(state), False
        if not violated and self._inside(state):
            return state, True
        violated = violated or proved_rows(state.curve)
        if not violated or idle == STALLED:
            inward = max(EXACT, 100.0 * state.inward, 2.0 * state.least)
            return replace(state, inward=inward, idle=0), False
        if not state.rounds:
            violated = [*violated, *_spread(state.curve, violated)]
        return self._tightened(self._added(state, violated)), False

    @property
    def _always(self) -> bool:
        """Whether the optimum without inequality rows is not the base."""
        return self.problem.size > 0 and (self.linear.equations is not None or bool(self.slope.any()))

    def _inside(self, state: State) -> bool:
        """Whether equations hold, and all walls as exact extrema say."""
        if self.linear.equations is not None:
            left = LinearRows(self.problem, state.curve.knots).equality_rows[1]
            if np.abs(left).max(initial=0.0) > EXACT * np.abs(state.curve.points).max():
                return False
        if not self.prove:
            return True
        told = self._told(state, ())
        return told.inside and (not self.task.jumps or continuity(told.trajectory) >= self.task.continuity)

    def _told(self, state: State, rungs: tuple[str, ...]) -> SolvedTask:
        known = len(state.multipliers)
        rows = None if state.rows is None or not known else state.rows.chosen(np.arange(len(state.rows)) < known)
        solver = "banded" if state.answer is None else state.answer.solver
        rungs = ("next solver", *rungs) if self.failed else rungs
        known_by = state.multipliers, state.rounds, solver, tuple(self.failed), rungs
        return SolvedTask(
            self.task, self.durations, self.units, Optimum(state.curve.knots, rows, *known_by), self.problem
        )

    def _added(self, state: State, new_rows: list[WallRows]) -> State:
        rows = state.rows
        if new_rows and self.problem.size:
            fresh = rows_in_unknowns(self.problem, self.ends, self.compiled, reduce(WallRows.joined, new_rows))
            rows = fresh if rows is None else rows.joined(fresh)
        return replace(state, rows=rows)

    def _affordable(self, state: State) -> float:
        """Widths by which walls may move inwards for the share ``gap`` of the cost."""
        slope = 0.0 if state.rows is None else float(state.multipliers @ state.rows.width[: len(state.multipliers)])
        cost = self.problem.cost(state.curve.knots)
        return min(self.gap * cost / slope, MOST_INWARD) if slope > 0.0 else MOST_INWARD

    def _tightened(self, state: State) -> State:
        """Move walls inwards once the violation is small; later never further."""
        if state.answer is None or state.excess > NEARLY_INSIDE:
            return state
        affordable = self._affordable(state)
        return replace(state, shift=min(state.shift, affordable) if state.shift else affordable)

    def _solved(self, state: State) -> State:
        """Solve the QP over the rows so far, by the first solver whose answer passes its check.

        Raises
        ------
        InfeasibleRowsError
            If there is none.
        """
        if not self.problem.size:
            raise InfeasibleRowsError
        programme, size, norms = self._programme(state)
        entries = 0 if programme.G is None else programme.G.nnz
        for solver in self.solvers:
            price = WORK.active_set if solver == "daqp" else WORK.interior_point
            work = price * entries * self.problem.size
            if not self.task.deadline.affords(work):
                raise self.task.deadline.error()
            self.task.deadline.spend(work)
            solution = solve_qp(programme, solver)
            if solution is None:
                self.failed[solver] = None
                continue
            x = size * (solution.x if self.basis is None else self.basis @ solution.x)
            knots = self.problem.add(self.base, x * self.linear.scale[:-1])
            curve = Curve(self.problem, self.compiled, joined_exactly(self.problem, knots))
            multipliers = 2.0 * size * solution.multipliers / norms
            state = replace(state, curve=curve, answer=solution, multipliers=multipliers)
            return replace(state, rounds=state.rounds + 1)
        raise InfeasibleRowsError

    def _programme(self, state: State) -> tuple[Programme, float, FloatArray]:
        """Return the QP with rows of unit length and solutions of order one, its unit, and the rows' lengths."""
        G, h, norms = None, None, np.ones(0)
        if state.rows is not None:
            G, norms = of_unit_length(self._whitened(self.linear.matrix(state.rows.columns, state.rows.values)))
            h = (state.rows.bound - (state.shift + state.inward) * state.rows.width) / norms
        A, b = None, np.zeros(0)
        if self.linear.equations is not None:
            A, lengths = of_unit_length(self._whitened(self.linear.equality_rows[0]))
            b = self.linear.equality_rows[1] / lengths
        P, q = (
            (self.hessian, self.slope) if self.basis is None else (identity(len(self.basis)), self.slope @ self.basis)
        )
        sizes = [np.abs(q), np.zeros(1) if h is None else -h, np.abs(b)]
        size = max(float(part.max(initial=0.0)) for part in sizes) or 1.0
        sides = (None if h is None else h / size, A, b / size if len(b) else None)
        return Programme(P, q / size, G, *sides), size, norms

    def _whitened(self, rows: Any) -> Any:
        """Rows in the coordinates of the QP."""
        return rows if self.basis is None else csr_matrix(rows @ self.basis)

    def _without_noise(self, state: State) -> SolvedTask | None:
        """Set derivatives that are only rounding to zero; None where that brings no curve along a wall inside."""
        knots = state.curve.knots
        for scale in (np.abs(knots).max(axis=(0, 2), keepdims=True), np.abs(knots).max()):
            kept = replace(state.curve, knots=np.where(np.abs(knots) > NOISE * scale, knots, 0.0))
            if self._inside(replace(state, curve=kept)):
                return self._told(replace(state, curve=kept), ("rounding removed",))
        return None

    def _blended(self, nearest: State) -> SolvedTask:
        """Blend the curve nearest to the walls with one that has room to all of them.

        Raises
        ------
        InfeasibleRowsError, CorridorError, LateError
            If there is none.
        """
        task, curve = self.task, nearest.curve
        inner = straight(curve) if straight_inside(curve) else self._with_room(curve)
        knots = self.single() if self.single is not None and not task.deadline.passed else None
        state = State(replace(curve, knots=curve.knots if knots is None else knots))
        if knots is not None and self._inside(state):
            return self._told(state, ("one polynomial per leg",))
        if inner is not None:
            inner, curve = (replace(one, knots=joined_exactly(self.problem, one.knots)) for one in (inner, curve))
            share = least_share(curve, inner)
            while share <= 1.0:
                knots = curve.knots * (1.0 - share) + share * inner.knots
                state = replace(nearest, curve=replace(curve, knots=knots))
                if self._inside(state):
                    return self._told(state, ("blend",))
                share = 2.0 if share == 1.0 else min(1.0, 2.0 * share + EXACT)
        if task.deadline.passed:
            raise task.deadline.error()
        raise leg_on_wall(task, curve) or InfeasibleRowsError()

    def _with_room(self, curve: Curve) -> Curve | None:
        """Return a curve with room to all walls, at most ``NEARLY_INSIDE`` widths; None where there is none.

        Raises
        ------
        InfeasibleRowsError
            If no curve keeps all walls.
        """
        if not len(self.compiled.widths):
            return None
        task = replace(self.task, touching=False)
        asked = task, self.durations, common_slack(native_walls(task)), -NEARLY_INSIDE
        least = native_slacks(*asked)
        if least is None or least.status is not Status.DONE:
            least = slack_programme(*asked).run(sign=True)
        if least.slacks[0] > ACCURACY:
            raise InfeasibleRowsError
        return replace(curve, knots=least.knots) if least.slacks[0] < 0.0 else None


def _sampled(curve: Curve, instants: int) -> list[WallRows]:
    """Rows of every wall at equally spaced inner instants of its pieces."""
    s = np.arange(1, instants + 1) / (instants + 1)
    return [
        curve.rows(number, np.repeat(np.arange(len(block.leg)), instants), np.tile(s, len(block.leg)))
        for number, block in enumerate(curve.compiled.blocks)
    ]


def _spread(curve: Curve, violated: list[WallRows]) -> list[WallRows]:
    """Rows at Chebyshev points of walls that have violated rows, if these walls hold along a piece."""
    first, s = curve.compiled.first, 0.5 - 0.5 * np.cos(np.pi * (np.arange(SPREAD) + 0.5) / SPREAD)
    walls = np.unique(np.concatenate([rows.wall for rows in violated]))
    block = np.searchsorted(first, walls, side="right") - 1
    more = []
    for number in np.unique(block[~curve.compiled.momentary[walls]]).tolist():
        index = walls[block == number] - first[number]
        more.append(curve.rows(number, np.repeat(index, SPREAD), np.tile(s, len(index))))
    return more


def _whitening(hessian: Any) -> FloatArray | None:
    """Coordinates in which a Hessian of unit diagonal is the identity, (n, n); None where it is large or singular."""
    n = hessian.shape[0]
    if not 0 < n <= DENSE:
        return None
    factor, singular = dpotrf(hessian.toarray(), lower=1)
    return None if singular else np.asarray(dtrtri(factor, lower=1)[0].T)
