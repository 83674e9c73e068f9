r"""The quantities that limits bound, each in three forms: exact over all time, at samples, and as walls of the QP.

With gravity g up against :math:`e_3`, :math:`f = \ddot r + g e_3` is the thrust per mass (D. Mellinger and V. Kumar,
ICRA 2011): its norm over g is the thrust-to-weight ratio, its angle to the vertical the tilt, and
:math:`\|\dddot r \times f\| / \|f\|^2` the rate at which the thrust direction turns, the roll and pitch body rate.
All are polynomials or quotients of polynomials on every piece, so all maxima are exact. Those of thrust, tilt and body
rate come from :mod:`minsnap.native.thrust_axis` where it knows them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from math import tan
from typing import Any, NamedTuple, Protocol

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT, ROUNDING
from minsnap.corridors.constraint import Walls
from minsnap.native.proved_extrema import maximum
from minsnap.polynomials.bernstein import elevate, multiply, squared_norm
from minsnap.polynomials.enclosures import Enclosure, derivative
from minsnap.polynomials.extrema import halved_to_like_sizes, largest_ratio
from minsnap.trajectory.medium import Medium, norm
from minsnap.trajectory.samples import Samples
from minsnap.trajectory.trajectory import Trajectory

Bound = float | FloatArray
"""Of all legs, or one of each, (legs,)."""

Peak = tuple[float, int, float]
"""Largest value, its piece, and its place on [0, 1]."""


class Motion:
    """Derivatives of position, computed once each: control points of all pieces, or values at samples.

    Parameters
    ----------
    order : callable
        Gives a derivative, shape (..., dim).
    norm : {"euclidean", "axis"}
        Of speed, acceleration, jerk and snap.
    medium : Medium
        Of control points without drag.
    enclosed : callable, optional
        Returns the same control points with bounds of their rounding; by default they are exact.
    """

    def __init__(
        self,
        order: Callable[[int], FloatArray],
        norm: str,
        medium: Medium,
        enclosed: Callable[[int], Enclosure] | None = None,
    ) -> None:
        self.order, self.norm, self.medium = cache(order), norm, medium
        self.enclosed = cache(enclosed or (lambda number: _exactly(self.order(number))))

    def axis(self, derivatives: int = 0) -> tuple[FloatArray, ...]:
        """Vector along the thrust axis over gravity, and its derivatives."""
        medium = self.medium
        if not medium.drags:
            upright = self.order(2) / medium.gravity + np.array([0.0, 0.0, 1.0])
            return upright, *(self.order(3 + k) / medium.gravity for k in range(derivatives))
        forces = medium.lift(*(self.order(k) for k in range(1, 3 + derivatives)))
        return tuple(part / medium.gravity for part in forces)

    def thrust(self) -> FloatArray:
        """Thrust over weight."""
        force = self.axis()[0]
        if not self.medium.drags:
            return force
        size = norm(force)[..., None]
        total = self.medium.thrust(force * self.medium.gravity, self.order(1))[..., None] / self.medium.gravity
        return np.asarray(force * (total / np.where(size == 0.0, np.inf, size)))


def exact_motion(traj: Trajectory, norm: str, gravity: float) -> Motion:
    """Return control points of a trajectory's derivatives, (pieces, n + 1, dim); without drag."""
    enclosed = cache(partial(derivative, traj.control_points, traj.durations))
    return Motion(lambda order: enclosed(order).points, norm, Medium(gravity), enclosed)


def sampled_motion(samples: Samples, norm: str, medium: Medium) -> Motion:
    """Return derivatives at samples, (m, dim); a missing derivative raises TypeError."""
    names = ("position", "velocity", "acceleration", "jerk", "snap")
    return Motion(lambda number: _there(getattr(samples, names[number])), norm, medium)


class Extent(NamedTuple):
    """Size of the walls to build."""

    legs: int
    dim: int


class Measure(Protocol):
    """The quantity that a limit bounds."""

    def largest(self, motion: Motion, order: int) -> Peak:
        """Return the largest value over all time (the smallest of a lower bound)."""
        ...

    def sampled(self, motion: Motion, order: int) -> FloatArray:
        """Return the values at samples, shape (m,)."""
        ...

    def walls(self, extent: Extent, limit: Any, name: str, order: int, norm: str, gravity: float) -> list[Walls]:
        """Return the limit as convex sets; none where it is not convex."""
        ...


