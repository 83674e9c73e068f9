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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import factorial, inf, isfinite, sqrt
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.cached import cached_property
from minsnap.basics.tolerances import EXACT
from minsnap.optimisation.task import Task


@dataclass(frozen=True)
class ShortTotalSettings:
    """How a time is bounded, and along which directions.

    Parameters
    ----------
    cells : int
        Of a time; an even number, as the bounds from both ends often meet in the middle.
    highest_order : int
        Order of the highest derivative that limits bound.
    rough_share : float
        Share to which times are found that are only compared.
    directions : int
        Directions for each kind of limit along which a part of the way is cut.
    legs_times_way : int
        Largest product of the legs of a part and those of the way.
    turned_from : float
        Share of the total that a bound must reach for its directions to be turned, to make it larger still.
    first_turn, least_turn : float
        By which a direction of length 1 is turned at first, and at least.
    """

    cells: int = 12
    highest_order: int = 4
    rough_share: float = 1e-3
    directions: int = 2
    legs_times_way: int = 30
    turned_from: float = 0.9
    first_turn: float = 0.2
    least_turn: float = 0.01


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
            return float(self.reach / max(self.most[1][0], EXACT * self.reach) * (1.0 - EXACT))
        while self.farthest(high) < self.reach and high < 1.0 / EXACT**2:
            low, high = high, 2.0 * high
        while high - low > share * high > 0.0:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.farthest(middle) < self.reach else (low, middle)
        return low * (1.0 - EXACT)


def _covered(most: dict[int, Any], known: list[Any], time: Any) -> list[Any]:
    """Return bounds of the distance in each cell of a time, where derivatives are known at its start.

    Those of the velocity do not fall, so that what is not covered in a time is not covered in less.
    """
    usable = {order: value for order, value in most.items() if order <= len(known) + 1 and value < inf}
    most = {order: value if order == 1 else max(value, 0) for order, value in usable.items()}
    known = [value if order == 1 else max(value, 0) for order, value in enumerate(known, 1)]
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


WallRow = tuple[tuple[tuple[float, ...], ...], tuple[float, ...], tuple[float, ...], float]
"""Matrix, slope, anchor and radius of one of ``Walls``."""


