r"""Proof that no curve satisfies some walls: multipliers after Farkas, checked in exact rational arithmetic.

Rows :math:`a_i^\top x^{(p)}(t_i) \le b_i` at chosen instants have no common solution if there are multipliers
:math:`\lambda_i \ge 0` with which their sum does not depend on the curve and reads :math:`0 \le -1` (J. Farkas,
"Theorie der einfachen Ungleichungen", Journal für die reine und angewandte Mathematik 124, 1902).  A curve is all
derivatives at its knots, of which the pinned ones are known.  Continuity above the k - 1 derivatives that pieces share
and the plane of a gate are rows with a multiplier of any sign.  A tangent plane of a ball or a cone, along a direction
u of length at most 1, is a row too: :math:`u^\top A (x - a) + n^\top (x - a) \le \rho`.

Multipliers are numbers of finite length, so that the sum of the rows depends on the curve a little.  What is left,
computed exactly, is bounded for all curves that are not larger than a billion legs; for them the sum must be below 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, cached_property
from math import comb, perm

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.deadline import WORK
from minsnap.basics.tolerances import EXACT, ROUNDING
from minsnap.native.corridor import LeastSlack, WallArrays
from minsnap.optimisation.native_walls import native_walls
from minsnap.optimisation.task import Task
from minsnap.optimisation.units import Units
from minsnap.polynomials.enclosures import UNIT

Unknown = tuple[int, int, int]
"""Knot, slot and axis of a free derivative."""

Joint = tuple[int, int, int]

Row = tuple[dict[Unknown, Fraction], Fraction]
"""Coefficients of free derivatives, and the bound of their sum."""


@dataclass(frozen=True, eq=False)
class PressedRow:
    """A wall at an instant: norm of M x + n . x <= bound, with x the derivative minus the anchor.

    Parameters
    ----------
    piece : int
    s : float
        Where on the piece, in [0, 1].
    order : int
        Derivative that is bounded.
    normal, anchor : ndarray, shape (dim,)
    bound : float
    matrix : ndarray, shape (q, dim)
        M; q is 0 for a plane.
    direction : ndarray, shape (q,)
        Of the tangent plane, no longer than 1.
    multiplier : Fraction
    equal : bool
        Whether it is a plane on which the curve lies, with a multiplier of any sign.
    """

    piece: int
    s: float
    order: int
    normal: FloatArray
    anchor: FloatArray
    bound: float
    matrix: FloatArray
    direction: FloatArray
    multiplier: Fraction = Fraction(1)
    equal: bool = False

    def exact(self) -> tuple[list[Fraction], Fraction]:
        """Return normal and bound of the row, without rounding."""
        u = _fractions(self.direction)
        matrix = [_fractions(row) for row in self.matrix]
        own = _fractions(self.normal)
        normal = [n + sum(a * row[j] for a, row in zip(u, matrix, strict=True)) for j, n in enumerate(own)]
        return normal, Fraction(self.bound) + _dot(normal, _fractions(self.anchor))


@dataclass(frozen=True, eq=False)
class Contradiction:
    """Walls at instants that no curve satisfies together: multipliers show it.

    Parameters
    ----------
    task : Task
        What is asked of the curve.
    durations : ndarray, shape (pieces,)
        [s].
    rows : tuple of PressedRow
    joints : tuple of ((int, int, int), Fraction)
        Piece, order and axis of the continuity rows that take part, above order k - 1 at the end of the piece, and
        their multipliers.
    """

    task: Task
    durations: FloatArray
    rows: tuple[PressedRow, ...]
    joints: tuple[tuple[Joint, Fraction], ...] = ()

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
        """Prove the contradiction in exact rational arithmetic on the stored numbers."""
        if any(_dot(u, u) > 1 for u in (_fractions(row.direction) for row in self.rows)):
            return False
        if any(row.multiplier < 0 and not row.equal for row in self.rows):
            return False
        return ExactRows(self.task, self.durations, self.rows, self.joints).contradict(self._multipliers)

    @property
    def _multipliers(self) -> list[Fraction]:
        return [*(row.multiplier for row in self.rows), *(multiplier for _, multiplier in self.joints)]

    def with_multipliers(self, multipliers: list[Fraction]) -> Contradiction:
        """Return it with other multipliers, those of the joints last, without rows that have no part in it then."""
        count = len(self.rows)
        rows = tuple(replace(row, multiplier=m) for row, m in zip(self.rows, multipliers[:count], strict=True) if m)
        joints = tuple((joint, m) for (joint, _), m in zip(self.joints, multipliers[count:], strict=True) if m)
        return replace(self, rows=rows, joints=joints)

    def refined(self) -> Contradiction | None:
        """Return it with multipliers with which it verifies, its own or refined ones; None where steps do not help.

        Those of continuity and planes are refined alone at first.  No more steps are taken than needed: each may also
        take away from the contradiction.  Late, LateError is raised.
        """
        exact, multipliers = ExactRows(self.task, self.durations, self.rows, self.joints), self._multipliers
        for alone in (True, False) if exact.free.any() else (False,):
            before: Fraction | None = None
            for _ in range(5):
                self.task.deadline.require()
                left, side = exact.sum_of(multipliers)
                if side + left < 0:
                    return self.with_multipliers(multipliers)
                if before is not None and 2 * left > before:
                    break
                before, multipliers = left, exact.refined(multipliers, alone)
        return None


class ExactRows:
    """Rows of a contradiction over the free derivatives without rounding, those of the joints last."""

    def __init__(
        self,
        task: Task,
        durations: FloatArray,
        rows: Sequence[PressedRow],
        joints: Sequence[tuple[Joint, Fraction]],
    ) -> None:
        self.task, self.durations, self._pinned = task, durations, task.pinned.copy()
        self._pinned[:: task.pieces, 0] = task.waypoints
        self.rows = [*(self._wall(row) for row in rows), *(self._joint(*joint) for joint, _ in joints)]
        self.free = np.array([*(row.equal for row in rows), *(True for _ in joints)])
        self.places = sorted({place for row, _ in self.rows for place in row})

    def contradict(self, multipliers: list[Fraction]) -> bool:
        """Whether the sum of the rows is below 0 for every curve that is ruled out."""
        return sum(self.sum_of(multipliers)) < 0

    def sum_of(self, multipliers: list[Fraction]) -> tuple[Fraction, Fraction]:
        """Return the most that the coefficients of the sum of the rows may come to, and the sum of their bounds."""
        left, side = self._sum(multipliers)
        return sum((abs(value) * self.largest(place) for place, value in left.items()), Fraction(0)), side

    def eliminated(self) -> list[Fraction] | None:
        """Multipliers with which nothing is left of the unknowns and the bound is below 0; None where there are none.

        LateError is raised after the deadline: twelve legs of three coordinates take half a second.
        """
        pivots: dict[Unknown, dict[Unknown, Fraction]] = {}
        for number, (row, _) in enumerate(self.rows):
            left = {**row, (-1, number, 0): Fraction(1)}  # with the multipliers of which it is the sum, at no knot
            for place, other in pivots.items():
                share = left.pop(place, None)
                if share:
                    self.task.deadline.spend(WORK.term * len(other))
                    self.task.deadline.require()
                    for key, value in other.items():
                        left[key] = left.get(key, Fraction(0)) - share * value
            pivot = next((key for key, value in left.items() if value and key[0] >= 0), None)
            if pivot is not None:
                scale = 1 / left.pop(pivot)
                pivots[pivot] = {key: value * scale for key, value in left.items() if value}
                continue
            multipliers = [left.get((-1, i, 0), Fraction(0)) for i in range(len(self.rows))]
            side = self._sum(multipliers)[1]
            if side:
                return multipliers if side < 0 else [-m for m in multipliers]
        return None

    def refined(self, multipliers: list[Fraction], alone: bool = False) -> list[Fraction]:
        """Return multipliers of which less is left, by least squares relative to them; a sum below 0 stays.

        Parameters
        ----------
        alone : bool
            Whether only those of any sign change.
        """
        chosen = np.flatnonzero(self.free) if alone else np.arange(len(multipliers))
        left, side = self._sum(multipliers)
        matrix, free = self.matrix[:, chosen], self.free[chosen]
        right = -np.array([float(left.get(place, 0) * self.largest(place)) for place in self.places])
        weights, sizes = np.abs([float(multipliers[row]) for row in chosen]), np.linalg.norm(matrix, axis=0)
        weights[free] = (1.0 if alone else (weights * sizes).max()) / np.where(sizes, sizes, 1.0)[free]
        matrix *= weights
        if side < 0 and not alone:
            bounds = weights * [float(bound) for _, bound in self.rows]
            bounds *= np.abs(matrix).max() / np.abs(bounds).max()
            matrix, right = np.vstack((matrix, bounds)), np.append(right, 0.0)
        sums = list(multipliers)
        for row, more in zip(chosen.tolist(), weights * np.linalg.lstsq(matrix, right, rcond=UNIT)[0], strict=True):
            sums[row] += Fraction(float(more))
        return [m if free else max(m, Fraction(0)) for m, free in zip(sums, self.free, strict=True)]

    @cached_property
    def matrix(self) -> FloatArray:
        """Coefficients times the largest values of their unknowns, (places, rows), rounded."""
        known = {place: (i, float(self.largest(place))) for i, place in enumerate(self.places)}
        matrix = np.zeros((len(known), len(self.rows)))
        for column, (row, _) in enumerate(self.rows):
            for place, value in row.items():
                matrix[known[place][0], column] = float(value) * known[place][1]
        return matrix

    def _sum(self, multipliers: list[Fraction]) -> Row:
        """Return what is left of the sum of all rows: coefficients, and the bound."""
        left: dict[Unknown, Fraction] = {}
        side = Fraction(0)
        self.task.deadline.spend(WORK.term * sum(len(row) for row, _ in self.rows))
        for (row, bound), multiplier in zip(self.rows, multipliers, strict=True):
            side += multiplier * bound
            for place, value in row.items():
                left[place] = left.get(place, Fraction(0)) + multiplier * value
        return left, side

    def largest(self, place: Unknown) -> Fraction:
        """Largest value of a free derivative of the curves that are ruled out."""
        knot, slot, _ = place
        order, T = int(self.task.slots.order[slot]), self.durations
        longest = max(float(T[max(knot - 1, 0)]), float(T[min(knot, len(T) - 1)]))
        return Fraction(self.task.length / EXACT) * perm(2 * self.task.half - 1, order) / Fraction(longest) ** order

    def _wall(self, row: PressedRow) -> Row:
        normal, bound = row.exact()
        return self._row([(row.piece, Fraction(row.s), row.order, axis, n) for axis, n in enumerate(normal)], bound)

    def _joint(self, piece: int, order: int, axis: int) -> Row:
        after, one = (piece + 1) % len(self.durations), Fraction(1)
        return self._row([(piece, one, order, axis, one), (after, 0 * one, order, axis, -one)], 0 * one)

    def _row(self, terms: list[tuple[int, Fraction, int, int, Fraction]], bound: Fraction) -> Row:
        """Return the row of a sum of terms: piece, place on it, order and axis of a derivative, and its factor."""
        task, unknowns = self.task, dict[Unknown, Fraction]()
        for piece, s, order, axis, factor in terms:
            weights = _weights(task.half, Fraction(float(self.durations[piece])), s, order) if factor else ()
            for j, weight in enumerate(weights):
                own, knot = (task.slots.start if j < task.half else task.slots.end), piece + j // task.half
                place = knot % len(self.durations) if task.closed else knot, int(own[j % task.half]), axis
                if task.free[place]:
                    unknowns[place] = unknowns.get(place, Fraction(0)) + factor * weight
                else:
                    bound -= factor * weight * Fraction(float(self._pinned[place]))
        return unknowns, bound


@cache
def _weights(half: int, duration: Fraction, s: Fraction, order: int) -> list[Fraction]:
    """Return the derivative at s of the curves with one end derivative 1 and the others 0, those at the start first."""
    degree, low = 2 * half - 1, 2 * half - 1 - order
    own = [comb(low, i) * s**i * (1 - s) ** (low - i) for i in range(low + 1)]
    for _ in range(order):
        own = [before - after for before, after in zip([Fraction(0), *own], [*own, Fraction(0)], strict=True)]
    scale = perm(degree, order) / duration**order
    weights = []
    for sign, points in ((1, own), (-1, own[::-1])):
        for j in range(half):
            total = sum((comb(i, j) * points[i] for i in range(j, half)), Fraction(0))
            weights.append(sign**j * total * scale * duration**j / perm(degree, j))
    return weights


def _fractions(values: FloatArray) -> list[Fraction]:
    return [Fraction(value) for value in values.tolist()]


def _dot(left: list[Fraction], right: list[Fraction]) -> Fraction:
    return sum((a * b for a, b in zip(left, right, strict=True)), Fraction(0))


def find_contradiction(task: Task, durations: FloatArray, walls: WallArrays, least: LeastSlack) -> Contradiction | None:
    """Prove that the rows that press at the least slacks contradict each other; None where that fails.

    Parameters
    ----------
    task : Task
        Without what follows where waypoints lie on walls (``touching``).
    durations : ndarray, shape (pieces,)
        [s].
    walls : WallArrays
        Those of the task.
    """
    pressing, units = np.flatnonzero(least.multiplier), task.units(durations)
    rows = [_pressed(walls, least, row, units) for row in pressing.tolist()]
    if not rows:
        return None
    planes = (plane for wall, plane in _planes(walls) if wall not in least.wall[pressing])
    return Contradiction(task, durations, (*rows, *planes), _joints(task, durations)).refined()


def contradicting_joints(task: Task, durations: FloatArray, exactly: bool = False) -> Contradiction | None:
    """Return continuity and planes of gates that contradict each other and the pins; None where that is not proved.

    Parameters
    ----------
    exactly : bool
        Whether by exact elimination, which finds what least squares leave open; it takes longer.
    """
    joints = _joints(task, durations)
    if not joints:
        return None
    planes = tuple(plane for _, plane in _planes(native_walls(task)))
    exact, asked = ExactRows(task, durations, planes, joints), Contradiction(task, durations, planes, joints)
    if exactly:
        found = exact.eliminated()
        return None if found is None else asked.with_multipliers(found)
    matrix, sides = exact.matrix.T, np.array([float(side) for _, side in exact.rows])
    sizes = np.linalg.norm(matrix, axis=1)
    alone = sizes == 0.0
    sizes[alone] = np.abs(sides[alone]).max(initial=0.0) or 1.0
    matrix, sides = matrix / sizes[:, None], sides / sizes
    left = sides - matrix @ np.linalg.lstsq(matrix, sides, rcond=ROUNDING)[0]
    if alone.any() and np.abs(sides[alone]).max() > 0.0:
        left[~alone] = 0.0
    if np.abs(left).max() <= EXACT * np.abs(sides).max():
        return None
    return asked.with_multipliers([Fraction(-value) for value in (left / sizes).tolist()]).refined()


def _planes(walls: WallArrays) -> list[tuple[int, PressedRow]]:
    """Planes in which waypoints lie, by the numbers of their walls, with multipliers of 0."""
    when = np.zeros(0) if walls.when is None else walls.when
    return [
        (wall, _row(walls, wall, float(when[wall] - 2), Fraction(0))) for wall in np.flatnonzero(when >= 2).tolist()
    ]


def _joints(task: Task, durations: FloatArray) -> tuple[tuple[Joint, Fraction], ...]:
    """Piece, order and axis of the continuity rows, with multipliers of 0."""
    inner = range(len(durations) - (not task.closed))
    return tuple(
        ((piece, order, axis), Fraction(0)) for order in task.jumps for axis in range(task.dim) for piece in inner
    )


def _pressed(walls: WallArrays, least: LeastSlack, row: int, units: Units) -> PressedRow:
    """Return a row with its multiplier in metres and seconds, without rounding."""
    wall = int(least.wall[row])
    multiplier = Fraction(float(least.multiplier[row])) + Fraction(float(least.remainder[row]))
    multiplier *= Fraction(units.time) ** int(walls.order[wall]) / Fraction(units.length)
    return _row(walls, wall, float(least.s[row]), multiplier, least.direction[row])


def _row(
    walls: WallArrays, wall: int, s: float, multiplier: Fraction, direction: FloatArray | None = None
) -> PressedRow:
    place, anchor = (int(walls.piece[wall]), s, int(walls.order[wall])), walls.anchor[wall]
    equal = walls.when is not None and bool(walls.when[wall] >= 2)
    ball = -1 if walls.ball is None else int(walls.ball[wall])
    round_wall = np.zeros((0, len(anchor))), np.zeros(0)
    if walls.matrix is not None and direction is not None and ball >= 0:
        round_wall = walls.matrix[ball], direction
    return PressedRow(*place, walls.normal[wall], anchor, float(walls.bound[wall]), *round_wall, multiplier, equal)
