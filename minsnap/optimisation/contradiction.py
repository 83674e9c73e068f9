r"""Proof that no curve satisfies some walls: multipliers after Farkas, checked in exact rational arithmetic.

Rows :math:`a_i^\top x^{(p)}(t_i) \le b_i` at chosen instants have no common solution if there are multipliers
:math:`\lambda_i \ge 0` with which their sum does not depend on the curve and reads :math:`0 \le -1` (J. Farkas,
"Theorie der einfachen Ungleichungen", Journal für die reine und angewandte Mathematik 124, 1902).  A curve is all
derivatives at its knots, of which the pinned ones are known.  Continuity above the k - 1 derivatives that pieces share
is a row with a multiplier of any sign.  A tangent plane of a ball or a cone, along a direction u of length at most 1,
is a row too: :math:`u^\top A (x - a) \le \rho + s^\top (x - a)`.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import comb, perm

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.corridors.constraint import Cones
from minsnap.optimisation.axis_group import AxisGroup, axis_group
from minsnap.optimisation.exact_equations import Equation, solution
from minsnap.optimisation.normalised_constraints import Compiled, WallRows
from minsnap.optimisation.problem import Task
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.rows import RowSet
from minsnap.polynomials.rationals import derivative, value_at
from minsnap.tolerances import EXACT

Unknown = tuple[int, int, int]
"""Knot, slot and axis of a free derivative."""


@dataclass(frozen=True, eq=False)
class PressedRow:
    """A wall at an instant.

    Parameters
    ----------
    walls : Cones
        The block of walls that it belongs to.
    wall : int
        Which of them.
    piece : int
    s : float
        Where on the piece, in [0, 1].
    direction : ndarray, shape (q,)
        Of the tangent plane, no longer than 1; q is 0 for a plane.
    multiplier : float
        Positive; rounded.
    """

    walls: Cones
    wall: int
    piece: int
    s: float
    direction: FloatArray
    multiplier: float

    def exact(self) -> tuple[list[Fraction], Fraction]:
        """Return normal and bound of the row, without rounding."""
        u = [Fraction(value) for value in self.direction.tolist()]
        matrix = [[Fraction(value) for value in row] for row in self.walls.matrix[self.wall].tolist()]
        slope = [Fraction(value) for value in self.walls.slope[self.wall].tolist()]
        normal = [sum((a * row[j] for a, row in zip(u, matrix, strict=True)), -s) for j, s in enumerate(slope)]
        anchor = [Fraction(value) for value in self.walls.anchor[self.wall].tolist()]
        return normal, Fraction(float(self.walls.radius[self.wall])) + _dot(normal, anchor)


@dataclass(frozen=True, eq=False)
class Contradiction:
    """Walls at instants that no curve satisfies together, with the multipliers that show it.

    Parameters
    ----------
    task : Task
        What is asked of the curve.
    durations : ndarray, shape (pieces,)
        [s].
    rows : tuple of PressedRow
    joints : tuple of (int, int, int)
        Piece, order and axis of the continuity rows that take part, above order k - 1 at the end of the piece.
    """

    task: Task
    durations: FloatArray
    rows: tuple[PressedRow, ...]
    joints: tuple[tuple[int, int, int], ...] = ()

    @property
    def legs(self) -> tuple[int, ...]:
        """Legs whose walls contradict each other."""
        return tuple(sorted({row.piece // self.task.pieces for row in self.rows}))

    @property
    def instants(self) -> FloatArray:
        """Instants of the rows [s]."""
        breaks = np.append(0.0, np.cumsum(self.durations))
        return np.array([breaks[row.piece] + row.s * self.durations[row.piece] for row in self.rows])

    def verify(self) -> bool:
        """Prove the contradiction in exact rational arithmetic on the stored numbers; slow, up to some seconds."""
        if any(_dot(u, u) > 1 for u in ([Fraction(v) for v in row.direction.tolist()] for row in self.rows)):
            return False
        walls, joints = [self._wall(row) for row in self.rows], [self._joint(*joint) for joint in self.joints]
        multipliers = solution([*walls, *joints], Fraction(-1))
        return multipliers is not None and all(value >= 0 for value in multipliers[: len(walls)])

    def _wall(self, row: PressedRow) -> Equation:
        normal, bound = row.exact()
        found = _Functional(self.task, self.durations)
        for axis, factor in enumerate(normal):
            found.add(row.piece, Fraction(row.s), row.walls.order, axis, factor)
        return found.unknowns, bound - found.known

    def _joint(self, piece: int, order: int, axis: int) -> Equation:
        found = _Functional(self.task, self.durations)
        found.add(piece, Fraction(1), order, axis, Fraction(1))
        found.add(piece + 1, Fraction(0), order, axis, Fraction(-1))
        return found.unknowns, -found.known


class _Functional:
    """A linear functional of the curve: coefficients of the free derivatives, and what the pinned ones add."""

    def __init__(self, task: Task, durations: FloatArray) -> None:
        self.task, self.durations = task, durations
        self.unknowns: dict[Unknown, Fraction] = {}
        self.known = Fraction(0)
        self._pinned = pinned_values(task)

    def add(self, piece: int, s: Fraction, order: int, axis: int, factor: Fraction) -> None:
        """Add a factor times a derivative of one coordinate at a place of a piece."""
        if not factor:
            return
        duration, slots, half = Fraction(float(self.durations[piece])), self.task.slots, self.task.half
        for j, weight in enumerate(_weights(half, duration, s, order)):
            own = slots.start if j < half else slots.end
            self._take((piece + j // half, int(own[j % half]), axis), factor * weight)

    def _take(self, place: Unknown, factor: Fraction) -> None:
        if self.task.free[place]:
            self.unknowns[place] = self.unknowns.get(place, Fraction(0)) + factor
        else:
            self.known += factor * Fraction(float(self._pinned[place]))


def pinned_values(task: Task) -> FloatArray:
    """Values of the derivatives that are not free, (knots, slots, dim) [m/s^order]."""
    values = np.zeros(task.free.shape)
    values[:: task.pieces, 0] = task.waypoints
    for waypoint, state in task.pins.items():
        for order, value in state.items():
            values[waypoint * task.pieces, [task.slots.start[order], task.slots.end[order]]] = value
    return values


def _weights(half: int, duration: Fraction, s: Fraction, order: int) -> list[Fraction]:
    """Return the derivative at s of the curves with one end derivative 1 and the others 0, those at the start first."""
    degree, found = 2 * half - 1, []
    for j in range(half):
        unit = [comb(i, j) * Fraction(duration) ** j / perm(degree, j) for i in range(half)]
        found.append([*unit, *[Fraction(0)] * half])
    found += [[(-1) ** j * value for value in points[::-1]] for j, points in enumerate(found)]
    return [value_at(derivative([points], duration, order)[0], s) for points in found]


def _dot(left: list[Fraction], right: list[Fraction]) -> Fraction:
    return sum((a * b for a, b in zip(left, right, strict=True)), Fraction(0))


def find_contradiction(
    task: Task, durations: FloatArray, problem: Problem, base: FloatArray, compiled: Compiled, rows: RowSet
) -> Contradiction | None:
    """Find multipliers for rows of a task's walls by a linear programme; None where it has no solution.

    Closed laps and waypoints that are free are left out: there it is None.

    Parameters
    ----------
    durations : ndarray, shape (pieces,)
        [s].
    base : ndarray, shape (knots, slots, dim)
        Values from which the rows' bounds are measured.
    """
    if task.closed or task.held.any():
        return None
    group = axis_group(problem, base, np.ones(problem.dim, dtype=bool), False)
    multipliers, used = _multipliers(group, rows)
    if not multipliers.any():
        return None
    pressed = np.flatnonzero(multipliers)
    return Contradiction(
        task,
        durations,
        tuple(_pressed(task, compiled, rows.source, int(i), float(multipliers[i])) for i in pressed),
        tuple(joint for joint, taken in zip(_joints(problem), used, strict=True) if taken),
    )


def _multipliers(group: AxisGroup, rows: RowSet) -> tuple[FloatArray, list[bool]]:
    """Least multipliers, and which equality rows take part; zeros where no combination contradicts itself."""
    from scipy.optimize import linprog
    from scipy.sparse import csc_matrix, hstack, vstack

    G, h, norms = group.matrix(rows, np.arange(len(rows)), 0.0)
    A, b = group.equality_rows()
    count = 0 if b is None else len(b)
    columns = [csc_matrix(G).T] + ([] if A is None else [csc_matrix(A).T])
    sides = csc_matrix(np.concatenate([h, np.zeros(0) if b is None else b])[None] / (np.abs(h).max() or 1.0))
    equations = vstack([hstack(columns), sides])
    limits = [(0.0, None)] * len(rows) + [(None, None)] * count
    cost = np.append(np.ones(len(rows)), np.zeros(count))
    right = np.append(np.zeros(equations.shape[0] - 1), -1.0)
    found = linprog(cost, A_eq=equations, b_eq=right, bounds=limits, method="highs-ds")
    if not found.success:
        return np.zeros(len(rows)), [False] * count
    x = np.where(np.abs(found.x) > EXACT * np.abs(found.x).max(), found.x, 0.0)
    return x[: len(rows)] / norms, (x[len(rows) :] != 0.0).tolist()


def _joints(problem: Problem) -> list[tuple[int, int, int]]:
    """Piece, order and axis of the equality rows, in the order of :func:`jump_rows`."""
    inner = range(len(problem.durations) - 1)
    return [(piece, order, axis) for order in problem.jumps for axis in range(problem.dim) for piece in inner]


def _pressed(task: Task, compiled: Compiled, rows: WallRows, index: int, multiplier: float) -> PressedRow:
    block = int(np.searchsorted(compiled.first, rows.wall[index], side="right")) - 1
    walls = task.walls[block].cones
    wall = int(rows.wall[index] - compiled.first[block]) // task.pieces
    tangent = rows.normal[index] + walls.slope[wall]
    direction = np.linalg.lstsq(walls.matrix[wall].T, tangent, rcond=None)[0] if not walls.flat else np.zeros(0)
    direction = direction / max(float(np.linalg.norm(direction)) * (1.0 + EXACT), EXACT)
    return PressedRow(walls, wall, int(rows.piece[index]), float(rows.s[index]), direction, multiplier)