@dataclass(frozen=True, eq=False)
class MoveBounds:
    """What a task asks of the velocity along a direction.

    Parameters
    ----------
    task : Task
    hopeless : float, optional
        The only time that is tried [s], where it is asked whether there is any.
    """

    task: Task
    hopeless: float | None = None

    def timed(self, moves: Moves, share: float = EXACT) -> Moves:
        """Return moves with the longest times that are proved, to a share."""
        known = [self.velocity(moves, number, float) for number in range(len(moves))]
        if self.hopeless is None:
            least = [velocity.least_time(share) for velocity in known]
        else:
            least = [self.hopeless * (velocity.farthest(self.hopeless) < velocity.reach) for velocity in known]
        return tuple(replace(move, least=time) for move, time in zip(moves, least, strict=True))

    def velocity(self, moves: Moves, number: int, real: Any) -> VelocityBounds:
        """Return what is known of one of the moves, in numbers of a kind."""
        move, task = moves[number], self.task
        g = [real(x) for x in move.direction.tolist()]
        turns = self._turns(moves, number - 1, real), self._turns(moves, number, real)
        legs = range(task.legs) if any(turns) else [leg % task.legs for leg in range(move.start, move.end)]
        smooth = task.pieces == 1 and len(legs) == 1 and not any(turns)  # within one polynomial
        orders = range(1, (SETTINGS.highest_order if smooth else min(SETTINGS.highest_order, task.continuity + 1)) + 1)
        ways = g, [-x for x in g]
        rows = {order: {self._rows.get((leg, order), ()) for leg in legs} for order in orders}
        most = {order: tuple(max(_most(row, way) for row in rows[order]) for way in ways) for order in orders}
        ends = zip(turns, (move.start, move.end), strict=True)
        left, right = ([real(0)] if turn else self._pinned(waypoint, g) for turn, waypoint in ends)
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

    def _turns(self, moves: Moves, number: int, real: Any) -> bool:
        """Whether the way goes back after a move, the last of a lap before the first."""
        move, after = moves[number], moves[(number + 1) % len(moves)]
        around = self.task.legs if number in (-1, len(moves) - 1) else 0
        if after.start + around != move.end or (around and not self.task.closed):
            return False
        opposite = bool((move.direction == -after.direction).all())
        return opposite and all(self._reach(one, list(map(real, one.direction.tolist()))) > 0 for one in (move, after))

    def _pinned(self, waypoint: int, g: list[Any]) -> list[Any]:
        """Return the known derivatives along a direction at a waypoint, from order 1 on."""
        state = self.task.pins.get(waypoint % self.task.legs if self.task.closed else waypoint, {})
        known: list[Any] = []
        while len(known) + 1 < SETTINGS.highest_order and len(known) + 1 in state:
            known.append(_product(g, state[len(known) + 1].tolist()))
        return known

    @cached_property
    def _rows(self) -> dict[tuple[int, int], tuple[WallRow, ...]]:
        """Walls on derivatives by leg and order; those of legs with the same walls are equal."""
        rows: dict[tuple[int, int], tuple[WallRow, ...]] = {}
        for walls in (one for one in self.task.walls if one.order and one.at is None):
            for leg, matrix, slope, anchor, radius in zip(
                *(values.tolist() for values in (walls.leg, walls.matrix, walls.slope, walls.anchor, walls.radius)),
                strict=True,
            ):
                row = tuple(map(tuple, matrix)), tuple(slope), tuple(anchor), radius
                rows[leg, walls.order] = (*rows.get((leg, walls.order), ()), row)
        return rows


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
        ordered = 0 <= starts[0] and all(start < end for start, end in zip(starts, ends, strict=True))
        ordered &= all(end <= start for end, start in zip(ends, [*starts[1:], last], strict=True))
        if not ordered or self.least <= Fraction(self.total):
            return False
        course = MoveBounds(self.task)
        known = ((move.least, course.velocity(self.moves, i, Fraction)) for i, move in enumerate(self.moves))
        return all(not least or velocity.farthest(Fraction(least)) < velocity.reach > 0 for least, velocity in known)


def _product(g: list[Any], values: Sequence[float]) -> Any:
    real = type(g[0])
    return sum((a * real(x) for a, x in zip(g, values, strict=True)), real(0))


def _most(rows: tuple[WallRow, ...], g: list[Any]) -> Any:
    """Return how far a derivative may go along a direction."""
    return min((_support(row, g) for row in rows), default=inf)


def _support(row: WallRow, g: list[Any]) -> Any:
    """Return how far a wall lets a derivative go along a direction; infinity where that is not known at once."""
    real, (matrix, slope, anchor, radius) = type(g[0]), row
    if not matrix:
        return real(radius) + _product(g, anchor) if g == [-x for x in slope] else inf
    image = [_product(g, line) for line in matrix]
    squared = _product(image, image)
    size = real(sqrt(squared) * (1.0 + EXACT))
    back = [_product(image, column) for column in zip(*matrix, strict=True)]
    known = back == g and squared <= size * size and not any(slope)
    return size * real(radius) + _product(g, anchor) if known else inf


def short_total(bounded: Task, total: float, any_time: bool = False) -> ShortTotal | None:
    """Prove that a total [s] is too short for a task with the walls of its limits; None where there is no proof.

    Parameters
    ----------
    any_time : bool
        Whether the total is more than any, so that a part of the way has to take longer than all of it.
    """
    bounds = MoveBounds(bounded, 2.0 * total if any_time else None)
    moves = _parted(bounds)
    return _proved(
        bounds, total, _bent(bounds, moves, total) if SETTINGS.turned_from * total < _time(moves) <= total else moves
    )


def short_leg(bounded: Task, durations: FloatArray) -> ShortTotal | None:
    """Prove of one of leg durations (legs,) [s] that it is too short; None where there is no proof."""
    bounds = MoveBounds(bounded)
    tried = ((leg, moves) for leg in range(bounded.legs) for moves in _longest(bounds, leg, leg + 1))
    leg, moves = max(tried, key=lambda one: _time(one[1]) / durations[one[0]], default=(0, ()))
    return _proved(bounds, float(durations[leg]), moves)


