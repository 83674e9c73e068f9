r"""Proof that a time is too short for the limits, however it is split over the legs: least times that add up.

The way is cut into moves, each along a direction g between two waypoints.  Convex walls bound the scalar velocity
:math:`g^\top v` of a move and its derivatives.  At an end of the flight the pinned derivatives are known besides.
Where the next move goes back along the same direction, the coordinate along g has an extreme at least as far as the
waypoint between them, where the velocity is 0.  Such extremes follow each other in the order of the waypoints, and the
flight is cut there instead.

From an end where it is known the velocity changes by Taylor's formula at most as fast as its bounds allow, here on a
few cells of time.  The distance of a move is at most the sum of the lower of what both ends allow.  Between ends where
derivatives are 0 it is also at most :math:`\int |K|` times a bound of :math:`(g^\top v)^{(m)}`, with a polynomial K of
degree m for which integration by parts leaves nothing at the ends: at rest a Chebyshev polynomial of the second kind,
which has the least norm in L1.  That a move is not made in a time is proved in exact rational arithmetic.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import factorial, inf, isfinite, sqrt
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.constraint import Walls
from minsnap.optimisation.task import Task


@dataclass(frozen=True)
class ShortTotalSettings:
    """How a time is bounded, and along which directions.

    Parameters
    ----------
    cells : int
        Of a time; an even number, as the bounds from both ends often meet in the middle.
    highest : int
        Order of the highest derivative that limits bound.
    roughly : float
        Share to which times are found that are only compared.
    tried, window : int
        Directions for each kind of limit, and of how many legs at most each is made.
    legs : int
        Of the longest way whose turns are sought.
    """

    cells: int = 12
    highest: int = 4
    roughly: float = 1e-3
    tried: int = 3
    window: int = 4
    legs: int = 30


SETTINGS = ShortTotalSettings()

KERNELS = {
    (3, 1, 1): Fraction(1, 12),
    (3, 1, 2): Fraction(1, 20),
    (3, 2, 2): Fraction(1, 32),
    (4, 1, 3): Fraction(1, 116),
    (4, 3, 3): Fraction(1, 384),
}
"""Bounds of the norm of K in a time of 1, by the order that is bounded and how many derivatives are 0 at either end."""


@dataclass(frozen=True, eq=False)
class LeastMove:
    """A part of the way that takes longer than a time.

    Parameters
    ----------
    start, end : int
        Waypoints, counted on past the last around a lap.
    direction : ndarray, shape (dim,)
    least : float
        [s].
    """

    start: int
    end: int
    direction: FloatArray
    least: float = 0.0


Moves = tuple[LeastMove, ...]


@dataclass(frozen=True, eq=False)
class VelocityBounds:
    """What is known of the velocity of a move along its direction, in floats or in fractions.

    Parameters
    ----------
    reach : number
        Least distance [m].
    most : mapping of int to (number, number)
        Bounds of the derivatives of the position, forwards and backwards along the direction, by their order.
    left, right : list of number
        Derivatives of the position from order 1 on at the start, and at the end for time running backwards.
    """

    reach: Any
    most: dict[int, tuple[Any, Any]]
    left: list[Any]
    right: list[Any]

    def farthest(self, time: Any) -> Any:
        """Return a bound of the distance in a time [s]."""
        forwards = {order: both[0] for order, both in self.most.items()}
        backwards = {order: both[(order + 1) % 2] for order, both in self.most.items()}
        ends = _covered(forwards, self.left, time), reversed(_covered(backwards, self.right, time))
        far = sum(map(min, *ends))
        if any(self.left) or any(self.right):
            return far
        for (order, few, many), norm in KERNELS.items():
            zeros = sorted(min(len(end), order - 1) for end in (self.left, self.right))
            most = max(self.most.get(order, (inf, inf)))
            if most < inf and zeros == [few, many]:
                far = min(far, norm * most * time**order)
        return far

    def least_time(self, share: float) -> float:
        """Return the longest time in which the distance is not covered, to a share [s]."""
        low, high = 0.0, 1.0
        if self.reach <= 0.0 or not isfinite(self.farthest(high)):
            return 0.0
        if not (self.left or self.right):
            return float(self.reach / self.most[1][0] * (1.0 - EXACT))
        while self.farthest(high) < self.reach and high < 1.0 / EXACT:
            low, high = high, 2.0 * high
        while high - low > share * high > 0.0:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.farthest(middle) < self.reach else (low, middle)
        return low * (1.0 - EXACT)


def _covered(most: dict[int, Any], known: list[Any], time: Any) -> list[Any]:
    """Return bounds of the distance in each cell of a time, where derivatives are known at its start."""
    most = {order: value for order, value in most.items() if order <= len(known) + 1 and value < inf}
    if not most:
        return [inf] * SETTINGS.cells
    last, step = max(most), time / SETTINGS.cells
    powers = [step**i / factorial(i) for i in range(last + 1)]
    state, distances = [*known[: last - 1], most[last]], []
    for _ in range(SETTINGS.cells):
        far = sum(value * power for value, power in zip(state, powers[1:], strict=True))
        distances.append(min(far, most[1] * step) if 1 in most else far)
        for i in range(last - 1):
            grown = sum(value * power for value, power in zip(state[i:], powers, strict=False))
            state[i] = min(grown, most[i + 1]) if i + 1 in most else grown
    return distances


@dataclass(frozen=True, eq=False)
class MoveBounds:
    """What a task asks of the velocity along a direction."""

    task: Task

    def timed(self, moves: Moves, share: float = EXACT) -> Moves:
        """Return moves with the longest times that are proved, to a share."""
        least = [self.velocity(moves, number, float).least_time(share) for number in range(len(moves))]
        return tuple(replace(move, least=time) for move, time in zip(moves, least, strict=True))

    def velocity(self, moves: Moves, number: int, real: Any) -> VelocityBounds:
        """Return what is known of one of the moves, in numbers of a kind."""
        move, task = moves[number], self.task
        g = [real(x) for x in move.direction.tolist()]
        turns = self._turns(moves, number - 1), self._turns(moves, number)
        legs = range(task.legs) if any(turns) else [leg % task.legs for leg in range(move.start, move.end)]
        orders = range(1, min(SETTINGS.highest, task.continuity + 1) + 1)
        ways = g, [-x for x in g]
        most = {order: tuple(max(self._most(leg, order, way) for leg in legs) for way in ways) for order in orders}
        left = self._pinned(0, g) if move.start == 0 else []
        right = self._pinned(task.legs, g) if move.end == task.legs else []
        left, right = ([real(0)] if turn else end for turn, end in zip(turns, (left, right), strict=True))
        return VelocityBounds(self._reach(move, g), most, left, [-((-1) ** i) * x for i, x in enumerate(right, 1)])

    def _reach(self, move: LeastMove, g: list[Any]) -> Any:
        """Return the least distance from start to end along a direction."""
        task, far, real = self.task, 0, type(g[0])
        for waypoint, sign in ((move.start, -1), (move.end, 1)):
            k = waypoint % task.legs if task.closed else waypoint
            numbers = ([real(x) for x in points[k].tolist()] for points in (task.waypoints, task.lower, task.upper))
            far += sum(
                sign * a * x + min(sign * a * low, sign * a * up) for a, x, low, up in zip(g, *numbers, strict=True)
            )
        return far

    def _turns(self, moves: Moves, number: int) -> bool:
        """Whether the way goes back after a move, the last of a lap before the first."""
        move, after = moves[number], moves[(number + 1) % len(moves)]
        lap = self.task.closed and moves[-1].end - moves[0].start == self.task.legs
        if number in (-1, len(moves) - 1) and not lap:
            return False
        both = all(self._reach(one, [Fraction(x) for x in one.direction.tolist()]) > 0 for one in (move, after))
        return both and bool((move.direction == -after.direction).all())

    def _pinned(self, waypoint: int, g: list[Any]) -> list[Any]:
        """Return the known derivatives along a direction at an end of the flight, from order 1 on."""
        state = self.task.pins.get(waypoint, {})
        known: list[Any] = []
        while len(known) + 1 < SETTINGS.highest and len(known) + 1 in state:
            known.append(_product(g, state[len(known) + 1].tolist()))
        return known

    @cached_property
    def _rows(self) -> dict[tuple[int, int], list[tuple[Walls, int]]]:
        """Walls on derivatives and their rows by leg and order."""
        rows: dict[tuple[int, int], list[tuple[Walls, int]]] = {}
        for walls in (one for one in self.task.walls if one.order and one.at is None):
            for row, leg in enumerate(walls.leg.tolist()):
                rows.setdefault((leg, walls.order), []).append((walls, row))
        return rows

    def _most(self, leg: int, order: int, g: list[Any]) -> Any:
        """Return how far a derivative on a leg may go along a direction."""
        return min((_support(walls, row, g) for walls, row in self._rows.get((leg, order), ())), default=inf)


@dataclass(frozen=True, eq=False)
class ShortTotal:
    """Moves, one after the other, that take longer than a time.

    Parameters
    ----------
    task : Task
        With the walls that every curve within the limits keeps.
    total : float
        [s].
    moves : tuple of LeastMove
    """

    task: Task
    total: float
    moves: Moves

    @property
    def least(self) -> Fraction:
        """The time that they take at least [s]."""
        return sum((Fraction(move.least) for move in self.moves), Fraction(0))

    def verify(self) -> bool:
        """Prove in exact rational arithmetic that every split of the total exceeds a limit."""
        starts, ends = [move.start for move in self.moves], [move.end for move in self.moves]
        last = self.task.legs + (starts[0] if self.task.closed else 0)
        ordered = 0 <= starts[0] and starts[1:] == ends[:-1] and ends[-1] <= last
        ordered &= all(start < end for start, end in zip(starts, ends, strict=True))
        if not ordered or self.least <= Fraction(self.total):
            return False
        course = MoveBounds(self.task)
        known = ((move.least, course.velocity(self.moves, i, Fraction)) for i, move in enumerate(self.moves))
        return all(not least or velocity.farthest(Fraction(least)) < velocity.reach for least, velocity in known)


def _product(g: list[Any], values: list[float]) -> Any:
    real = type(g[0])
    return sum((a * real(x) for a, x in zip(g, values, strict=True)), real(0))


def _support(walls: Walls, row: int, g: list[Any]) -> Any:
    """Return how far a wall lets a derivative go along a direction; infinity where that is not known at once."""
    real, slope, middle = type(g[0]), walls.slope[row].tolist(), _product(g, walls.anchor[row].tolist())
    radius = real(float(walls.radius[row]))
    if walls.flat:
        return radius + middle if g == [-x for x in slope] else inf
    image = [_product(g, line) for line in walls.matrix[row].tolist()]
    squared = _product(image, image)
    size = real(sqrt(squared) * (1.0 + EXACT))
    back = [_product(image, column) for column in walls.matrix[row].T.tolist()]
    return inf if any(slope) or back != g or size * size < squared else size * radius + middle


def short_total(bounded: Task, total: float) -> ShortTotal | None:
    """Prove that a total [s] is too short for a task with the walls of its limits; None where there is no proof."""
    course = MoveBounds(bounded)
    tried = (course.timed(moves, SETTINGS.roughly) for moves in (_legs(course), *_turning(bounded)))
    return _proved(course, total, max(tried, key=lambda moves: sum(move.least for move in moves)))


def short_leg(bounded: Task, durations: FloatArray) -> ShortTotal | None:
    """Prove of one of leg durations (legs,) [s] that it is too short; None where there is no proof."""
    course = MoveBounds(bounded)
    move = max(_legs(course), key=lambda one: one.least / durations[one.start])
    return _proved(course, float(durations[move.start]), (move,))


def _proved(course: MoveBounds, total: float, moves: Moves) -> ShortTotal | None:
    short = ShortTotal(course.task, total, course.timed(moves))
    return short if short.verify() else None


def _legs(course: MoveBounds) -> Moves:
    """Return each leg along the direction in which it takes longest."""
    parts, normals, moves = _parts(course.task), _normals(course.task), []
    for leg, step in enumerate(np.diff(course.task.waypoints, axis=0)):
        ways = [_unit(step @ part.T @ part) for part in parts]
        ways += [way if way @ step > 0.0 else -way for way in normals]
        tried = (course.timed((LeastMove(leg, leg + 1, way),), SETTINGS.roughly)[0] for way in ways)
        moves.append(max(tried, key=lambda one: one.least, default=LeastMove(leg, leg + 1, step)))
    return tuple(moves)


def _turning(bounded: Task) -> list[Moves]:
    """Return the way back and forth along single directions: of planes, and of sums of legs along which it is long."""
    if bounded.legs > SETTINGS.legs:
        return []
    steps, found = np.diff(bounded.waypoints, axis=0), [_back_and_forth(bounded, way) for way in _normals(bounded)]
    windows = [(i, j) for i in range(len(steps)) for j in range(i + 1, min(i + SETTINGS.window, len(steps)) + 1)]
    signs = np.ones((SETTINGS.window, 1)), (-1.0) ** np.arange(SETTINGS.window)[:, None]
    for part in _parts(bounded):
        mapped = steps @ part.T @ part
        ways = [_unit((sign[: j - i] * mapped[i:j]).sum(axis=0)) for i, j in windows for sign in signs]
        ways.sort(key=lambda way: -sum(sqrt(far) for far in np.abs(np.diff(_cut(bounded, way)[2]))))
        found += [_back_and_forth(bounded, way) for way in ways[: SETTINGS.tried]]
    return [moves for moves in found if moves]


def _back_and_forth(bounded: Task, way: FloatArray) -> Moves:
    """Cut the way where it turns along a direction."""
    first, knots, along = _cut(bounded, way)
    both = zip(knots, knots[1:], np.diff(along).tolist(), strict=False)
    return tuple(LeastMove(first + i, first + j, way if rise > 0.0 else -way) for i, j, rise in both)


def _cut(bounded: Task, way: FloatArray) -> tuple[int, list[int], FloatArray]:
    """Return where the way begins, on a lap at its farthest waypoint, where it turns from there on, and how far."""
    along = (bounded.waypoints * way).sum(axis=1)
    first = int(along[:-1].argmax()) if bounded.closed else 0
    along = np.append(np.roll(along[:-1], -first), along[first]) if bounded.closed else along
    knots = [0]
    for k in (np.flatnonzero(np.diff(along)) + 1).tolist():
        onwards = len(knots) > 1 and (along[knots[-1]] > along[knots[-2]]) == (along[k] > along[knots[-1]])
        knots[-1:] = [k] if onwards else [knots[-1], k]
    knots[-1] = bounded.legs if len(knots) > 1 else 0
    return first, knots, along[knots]


def _parts(bounded: Task) -> list[FloatArray]:
    """Return the matrices of balls in which derivatives are kept, each once."""
    balls = [walls for walls in bounded.walls if walls.order and not walls.flat and not walls.slope.any()]
    return list({matrix.tobytes(): matrix for walls in balls for matrix in walls.matrix}.values())


def _normals(bounded: Task) -> list[FloatArray]:
    """Return the normals of planes that derivatives are behind, each once up to its sign."""
    planes = (row for walls in bounded.walls if walls.order and walls.flat for row in walls.slope.tolist())
    one_way = {max(tuple(row), tuple(-x for x in row)) for row in planes}
    return [np.array(row) + 0.0 for row in sorted(one_way)]


def _unit(way: FloatArray) -> FloatArray:
    """Return a vector of about length 1, or zeros."""
    return way / max(sqrt((way * way).sum()), EXACT)