_UP = slice(2, 3)
"""The vertical coordinate."""


class _Part:
    """Some coordinates of a derivative: their Euclidean norm, each of all with ``norm="axis"``, or one side of one."""

    def __init__(self, columns: slice = slice(None), sign: int = 0) -> None:
        self.columns, self.sign = columns, sign

    def largest(self, motion: Motion, order: int) -> Peak:
        curve = motion.enclosed(order)
        part = Enclosure(curve.points[..., self.columns], curve.errors[..., self.columns])
        return _largest_component(part, self.sign) if self._single(motion.norm) else _largest_norm(part)

    def sampled(self, motion: Motion, order: int) -> FloatArray:
        values = motion.order(order)[:, self.columns]
        if self.sign:
            return np.maximum(self.sign * values[:, 0], 0.0)
        return np.asarray(np.abs(values).max(axis=1) if self._single(motion.norm) else np.linalg.norm(values, axis=1))

    def walls(self, extent: Extent, limit: Any, name: str, order: int, norm: str, gravity: float) -> list[Walls]:
        axes = np.eye(extent.dim)[self.columns]
        if not self._single(norm):
            return [_ball(extent, axes, limit, order, name)]
        bounds = (-np.inf if self.sign > 0 else -limit), (np.inf if self.sign < 0 else limit)
        return [_faces(extent, axis, bounds, order, name) for axis in axes]

    def _single(self, norm: str) -> bool:
        return self.columns == _UP or (norm == "axis" and self.columns == slice(None))


class _Thrust:
    """Thrust over weight: a ball around free fall; for a least thrust its vertical part, which is sufficient."""

    def __init__(self, least: bool = False) -> None:
        self.least = least

    def largest(self, motion: Motion, order: int) -> Peak:
        if not self.least:
            return _largest_norm(_exactly(motion.thrust()))
        value, piece, s = maximum(-squared_norm(motion.thrust()))
        return float(np.sqrt(max(-value, 0.0))), piece, s

    def sampled(self, motion: Motion, order: int) -> FloatArray:
        return np.asarray(np.linalg.norm(motion.thrust(), axis=1))

    def walls(self, extent: Extent, limit: float, name: str, order: int, norm: str, gravity: float) -> list[Walls]:
        if self.least:
            return [_faces(extent, np.eye(3)[2], ((limit - 1.0) * gravity, np.inf), 2, name)]
        return [_ball(extent, np.eye(3), limit * gravity, 2, name, anchor=(0.0, 0.0, -gravity))]


class _Tilt:
    """Angle of the thrust to the vertical; its tangent is a quotient of polynomials while the thrust points up.

    The walls are a cone that opens upwards from free fall, and a half-space that holds its upper half alone.
    """

    def largest(self, motion: Motion, order: int) -> Peak:
        thrust = motion.thrust()
        lowest, piece, s = maximum(-thrust[..., 2])
        if lowest >= 0.0:
            return np.pi / 2.0 if lowest == 0.0 else np.pi, piece, s
        value, piece, s = largest_ratio(squared_norm(thrust[..., :2]), squared_norm(thrust[..., 2:]), maximum)
        return float(np.arctan(np.sqrt(max(value, 0.0)))), piece, s

    def sampled(self, motion: Motion, order: int) -> FloatArray:
        thrust = motion.thrust()
        flat = ~thrust.any(axis=1)  # free fall: no thrust has no direction
        return np.asarray(np.where(flat, np.pi / 2.0, np.arctan2(np.linalg.norm(thrust[:, :2], axis=1), thrust[:, 2])))

    def walls(self, extent: Extent, limit: float, name: str, order: int, norm: str, gravity: float) -> list[Walls]:
        slope = tan(limit)  # NumPy's differs from processor to processor
        up = _faces(extent, np.eye(3)[2], (-(1.0 - EXACT) * gravity, np.inf), 2, name)
        return [up, _ball(extent, np.eye(2, 3), slope * gravity, 2, name, slope=(0.0, 0.0, slope))]


