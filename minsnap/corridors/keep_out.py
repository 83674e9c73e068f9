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
from minsnap.corridors.gate_frames import Bar
from minsnap.corridors.moving import Moving
from minsnap.corridors.prism import Prism
from minsnap.errors import CorridorError
from minsnap.trajectory.trajectory import Trajectory


@runtime_checkable
class Obstacle(Protocol):
    """A convex set that vehicles keep out of: a ball in scaled coordinates, cut by slabs along the axes."""

    def numbers(self) -> FloatArray:
        """Return center (3), scale (3), radius (below 0 for no ball), lower and upper bounds (3 each), shape (13,)."""
        ...


Avoided = Obstacle | Moving | Prism
"""What a curve keeps out of: what stands, what moves, and prisms, some of which it keeps inside of."""


def called(obstacles: Sequence[Avoided], which: int) -> str:
    """Return what messages call an obstacle: by its number, or by the gate around which it is."""
    obstacle = obstacles[which]
    if isinstance(obstacle, Bar):
        return obstacle.called(which)
    return f"{'fence' if is_fence(obstacle) else 'obstacle'} {which}"


def is_fence(obstacle: Avoided) -> bool:
    """Whether its inside is where to stay."""
    return isinstance(obstacle, Prism) and obstacle.inclusion


def clearance_of(obstacle: Obstacle, point: FloatArray) -> float:
    """Return how far a point (3,) is from an obstacle, at least, negative inside [m]."""
    return float(clearances_of(obstacle, point))


def clearances_of(obstacle: Obstacle | Prism, points: FloatArray) -> FloatArray:
    """Return how far points (..., 3) are from an obstacle, at least, negative inside, shape (...) [m]."""
    if isinstance(obstacle, Prism):
        return obstacle.clearances(points)
    return clearance_in(obstacle.numbers(), points)


def clearance_in(numbers: FloatArray, points: FloatArray) -> FloatArray:
    """Return the same for the thirteen numbers of an obstacle, or of some, shape (..., 13)."""
    center, scale, radius, low, high = np.split(numbers, (3, 6, 7, 10), axis=-1)
    flat = np.maximum(points - high, low - points).max(axis=-1)
    round_ = np.sqrt(((scale * (points - center)) ** 2).sum(axis=-1)) - radius[..., 0]
    return np.asarray(np.where(radius[..., 0] < 0.0, flat, np.maximum(flat, round_)))


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


NAMED: dict[str, tuple[Callable[[Any], Avoided], str, tuple[int, ...]]] = {
    "cylinder": (lambda n: Cylinder(n[:2], n[2], *n[3:]), "x, y, radius and, if it has ends, low and high", (3, 5)),
    "ellipsoid": (lambda n: Ellipsoid(n[:3], n[3:]), "x, y, z and three half-axes", (6,)),
    "cuboid": (lambda n: Cuboid(n[:3], n[3:]), "x, y, z of one corner and of the opposite one", (6,)),
    "prism": (lambda n: _named_prism(n), "the number of corners, x and y of each, and low and high if it has ends", ()),
    "fence": (lambda n: _named_prism(n, True), "the number of corners, x and y of each, and low and high if any", ()),
    "bar": (lambda n: _named_bar(n), "the gate, -1 for none, by how much it is larger, and the numbers of a prism", ()),
    "moving": (lambda n: _named_rows(n), "radius, growth, 2 or 3, and rows of t and as many coordinates", ()),
    "moving_curve": (
        lambda n: _named_curve(n),
        "radius, growth, 2 or 3, the degree, when it begins, and of each piece its duration and control points",
        (),
    ),
}
"""Obstacles by the names that files have for them, from plain numbers; which these are, and how many there may be."""


def _named_prism(n: Sequence[float], inclusion: bool = False) -> Prism:
    """Return a prism from the number of corners, their places, and its ends."""
    corners = int(n[0]) if len(n) > 6 and n[0] == int(n[0]) else 0
    if corners < 3 or len(n) not in (1 + 2 * corners, 3 + 2 * corners):
        raise CorridorError(f"a prism has {len(n)} numbers: give {NAMED['prism'][1]} [m]")
    places, ends = n[1 : 1 + 2 * corners], n[1 + 2 * corners :]
    return Prism(np.reshape(places, (-1, 2)), *ends, inclusion=inclusion)


def _named_bar(n: Sequence[float]) -> Bar:
    """Return a bar of a gate's frame from the number of the gate, by how much it is larger, and its prism."""
    if len(n) < 2 or n[0] != int(n[0]):
        raise CorridorError(f"a bar has {len(n)} numbers: give {NAMED['bar'][1]} [m]")
    prism = _named_prism(n[2:])
    return Bar(prism.polygon, prism.low, prism.high, None if n[0] < 0 else int(n[0]), n[1])


def _named_rows(n: Sequence[float]) -> Moving:
    """Return a moving obstacle from its radius, its growth, its dimension, and rows of an instant and a place."""
    dim = int(n[2]) if len(n) > 3 and n[2] in (2, 3) else 0
    if not dim or (len(n) - 3) % (1 + dim):
        raise CorridorError(f"a moving obstacle has {len(n)} numbers: give {NAMED['moving'][1]} [m, m/s, s]")
    return Moving(np.reshape(n[3:], (-1, 1 + dim)), n[0], n[1])


