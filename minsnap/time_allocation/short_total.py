r"""Proof that a total is too short for the limits on the velocity, however it is split over the legs, or one leg.

A convex set that the velocity stays in contains its mean over a leg of duration :math:`T_i`.  For a wall
:math:`g^\top v \le b` and any points p, q of the waypoints' boxes that therefore is
:math:`g^\top (q - p) / b \le T_i`, and the sum of the left sides over the legs is a total below which there is none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.optimisation.contradiction import PressedRow
from minsnap.optimisation.task import Task


@dataclass(frozen=True, eq=False)
class ShortTotal:
    """Walls of the velocity, one on a leg at most, within which these legs take longer than a time.

    Parameters
    ----------
    task : Task
    total : float
        [s].
    rows : tuple of PressedRow
        Walls of order 1; their instants and multipliers have no part in it.
    """

    task: Task
    total: float
    rows: tuple[PressedRow, ...]

    @property
    def least(self) -> Fraction:
        """The least total within these walls [s]."""
        return sum((self._least_on(row) for row in self.rows), Fraction(0))

    def verify(self) -> bool:
        """Prove in exact rational arithmetic that every split of the total exceeds a limit."""
        legs = {row.piece for row in self.rows}
        short = all(sum(Fraction(u) ** 2 for u in row.direction.tolist()) <= 1 and row.order == 1 for row in self.rows)
        return short and len(legs) == len(self.rows) and self.least > Fraction(self.total)

    def _least_on(self, row: PressedRow) -> Fraction:
        normal, bound = row.exact()
        start, end = self._along(normal, row.piece), self._along(normal, row.piece + 1)
        return max((min(end) - max(start)) / bound, Fraction(0))

    def _along(self, normal: list[Fraction], waypoint: int) -> tuple[Fraction, Fraction]:
        """Return the least and the greatest product of a normal with the points that a waypoint may be at."""
        sides = (self.task.lower[waypoint], self.task.upper[waypoint])
        low, high = ([f * Fraction(offset) for f, offset in zip(normal, side.tolist(), strict=True)] for side in sides)
        point = self.task.waypoints[waypoint].tolist()
        middle = sum((f * Fraction(x) for f, x in zip(normal, point, strict=True)), Fraction(0))
        return sum(map(min, low, high), middle), sum(map(max, low, high), middle)


def short_total(bounded: Task, total: float) -> ShortTotal | None:
    """Prove that a total [s] is too short for a task with the walls of its limits; None where there is no proof."""
    return _proved(bounded, total, [row for _, row in _slowest(bounded).values()])


def short_leg(bounded: Task, durations: FloatArray) -> ShortTotal | None:
    """Prove of one of leg durations (legs,) [s] that it is too short; None where there is no proof."""
    slowest = _slowest(bounded)
    if not slowest:
        return None
    leg = max(slowest, key=lambda one: slowest[one][0] / durations[one])
    return _proved(bounded, float(durations[leg]), [slowest[leg][1]])


def _proved(bounded: Task, total: float, rows: Sequence[PressedRow]) -> ShortTotal | None:
    short = ShortTotal(bounded, total, tuple(rows))
    return short if short.verify() else None


def _slowest(bounded: Task) -> dict[int, tuple[float, PressedRow]]:
    """Return by leg the time [s] that the straight way takes within the wall that allows least, and that wall."""
    best: dict[int, tuple[float, PressedRow]] = {}
    steps = np.diff(bounded.waypoints, axis=0)
    for cones in (wall for wall in bounded.walls if wall.order == 1):
        for row, leg in enumerate(cones.leg.tolist()):
            along = cones.matrix[row] @ steps[leg]
            length = float(np.linalg.norm(along))
            takes = (length - float(cones.slope[row] @ steps[leg])) / float(cones.radius[row])
            if takes > best.get(leg, (0.0,))[0]:
                wall = -cones.slope[row], cones.anchor[row], float(cones.radius[row]), cones.matrix[row]
                best[leg] = takes, PressedRow(leg, 0.0, 1, *wall, along / max(length * (1.0 + EXACT), EXACT))
    return best
