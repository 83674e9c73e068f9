"""Margins of a curve to obstacles: proved over all time, in floats by the native core and again in exact rationals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.keep_out import Obstacle
from minsnap.native.fleet_border import FleetArrays, clearances
from minsnap.polynomials import rationals
from minsnap.trajectory.trajectory import Trajectory

FINEST = 1e-9
"""Greatest difference between a proved margin and the true one [m]."""


@dataclass(frozen=True)
class ObstacleMargin:
    """Least distance of a trajectory to an obstacle, and the place where it occurs.

    Parameters
    ----------
    value : float
        Least distance [m]; negative inside. The exact one is not less; near edges and ellipsoids it may be more.
    obstacle : int
        Which one, from 0.
    instant : float
        When [s].
    """

    value: float
    obstacle: int
    instant: float

    @property
    def inside(self) -> str:
        """How far inside of which obstacle the trajectory is, and when, in words."""
        return f"{-self.value:.3g} m inside obstacle {self.obstacle} at {self.instant:.4g} s"


def nearest_obstacle(curve: Trajectory, obstacles: Sequence[Obstacle]) -> ObstacleMargin:
    """Return the proved least distance to one obstacle or more over all time."""
    arrays = FleetArrays([in_space(curve.control_points)], [curve.breaks])
    values, instants, which = clearances(arrays, np.stack([each.numbers() for each in obstacles]), FINEST, 1)
    return ObstacleMargin(float(values[0]), int(which[0]), float(instants[0]))


def in_space(points: FloatArray) -> FloatArray:
    """Return points with a height of zero, where they have none."""
    lacking = 3 - points.shape[-1]
    return np.concatenate((points, np.zeros((*points.shape[:-1], lacking))), axis=-1) if lacking else points


def clearance_holds(curve: Trajectory, obstacle: Obstacle, margin: float) -> bool:
    """Whether a trajectory is proved to keep a margin to an obstacle over all time, in exact arithmetic."""
    points, asked = in_space(curve.control_points), Fraction(margin)
    return all(
        rationals.is_one_never_negative(list(_room_left(rationals.exact(piece), obstacle.numbers(), asked)))
        for piece in points
    )


def _room_left(curve: rationals.Curve, numbers: FloatArray, margin: Fraction) -> Iterator[rationals.Scalar]:
    """Yield what is not negative where a piece keeps the margin to one of the sets whose overlap an obstacle is."""
    center, scale, (radius,), low, high = np.split(numbers, (3, 6, 7, 10))
    for axis, lower, upper in zip(curve, low.tolist(), high.tolist(), strict=True):
        if np.isfinite(upper):
            yield [value - Fraction(upper) - margin for value in axis]
        if np.isfinite(lower):
            yield [Fraction(lower) - margin - value for value in axis]
    if radius < 0.0:
        return
    reach = Fraction(float(radius)) + margin
    if reach <= 0:
        yield [Fraction(1)]
    away = rationals.relative(curve, center)
    scaled = [[Fraction(float(s)) * value for value in axis] for s, axis in zip(scale, away, strict=True)]
    yield [value - reach * reach for value in rationals.squared_norm(scaled)]
