"""The ladder of fallbacks: the attempts, in order, after an exchange that ended in a trouble.

An attempt is one run of the exchange by one method: a solver, coordinates for its QPs, and an inward shift of the
walls.  When it ends in a trouble, the next rung of ``LADDER`` whose condition holds makes the next attempt, with the
rows found so far.  The report of a plan names the rungs taken.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.deadline import NEVER, Deadline
from minsnap.basics.tolerances import EXACT, GAP
from minsnap.errors import SolverError
from minsnap.optimisation.axis_group import floating
from minsnap.optimisation.effort import ALONE, Effort
from minsnap.optimisation.elastic import ACCURACY as APPARENT
from minsnap.optimisation.elastic import Elastic, Give
from minsnap.optimisation.exchange import NEAR, Proof, State, Trouble, begun, exchange, solved_once
from minsnap.optimisation.linear_rows import joined_exactly
from minsnap.optimisation.master_qp import MasterQP, axis_masks, master_qp
from minsnap.optimisation.normalised_constraints import Compiled, WallRows
from minsnap.optimisation.optimum import InfeasibleRowsError, Optimum
from minsnap.optimisation.qp import ACCURACY, DENSE
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.rows import Curve
from minsnap.optimisation.stop_and_go import least_share, straight, straight_inside
from minsnap.optimisation.unconstrained import unbounded_optimum

MIDDLE = 1500
"""Unknowns up to which a QP that sparse solvers left is tried in dense coordinates."""

NOISE = 1e-13
"""Share of the largest derivative, of its order or of all in normalised units, below which one is rounding."""


Single = Callable[[], FloatArray | None]


@dataclass(frozen=True)
class Method:
    """How the QPs of an attempt are solved.

    Parameters
    ----------
    solvers : tuple of str
        Tried in turn for every QP.
    whitened : bool
        In dense coordinates where the Hessian is the identity, or in sparse ones where it has a unit diagonal.
    extended : bool
        Whether base and coordinates are computed in decimal arithmetic.
    inward : float
        Widths by which walls are moved inwards beside what optimality allows.
    """

    solvers: tuple[str, ...]
    whitened: bool
    extended: bool = False
    inward: float = 0.0


@dataclass(frozen=True, eq=False)
class Attempt:
    """One attempt and how it ended.

    Parameters
    ----------
    master : MasterQP
    method : Method
    state : State
        Of its last round.
    trouble : Trouble or None
        None where the curve is proved to be inside.
    proof : callable or None
    gap : float
    deadline : Deadline
        At which to end.
    once : bool
        Whether the rows to begin with are all that is asked.
    inner : ndarray, shape (knots, slots, dim), or None
        A curve with room to all walls, where stop-and-go is none and one was asked for and found.
    single : callable or None
        Finds the knots of a curve of one polynomial per leg that keeps all walls, in the pieces of this problem, or
        none.
    """

    master: MasterQP
    method: Method
    state: State
    trouble: Trouble | None
    proof: Proof | None
    gap: float
    deadline: Deadline
    once: bool
    inner: FloatArray | None = None
    single: Single | None = None

    @property
    def problem(self) -> Problem:
        """The problem, with or without more digits."""
        return self.master.problem

    @property
    def dense(self) -> bool:
        """Whether all groups are in dense coordinates."""
        return all(group.whitened for group in self.master.groups)

    @property
    def size(self) -> int:
        """Number of unknowns of the largest group of axes."""
        return max(len(group.columns) for group in self.master.groups)

    def again(self, method: Method) -> Attempt:
        """Run the exchange with another method and the rows found so far, unless its coordinates are singular."""
        master = self.master
        if (method.whitened, method.extended) == (self.method.whitened, self.method.extended):
            master = replace(master, solvers=method.solvers)
        else:
            problem = replace(master.problem, extended=method.extended)
            base = unbounded_optimum(problem)
            try:
                master = master_qp(problem, base, master.compiled, method.solvers, method.whitened, master.effort)
            except SolverError:
                return self
        rows = None if self.state.rows is None else master.express(self.state.rows.source)
        answer = self.state.answer if method.extended == self.method.extended else None
        state = State(self.state.curve, self.state.nearest, rows, answer, self.state.shift, method.inward)
        state = replace(state, rounds=self.state.rounds, failed=self.state.failed)
        ended = replace(self, master=master, method=method, state=state).run()
        if ended.state.least <= self.state.least:
            return ended
        return replace(ended, state=replace(ended.state, nearest=self.state.nearest, least=self.state.least))

    def run(self) -> Attempt:
        """Run the exchange from the state."""
        if self.once:
            state, trouble = solved_once(self.master, self.state)
        else:
            state, trouble = exchange(self.master, self.state, self.proof, self.gap, self.deadline)
        if trouble is not None and self.master.effort.over:
            trouble = Trouble.SPENT
        if trouble is not None and self.deadline.passed:
            trouble = Trouble.LATE
        return replace(self, state=state, trouble=trouble)


@dataclass(frozen=True)
class Rung:
    """One fallback.

    Parameters
    ----------
    name : str
    after : tuple of Trouble
        What leads to it.
    when : callable
        Whether it can help an attempt that ended so.
    attempt : callable
        Makes the next attempt.
    repeats : bool
        Whether it may be taken again.
    """

    name: str
    after: tuple[Trouble, ...]
    when: Callable[[Attempt], bool]
    attempt: Callable[[Attempt], Attempt]
    repeats: bool = False


def solvers_for(asked: str, dense: bool) -> tuple[str, ...]:
    """Solvers to try in turn for every QP: the requested one, then those suitable for the coordinates."""
    usual = ("daqp", "nnls", "piqp", "clarabel") if dense else ("piqp", "clarabel")
    return usual if asked == "auto" else (asked, *(name for name in usual if name != asked))


def _accurate(last: Attempt) -> Attempt:
    others = tuple(name for name in last.method.solvers if name != "nnls")
    return last.again(replace(last.method, solvers=("nnls", *others)))


def _whitened(last: Attempt) -> Attempt:
    return last.again(replace(last.method, solvers=solvers_for("auto", dense=True), whitened=True))


def _with_more_digits(last: Attempt) -> Attempt:
    return last.again(replace(last.method, solvers=solvers_for("auto", dense=True), whitened=True, extended=True))


def _without_noise(last: Attempt) -> Attempt:
    """Set derivatives that are only rounding to zero, so that a curve that slides along a wall is inside."""
    knots = last.state.curve.knots
    by_order, by_all = np.abs(knots).max(axis=(0, 2), keepdims=True), np.abs(knots).max()
    for scale in (by_order, by_all) if last.trouble is Trouble.STALLED else (by_order,):
        kept = np.abs(knots) > NOISE * scale
        state = replace(last.state, curve=replace(last.state.curve, knots=np.where(kept, knots, 0.0)))
        if last.proof is not None and last.proof(state):
            return replace(last, state=state, trouble=None)
    return last


def _moved_inwards(last: Attempt) -> Attempt:
    """Begin with a shift of rounding size, then 100 times as far, and at least as far as the least violation so far."""
    inward = max(EXACT, 100.0 * last.method.inward, 2.0 * last.state.least)
    return last.again(replace(last.method, inward=inward))


def _with_one_piece(last: Attempt) -> Attempt:
    """Take the optimum of one polynomial per leg, cut into the pieces that were asked for."""
    knots = None if last.single is None else last.single()
    if knots is None:
        return last
    curve = replace(last.state.curve, problem=last.problem, knots=knots)
    state = replace(last.state, curve=curve, nearest=curve)
    kept = last.proof is None or last.proof(state)
    return replace(last, state=state, trouble=None if kept else last.trouble)


def _blended(last: Attempt) -> Attempt:
    """Blend the curve with the least violation with one that has room to all walls.

    Walls are convex, so that the least share that brings it inside follows from both curves' extrema.
    """
    nearest = last.state.nearest
    inner = straight(nearest) if last.inner is None else replace(nearest, knots=last.inner)
    inner, nearest = _joined(last, inner), _joined(last, nearest)
    share = least_share(nearest, inner)
    while True:
        curve = replace(nearest, knots=nearest.knots * (1.0 - share) + share * inner.knots)
        state = replace(last.state, curve=curve)
        if last.proof is None or last.proof(state):
            return replace(last, state=state, trouble=None)
        if share == 1.0:
            return replace(last, state=state, trouble=OUTSIDE)
        share = min(1.0, 2.0 * share + EXACT)


def _with_room(last: Attempt) -> Attempt:
    """Find a curve with room to all walls, at most ``NEAR`` widths, by the elastic problem.

    Raises
    ------
    InfeasibleRowsError
        If no curve keeps all walls.
    """
    compiled = last.master.compiled
    count = len(compiled.widths)
    if not count:
        return last
    give = Give(np.zeros(count, dtype=np.intp), np.ones(count), 1, -NEAR)
    try:
        found = Elastic(last.problem, compiled, give, last.master.effort, accuracy=ACCURACY, sign=True).run()
    except SolverError:
        return last
    if found.slacks[0] > APPARENT:
        raise InfeasibleRowsError
    return replace(last, inner=found.knots) if found.slacks[0] < 0.0 else last


def _joined(last: Attempt, curve: Curve) -> Curve:
    """Return a curve without what solvers leave of jumps."""
    return replace(curve, knots=joined_exactly(last.problem, curve.knots))


UNSOLVED, STALLED, OUTSIDE = Trouble.UNSOLVED, Trouble.STALLED, Trouble.OUTSIDE
LATE, SPENT = Trouble.LATE, Trouble.SPENT

LADDER = (
    Rung(
        "non-negative least squares",
        (STALLED,),
        lambda last: last.dense and last.size <= DENSE and last.method.solvers[0] != "nnls",
        _accurate,
    ),
    Rung("dense coordinates", (UNSOLVED,), lambda last: not last.dense and last.size <= MIDDLE, _whitened),
    Rung(
        "more digits",
        (UNSOLVED,),
        lambda last: last.size <= DENSE and not last.method.extended and straight_inside(last.state.curve),
        _with_more_digits,
    ),
    Rung("rounding removed", (STALLED, OUTSIDE), lambda last: True, _without_noise),
    Rung(
        "inward shift",
        (STALLED, OUTSIDE),
        lambda last: max(last.method.inward, last.state.least) < NEAR,
        _moved_inwards,
        repeats=True,
    ),
    Rung(
        "one polynomial per leg",
        (UNSOLVED, STALLED, OUTSIDE, SPENT),
        lambda last: last.single is not None,
        _with_one_piece,
    ),
    Rung(
        "blend",
        (UNSOLVED, STALLED, OUTSIDE, LATE, SPENT),
        lambda last: last.inner is not None or straight_inside(last.state.curve),
        _blended,
    ),
)
"""All fallbacks, in the order in which they are tried."""


def climb(first: Attempt) -> tuple[Attempt, tuple[str, ...]]:
    """Take every rung whose condition holds after an attempt, until a curve is proved to be inside.

    Returns
    -------
    Attempt
        The last one.
    tuple of str
        Names of the rungs taken.

    Raises
    ------
    InfeasibleRowsError
        If no curve keeps all walls, or no rung is left after an attempt whose QP was not solved or was not worth it.
    """
    last, taken, number = first, ("next solver",) if first.state.failed else (), 0
    if last.trouble not in (None, LATE) and not last.once and not straight_inside(last.state.curve):
        last.master.effort.share = ALONE
        last = _with_room(last)
    while last.trouble is not None and number < len(LADDER):
        rung = LADDER[number]
        fits = last.trouble in rung.after and rung.when(last)
        if fits:
            last, taken = rung.attempt(last), (*taken, rung.name)
        number += not (fits and rung.repeats)
    if last.trouble in (UNSOLVED, SPENT):
        raise InfeasibleRowsError
    return last, taken


def optimum(last: Attempt, rungs: tuple[str, ...]) -> Optimum:
    """Return the result of the last attempt."""
    state = last.state
    known = len(state.multipliers)
    rows = None if state.rows is None or not known else state.rows.chosen(np.arange(len(state.rows)) < known)
    solver = "banded" if state.answer is None else state.answer.solver
    return Optimum(state.curve.knots, rows, state.multipliers, state.rounds, solver, state.failed, rungs)


def first_attempt(
    problem: Problem,
    base: FloatArray,
    compiled: Compiled,
    solver: str,
    effort: Effort,
    seed: WallRows | None = None,
    proof: Proof | None = None,
    gap: float = GAP,
    deadline: Deadline = NEVER,
    once: bool = False,
    single: Single | None = None,
) -> Attempt:
    """Run the exchange: dense coordinates with DAQP for few unknowns, sparse ones with PIQP for many.

    Parameters
    ----------
    base : ndarray, shape (knots, slots, dim)
        Optimum without walls.
    solver : str
        Name of a solver, or ``"auto"``.
    effort : Effort
        What the solvers of all attempts may spend.
    seed : WallRows, optional
        Rows to begin with.
    proof : callable, optional
        Says whether a curve is inside at every instant; without it peaks on a grid are trusted.
    gap : float
        Share of the cost that may be given away for fewer rounds.
    deadline : Deadline
        At which to end.
    once : bool
        Whether the rows to begin with are all that is asked.
    single : callable, optional
        Finds a curve of one polynomial per leg: see ``Attempt``.
    """
    axes = axis_masks(problem, compiled)
    dense = max(problem.unknowns(mask) for mask in axes) <= DENSE and not any(floating(problem, a) for a in axes)
    method = Method(solvers_for(solver, dense), dense)
    master = master_qp(problem, base, compiled, method.solvers, dense, effort)
    return Attempt(master, method, begun(master, seed), None, proof, gap, deadline, once, single=single).run()
