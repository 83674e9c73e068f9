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

from minsnap.compiled import Compiled, Rows
from minsnap.components import Component, split_axes
from minsnap.contacts import Contacts
from minsnap.problem import IntArray, Problem
from minsnap.qp import SMALL
from minsnap.rows import Curve, RowSet, momentary_rows, rows_in_unknowns, spread_rows, sticking_out
from minsnap.samples import FloatArray
from minsnap.windows import BoolArray, loss, solve_near

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

IDLE = 1e-6
"""Share of the largest multiplier below which a row counts as without effect."""

SLACK = 1e-3
"""Distance to a row, in widths, beyond which one without effect is forgotten."""

FORGETFUL = 20
"""Rounds in which rows are forgotten: each raises the cost, but a limit makes sure that it ends."""


class InfeasibleRowsError(Exception):
    """The QP over the rows so far has no solution; carries the component and rows."""


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
    """

    knots: FloatArray
    rows: RowSet | None
    multipliers: FloatArray
    rounds: int
    solver: str
    fallback: tuple[str, ...]
    excess: float


Proof = Callable[[Outcome], bool]
"""Says whether an outcome is inside every wall at every instant."""


class Exchange:
    """State of one run: a problem, its optimum without walls, the walls, and the rows found so far."""

    def __init__(
        self,
        problem: Problem,
        base: FloatArray,
        compiled: Compiled,
        solver: str,
        seed: Rows | None = None,
        gap: float = GAP,
    ) -> None:
        self.problem, self.base, self.compiled, self.gap = problem, base, compiled, gap
        masks = split_axes(compiled, problem) if problem.size > SMALL else [np.ones(problem.dim, dtype=bool)]
        self.components = [Component(problem, base, mask, solver) for mask in masks]
        self.group = np.argmax(np.stack(masks), axis=0)
        self.rows: RowSet | None = None
        self.ends = problem.plain_ends(base)
        self.shrink = 0.0
        self.unknowns = np.zeros(problem.size)
        self.multipliers = np.zeros(0)
        self.base_cost = problem.cost(base)
        self.gain = 0.0
        self.rounds = 0
        self.curve = Curve(problem, compiled, base)
        self.exact, self.nudge = False, NUDGE
        self.seeded = seed is not None and problem.size > 0
        self.due = np.ones(len(masks), dtype=bool)
        self._add([*momentary_rows(self.curve), *([] if seed is None else [seed])])

    def run(self, proof: Proof | None = None) -> Outcome:
        """Iterate until nothing sticks out of the true walls.

        A proof, if there is one, is asked as soon as the curve is likely inside; its word ends the run.
        """
        excess, best, stalled = np.inf, np.inf, 0
        due = any(component.always for component in self.components) or self.rounds > 0
        if self.seeded and not self.rounds:
            self._solve()
            due = False
        for _ in range(ROUNDS):
            if proof is not None and self._likely_inside(excess) and proof(last := self.outcome()):
                if self._optimal():
                    return last
            floor = 0.0 if self.shrink else self._affordable()
            found, excess = sticking_out(self.curve, floor, self.exact, self._contacts())
            if excess <= 0.0 and floor == 0.0 and not due and self._optimal():
                break
            stalled = 0 if excess < 0.75 * best else stalled + 1
            best = min(best, excess)
            broken = self._broken(BROKEN * excess) if stalled else []
            costly = excess * self._slope() > COSTLY * self.gap * self.cost
            if any([component.mistrust(costly) for component in broken]):
                self._solve()
                continue
            if broken:
                stalled = max(stalled, STALLED)
            if stalled >= 2 * STALLED:
                break
            if found:
                self._add(found if self.rounds else self._widened(found))
            self._tighten(excess, floor, stalled)
            self._solve()
            due = False
            self._forget()
        return self.outcome(excess)

    def insist(self) -> None:
        """Prove every round from now on; if that was done already, move the walls inwards by a little, then by more."""
        if self.exact:
            self._move(self.nudge)
            self.nudge *= 100.0
        self.exact = True

    def run_sampled(self, samples: int) -> Outcome:
        """Solve once with rows at equally spaced inner instants of every piece, as the thesis does."""
        s = np.arange(1, samples + 1) / (samples + 1)
        for number, block in enumerate(self.compiled.blocks):
            index = np.repeat(np.arange(len(block.piece)), samples)
            self._add([self.curve.rows(number, index, np.tile(s, len(block.piece)))])
        self._solve()
        return self.outcome()

    def outcome(self, excess: float = 0.0) -> Outcome:
        """Wrap the last curve with how it was found."""
        solver = next((c.solver for c in self.components if c.solver), "banded")
        failed = tuple(dict.fromkeys(name for c in self.components for name in c.failed))
        return Outcome(self.curve.knots, self.rows, self.multipliers, self.rounds, solver, failed, max(excess, 0.0))

    def _affordable(self) -> float:
        """By how many widths the walls may move inwards for ``gap`` of the cost; 0 before the first solve."""
        if self.rows is None or not len(self.multipliers):
            return 0.0
        slope = self._slope()
        return min(self.gap * self.cost / (SAFETY * slope), LARGEST_SHRINK) if slope > 0.0 else LARGEST_SHRINK

    def _slope(self) -> float:
        """Cost of moving walls inwards, for each width."""
        return float(self.multipliers @ self.rows.width[: len(self.multipliers)]) if self.rows is not None else 0.0

    @property
    def cost(self) -> float:
        """Cost of the last curve, normalised."""
        return self.base_cost + self.gain

    def _likely_inside(self, excess: float) -> bool:
        """Whether walls that were moved inwards make up for the little that is left of an excess."""
        return self.shrink > 0.0 and excess < NEARLY and not self.problem.held.any()

    def _contacts(self) -> Contacts | None:
        return None if self.rows is None or not self.rounds else Contacts(self.rows.source, self.multipliers)

    def _tighten(self, excess: float, floor: float, stalled: int) -> None:
        """Move walls inwards: by what is affordable near the end, by what the solvers leave open where they stall."""
        if self.rounds and (excess <= floor or (stalled >= STALLED and excess <= LARGEST_SHRINK)):
            self._move(SAFETY * max(excess, floor))
        elif excess < NEAR and 0.0 < floor < LARGEST_SHRINK:
            self._move(floor)

    def _move(self, further: float) -> None:
        """Move all walls inwards by so many widths more."""
        self.shrink += further
        self.due[:] = True

    def _add(self, found: list[Rows]) -> None:
        for rows in found:
            fresh = rows_in_unknowns(self.problem, self.ends, self.compiled, rows)
            self.rows = fresh if self.rows is None else self.rows.joined(fresh)
            self.due[self._groups(fresh)] = True

    def _widened(self, found: list[Rows]) -> list[Rows]:
        """Add rows to the first ones, for a good first solve."""
        if self.problem.size <= SMALL:
            return [*found, *spread_rows(self.curve)]
        aside = [replace(rows, s=np.clip(rows.s + step, 0.0, 1.0)) for rows in found for step in (-ASIDE, ASIDE)]
        return [*found, *aside]

    def _broken(self, violation: float) -> list[Component]:
        """Components whose solver left rows violated by so many widths."""
        if self.rows is None:
            return []
        groups = self._groups(self.rows)[self._slacks(self.rows) < -violation * self.rows.width]
        numbers = np.unique(groups)
        self.due[numbers] = True
        return [self.components[number] for number in numbers]

    def _slacks(self, rows: RowSet) -> FloatArray:
        """Distances of the rows' values from their bounds."""
        moved = np.append(self.unknowns, 0.0)
        return np.asarray(rows.bound - (rows.values * moved[rows.columns]).sum(axis=1))

    def _forget(self) -> None:
        """Drop rows without effect from what sparse solvers are given: their time grows with the rows."""
        sparse = np.array([component.sparse for component in self.components])
        if self.rounds > FORGETFUL or self.rows is None or not sparse.any():
            return
        rows = self.rows
        idle = (self.multipliers <= IDLE * self.multipliers.max()) & (self._slacks(rows) > SLACK * rows.width)
        kept = ~(idle & sparse[self._groups(rows)] & ~self.compiled.momentary[rows.source.wall])
        self.rows, self.multipliers = rows.chosen(kept), self.multipliers[kept]

    def _solve(self) -> None:
        """Solve every component that is due over its rows and put the results together."""
        rows, known = self.rows, len(self.multipliers)
        size = 0 if rows is None else len(rows)
        self.rounds += 1
        self.multipliers = np.concatenate((self.multipliers, np.zeros(size - known)))
        group = np.zeros(0, dtype=np.intp) if rows is None else self._groups(rows)
        for number, component in enumerate(self.components):
            chosen = np.flatnonzero(group == number)
            if not self.due[number] or not (len(chosen) or component.always):
                continue
            self.due[number] = False
            found = self._found(component, chosen, chosen >= known)
            if found is None:
                raise InfeasibleRowsError(number, chosen)
            self.unknowns[component.columns], self.multipliers[chosen] = found
        self.gain = sum(component.gain for component in self.components)
        self.curve = Curve(self.problem, self.compiled, self.problem.add(self.base, self.unknowns))

    def _found(self, part: Component, chosen: IntArray, fresh: BoolArray) -> tuple[FloatArray, FloatArray] | None:
        """Unknowns and multipliers of a component, solved for near its fresh rows if that does."""
        if not len(part.columns):
            return None
        rows, near = self.rows, None
        if rows is not None:
            near = solve_near(part, rows, chosen, self.shrink, self.multipliers[chosen], fresh)
        return near if near is not None else part.solve(rows, chosen, self.shrink)

    def _optimal(self) -> bool:
        """Whether components that were solved for a part of their unknowns cost too little more than the optimum.

        One that does not is solved as a whole next time.
        """
        for number, part in enumerate(self.components):
            if not part.held or self.rows is None:
                continue
            chosen = np.flatnonzero(self._groups(self.rows) == number)
            if loss(part, self.rows, chosen, self.shrink, self.multipliers[chosen]) > self.gap * self.cost:
                part.shrink, self.due[number] = np.nan, True
                return False
            part.held = False
        return True

    def _groups(self, rows: RowSet) -> IntArray:
        """Component of each row."""
        if len(self.components) == 1:
            return np.zeros(len(rows), dtype=np.intp)
        return np.asarray(self.group[np.argmax(np.abs(rows.source.normal), axis=1)])
