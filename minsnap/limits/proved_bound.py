"""Largest values of quantities along a path, sampled and then proved by interval bounds on ever smaller parts."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.limits.vehicle_drag import flat_drag, lateral_alike, medium_of
from minsnap.polynomials.bernstein import differentiate, elevate, subdivide
from minsnap.polynomials.intervals import Interval, Vector, along, dot, length, plus, times

if TYPE_CHECKING:
    from minsnap.trajectory.trajectory import Trajectory
    from minsnap.vehicle import Quadrotor
    from minsnap.vehicle.states import FlatStates

GRID = 256
"""Samples of a piece from which the largest value is taken."""

MARGIN = 5e-4
"""Share added to it, below which interval bounds prove that all values stay."""

ROUNDS, PARTS, MOST = 9, 4, 400_000
"""How often, into how many parts, and up to how many parts in all a piece is divided for the proof."""

Found = tuple[float, float, str]
"""Largest value, instant [s], method."""


class ProvedBound:
    """Largest values of several quantities.

    Parameters
    ----------
    vehicle : Quadrotor
    traj : Trajectory
    """

    margins: FloatArray

    def __init__(self, vehicle: Quadrotor, traj: Trajectory) -> None:
        self.vehicle, self.traj, self.medium = vehicle, traj, medium_of(vehicle)

    def run(self) -> list[Found]:
        """Return the largest value of each quantity, the margin added."""
        t, sampled = self.sampled()
        best, method = sampled.argmax(axis=1), "sampled"
        values = sampled.max(axis=1) + self.margins
        if self._provable and lateral_alike(self.vehicle) and np.isfinite(values).all():
            values, method = self._proved(values), "interval"
        return [(float(value), float(t[i]), method) for value, i in zip(values, best, strict=True)]

    def sampled(self) -> tuple[FloatArray, FloatArray]:
        """Return many instants (m,) [s] and the quantities there, (count, m)."""
        return self._instants, self._quantities(self._states)

    @cached_property
    def _instants(self) -> FloatArray:
        inner = np.linspace(0.0, 1.0, GRID, endpoint=False)
        grid = self.traj.breaks[:-1, None] + self.traj.durations[:, None] * inner
        return np.append(grid.reshape(-1), self.traj.duration)

    @cached_property
    def _states(self) -> FlatStates:
        from minsnap.vehicle import flatness_of

        return flatness_of(self.vehicle, self.traj, self._instants, drag=flat_drag(self.vehicle))

    @property
    def _provable(self) -> bool:
        """Whether there are interval bounds."""
        raise NotImplementedError

    def _quantities(self, states: FlatStates) -> FloatArray:
        """Values at instants, (count, m)."""
        raise NotImplementedError

    def _bounds(self, motion: Lift, start: FloatArray, width: FloatArray) -> FloatArray:
        """Upper bounds on parts that begin at instants and are so wide [s], (count, parts)."""
        raise NotImplementedError

    def _proved(self, values: FloatArray) -> FloatArray:
        """Return the values raised until interval bounds prove them."""
        points, start, width = self._pieces()
        for level in range(ROUNDS):
            with np.errstate(all="ignore"):
                found = self._bounds(Lift.of(self.medium.quadratic, points), start, width)
            found = np.where(np.isnan(found), np.inf, found)
            open_ = (found > values[:, None]).any(axis=0)
            if not open_.any():
                return values
            parts = PARTS if level else 8 * PARTS
            if open_.sum() * parts > MOST or level == ROUNDS - 1:
                break
            points, start, width = _divided(points[open_], start[open_], width[open_], parts)
        return np.asarray(np.maximum(values, found.max(axis=1)))

    def _pieces(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return control points (pieces, rows, n), and begin and length of the pieces [s].

        Those of f with linear drag and its two derivatives; where there is drag, also of velocity to jerk.
        """
        control, durations, medium = self.traj.control_points, self.traj.durations, self.medium
        size = max(control.shape[1] - (1 if medium.drags else 2), 1)
        orders = {
            order: elevate((differentiate(control, order) / durations[:, None, None] ** order).transpose(0, 2, 1), size)
            for order in range(1 if medium.drags else 2, 5)
        }
        lift = [orders[order] + (medium.linear * orders[order - 1] if medium.drags else 0.0) for order in (2, 3, 4)]
        lift[0] = lift[0] + np.array([0.0, 0.0, medium.gravity])[:, None]
        rest = [orders[order] for order in (1, 2, 3)] if medium.drags else []
        return np.concatenate((*lift, *rest), axis=1), self.traj.breaks[:-1], durations


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
        r"""Return ranges from control points of the pieces or of parts of them; see ``ProvedBound._pieces``.

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
