r"""The reference: one QP after another over the instants where the curve leaves its walls, until it is proved inside.

A corridor that must hold at every instant is a QP with infinitely many rows; only those at the few instants where the
optimum touches a wall matter (R. Hettich and K. O. Kortanek, "Semi-infinite programming: theory, methods, and
applications", SIAM Review 35, 1993).  So:

1. The unknowns are deviations from the optimum without walls, which one factorisation finds.
2. A solver of qpsolvers finds the least cost over the rows so far.  Its answer is a lower bound of the cost.
3. Every wall gets a row at each local maximum of the curve's excess over it.  Back to 2.
4. Once the excess is small the walls are moved inwards by what costs the share ``GAP`` of the optimum, as the
   multipliers tell: a curve that breaks moved walls by less than that is inside the true ones.
5. The curve ends it where exact extrema prove it inside.

Where that fails the nearest curve is blended with one that has room to all walls: stop-and-go along the legs, or what
least slacks below zero find.  Walls are convex, so that the least share of it follows from the extrema of both.  The
native core does the same with an active set of its own, and asks here where it does not end.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from qpsolvers import Problem
from scipy.linalg.lapack import dpotrf, dtrtri
from scipy.sparse import csc_matrix, csr_matrix, diags, identity

from minsnap.basics.arrays import FloatArray
from minsnap.basics.deadline import WORK
from minsnap.basics.tolerances import EXACT
from minsnap.certificate import continuity
from minsnap.errors import SolverError
from minsnap.native.status import Status
from minsnap.optimisation.least_slacks import SlackProgramme, common_slack, native_slacks
from minsnap.optimisation.linear_rows import DENSE, equations, joined_exactly, of_unit_length
from minsnap.optimisation.optimum import BLEND, NO_CONTACTS, Contacts, InfeasibleRowsError, Optimum
from minsnap.optimisation.qp import solve_qp
from minsnap.optimisation.rows import Curve, Places, Rows, momentary, outside, proved_outside, sampled
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.stop_and_go import least_share, straight, straight_inside
from minsnap.optimisation.task import Task
from minsnap.optimisation.task_walls import all_walls, normalised_walls
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


@dataclass(frozen=True, eq=False)
class Answer:
    """A curve, and the QP that it answers.

    Parameters
    ----------
    curve : Curve
    rows : Rows or None
    multipliers : ndarray, shape (r,)
        Of the rows, for the normalised cost without 1/2.
    solver : str
    rounds : int
        QPs so far.
    """

    curve: Curve
    rows: Rows | None = None
    multipliers: FloatArray = field(default_factory=lambda: np.zeros(0))
    solver: str = "banded"
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
    """

    def __init__(self, task: Task, durations: FloatArray, units: Units, gap: float, prove: bool) -> None:
        self.task, self.durations, self.units, self.gap, self.prove = task, durations, units, gap, prove
        self.problem = problem = task.problem(durations, units)
        self.walls = normalised_walls(task, problem, units)
        try:
            self.base, moving = unbounded_optimum(problem), problem.held
        except SolverError:  # durations that differ too much for doubles: begin with stops at all knots
            self.base, moving = problem.values, np.ones_like(problem.held)
        self.ends = problem.plain_ends(self.base)
        hessian = problem.hessian
        self.scale = 1.0 / np.sqrt(hessian.diagonal())
        self.hessian = csc_matrix(diags(self.scale) @ hessian @ diags(self.scale))
        self.slope = problem.slope(self.base, moving) * self.scale
        self.equations = equations(problem, self.base, self.scale)
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
        LateError
            If time ran out.
        """
        start = Curve(self.problem, self.walls, self.base)
        if samples is not None:
            rows = self._rows(start, sampled(self.walls, np.arange(1, samples + 1) / (samples + 1)))
            return self._told(Answer(start) if rows is None else self._solved(Answer(start, rows), 0.0))
        # Walls hold at every instant, which is infinitely many rows. So: solve with a few, find where the curve sticks
        # out most, add a row there, and solve again. The limit of these curves touches the walls from outside; walls
        # that are moved inwards by a little (``inward``) are reached from outside in a finite number of rounds.
        answer = nearest = Answer(start, self._rows(start, momentary(self.walls)))
        inward, least, idle, floor = 0.0, np.inf, 0, 0.0
        always = self.problem.size > 0 and (len(self.equations[1]) > 0 or bool(self.slope.any()))
        while answer.rounds < ROUNDS and floor < NEARLY_INSIDE and not self.task.deadline.passed:
            try:
                answer = self._solved(answer, inward) if always or answer.rows is not None else answer
            except InfeasibleRowsError:
                break
            violated, excess = outside(answer.curve)
            idle = 0 if excess < 0.75 * least else idle + 1
            nearest, least = (answer, excess) if excess <= least else (nearest, least)
            affordable = self._affordable(answer) if excess <= NEARLY_INSIDE else 0.0
            # Inside, but the walls were moved further than the cost can afford: again, moved less.
            if not violated and inward > floor + 2.0 * affordable:
                inward = floor + affordable
                continue
            if not violated and self._inside(answer):
                return self._told(answer)
            violated = violated or proved_outside(answer.curve)
            # No row to add and not inside, or no progress: rounding is all that is left, so move the walls by more.
            if not violated or idle == STALLED:
                floor, idle = max(EXACT, 100.0 * floor, 2.0 * least), 0
            inward, answer = floor + affordable, self._with_rows(answer, violated)
        return self._blended(nearest)  # a mix with a flight that stops at every knot, which is inside for certain

    def _with_rows(self, answer: Answer, places: list[Places]) -> Answer:
        """Return an answer to which rows at places are added for the next QP."""
        rows = self._rows(answer.curve, places)
        return replace(answer, rows=answer.rows.joined(rows) if answer.rows and rows else answer.rows or rows)

    def _rows(self, curve: Curve, places: list[Places]) -> Rows | None:
        return curve.rows(places, self.ends) if places and self.problem.size else None

    def _inside(self, answer: Answer) -> bool:
        """Whether equations hold, and all walls as exact extrema say."""
        left = equations(self.problem, answer.curve.knots)[1]
        if np.abs(left).max(initial=0.0) > EXACT * np.abs(answer.curve.points).max():
            return False
        if not self.prove:
            return True
        told = self._told(answer)
        return told.inside and (not self.task.joined_orders or continuity(told.trajectory) >= self.task.continuity)

    def _told(self, answer: Answer, *rungs: str) -> SolvedTask:
        contacts, known = NO_CONTACTS, len(answer.multipliers)
        if answer.rows and known:
            contacts = Contacts(answer.rows.wall[:known], answer.rows.s[:known], answer.multipliers)
        rungs = ("next solver", *rungs) if self.failed else rungs
        told = answer.rounds, answer.solver, contacts, tuple(self.failed), rungs
        return SolvedTask(self.task, self.durations, self.units, Optimum(answer.curve.knots, *told), self.problem)

    def _affordable(self, answer: Answer) -> float:
        """Widths by which walls may move inwards for the share ``gap`` of the cost; none before the first QP."""
        if not answer.rounds:
            return 0.0
        slope = float(answer.multipliers @ answer.rows.width[: len(answer.multipliers)]) if answer.rows else 0.0
        return (
            min(self.gap * self.problem.cost(answer.curve.knots) / slope, MOST_INWARD) if slope > 0.0 else MOST_INWARD
        )

    def _solved(self, answer: Answer, inward: float) -> Answer:
        """Solve the QP over the rows so far, by the first solver whose answer passes its check.

        Raises
        ------
        InfeasibleRowsError
            If there is none.
        """
        if not self.problem.size:
            raise InfeasibleRowsError
        programme, size, norms = self._programme(answer.rows, inward)
        entries = 0 if programme.G is None else programme.G.nnz
        for solver in self.solvers:
            work = (WORK.active_set if solver == "daqp" else WORK.interior_point) * entries * self.problem.size
            if not self.task.deadline.affords(work):
                raise self.task.deadline.error()
            self.task.deadline.spend(work)
            solution: Any = solve_qp(programme, solver)
            if solution is None:
                self.failed[solver] = None
                continue
            x = size * (solution.x if self.basis is None else self.basis @ solution.x)
            knots = joined_exactly(self.problem, self.problem.add(self.base, x * self.scale))
            curve = replace(answer.curve, knots=knots)
            multipliers = np.zeros(0) if solution.z is None else 2.0 * size * solution.z / norms
            return Answer(curve, answer.rows, multipliers, solver, answer.rounds + 1)
        raise InfeasibleRowsError

    def _programme(self, rows: Rows | None, inward: float) -> tuple[Any, float, FloatArray]:
        """Return the QP with rows of unit length and solutions of order one, its unit, and the rows' lengths."""
        G, h, norms = None, np.zeros(0), np.ones(0)
        if rows is not None:
            G, norms = of_unit_length(self._whitened(rows.matrix.multiply(self.scale)))
            h = (rows.bound - inward * rows.width) / norms
        A, lengths = of_unit_length(self._whitened(self.equations[0]))
        b = self.equations[1] / lengths
        P, q = self.hessian, self.slope
        if self.basis is not None:
            P, q = identity(len(q)), q @ self.basis
        size = max(float(part.max(initial=0.0)) for part in (np.abs(q), -h, np.abs(b))) or 1.0
        equal = (A, b / size) if len(b) else (None, None)
        return Problem(P, q / size, G, None if G is None else h / size, *equal), size, norms

    def _whitened(self, rows: Any) -> Any:
        """Rows in the coordinates of the QP."""
        return rows if self.basis is None else csr_matrix(rows @ self.basis)

    def _blended(self, nearest: Answer) -> SolvedTask:
        """Blend the curve nearest to the walls with one that has room to all of them.

        Raises
        ------
        InfeasibleRowsError, LateError
            If there is none, or time ran out.
        """
        curve = nearest.curve
        inner = straight(curve) if straight_inside(curve) else self._with_room(curve)
        share = least_share(curve, inner)
        while share <= 1.0:
            blend = replace(curve, knots=curve.knots * (1.0 - share) + share * inner.knots)
            answer = replace(nearest, curve=blend)
            if self._inside(answer):
                return self._told(answer, BLEND)
            share = 2.0 if share == 1.0 else min(1.0, 2.0 * share + EXACT)
        if self.task.deadline.passed:
            raise self.task.deadline.error()
        raise InfeasibleRowsError

    def _with_room(self, curve: Curve) -> Curve:
        """Return a curve with room to all walls, at most ``NEARLY_INSIDE`` widths.

        Raises
        ------
        InfeasibleRowsError
            If there is none.
        """
        if not len(self.walls):
            raise InfeasibleRowsError
        task = replace(self.task, touching=False)
        asked = task, self.durations, common_slack(all_walls(task)), -NEARLY_INSIDE
        least = native_slacks(*asked)
        if least is None or least.status is not Status.DONE:
            least = SlackProgramme(*asked).run(sign=True)
        if least.slacks[0] >= 0.0:
            raise InfeasibleRowsError
        return replace(curve, knots=joined_exactly(self.problem, least.knots))


def _whitening(hessian: Any) -> FloatArray | None:
    """Coordinates in which a Hessian of unit diagonal is the identity, (n, n); None where it is large or singular."""
    n = hessian.shape[0]
    if not 0 < n <= DENSE:
        return None
    factor, singular = dpotrf(hessian.toarray(), lower=1)
    return None if singular else np.asarray(dtrtri(factor, lower=1)[0].T)