def _named_curve(n: Sequence[float]) -> Moving:
    """Return a moving obstacle from its radius, its growth, its dimension, its degree, its beginning and its pieces."""
    dim, degree = (int(n[2]), int(n[3])) if len(n) > 5 else (0, 0)
    each = 1 + (degree + 1) * dim
    if dim not in (2, 3) or degree < 0 or (len(n) - 5) % each:
        raise CorridorError(f"a moving curve has {len(n)} numbers: give {NAMED['moving_curve'][1]} [m, m/s, s]")
    pieces = np.reshape(n[5:], (-1, each))
    curve = Trajectory(pieces[:, 1:].reshape(-1, degree + 1, dim), pieces[:, 0])
    return Moving(curve, n[0], n[1]).after(-n[4])


def named_obstacle(kind: str, values: Sequence[float]) -> Avoided:
    """Return an obstacle from its name and its numbers [m].

    Raises
    ------
    CorridorError
        If there is none of that name, or it takes other numbers.
    """
    if kind not in NAMED:
        raise CorridorError(f"no obstacle is called {shown(kind)}: choose one of {', '.join(NAMED)}")
    make, what, counts = NAMED[kind]
    if counts and len(values) not in counts:
        raise CorridorError(f"a {kind} has {len(values)} numbers: give {what} [m]")
    return make(values)


def name_of(obstacle: Avoided) -> tuple[str, list[float]]:
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
    if isinstance(obstacle, Moving):
        return _name_of_moving(obstacle)
    if isinstance(obstacle, Prism):
        ends = [] if isinf(obstacle.low) and isinf(obstacle.high) else [obstacle.low, obstacle.high]
        places = [float(len(obstacle.polygon)), *obstacle.polygon.ravel().tolist()]
        if isinstance(obstacle, Bar):
            return "bar", [-1.0 if obstacle.gate is None else float(obstacle.gate), obstacle.clearance, *places, *ends]
        return "fence" if obstacle.inclusion else "prism", [*places, *ends]
    raise CorridorError(f"an obstacle of kind {type(obstacle).__name__} has no description: give one of the library's")


def _name_of_moving(obstacle: Moving) -> tuple[str, list[float]]:
    head, rows, curve = [obstacle.radius, obstacle.growth, float(obstacle.dim)], obstacle.rows(), obstacle.motion
    if rows is not None:
        return "moving", [*head, *(value for row in rows for value in row)]
    pieces = np.column_stack((curve.durations, curve.control_points.reshape(len(curve.durations), -1)))
    return "moving_curve", [*head, float(curve.degree), obstacle.begin, *pieces.ravel().tolist()]


def named_obstacles(avoid: Sequence[Avoided]) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """Return obstacles as documents hold them, by their names and numbers."""
    return tuple((name, tuple(values)) for name, values in map(name_of, avoid))


def as_obstacles(avoid: Any) -> tuple[Avoided, ...]:
    """Return the argument ``avoid`` as obstacles: one, several or none."""
    if avoid is None:
        return ()
    obstacles = tuple(avoid) if isinstance(avoid, Sequence) else (avoid,)
    for obstacle in obstacles:
        if not (isinstance(obstacle, Moving | Prism) or has_method(obstacle, "numbers")):
            raise CorridorError(f"avoid has {shown(obstacle)}: give cylinders, ellipsoids and cuboids, Prism or Moving")
    return obstacles


def standing_at(obstacle: Moving, instants: FloatArray) -> list[Obstacle]:
    """Return a moving obstacle as it is at instants (m,) [s]."""
    pairs = zip(obstacle.center(instants), obstacle.radius_at(instants).tolist(), strict=True)
    return [Cylinder(at, radius) if obstacle.dim == 2 else Ellipsoid(at, radius) for at, radius in pairs]


def as_still(avoid: Any) -> tuple[Obstacle | Prism, ...]:
    """Return obstacles none of which moves.

    Raises
    ------
    CorridorError
        If one of them does.
    """
    obstacles = as_obstacles(avoid)
    still = tuple(each for each in obstacles if not isinstance(each, Moving))
    if len(still) < len(obstacles):
        which = next(which for which, each in enumerate(obstacles) if isinstance(each, Moving))
        raise CorridorError(f"obstacle {which} moves: plan takes it; a fleet has it as a vehicle of fixed=")
    return still


def as_simple(avoid: Any) -> tuple[Obstacle, ...]:
    """Return obstacles that are cylinders, ellipsoids and cuboids.

    Raises
    ------
    CorridorError
        If one of them moves, or is a prism.
    """
    still = as_still(avoid)
    simple = tuple(each for each in still if not isinstance(each, Prism))
    if len(simple) < len(still):
        which = next(which for which, each in enumerate(still) if isinstance(each, Prism))
        raise CorridorError(f"obstacle {which} is a prism: fleets take cylinders, ellipsoids and cuboids, and a room")
    return simple