class _BodyRate:
    """Rate at which the thrust direction turns, squared |j x f|^2 over |f|^4; not convex: linearised in searches."""

    def largest(self, motion: Motion, order: int) -> Peak:
        parts = halved_to_like_sizes(*motion.axis(1))
        value, part, s = self._largest_on(*parts.curves)
        return value, int(parts.row[part]), float(parts.low[part] + s * parts.width[part])

    @staticmethod
    def _largest_on(thrust: FloatArray, jerk: FloatArray) -> Peak:
        square = squared_norm(thrust)
        highest, piece, s = maximum(-square)
        if highest >= -(ROUNDING**2):
            return np.inf, piece, s
        cross = multiply(_rows(jerk, 1), _rows(thrust, 2)) - multiply(_rows(jerk, 2), _rows(thrust, 1))
        top, bottom = multiply(cross, cross).reshape(3, len(square), -1).sum(axis=0), multiply(square, square)
        value, piece, s = largest_ratio(elevate(top, bottom.shape[1]), bottom, maximum)
        return float(np.sqrt(max(value, 0.0))), piece, s

    def sampled(self, motion: Motion, order: int) -> FloatArray:
        thrust, jerk = motion.axis(1)
        square = (thrust * thrust).sum(axis=1)
        turns = square > ROUNDING**2
        rate = np.linalg.norm(np.cross(jerk, thrust), axis=1) / np.where(turns, square, 1.0)
        return np.asarray(np.where(turns, rate, np.inf))

    def walls(self, extent: Extent, limit: float, name: str, order: int, norm: str, gravity: float) -> list[Walls]:
        return []


MEASURES: dict[str, Measure] = {
    "norm": _Part(),
    "horizontal": _Part(slice(0, 2)),
    "upwards": _Part(_UP, 1),
    "downwards": _Part(_UP, -1),
    "vertical": _Part(_UP),
    "thrust": _Thrust(),
    "least_thrust": _Thrust(least=True),
    "tilt": _Tilt(),
    "body_rate": _BodyRate(),
}
"""By name; the yaw rate, which is no function of the position, is measured where limits are."""


def _exactly(points: FloatArray) -> Enclosure:
    return Enclosure(points, np.zeros_like(points))


def _rows(points: FloatArray, turned: int) -> FloatArray:
    """Coordinates one after the other, from one of them on: (pieces, n, 3) to (3 pieces, n)."""
    return np.roll(points, -turned, axis=2).transpose(2, 0, 1).reshape(-1, points.shape[1])


def _largest_norm(curve: Enclosure) -> Peak:
    size = float(np.abs(curve.points).max()) or 1.0
    scaled = Enclosure(curve.points / size, curve.errors / size)
    square = scaled.squared_norm() if curve.errors.any() else _exactly(squared_norm(scaled.points))
    value, piece, s = maximum(square.points, square.errors)
    return size * float(np.sqrt(max(value, 0.0))), piece, s


def _largest_component(curve: Enclosure, sign: int) -> Peak:
    """Largest coordinate upwards (1), downwards (-1) or both ways (0)."""
    sides = (sign,) if sign else (1, -1)
    both = np.concatenate([side * curve.points for side in sides], axis=2).transpose(0, 2, 1)
    errors = np.concatenate([curve.errors] * len(sides), axis=2).transpose(0, 2, 1)
    value, row, s = maximum(both.reshape(-1, both.shape[2]), errors.reshape(-1, both.shape[2]))
    return value, row // both.shape[1], s


def _ball(
    extent: Extent, matrix: FloatArray, radius: Bound, order: int, name: str, anchor: Any = None, slope: Any = None
) -> Walls:
    rows = [np.zeros((extent.legs, extent.dim)) + (0.0 if each is None else each) for each in (anchor, slope)]
    matrices = np.zeros((extent.legs, *matrix.shape)) + matrix
    radii = np.zeros(extent.legs) + radius
    return Walls.unchecked(np.arange(extent.legs), matrices, *rows, radii, radii, order, name)


def _faces(extent: Extent, normal: FloatArray, bounds: tuple[Bound, Bound], order: int, name: str) -> Walls:
    zeros = np.zeros((extent.legs, extent.dim))
    lower, upper = (np.zeros(extent.legs) + bound for bound in bounds)
    widths = np.minimum(np.abs(lower), np.abs(upper))
    return Walls.planes(np.arange(extent.legs), zeros + normal, zeros, lower, upper, widths, order, name)


def _there(values: FloatArray | None) -> FloatArray:
    if values is None:
        raise TypeError("a quantity that the samples do not have")
    return values
