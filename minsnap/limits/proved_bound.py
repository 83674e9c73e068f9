"""Proof of largest values of quantities along a path, by interval bounds on ever smaller parts."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.polynomials.bernstein import differentiate, elevate, subdivide
from minsnap.polynomials.intervals import Interval, Vector, along, dot, length, plus, times
from minsnap.trajectory.medium import Medium

if TYPE_CHECKING:
    from minsnap.trajectory.trajectory import Trajectory

MARGIN = 5e-4
"""Share added to the largest of many samples, below which interval bounds prove that all values stay."""

ROUNDS, PARTS, MOST = 9, 4, 400_000
"""How often, into how many parts, and up to how many parts in all a piece is divided for the proof."""


def proved(
    values: FloatArray, bounds: Callable[[Lift, FloatArray, FloatArray], FloatArray], medium: Medium, traj: Trajectory
) -> FloatArray:
    """Return values (count,) of quantities, raised until interval bounds prove that none goes beyond.

    Parameters
    ----------
    bounds : callable
        From ranges of the motion on parts that begin at instants and are so wide [s] to bounds (count, parts).
    """
    points, start, width = _pieces(medium, traj)
    for level in range(ROUNDS):
        with np.errstate(all="ignore"):
            found = bounds(Lift.of(medium.quadratic, points), start, width)
        found = np.where(np.isnan(found), np.inf, found)
        open_ = (found > values[:, None]).any(axis=0)
        if not open_.any():
            return values
        parts = PARTS if level else 8 * PARTS
        if open_.sum() * parts > MOST or level == ROUNDS - 1:
            break
        points, start, width = _divided(points[open_], start[open_], width[open_], parts)
    return np.asarray(np.maximum(values, found.max(axis=1)))


def _pieces(medium: Medium, traj: Trajectory) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return control points (pieces, rows, n), and begin and length of the pieces [s].

    Those of f with linear drag and its two derivatives; where there is drag, also of velocity to jerk.
    """
    control, durations = traj.control_points, traj.durations
    size = max(control.shape[1] - (1 if medium.drags else 2), 1)
    orders = {
        order: elevate((differentiate(control, order) / durations[:, None, None] ** order).transpose(0, 2, 1), size)
        for order in range(1 if medium.drags else 2, 5)
    }
    lift = [orders[order] + (medium.linear * orders[order - 1] if medium.drags else 0.0) for order in (2, 3, 4)]
    lift[0] = lift[0] + np.array([0.0, 0.0, medium.gravity])[:, None]
    rest = [orders[order] for order in (1, 2, 3)] if medium.drags else []
    return np.concatenate((*lift, *rest), axis=1), traj.breaks[:-1], durations


class Lift:
    """Ranges of f along the thrust axis, its derivatives, and the velocity where there is drag.

    Parameters
    ----------
    force, change, bend : Vector
        f [m/s^2] and its first and second derivative.
    velocity : Vector or None
        [m/s].
    """

    def __init__(self, force: Vector, change: Vector, bend: Vector, velocity: Vector | None) -> None:
        self.force, self.change, self.bend, self.velocity = force, change, bend, velocity

    @classmethod
    def of(cls, quadratic: float, points: FloatArray) -> Lift:
        r"""Return ranges from control points of the pieces or of parts of them; see ``_pieces``.

        The quadratic drag's :math:`q |v| v` is differentiated in a form without quotients by the speed: with the
        direction :math:`e = v / |v|` the derivative of the speed is :math:`e \cdot a`, and the second one times v is
        :math:`e\,(a \cdot a + v \cdot j - (e \cdot a)^2)`.
        """
        low, high = points.min(axis=2), points.max(axis=2)
        ranges = [Interval(low[:, i], high[:, i]) for i in range(points.shape[1])]
        force, change, bend, *rest = (tuple(ranges[i : i + 3]) for i in range(0, len(ranges), 3))
        if not rest:
            return cls(force, change, bend, None)  # type: ignore[arg-type]
        velocity, acceleration, jerk = rest
        if quadratic:
            direction, speed = along(velocity), length(velocity).scaled(quadratic)  # type: ignore[arg-type]
            first = dot(direction, acceleration)  # type: ignore[arg-type]
            bent = dot(acceleration, acceleration) + dot(velocity, jerk) - first.squared()  # type: ignore[arg-type]
            growth = first.scaled(quadratic)
            force = plus(force, times(velocity, speed))  # type: ignore[arg-type]
            change = plus(change, times(velocity, growth), times(acceleration, speed))  # type: ignore[arg-type]
            more = times(direction, bent.scaled(quadratic)), times(acceleration, growth.scaled(2.0))  # type: ignore[arg-type]
            bend = plus(bend, *more, times(jerk, speed))  # type: ignore[arg-type]
        return cls(force, change, bend, velocity)  # type: ignore[arg-type]

    def thrust(self, more_linear: float, more_quadratic: float) -> Interval:
        """Range of the thrust per mass."""
        size = length(self.force)
        if self.velocity is None:
            return size
        share = length(self.velocity).scaled(more_quadratic).shifted(more_linear)
        return size + share * dot(along(self.force), self.velocity)


def _divided(
    points: FloatArray, start: FloatArray, width: FloatArray, parts: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    count, rows, size = points.shape
    finer = subdivide(points.reshape(-1, size), parts).reshape(count, rows, parts, size).transpose(0, 2, 1, 3)
    begins = start[:, None] + width[:, None] * np.arange(parts) / parts
    return finer.reshape(-1, rows, size), begins.reshape(-1), np.repeat(width / parts, parts)
