"""Proof that pins and continuity have no curve in any time: a direction in which only what is pinned between moves.

Where derivatives up to 2k - 2 join polynomials of degree 2k - 1, one for each leg, only one curve passes positions at
given times with known derivatives at the ends: that of the least integral of the squared k-th derivative
(I. J. Schoenberg, "Spline interpolation and the higher derivatives", Proceedings of the National Academy of Sciences
51, 1964).  Along a direction in which neither the waypoints nor the ends move, it rests, whatever the times are.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from minsnap.basics.arrays import FloatArray
from minsnap.optimisation.task import Task


@dataclass(frozen=True, eq=False)
class StillDirection:
    """A direction in which a curve moves nowhere, and a pinned derivative does.

    Parameters
    ----------
    task : Task
    direction : tuple of Fraction, length dim
    """

    task: Task
    direction: tuple[Fraction, ...]

    def verify(self) -> bool:
        """Prove in exact rational arithmetic that no curve in any time has what is pinned."""
        resting, moving = _known(self.task)
        along = [any(_product(self.direction, value) for value in values) for values in (resting, moving)]
        return _single(self.task) and along == [False, True]


def still_direction(task: Task) -> StillDirection | None:
    """Find such a direction among those in which nothing else moves; None where there is none."""
    if not _single(task):
        return None
    reduced: dict[int, list[Fraction]] = {}  # Gauss and Jordan: what moves elsewhere, each row alone in a coordinate
    for row in _known(task)[0]:
        for pivot, other in reduced.items():
            row = _less(row, pivot, other)
        first = next((axis for axis, value in enumerate(row) if value), None)
        if first is not None:
            row = [value / row[first] for value in row]
            reduced = {pivot: _less(other, first, row) for pivot, other in reduced.items()} | {first: row}
    for free in set(range(task.dim)) - set(reduced):
        ways = (-reduced[axis][free] if axis in reduced else Fraction(axis == free) for axis in range(task.dim))
        found = StillDirection(task, tuple(ways))
        if found.verify():
            return found
    return None


def _single(task: Task) -> bool:
    """Whether positions, times and ends leave one curve."""
    ends = () if task.closed else (0, task.legs)
    known = all(set(range(1, task.half)) <= set(task.pins.get(end, {})) for end in ends)
    joined = task.pieces == 1 and task.continuity >= 2 * task.half - 2
    return known and joined and bool((task.lower == task.upper).all())


def _known(task: Task) -> tuple[list[list[Fraction]], list[list[Fraction]]]:
    """Return the ways between waypoints and the derivatives at the ends, and the derivatives between them."""
    points, ends = [_exact(point) for point in task.waypoints], set() if task.closed else {0, task.legs}
    ways = [[b - a for a, b in zip(points[0], point, strict=True)] for point in points[1:]]
    pinned = [(waypoint in ends, _exact(value)) for waypoint, state in task.pins.items() for value in state.values()]
    return [*ways, *(value for end, value in pinned if end)], [value for end, value in pinned if not end]


def _exact(values: FloatArray) -> list[Fraction]:
    return [Fraction(value) for value in values.tolist()]


def _less(row: list[Fraction], pivot: int, other: list[Fraction]) -> list[Fraction]:
    """Return a row less as much of another as leaves nothing in a coordinate."""
    return [a - row[pivot] * b for a, b in zip(row, other, strict=True)]


def _product(way: tuple[Fraction, ...], value: list[Fraction]) -> Fraction:
    return sum((a * b for a, b in zip(way, value, strict=True)), Fraction(0))
