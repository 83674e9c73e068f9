"""Obstacles that vehicles keep out of: vertical cylinders, ellipsoids and boxes.

What keeps out is the vehicle's center: make an obstacle larger by what the vehicle itself needs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, isinf
from typing import Any, Protocol, runtime_checkable

import numpy as np

from minsnap.basics.arrays import SMALLEST, ArrayLike, FloatArray, ReadOnly, numbers, set_fields
from minsnap.basics.checks import check_array, has_method
from minsnap.basics.messages import shown
from minsnap.errors import CorridorError


@runtime_checkable
class Obstacle(Protocol):
    """A convex set that vehicles keep out of: a ball in scaled coordinates, cut by slabs along the axes."""

    def numbers(self) -> FloatArray:
        """Return center (3), scale (3), radius (below 0 for no ball), lower and upper bounds (3 each), shape (13,)."""
        ...


def clearance_of(obstacle: Obstacle, point: FloatArray) -> float:
    """Return how far a point (3,) is from an obstacle, at least, negative inside [m]."""
    return float(clearances_of(obstacle, point))


def clearances_of(obstacle: Obstacle, points: FloatArray) -> FloatArray:
    """Return how far points (..., 3) are from an obstacle, at least, negative inside, shape (...) [m]."""
    center, scale, (radius,), low, high = np.split(obstacle.numbers(), (3, 6, 7, 10))
    flat = np.maximum(points - high, low - points).max(axis=-1)
    round_ = np.sqrt(((scale * (points - center)) ** 2).sum(axis=-1)) - radius
    return np.asarray(flat if radius < 0.0 else np.maximum(flat, round_))


@dataclass(frozen=True, eq=False)
class Cylinder(ReadOnly):
    """A vertical cylinder.

    Parameters
    ----------
    center : array_like, shape (2,)
        x and y of its axis [m].
    radius : float
        [m].
    low, high : float
        Heights of its ends [m]; by default from minus infinity to infinity.

    Raises
    ------
    CorridorError
        If a number is none, the radius is not positive, or ``low`` is not below ``high``.
    """

    center: FloatArray
    radius: float
    low: float = -inf
    high: float = inf

    def __init__(self, center: ArrayLike, radius: float, low: float = -inf, high: float = inf) -> None:
        axis = check_array("the center of a cylinder", center, ((2,),), "x and y [m]", CorridorError)
        give = "a positive number [m]"
        size = check_array("the radius of a cylinder", radius, ((),), give, CorridorError, SMALLEST)
        ends = numbers((low, high))
        if ends is None or ends.shape != (2,) or not ends[0] < ends[1]:
            raise CorridorError(f"a cylinder runs from {shown(low)} to {shown(high)}: give low below high [m]")
        set_fields(self, center=axis, radius=float(size), low=float(ends[0]), high=float(ends[1]))

    def numbers(self) -> FloatArray:
        """Return its thirteen numbers; see ``Obstacle``."""
        bounds = (-inf, -inf, self.low, inf, inf, self.high)
        return np.array([*self.center, 0.0, 1.0, 1.0, 0.0, self.radius, *bounds])


@dataclass(frozen=True, eq=False)
class Ellipsoid(ReadOnly):
    """An ellipsoid along the axes; a sphere, if its half-axes are one number.

    Parameters
    ----------
    center : array_like, shape (3,)
        [m].
    half_axes : float or array_like, shape (3,)
        [m].

    Raises
    ------
    CorridorError
        If a number is none, or a half-axis is not positive.
    """

    center: FloatArray
    half_axes: FloatArray

    def __init__(self, center: ArrayLike, half_axes: ArrayLike) -> None:
        middle = check_array("the center of an ellipsoid", center, ((3,),), "x, y and z [m]", CorridorError)
        what, give = "the half-axes of an ellipsoid", "one positive number, or three [m]"
        axes = check_array(what, half_axes, ((), (3,)), give, CorridorError, SMALLEST)
        set_fields(self, center=middle, half_axes=axes + np.zeros(3))

    def numbers(self) -> FloatArray:
        """Return its thirteen numbers; see ``Obstacle``."""
        least = float(self.half_axes.min())
        return np.array([*self.center, *(least / self.half_axes), least, *(-inf,) * 3, *(inf,) * 3])


@dataclass(frozen=True, eq=False)
class Cuboid(ReadOnly):
    """A box along the axes that vehicles keep out of.

    Parameters
    ----------
    lower, upper : array_like, shape (3,)
        Opposite corners [m]; infinite where it has no end.

    Raises
    ------
    CorridorError
        If a lower bound is not below its upper one.
    """

    lower: FloatArray
    upper: FloatArray

    def __init__(self, lower: ArrayLike, upper: ArrayLike) -> None:
        low, high = numbers(lower), numbers(upper)
        if low is None or high is None or low.shape != (3,) or high.shape != (3,) or not (low < high).all():
            raise CorridorError(
                f"a cuboid runs from {shown(lower)} to {shown(upper)}: give two corners of three numbers, "
                "the lower below the upper [m]"
            )
        set_fields(self, lower=low, upper=high)

    def numbers(self) -> FloatArray:
        """Return its thirteen numbers; see ``Obstacle``."""
        return np.array([*(0.0,) * 6, -1.0, *self.lower, *self.upper])


NAMED: dict[str, tuple[Callable[[Any], Obstacle], str, int]] = {
    "cylinder": (lambda n: Cylinder(n[:2], n[2], *n[3:]), "x, y, radius and, if it has ends, low and high", 3),
    "ellipsoid": (lambda n: Ellipsoid(n[:3], n[3:]), "x, y, z and three half-axes", 6),
    "cuboid": (lambda n: Cuboid(n[:3], n[3:]), "x, y, z of one corner and of the opposite one", 6),
}
"""Obstacles by the names that files have for them, from plain numbers; which these are, and the least count."""


def named_obstacle(kind: str, values: Sequence[float]) -> Obstacle:
    """Return an obstacle from its name and its numbers [m].

    Raises
    ------
    CorridorError
        If there is none of that name, or it takes other numbers.
    """
    if kind not in NAMED:
        raise CorridorError(f"no obstacle is called {shown(kind)}: choose one of {', '.join(NAMED)}")
    make, what, least = NAMED[kind]
    if len(values) not in (least, least if least == 6 else 5):
        raise CorridorError(f"a {kind} has {len(values)} numbers: give {what} [m]")
    return make(values)


def name_of(obstacle: Obstacle) -> tuple[str, list[float]]:
    """Return the name and the numbers from which :func:`named_obstacle` makes an obstacle again.

    Raises
    ------
    CorridorError
        If it is of another kind.
    """
    if isinstance(obstacle, Cylinder):
        ends = [] if isinf(obstacle.low) and isinf(obstacle.high) else [obstacle.low, obstacle.high]
        return "cylinder", [*obstacle.center.tolist(), obstacle.radius, *ends]
    if isinstance(obstacle, Ellipsoid):
        return "ellipsoid", [*obstacle.center.tolist(), *obstacle.half_axes.tolist()]
    if isinstance(obstacle, Cuboid):
        return "cuboid", [*obstacle.lower.tolist(), *obstacle.upper.tolist()]
    raise CorridorError(f"an obstacle of kind {type(obstacle).__name__} has no description: give one of the library's")


def named_obstacles(avoid: Sequence[Obstacle]) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """Return obstacles as documents hold them, by their names and numbers."""
    return tuple((name, tuple(values)) for name, values in map(name_of, avoid))


def as_obstacles(avoid: Any) -> tuple[Obstacle, ...]:
    """Return the argument ``avoid`` as obstacles: one, several or none."""
    if avoid is None:
        return ()
    obstacles = tuple(avoid) if isinstance(avoid, Sequence) else (avoid,)
    for obstacle in obstacles:
        if not has_method(obstacle, "numbers"):
            raise CorridorError(f"avoid has {shown(obstacle)}: give cylinders, ellipsoids and cuboids")
    return obstacles