def _proved(bounds: MoveBounds, total: float, moves: Moves) -> ShortTotal | None:
    short = ShortTotal(bounds.task, total, bounds.timed(moves))
    return short if moves and short.verify() else None


def _time(moves: Moves) -> float:
    return sum(move.least for move in moves)


def _parted(bounds: MoveBounds) -> Moves:
    """Cut the way into parts that go back and forth along a direction each, such that they take longest in all."""
    legs, best = bounds.task.legs, [(0.0, Moves())]
    for end in range(1, legs + 1):
        starts = range(max(0, end - max(1, SETTINGS.legs_times_way // legs)), end)
        tried = ((start, moves) for start in starts for moves in _longest(bounds, start, end))
        whole = ((best[start][0] + _time(moves), (*best[start][1], *moves)) for start, moves in tried)
        best.append(max(whole, key=lambda one: one[0], default=best[-1]))
    return best[-1][1]


def _bent(bounds: MoveBounds, moves: Moves, total: float) -> Moves:
    """Turn the direction of each part of the way for longer moves, until they take longer than a total [s]."""
    parts = [list(moves[:1])]
    for move in moves[1:]:
        if (move.direction == -parts[-1][-1].direction).all() and move.start == parts[-1][-1].end:
            parts[-1].append(move)
        else:
            parts.append([move])
    step, best = SETTINGS.first_turn, [bounds.timed(tuple(part), SETTINGS.rough_share) for part in parts]
    while step > SETTINGS.least_turn and sum(map(_time, best)) <= total:
        before = sum(map(_time, best))
        for number, part in enumerate(best):
            for turn in step * np.concatenate((np.eye(bounds.task.dim), -np.eye(bounds.task.dim))):
                way = _unit(part[0].direction + turn)
                turned = tuple(replace(move, direction=(-1.0) ** i * way) for i, move in enumerate(part))
                best[number] = max(best[number], bounds.timed(turned, SETTINGS.rough_share), key=_time)
        step *= 1.0 if sum(map(_time, best)) > before * (1.0 + SETTINGS.rough_share) else 0.5
    return tuple(move for part in best for move in part)


def _longest(bounds: MoveBounds, start: int, end: int) -> Iterator[Moves]:
    """Return moves between two waypoints along single directions: of planes, and of sums of legs between them."""
    task = bounds.task
    steps, ways = np.diff(task.waypoints[start : end + 1], axis=0), _normals(task)
    windows = [(i, j) for i in range(len(steps)) for j in range(i + 1, len(steps) + 1)]
    signs = np.ones((len(steps), 1)), (-1.0) ** np.arange(len(steps))[:, None]
    for part in _parts(task):
        mapped = steps @ part.T @ part
        sums = [_unit((sign[: j - i] * mapped[i:j]).sum(axis=0)) for i, j in windows for sign in signs]
        sums.sort(key=lambda way: -sum(sqrt(abs(far)) for _, _, far in _swings(task, start, end, way)))
        ways += sums[: SETTINGS.directions]
    for way in ways:
        moves = (LeastMove(i, j, way if rise > 0.0 else -way) for i, j, rise in _swings(task, start, end, way))
        yield bounds.timed(tuple(moves), SETTINGS.rough_share)


def _swings(task: Task, start: int, end: int, way: FloatArray) -> list[tuple[int, int, float]]:
    """Return from where to where, and how far, the way goes along a direction; a whole lap begins at its farthest."""
    along = (task.waypoints[start : end + 1] * way).sum(axis=1)
    if task.closed and end - start == task.legs:
        start = int(along[:-1].argmax())
        along = np.append(np.roll(along[:-1], -start), along[start])
    knots = [0]
    for k in (np.flatnonzero(np.diff(along)) + 1).tolist():
        onwards = len(knots) > 1 and (along[knots[-1]] > along[knots[-2]]) == (along[k] > along[knots[-1]])
        knots[-1:] = [k] if onwards else [knots[-1], k]
    knots[-1] = len(along) - 1 if len(knots) > 1 else 0
    return [(start + i, start + j, float(along[j] - along[i])) for i, j in zip(knots, knots[1:], strict=False)]


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
