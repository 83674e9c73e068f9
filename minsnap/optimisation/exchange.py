r"""The exchange method: solve with few rows, find where the curve sticks out, add rows there, solve again.

A corridor that must hold at every instant makes a QP with infinitely many rows; only those at the few instants where
the optimum touches a wall matter (R. Hettich and K. O. Kortanek, "Semi-infinite programming: theory, methods, and
applications", SIAM Review 35, 1993).  Every solve is a relaxation, so its cost is a lower bound.  Once the excess is so
small that moving the walls inwards by as much costs less than ``GAP`` of the optimum, as the multipliers tell, they are
moved, and what the next solve gives is inside the true ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.optimisation.axis_group import Component
from minsnap.optimisation.master_qp import Relaxation
from minsnap.optimisation.normalised_constraints import Compiled, Rows
from minsnap.optimisation.qp import SMALL
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.rows import RowSet, momentary_rows, spread_rows, sticking_out

GAP = 1e-6
"""Share of the cost that may be lost by moving walls inwards instead of iterating on."""

ROUNDS = 80
STALLED = 6
"""Rounds without a quarter less excess after which the solver's accuracy is taken to be reached."""

ASIDE = 0.1
"""How far to both sides of the first rows of a large problem there are two more, in pieces."""

BROKEN = 0.3
"""Share of the excess by which rows that the solver was given may be violated: more is the solver's fault."""

COSTLY = 5.0
"""How many times the gap may be left open by a solver that was asked for."""

SAFETY = 1.5
"""Walls are moved by so many times the excess."""

LARGEST_SHRINK = 1e-3
"""Share of their width by which walls are moved at most where it costs nothing."""

NEAR = 0.3
"""Excess, in widths, below which walls are moved inwards by what is affordable, for the last rounds to end inside."""

NEARLY = 1e-4
"""Excess, in widths, that is likely gone after one more round."""

NUDGE = 1e-9
"""Widths by which walls are moved first where rounding alone leaves the curve outside."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the exchange found.

    Parameters
    ----------
    knots : ndarray, shape (knots, slots, dim)
    rows : RowSet or None
        Rows of the last QP.
    multipliers : ndarray, shape (r,)
        Of these rows, for the normalised cost without 1/2.
    rounds : int
    solver : str
    fallback : tuple of str
        Solvers that failed on the way.
    excess : float
        Largest excess over a true wall, in its widths; 0 or less when inside.
    core : str
        Which core found it, ``"native"`` or ``"python"``.
    handed_over : str
        Why the native core did not; empty where it did or was not asked.
    points : ndarray, shape (pieces, 2k, dim), or None
        Control points that were proved to be inside [m]; None where they follow from ``knots``.
    """

    knots: FloatArray
    rows: RowSet | None
    multipliers: FloatArray
    rounds: int
    solver: str
    fallback: tuple[str, ...]
    excess: float
    core: str = "python"
    handed_over: str = ""
    points: FloatArray | None = None


Proof = Callable[[Outcome], bool]
"""Says whether an outcome is inside every wall at every instant."""


