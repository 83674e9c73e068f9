"""Margins of a curve to obstacles: proved over all time, in floats by the native core and again in exact rationals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.keep_out import Avoided, called, is_fence
from minsnap.corridors.moving import Moving, keeps_margin, nearest_moving
from minsnap.corridors.prism import Prism, keeps_from_prism, nearest_prism
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
    name : str
        What messages call it: ``"obstacle 3"``, ``"fence 0"``, ``"the frame of gate 1 and its margin of 0.2 m"``.
    fence : bool
        Whether its inside is where to stay.
    """

    value: float
    obstacle: int
    instant: float
    name: str
    fence: bool

    @classmethod
    def of(cls, value: float, which: int, instant: float, obstacles: Sequence[Avoided]) -> ObstacleMargin:
        """Return the margin to one of several obstacles, with its name."""
        return cls(value, which, instant, called(obstacles, which), is_fence(obstacles[which]))

    @property
    def beyond(self) -> str:
        """How deep inside of which obstacle, or outside of which fence, the trajectory is, in words."""
        return f"{-self.value:.3g} m {'outside' if self.fence else 'inside'} {self.name}"

    @property
    def inside(self) -> str:
        """The same, and when."""
        return f"{self.beyond} at {self.instant:.4g} s"


def nearest_obstacle(curve: Trajectory, obstacles: Sequence[Avoided]) -> ObstacleMargin:
    """Return the proved least distance to one obstacle or more over all time, those that move at each instant."""
    found, still = list[ObstacleMargin](), list[int]()
    for which, each in enumerate(obstacles):
        if isinstance(each, Moving | Prism):
            near = nearest_moving(curve, each) if isinstance(each, Moving) else nearest_prism(curve, each)
            found.append(ObstacleMargin.of(near.value, which, near.instant, obstacles))
        else:
            still.append(which)
    if still:
        arrays = FleetArrays([in_space(curve.control_points)], [curve.breaks])
        table = np.stack([obstacles[which].numbers() for which in still])  # type: ignore[union-attr]
        values, instants, which_still = clearances(arrays, table, FINEST, 1)
        found.append(ObstacleMargin.of(float(values[0]), still[int(which_still[0])], float(instants[0]), obstacles))
    return min(found, key=lambda near: near.value)


def in_space(points: FloatArray) -> FloatArray:
    """Return points with a height of zero, where they have none."""
    lacking = 3 - points.shape[-1]
    return np.concatenate((points, np.zeros((*points.shape[:-1], lacking))), axis=-1) if lacking else points


def clearance_holds(curve: Trajectory, obstacle: Avoided, margin: float) -> bool:
    """Whether a trajectory is proved to keep a margin to an obstacle over all time, in exact arithmetic."""
    if isinstance(obstacle, Moving):
        return keeps_margin(curve, obstacle, margin)
    if isinstance(obstacle, Prism):
        return keeps_from_prism(curve, obstacle, margin)
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
