"""The master QP: least cost over the rows found so far, one group of axes at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.optimisation.axis_group import AxisGroup, axis_group, programme, split_axes
from minsnap.optimisation.effort import Effort
from minsnap.optimisation.linear_rows import joined_exactly
from minsnap.optimisation.normalised_constraints import Compiled, WallRows
from minsnap.optimisation.optimum import InfeasibleRowsError
from minsnap.optimisation.qp import DENSE, Solution, solve_qp
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.rows import Curve, RowSet, rows_in_unknowns
from minsnap.optimisation.window import solve_near


@dataclass(frozen=True, eq=False)
class GroupAnswer:
    """A solution for one group of axes.

    Parameters
    ----------
    x : ndarray, shape (n,)
        In the coordinates of the group.
    multipliers : ndarray, shape (r,)
        Of its rows.
    solver : str
        Which found it; empty where nothing had to be solved.
    failed : tuple of str
        Solvers that gave no answer that passes its check.
    """

    x: FloatArray
    multipliers: FloatArray
    solver: str = ""
    failed: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Answer:
    """A solution of the master QP.

    Parameters
    ----------
    parts : tuple of GroupAnswer
        By group.
    multipliers : ndarray, shape (r,)
        Of all rows, for the normalised cost without 1/2.
    shift : float
        Widths by which walls were moved inwards.
    broken : float
        Largest violation of a row that the solver was given, without that shift, in widths.
    """

    parts: tuple[GroupAnswer, ...]
    multipliers: FloatArray
    shift: float
    broken: float

    @property
    def solver(self) -> str:
        """Which solver found it, for the last group that needed one."""
        return next((part.solver for part in reversed(self.parts) if part.solver), "banded")

    @property
    def failed(self) -> tuple[str, ...]:
        """Solvers that gave no answer that passes its check."""
        return tuple(dict.fromkeys(name for part in self.parts for name in part.failed))


@dataclass(frozen=True, eq=False)
class MasterQP:
    """What all solves of one attempt share.

    Parameters
    ----------
    problem : Problem
    base : ndarray, shape (knots, slots, dim)
        Knot values of the optimum without walls, from which the unknowns are deviations.
    compiled : Compiled
    groups : tuple of AxisGroup
    solvers : tuple of str
        Tried in turn for every QP; ``"nnls"`` where the Hessian is the identity.
    effort : Effort
        What its solvers may spend.
    """

    problem: Problem
    base: FloatArray
    compiled: Compiled
    groups: tuple[AxisGroup, ...]
    solvers: tuple[str, ...]
    effort: Effort

    @property
    def always(self) -> bool:
        """Whether it needs a solve even without inequality rows."""
        return any(group.always for group in self.groups)

    def express(self, rows: WallRows) -> RowSet:
        """Write rows in the unknowns."""
        return rows_in_unknowns(self.problem, self.problem.plain_ends(self.base), self.compiled, rows)

    def curve(self, answer: Answer) -> Curve:
        """Return the curve of an answer."""
        unknowns = self._joined(answer.parts)[:-1]
        return Curve(self.problem, self.compiled, joined_exactly(self.problem, self.problem.add(self.base, unknowns)))

    def _joined(self, parts: Sequence[GroupAnswer]) -> FloatArray:
        """All unknowns and a zero, (size + 1,)."""
        unknowns = np.zeros(self.problem.size + 1)
        for group, part in zip(self.groups, parts, strict=True):
            unknowns[group.columns] = group.unknowns(part.x)
        return unknowns

    def _broken(self, rows: RowSet | None, parts: Sequence[GroupAnswer]) -> float:
        if rows is None:
            return 0.0
        slack = rows.bound - (rows.values * self._joined(parts)[rows.columns]).sum(axis=1)
        return float((-slack / self.compiled.widths[rows.source.wall]).max(initial=0.0))

    def solve(self, rows: RowSet | None, shift: float, last: Answer | None) -> Answer:
        """Solve over rows, with walls moved inwards by ``shift`` widths.

        A group that got no new rows since the last answer keeps its part of it.

        Raises
        ------
        InfeasibleRowsError
            If no solver finds an answer that passes its check.
        """
        number = self._groups_of(rows)
        multipliers = np.zeros(len(number))
        parts = []
        for index, group in enumerate(self.groups):
            mine = np.flatnonzero(number == index)
            known = None if last is None else last.parts[index]
            if known is None or last is None or last.shift != shift or len(known.multipliers) != len(mine):
                near = self._near(group, rows, mine, shift, known) if last is not None and shift <= last.shift else None
                known = near or self._part(group, rows, mine, shift, known)
            multipliers[mine] = known.multipliers
            parts.append(known)
        return Answer(tuple(parts), multipliers, shift, self._broken(rows, parts))

    def _part(
        self, group: AxisGroup, rows: RowSet | None, chosen: IntArray, shift: float, known: GroupAnswer | None
    ) -> GroupAnswer:
        if not len(chosen) and not group.always:
            return GroupAnswer(np.zeros(len(group.columns)), np.zeros(0))
        if not len(group.columns):
            raise InfeasibleRowsError
        asked, size, norms = programme(group, rows, chosen, shift)
        active = None if known is None else known.multipliers > 0.0
        suited = tuple(solver for solver in self.solvers if group.whitened or solver != "nnls")
        width = len(group.columns) if group.whitened else 2 * self.problem.half * self.problem.dim
        for number, solver in enumerate(suited):
            self.effort.spend(solver, len(chosen), len(group.columns), width)
            if number and self.effort.over:
                break
            found = solve_qp(asked, solver, active=active, spend=self.effort.spend_on_iterations)
            if found is not None:
                multipliers = 2.0 * size * found.multipliers / norms
                return GroupAnswer(size * found.x, multipliers, solver, suited[:number])
        raise InfeasibleRowsError

    def _near(
        self, group: AxisGroup, rows: RowSet | None, chosen: IntArray, shift: float, known: GroupAnswer | None
    ) -> GroupAnswer | None:
        """Solve near the new rows of a group alone; None where these are on many legs, or that is not good enough."""
        if rows is None or known is None or not known.solver or group.whitened or group.always:
            return None
        near = group.near(rows.source.piece[chosen[len(known.multipliers) :]])
        if not 0 < 4 * len(near) < len(group.columns):
            return None
        asked, size, norms = programme(group, rows, chosen, shift)
        multipliers = np.pad(known.multipliers, (0, len(chosen) - len(known.multipliers))) * norms / (2.0 * size)
        last = Solution(known.x / size, multipliers, np.zeros(0), known.solver)
        found = solve_near(asked, last, near, shift * rows.width[chosen] / norms / size)
        self.effort.spend(known.solver, len(chosen), len(near), 2 * self.problem.half * self.problem.dim)
        if found is None:
            return None
        return GroupAnswer(size * found.x, 2.0 * size * found.multipliers / norms, known.solver)

    def _groups_of(self, rows: RowSet | None) -> IntArray:
        """Group of each row."""
        if rows is None or len(self.groups) == 1:
            return np.zeros(0 if rows is None else len(rows), dtype=np.intp)
        group = np.argmax(np.stack([group.axes for group in self.groups]), axis=0)
        return np.asarray(group[np.argmax(np.abs(rows.source.normal), axis=1)])


def axis_masks(problem: Problem, compiled: Compiled) -> list[BoolArray]:
    """Axes of each group, masks of shape (dim,): one group for all where there are few unknowns."""
    return split_axes(compiled, problem) if problem.size > DENSE else [np.ones(problem.dim, dtype=bool)]


def master_qp(
    problem: Problem, base: FloatArray, compiled: Compiled, solvers: tuple[str, ...], whitened: bool, effort: Effort
) -> MasterQP:
    """Split a problem into groups of axes and choose their coordinates."""
    groups = tuple(axis_group(problem, base, mask, whitened) for mask in axis_masks(problem, compiled))
    return MasterQP(problem, base, compiled, groups, solvers, effort)
