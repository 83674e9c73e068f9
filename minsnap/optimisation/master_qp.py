"""The relaxation: the QP over the rows found so far, component by component."""

from __future__ import annotations

import numpy as np

from minsnap.arrays import BoolArray, FloatArray, IntArray
from minsnap.optimisation.axis_group import Component, split_axes
from minsnap.optimisation.contacts import Contacts
from minsnap.optimisation.local_resolve import loss, solve_near
from minsnap.optimisation.normalised_constraints import Compiled, Rows
from minsnap.optimisation.qp import SMALL
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.rows import Curve, RowSet, rows_in_unknowns

IDLE = 1e-6
"""Share of the largest multiplier below which a row counts as without effect."""

SLACK = 1e-3
"""Distance to a row, in widths, beyond which one without effect is forgotten."""

FORGETFUL = 20
"""Solves after which no more rows are forgotten, so that it ends."""


class InfeasibleRowsError(Exception):
    """The QP over the rows so far has no solution; carries the component and rows."""


class Relaxation:
    """State of one run: a problem, its optimum without walls, the walls, the rows so far, and the curve they allow.

    Parameters
    ----------
    problem : Problem
    base : ndarray, shape (knots, slots, dim)
        Knot values of the optimum without walls.
    compiled : Compiled
    solver : str
        Name of the QP solver, or ``"auto"``.
    """

    def __init__(self, problem: Problem, base: FloatArray, compiled: Compiled, solver: str) -> None:
        self.problem, self.base, self.compiled = problem, base, compiled
        masks = split_axes(compiled, problem) if problem.size > SMALL else [np.ones(problem.dim, dtype=bool)]
        self.components = [Component(problem, base, mask, solver) for mask in masks]
        self.group = np.argmax(np.stack(masks), axis=0)
        self.due = np.ones(len(masks), dtype=bool)
        self.curve, self.ends = Curve(problem, compiled, base), problem.plain_ends(base)
        self.rows: RowSet | None = None
        self.unknowns, self.multipliers = np.zeros(problem.size), np.zeros(0)
        self.base_cost, self.gain = problem.cost(base), 0.0
        self.shrink, self.solves = 0.0, 0

    @property
    def cost(self) -> float:
        """Cost of the curve, normalised."""
        return self.base_cost + self.gain

    @property
    def slope(self) -> float:
        """Cost of moving all walls inwards, for each width."""
        return float(self.multipliers @ self.rows.width[: len(self.multipliers)]) if self.rows is not None else 0.0

    @property
    def always(self) -> bool:
        """Whether it needs a solve even without rows."""
        return any(component.always for component in self.components)

    def contacts(self) -> Contacts | None:
        """Places where rows press on the curve; None before the first solve."""
        return Contacts(self.rows.source, self.multipliers) if self.rows is not None and self.solves else None

    def add(self, found: list[Rows]) -> None:
        """Add rows to those so far."""
        for rows in found:
            fresh = rows_in_unknowns(self.problem, self.ends, self.compiled, rows)
            self.rows = fresh if self.rows is None else self.rows.joined(fresh)
            self.due[self._groups(fresh)] = True

    def move(self, further: float) -> None:
        """Move all walls inwards by so many widths more."""
        self.shrink += further
        self.due[:] = True

    def solve(self) -> None:
        """Solve every component that is due over its rows and put the results together."""
        rows, known = self.rows, len(self.multipliers)
        size = 0 if rows is None else len(rows)
        self.solves += 1
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

    def forget(self) -> None:
        """Drop rows without effect from what sparse solvers are given: their time grows with the rows."""
        sparse = np.array([component.sparse for component in self.components])
        if self.solves > FORGETFUL or self.rows is None or not sparse.any():
            return
        rows = self.rows
        weak = self.multipliers <= IDLE * self.multipliers.max(initial=0.0)
        idle = weak & (self._slacks(rows) > SLACK * rows.width)
        kept = ~(idle & sparse[self._groups(rows)] & ~self.compiled.momentary[rows.source.wall])
        self.rows, self.multipliers = rows.chosen(kept), self.multipliers[kept]

    def broken(self, violation: float) -> list[Component]:
        """Components whose solver left rows violated by so many widths."""
        if self.rows is None:
            return []
        groups = self._groups(self.rows)[self._slacks(self.rows) < -violation * self.rows.width]
        numbers = np.unique(groups)
        self.due[numbers] = True
        return [self.components[number] for number in numbers]

    def optimal(self, gap: float) -> bool:
        """Whether components that were solved for a part of their unknowns cost at most that share too much.

        The first that costs more is solved as a whole next time.
        """
        for number, part in enumerate(self.components):
            if not part.held or self.rows is None:
                continue
            chosen = np.flatnonzero(self._groups(self.rows) == number)
            if loss(part, self.rows, chosen, self.shrink, self.multipliers[chosen]) > gap * self.cost:
                part.shrink, self.due[number] = np.nan, True
                return False
            part.held = False
        return True

    def _slacks(self, rows: RowSet) -> FloatArray:
        """Distances of the rows' values from their bounds."""
        moved = np.append(self.unknowns, 0.0)
        return np.asarray(rows.bound - (rows.values * moved[rows.columns]).sum(axis=1))

    def _groups(self, rows: RowSet) -> IntArray:
        """Component of each row."""
        if len(self.components) == 1:
            return np.zeros(len(rows), dtype=np.intp)
        return np.asarray(self.group[np.argmax(np.abs(rows.source.normal), axis=1)])