class Exchange:
    """One run of the method, and what it has found so far."""

    def __init__(
        self,
        problem: Problem,
        base: FloatArray,
        compiled: Compiled,
        solver: str,
        seed: Rows | None = None,
        gap: float = GAP,
    ) -> None:
        self.relaxation = Relaxation(problem, base, compiled, solver)
        self.gap, self.exact, self.nudge = gap, False, NUDGE
        self.seeded = seed is not None and problem.size > 0
        self.relaxation.add([*momentary_rows(self.relaxation.curve), *([] if seed is None else [seed])])

    def run(self, proof: Proof | None = None) -> Outcome:
        """Iterate until nothing sticks out of the true walls.

        A proof, if there is one, is asked as soon as the curve is likely inside; its word ends the run.
        """
        state, excess, best, stalled = self.relaxation, np.inf, np.inf, 0
        pending = state.always or state.solves > 0
        if self.seeded and not state.solves:
            state.solve()
            pending = False
        for _ in range(ROUNDS):
            asked = proof if self._likely_inside(excess) else None
            if asked is not None and asked(last := self.outcome()) and state.optimal(self.gap):
                return last
            floor = 0.0 if state.shrink else self._affordable()
            found, excess = sticking_out(state.curve, floor, self.exact, state.contacts())
            if excess <= 0.0 and floor == 0.0 and not pending and state.optimal(self.gap):
                break
            stalled = 0 if excess < 0.75 * best else stalled + 1
            best = min(best, excess) if excess > 0.0 else best
            broken = state.broken(BROKEN * excess) if stalled else []
            if broken and self._replaced(broken, excess):
                state.solve()
                continue
            stalled = max(stalled, STALLED) if broken else stalled
            if stalled >= 2 * STALLED:
                break
            state.add(found if state.solves else self._widened(found))
            self._tighten(excess, floor, stalled)
            state.solve()
            pending = False
            state.forget()
        return self.outcome(excess)

    def insist(self) -> None:
        """Prove every round from now on; if that was done already, move the walls inwards by a little, then by more."""
        if self.exact:
            self.relaxation.move(self.nudge)
            self.nudge *= 100.0
        self.exact = True

    def run_sampled(self, samples: int) -> Outcome:
        """Solve once with rows at equally spaced inner instants of every piece, as the thesis does."""
        s, state = np.arange(1, samples + 1) / (samples + 1), self.relaxation
        for number, block in enumerate(state.compiled.blocks):
            index = np.repeat(np.arange(len(block.piece)), samples)
            state.add([state.curve.rows(number, index, np.tile(s, len(block.piece)))])
        state.solve()
        return self.outcome()

    def outcome(self, excess: float = 0.0) -> Outcome:
        """Wrap the last curve with how it was found."""
        state = self.relaxation
        solver = next((part.solver for part in state.components if part.solver), "banded")
        failed = tuple(dict.fromkeys(name for part in state.components for name in part.failed))
        return Outcome(state.curve.knots, state.rows, state.multipliers, state.solves, solver, failed, max(excess, 0.0))

    def _affordable(self) -> float:
        """By how many widths the walls may move inwards for ``gap`` of the cost; 0 before the first solve."""
        state = self.relaxation
        if not len(state.multipliers):
            return 0.0
        slope = state.slope
        return min(self.gap * state.cost / (SAFETY * slope), LARGEST_SHRINK) if slope > 0.0 else LARGEST_SHRINK

    def _likely_inside(self, excess: float) -> bool:
        """Whether walls that were moved inwards make up for the little that is left of an excess."""
        return self.relaxation.shrink > 0.0 and excess < NEARLY and not self.relaxation.problem.held.any()

    def _replaced(self, broken: list[Component], excess: float) -> bool:
        """Whether a solver that broke its own rows has given way to another."""
        costly = excess * self.relaxation.slope > COSTLY * self.gap * self.relaxation.cost
        return any([component.mistrust(costly) for component in broken])

    def _tighten(self, excess: float, floor: float, stalled: int) -> None:
        """Move walls inwards: by what is affordable near the end, by what the solvers leave open where they stall."""
        if self.relaxation.solves and (excess <= floor or (stalled >= STALLED and excess <= LARGEST_SHRINK)):
            self.relaxation.move(SAFETY * max(excess, floor))
        elif excess < NEAR and 0.0 < floor < LARGEST_SHRINK:
            self.relaxation.move(floor)

    def _widened(self, found: list[Rows]) -> list[Rows]:
        """Add rows to the first ones, if there are any, for a good first solve."""
        if found and self.relaxation.problem.size <= SMALL:
            return [*found, *spread_rows(self.relaxation.curve)]
        momentary = self.relaxation.compiled.momentary
        lasting = [rows.chosen(~momentary[rows.wall]) for rows in found]
        aside = [replace(rows, s=np.clip(rows.s + step, 0.0, 1.0)) for rows in lasting for step in (-ASIDE, ASIDE)]
        return [*found, *(rows for rows in aside if len(rows.s))]
