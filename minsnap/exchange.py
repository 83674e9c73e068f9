r"""The exchange method: solve with few rows, find where the curve sticks out, add rows there, solve again.

A corridor that must hold at every instant makes a QP with infinitely many rows; only those at the few instants where
the optimum touches a wall matter (R. Hettich and K. O. Kortanek, "Semi-infinite programming: theory, methods, and
applications", SIAM Review 35, 1993).  Every solve is a relaxation, so its cost is a lower bound.  Once the excess is so
small that moving the walls inwards by as much costs less than ``GAP`` of the optimum, as the multipliers tell, they are
moved, and what the next solve gives is inside the true ones.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from minsnap.compiled import Compiled, Rows
from minsnap.components import Component, split_axes
from minsnap.problem import IntArray, Problem
from minsnap.qp import SMALL
from minsnap.rows import RowSet, momentary_rows, rows_in_unknowns, sticking_out
from minsnap.samples import FloatArray

GAP = 1e-6
"""Share of the cost that may be lost by moving walls inwards instead of iterating on."""

ROUNDS = 80
STALLED = 6
"""Rounds without a quarter less excess after which the solver's accuracy is taken to be reached."""

START = 5
"""Rows that each violated wall of a small problem gets before the first solve."""

SAFETY = 1.5
"""Walls are moved by so many times the excess."""

LARGEST_SHRINK = 1e-3
"""Share of their width by which walls are moved at most where it costs nothing."""


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
        self.shrink = 0.0
        self.unknowns = np.zeros(problem.size)
        self.multipliers = np.zeros(0)
        self.base_cost = problem.cost(base)
        self.gain = 0.0
        self.rounds = 0
        self.last = base
        self.exact = False
        self.solved = [(0, 0.0)] * len(self.components)
        for rows in (*momentary_rows(problem, base, compiled), *([] if seed is None else [seed])):
            self._add([rows], False)

    def run(self) -> Outcome:
        """Iterate until nothing sticks out of the true walls."""
        best, stalled = np.inf, 0
        due = any(component.always for component in self.components) or self.rounds > 0
        for _ in range(ROUNDS):
            floor = 0.0 if self.shrink else self._affordable()
            found, excess = sticking_out(self.problem, self.compiled, self.last, floor, self.exact)
            if excess <= 0.0 and floor == 0.0 and not due:
                break
            stalled = 0 if excess < 0.75 * best else stalled + 1
            best = min(best, excess)
            if stalled >= 2 * STALLED:
                break
            if found:
                self._add(found, self.rounds == 0)
            cheap = excess <= floor or (stalled >= STALLED and excess <= LARGEST_SHRINK)
            if self.rounds and cheap:
                self.shrink += SAFETY * max(excess, floor)
            self.last, due = self._solve(), False
        return self.outcome(self.last, excess)

    def insist(self) -> None:
        """Prove every round from now on; if that was done already, move the walls inwards once more."""
        if self.exact:
            self.shrink = max(10.0 * self.shrink, 1e-9)
        self.exact = True

    def run_sampled(self, samples: int) -> Outcome:
        """Solve once with rows at equally spaced inner instants of every piece, as the thesis does."""
        s = np.arange(1, samples + 1) / (samples + 1)
        points = self.problem.relative_points(self.base)
        for number, block in enumerate(self.compiled.blocks):
            index = np.repeat(np.arange(len(block.piece)), samples)
            rows = self.compiled.rows(self.problem, points, number, index, np.tile(s, len(block.piece)))
            self._add([rows], False)
        return self.outcome(self._solve())

    def outcome(self, knots: FloatArray, excess: float = 0.0) -> Outcome:
        """Wrap knot values with how they were found."""
        solver = next((c.solver for c in self.components if c.solver), "banded")
        failed = tuple(dict.fromkeys(name for c in self.components for name in c.failed))
        return Outcome(knots, self.rows, self.multipliers, self.rounds, solver, failed, max(excess, 0.0))

    def _affordable(self) -> float:
        """By how many widths the walls may move inwards for ``gap`` of the cost; 0 before the first solve."""
        if self.rows is None or not len(self.multipliers):
            return 0.0
        slope = float(self.multipliers @ self.rows.width[: len(self.multipliers)])
        cost = self.base_cost + self.gain
        return min(self.gap * cost / (SAFETY * slope), LARGEST_SHRINK) if slope > 0.0 else LARGEST_SHRINK

    def _add(self, found: list[Rows], first: bool) -> None:
        if first and self.problem.size <= SMALL:
            found = [self._spread(rows) for rows in found]
        for rows in found:
            fresh = rows_in_unknowns(self.problem, self.base, self.compiled, rows)
            self.rows = fresh if self.rows is None else self.rows.joined(fresh)

    def _spread(self, rows: Rows) -> Rows:
        """Repeat the walls at a few instants each, for a good first solve."""
        walls, first = np.unique(rows.wall, return_index=True)
        first = first[~self.compiled.momentary[walls]]
        s = 0.5 - 0.5 * np.cos(np.pi * (np.arange(START) + 0.5) / START)
        spread = replace(rows.chosen(np.repeat(first, START)), s=np.tile(s, len(first)))
        return rows.joined(spread)

    def _solve(self) -> FloatArray:
        """Solve every component over its rows and put the results together."""
        rows = self.rows
        size = 0 if rows is None else len(rows)
        self.rounds += 1
        self.multipliers = np.concatenate((self.multipliers, np.zeros(size - len(self.multipliers))))
        group = self._row_groups()
        for number, component in enumerate(self.components):
            chosen = np.flatnonzero(group == number)
            state = (len(chosen), self.shrink)
            if (not len(chosen) and not component.always) or (self.rounds > 1 and state == self.solved[number]):
                continue
            self.solved[number] = state
            found = component.solve(rows, chosen, self.shrink) if len(component.columns) else None
            if found is None:
                raise InfeasibleRowsError(number, chosen)
            self.unknowns[component.columns], self.multipliers[chosen] = found
        self.gain = sum(component.gain for component in self.components)
        return self.problem.add(self.base, self.unknowns)

    def _row_groups(self) -> IntArray:
        if self.rows is None:
            return np.zeros(0, dtype=np.intp)
        return np.asarray(self.group[np.argmax(np.abs(self.rows.source.normal), axis=1)])
