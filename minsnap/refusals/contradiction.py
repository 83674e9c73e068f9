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
from functools import cache
from math import comb, lcm, perm

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.cached import cached_property
from minsnap.basics.deadline import WORK
from minsnap.basics.tolerances import EXACT, ROUNDING
from minsnap.native.corridor import LeastSlack
from minsnap.optimisation.task import Task
from minsnap.optimisation.task_walls import AllWalls, all_walls
from minsnap.polynomials.enclosures import UNIT

Unknown = tuple[int, int, int]
"""Knot, slot and axis of a free derivative."""

Joint = tuple[int, int, int]

Row = tuple[dict[Unknown, Fraction], Fraction]
"""Coefficients of free derivatives, and the bound of their sum."""


@dataclass(frozen=True, eq=False)
class Contradiction:
    """Walls at instants that no curve satisfies together: multipliers show it.

    Parameters
    ----------
    task : Task
        What is asked of the curve.
    durations : ndarray, shape (pieces,)
        [s].
    walls : AllWalls
        Those of the task.
    wall : ndarray of int, shape (r,)
        Which of them take part.
    s : ndarray, shape (r,)
        Where on their pieces, in [0, 1].
    direction : ndarray, shape (r, dim)
        Of tangent planes of round walls, no longer than 1; the first q components count where a matrix has q rows.
    joints : tuple of (int, int, int)
        Piece, order and axis of the continuity rows that take part, above order k - 1 at the end of the piece.
    multipliers : tuple of Fraction
        Of the walls, then of the joints; those of joints, and of planes on which the curve lies, have any sign.
    slack : float
        By how much the walls must give way, about and rather more; no part of the proof.
    """

    task: Task
    durations: FloatArray
    walls: AllWalls
    wall: IntArray
    s: FloatArray
    direction: FloatArray
    joints: tuple[Joint, ...]
    multipliers: tuple[Fraction, ...]
    slack: float = 0.0

    @property
    def legs(self) -> tuple[int, ...]:
        """Legs whose walls contradict each other."""
        return tuple(np.unique(self.walls.piece[self.wall] // self.task.pieces).tolist())

    @property
    def instants(self) -> FloatArray:
        """Instants of the walls [s]."""
        breaks, piece = np.append(0.0, np.cumsum(self.durations)), self.walls.piece[self.wall]
        return np.asarray(breaks[piece] + self.s * self.durations[piece])

    @property
    def orders(self) -> IntArray:
        """Orders of the derivatives that the walls bound."""
        return self.walls.order[self.wall]

    def verify(self) -> bool:
        """Prove the contradiction in exact rational arithmetic on the stored numbers."""
        if any(_dot(u, u) > 1 for u in map(self._direction, range(len(self.wall)))):
            return False
        if any(m < 0 and not free for m, free in zip(self.multipliers, self.free, strict=True)):
            return False
        return sum(self.sum_of(self.multipliers)) < 0

    def refined(self) -> Contradiction | None:
        """Return it with multipliers with which it verifies, its own or refined ones; None where steps do not help.

        Those of continuity and planes are refined alone at first.  No more steps are taken than needed: each may also
        take away from the contradiction.  Late, LateError is raised.
        """
        multipliers = self.multipliers
        # Multipliers come from an interior point in doubles, so their sum of rows is not quite free of the curve. One
        # least-squares step removes most of what is left; a step that does not halve it has reached the doubles' end.
        for alone in (True, False) if self.free.any() else (False,):
            before: Fraction | None = None
            for _ in range(5):
                self.task.deadline.require()
                left, side = self.sum_of(multipliers)
                if side + left < 0:
                    return self.with_multipliers(multipliers)
                if before is not None and 2 * left > before:
                    break
                before, multipliers = left, self.less_left(multipliers, alone)
        return None

    def with_multipliers(self, multipliers: Sequence[Fraction]) -> Contradiction:
        """Return it with other multipliers, without what has no part in it then."""
        count = len(self.wall)
        used, chosen = [i for i, m in enumerate(multipliers[:count]) if m], tuple(m for m in multipliers if m)
        joints = tuple(joint for joint, m in zip(self.joints, multipliers[count:], strict=True) if m)
        wall, s, direction = self.wall[used], self.s[used], self.direction[used]
        return replace(self, wall=wall, s=s, direction=direction, joints=joints, multipliers=chosen)

    @cached_property
    def free(self) -> BoolArray:
        """Which multipliers may have any sign, (rows,)."""
        return np.append(self.walls.equal[self.wall], np.ones(len(self.joints), dtype=bool))

    @cached_property
    def rows(self) -> list[Row]:
        """Rows over the free derivatives without rounding, those of the joints last."""
        return [*map(self._wall_row, range(len(self.wall))), *(self._joint_row(*joint) for joint in self.joints)]

    @cached_property
    def places(self) -> list[Unknown]:
        """Unknowns of the rows."""
        return sorted({place for row, _ in self.rows for place in row})

    def sum_of(self, multipliers: Sequence[Fraction]) -> tuple[Fraction, Fraction]:
        """Return the most that the coefficients of the sum of the rows may come to, and the sum of their bounds."""
        left, side = self._sum(multipliers)
        return sum((abs(value) * self.largest(place) for place, value in left.items()), Fraction(0)), side

    def eliminated(self) -> list[Fraction] | None:
        """Multipliers with which nothing is left of the unknowns and the bound is below 0; None where there are none.

        LateError is raised after the deadline: twelve legs of three coordinates take half a second.
        """
        # Gauss in exact fractions. Each row also carries, at the key (-1, number, 0), of which rows it is the sum. A
        # row in which no unknown is left says 0 <= side: a contradiction if side < 0, by the multipliers it carries.
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

    def less_left(self, multipliers: Sequence[Fraction], alone: bool = False) -> tuple[Fraction, ...]:
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
        weights, sizes = np.abs([float(multipliers[row]) for row in chosen.tolist()]), np.linalg.norm(matrix, axis=0)
        # A row counts relative to its multiplier, so that small ones stay positive. Multipliers that may have any sign,
        # of continuity and planes, may be zero now: they are weighed by the size of their row instead.
        weights[free] = (1.0 if alone else (weights * sizes).max()) / np.where(sizes, sizes, 1.0)[free]
        matrix *= weights
        # One more equation: the steps must not change the sum of the bounds, which is the contradiction itself.
        if side < 0 and not alone:
            bounds = weights * [float(bound) for _, bound in self.rows]
            bounds *= np.abs(matrix).max() / np.abs(bounds).max()
            matrix, right = np.vstack((matrix, bounds)), np.append(right, 0.0)
        sums = list(multipliers)
        for row, more in zip(chosen.tolist(), weights * np.linalg.lstsq(matrix, right, rcond=UNIT)[0], strict=True):
            sums[row] += Fraction(float(more))
        return tuple(m if free else max(m, Fraction(0)) for m, free in zip(sums, self.free, strict=True))

    @cached_property
    def matrix(self) -> FloatArray:
        """Coefficients times the largest values of their unknowns, (places, rows), rounded."""
        known = {place: (i, float(self.largest(place))) for i, place in enumerate(self.places)}
        matrix = np.zeros((len(known), len(self.rows)))
        for column, (row, _) in enumerate(self.rows):
            for place, value in row.items():
                matrix[known[place][0], column] = float(value) * known[place][1]
        return matrix

    def _sum(self, multipliers: Sequence[Fraction]) -> Row:
        """Return what is left of the sum of all rows: coefficients, and the bound."""
        left: dict[Unknown, int] = {}
        side = 0
        self.task.deadline.spend(WORK.term * sum(len(row) for row, _ in self.rows))
        shares = [m / scale for m, (_, _, scale) in zip(multipliers, self._whole, strict=True)]
        unit = lcm(*(share.denominator for share in shares))
        for (row, bound, _), share in zip(self._whole, shares, strict=True):
            times = share.numerator * (unit // share.denominator)
            side += times * bound
            for place, value in row.items():
                left[place] = left.get(place, 0) + times * value
        return {place: Fraction(value, unit) for place, value in left.items()}, Fraction(side, unit)

    @cached_property
    def _whole(self) -> list[tuple[dict[Unknown, int], int, int]]:
        """Rows multiplied until they are of whole numbers, which add up faster, and by how much: row, bound, factor."""
        whole = []
        for row, bound in self.rows:
            scale = lcm(bound.denominator, *(value.denominator for value in row.values()))
            whole.append(({place: int(scale * value) for place, value in row.items()}, int(scale * bound), scale))
        return whole

    def largest(self, place: Unknown) -> Fraction:
        """Largest value of a free derivative of the curves that are ruled out."""
        # Derivative q of a polynomial of degree n on [0, T] is at most n!/(n - q)! / T^q times the largest difference
        # of its control points (Bernstein form). Those beyond a billion legs are not ruled out, nor are they flown.
        knot, slot, _ = place
        order, T = int(self.task.slots.order[slot]), self.durations
        longest = max(float(T[max(knot - 1, 0)]), float(T[min(knot, len(T) - 1)]))
        return Fraction(self.task.length / EXACT) * perm(2 * self.task.half - 1, order) / Fraction(longest) ** order

    def _direction(self, row: int) -> list[Fraction]:
        block, _ = self.walls.place(int(self.wall[row]))
        return _fractions(self.direction[row, : block.matrix.shape[1]])

    def exact_plane(self, row: int) -> tuple[list[Fraction], Fraction]:
        """Return the normal and the bound of a wall's plane, without rounding."""
        block, wall = self.walls.place(int(self.wall[row]))
        u, matrix = self._direction(row), [_fractions(one) for one in block.matrix[wall]]
        own = enumerate(_fractions(block.slope[wall]))
        normal = [sum((a * one[j] for a, one in zip(u, matrix, strict=True)), -n) for j, n in own]
        return normal, Fraction(float(block.radius[wall])) + _dot(normal, _fractions(block.anchor[wall]))

    def _wall_row(self, row: int) -> Row:
        normal, bound = self.exact_plane(row)
        place = int(self.walls.piece[self.wall[row]]), Fraction(float(self.s[row])), int(self.orders[row])
        return self._row([(*place, axis, n) for axis, n in enumerate(normal)], bound)

    def _joint_row(self, piece: int, order: int, axis: int) -> Row:
        after, one = (piece + 1) % len(self.durations), Fraction(1)
        return self._row([(piece, one, order, axis, one), (after, 0 * one, order, axis, -one)], 0 * one)

    @cached_property
    def _known(self) -> FloatArray:
        """Pinned derivatives and positions of the knots, (knots, slots, dim)."""
        known = self.task.pinned.copy()
        known[:: self.task.pieces, 0] = self.task.waypoints
        return known

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
                elif self._known[place]:
                    bound -= factor * weight * Fraction(float(self._known[place]))
        return unknowns, bound


@cache
def _weights(half: int, duration: Fraction, s: Fraction, order: int) -> list[Fraction]:
    """Return the derivative at s of the curves with one end derivative 1 and the others 0, those at the start first."""
    degree, low = 2 * half - 1, 2 * half - 1 - order
    if low < 0:
        return [Fraction(0)] * (2 * half)
    part, whole = s.numerator, s.denominator
    own = [comb(low, i) * part**i * (whole - part) ** (low - i) for i in range(low + 1)]  # times whole**low
    for _ in range(order):
        own = [before - after for before, after in zip([0, *own], [*own, 0], strict=True)]
    weights = []
    for sign, points in ((1, own), (-1, own[::-1])):
        for j in range(half):
            total = sign**j * perm(degree, order) * sum(comb(i, j) * points[i] for i in range(j, half))
            weights.append(Fraction(total, whole**low * perm(degree, j)) * duration ** (j - order))
    return weights


def _fractions(values: FloatArray) -> list[Fraction]:
    return [Fraction(value) for value in values.tolist()]


def _dot(left: list[Fraction], right: list[Fraction]) -> Fraction:
    return sum((a * b for a, b in zip(left, right, strict=True)), Fraction(0))


def find_contradiction(task: Task, durations: FloatArray, walls: AllWalls, least: LeastSlack) -> Contradiction | None:
    """Prove that the rows that press at the least slacks contradict each other; None where that fails.

    Parameters
    ----------
    task : Task
        Without what follows where waypoints lie on walls (``touching``).
    durations : ndarray, shape (pieces,)
        [s].
    walls : AllWalls
        Those of the task.
    """
    pressing = np.flatnonzero(least.multiplier)
    if not len(pressing):
        return None
    wall, units = least.wall[pressing], task.units(durations)
    factors = (Fraction(units.time) ** order / Fraction(units.length) for order in walls.order[wall].tolist())
    numbers = zip(least.multiplier[pressing].tolist(), least.remainder[pressing].tolist(), factors, strict=True)
    multipliers = [(Fraction(m) + Fraction(rest)) * factor for m, rest, factor in numbers]
    more = _of_planes_and_joints(task, durations, walls)
    others = ~np.isin(more.wall, wall)
    return replace(
        more,
        slack=float(least.slacks.max(initial=0.0)),
        wall=np.append(wall, more.wall[others]),
        s=np.append(least.s[pressing], more.s[others]),
        direction=np.concatenate((least.direction[pressing], more.direction[others])),
        multipliers=(*multipliers, *(Fraction(0) for _ in range(int(others.sum()) + len(more.joints)))),
    ).refined()


def contradicting_joints(task: Task, durations: FloatArray, exactly: bool = False) -> Contradiction | None:
    """Return continuity and planes of gates that contradict each other and the pins; None where that is not proved.

    Parameters
    ----------
    exactly : bool
        Whether by exact elimination, which finds what least squares leave open; it takes longer.
    """
    asked = _of_planes_and_joints(task, durations, all_walls(task))
    if not asked.joints:
        return None
    if exactly:
        found = asked.eliminated()
        return None if found is None else asked.with_multipliers(found)
    matrix, sides = asked.matrix.T, np.array([float(side) for _, side in asked.rows])
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


def _of_planes_and_joints(task: Task, durations: FloatArray, walls: AllWalls) -> Contradiction:
    """Return all planes in which waypoints lie and all continuity rows, with multipliers of 0."""
    wall, inner = np.flatnonzero(walls.equal), range(len(durations) - (not task.closed))
    s = np.concatenate([np.zeros(0), *(block.at for block in walls.blocks if block.equal and block.at is not None)])
    joints = tuple((piece, order, axis) for order in task.joined_orders for axis in range(task.dim) for piece in inner)
    none = (Fraction(0),) * (len(wall) + len(joints))
    return Contradiction(task, durations, walls, wall, s, np.zeros((len(wall), task.dim)), joints, none)
