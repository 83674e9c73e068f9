r"""The exchange method: solve with few rows, find where the curve violates the walls, add rows, tighten, prove.

A corridor that must hold at every instant leads to a QP with infinitely many rows; only those at the few instants where
the optimum touches a wall matter (R. Hettich and K. O. Kortanek, "Semi-infinite programming: theory, methods, and
applications", SIAM Review 35, 1993).  Every solve is a relaxation, so its cost is a lower bound.  Once the violation is
small, the walls are moved inwards by the amount that costs the share ``GAP`` of the optimum, estimated from the
multipliers; a curve that violates the moved walls by less than that amount is inside the true ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.deadline import NEVER, Deadline
from minsnap.optimisation.master_qp import Answer, MasterQP
from minsnap.optimisation.normalised_constraints import WallRows
from minsnap.optimisation.optimum import InfeasibleRowsError
from minsnap.optimisation.rows import (
    Curve,
    RowSet,
    halfway_rows,
    momentary_rows,
    proved_rows,
    rows_outside,
    spread_rows,
)

NEAR = 0.3
"""Excess, in widths, below which walls are moved inwards; share of it that a faulty answer breaks rows by."""

MOST_INWARD = 1e-3
"""Share of their width by which walls are moved at most, where moving them costs nothing."""

ROUNDS = 80
"""Solves in one attempt."""

STALLED = 10
"""Rounds without a quarter less excess after which an attempt ends: the solver's accuracy is reached."""


class Trouble(Enum):
    """Why an attempt ended without a curve that is proved to be inside."""

    UNSOLVED = "the solver gave no answer that passes its check"
    STALLED = "the curve sticks out by as much as before, round after round"
    OUTSIDE = "no row is broken, and yet the curve is not proved to be inside"
    LATE = "the time limit has passed"
    SPENT = "the problem is worth no more work"


@dataclass(frozen=True, eq=False)
class State:
    """State of the exchange after some rounds.

    Parameters
    ----------
    curve : Curve
        The last one.
    rows : RowSet or None
        Found so far.
    answer : Answer or None
        Of the last solve; None before the first.
    shift : float
        Widths by which walls are moved inwards, as far as optimality allows.
    inward : float
        Widths by which they are moved inwards besides, so that rounding leaves the curve inside.
    excess : float
        Largest excess over the true walls at the last look, in widths.
    least : float
        The least of all rounds.
    nearest : Curve
        The curve that it belongs to.
    idle : int
        Rounds since that became a quarter less.
    rounds : int
        Solves so far.
    failed : tuple of str
        Solvers that failed on one of them.
    """

    curve: Curve
    nearest: Curve
    rows: RowSet | None = None
    answer: Answer | None = None
    shift: float = 0.0
    inward: float = 0.0
    excess: float = np.inf
    least: float = np.inf
    idle: int = 0
    rounds: int = 0
    failed: tuple[str, ...] = ()

    @property
    def multipliers(self) -> FloatArray:
        """Multipliers of the rows, for the normalised cost without 1/2."""
        return np.zeros(0) if self.answer is None else self.answer.multipliers

    @property
    def faulty(self) -> bool:
        """Whether a large part of the excess is at rows that the solver was given."""
        return self.answer is not None and self.answer.broken > NEAR * self.excess

    @property
    def slope(self) -> float:
        """Cost of moving all walls inwards, per width."""
        return 0.0 if self.rows is None else float(self.multipliers @ self.rows.width[: len(self.multipliers)])

    def affordable(self, gap: float) -> float:
        """Widths by which the walls may move inwards for a share ``gap`` of the cost."""
        cost = self.curve.problem.cost(self.curve.knots)
        return min(gap * cost / self.slope, MOST_INWARD) if self.slope > 0.0 else MOST_INWARD


Proof = Callable[[State], bool]
"""Says whether a curve is inside every wall at every instant."""


def exchange(
    master: MasterQP, state: State, proof: Proof | None, gap: float, deadline: Deadline = NEVER
) -> tuple[State, Trouble | None]:
    """Iterate from a state until the curve is proved to be inside, or until a trouble occurs."""
    for number in range(ROUNDS):
        if number or master.always or state.rows is not None:
            try:
                state = solved(master, state)
            except InfeasibleRowsError:
                return state, Trouble.UNSOLVED
        state, found = looked(state)
        if not found and state.shift > 2.0 * state.affordable(gap):
            state = tightened(state, gap)
            continue
        if not found:
            if proof is None or proof(state):
                return state, None
            found = proved_rows(state.curve)
            if not found:
                return state, Trouble.OUTSIDE
        state = tightened(added(master, state, found), gap)
        if state.idle >= (1 if state.faulty else STALLED):
            return state, Trouble.STALLED
        if deadline.passed:
            return state, Trouble.LATE
        if master.effort.over:
            return state, Trouble.SPENT
    return state, Trouble.STALLED


def solved_once(master: MasterQP, state: State) -> tuple[State, Trouble | None]:
    """Solve once over the initial rows, without the exchange."""
    try:
        return solved(master, state), None
    except InfeasibleRowsError:
        return state, Trouble.UNSOLVED


def begun(master: MasterQP, seed: WallRows | None = None) -> State:
    """Return the state before the first round: the optimum without walls, and the initial rows."""
    curve = Curve(master.problem, master.compiled, master.base)
    rows = [*momentary_rows(curve), *([seed] if seed is not None and master.problem.size else [])]
    return added(master, State(curve, curve), rows)


def solved(master: MasterQP, state: State) -> State:
    """Solve over the rows so far."""
    answer = master.solve(state.rows, state.shift + state.inward, state.answer)
    failed = tuple(dict.fromkeys((*state.failed, *answer.failed)))
    return replace(state, answer=answer, curve=master.curve(answer), rounds=state.rounds + 1, failed=failed)


def looked(state: State) -> tuple[State, list[WallRows]]:
    """Find where the curve violates the true walls: rows at the local maxima of the excess."""
    found, excess = rows_outside(state.curve, state.rows, state.multipliers)
    idle = 0 if excess < 0.75 * state.least else state.idle + 1
    nearest = state.curve if excess < state.least else state.nearest
    return replace(state, excess=excess, least=min(state.least, excess), nearest=nearest, idle=idle), found


def added(master: MasterQP, state: State, found: list[WallRows]) -> State:
    """Add rows, and more of them where that saves rounds.

    In dense coordinates, where rows are cheap, the first addition includes rows spread along each wall; in sparse ones
    each addition includes rows halfway to those before, once the excess is less than a width.
    """
    rows, dense = state.rows, all(group.whitened for group in master.groups)
    if dense and state.answer is None and state.excess < np.inf:
        found = [*found, *spread_rows(state.curve)]
    if not dense and rows is not None and state.excess < 1.0:
        found = [*found, *halfway_rows(state.curve, rows.source, found)]
    for part in found:
        fresh = master.express(part)
        rows = fresh if rows is None else rows.joined(fresh)
    return replace(state, rows=rows)


def tightened(state: State, gap: float) -> State:
    """Once the violation is small, move the walls inwards by what costs ``gap`` of the optimum; later never further."""
    if state.answer is None or state.excess > NEAR:
        return state
    affordable = state.affordable(gap)
    return replace(state, shift=min(state.shift, affordable) if state.shift else affordable)
