"""How far a trajectory uses each limit: exact maxima of polynomials and of their quotients."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.polynomials.bernstein import differentiate, multiply, squared_norm
from minsnap.polynomials.extrema import maximum
from minsnap.polynomials.ratios import largest_ratio
from minsnap.trajectory.heading import ConstantHeading, RemappedHeading, VelocityHeading
from minsnap.trajectory.path import Heading
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.tilt_heading import TiltHeading
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.turn_rates import largest_turn_rate

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits


VANISHING = 1e-20
"""Squared thrust, over gravity squared, below which its direction is lost and the body rate infinite."""

YAW_RATE = 200
"""Samples a leg of a yaw rate that is not a polynomial."""


Found = tuple[float, int, float]
"""Value, piece and place on [0, 1]."""


def measure_all(limits: Limits, traj: Trajectory) -> tuple[Utilisation, ...]:
    """Measure every limit that is set, in the order of its fields."""
    return tuple(_Measures(limits, traj).all())


def measure_state(limits: Limits, derivatives: Mapping[int, FloatArray], dim: int) -> tuple[Utilisation, ...]:
    """Measure a single instant.

    Parameters
    ----------
    derivatives : mapping of int to ndarray, shape (dim,)
        By order; those missing are zero.
    dim : int
    """
    instant = Trajectory(np.zeros((1, 1, dim)), np.ones(1))
    known = {order: derivatives.get(order, np.zeros(dim)).reshape(1, 1, dim) for order in range(1, 5)}
    return tuple(_Measures(limits, instant, known).all())


class _Measures:
    """Derivatives of one trajectory, computed once, and the measures taken from them."""

    def __init__(self, limits: Limits, traj: Trajectory, known: dict[int, FloatArray] | None = None) -> None:
        self.limits, self.traj = limits, traj
        self._cache = known or {}

    def all(self) -> Iterator[Utilisation]:
        """Go through the limits that are set."""
        takers: dict[str, Callable[[], Found]] = {
            **{
                name: self._normed(order)
                for name, order in (("speed", 1), ("acceleration", 2), ("jerk", 3), ("snap", 4))
            },
            "horizontal_speed": lambda: self._norm(self._order(1)[..., :2]),
            "horizontal_acceleration": lambda: self._norm(self._order(2)[..., :2]),
            "climb_speed": lambda: maximum(self._order(1)[..., 2]),
            "descent_speed": lambda: maximum(-self._order(1)[..., 2]),
            "vertical_speed": lambda: self._absolute(self._order(1)[..., 2:]),
            "vertical_acceleration": lambda: self._absolute(self._order(2)[..., 2:]),
            "max_thrust": lambda: self._scaled(self._norm(self._thrust()), 1.0 / self.limits.gravity),
            "min_thrust": self._least_thrust,
            "tilt": self._tilt,
            "body_rate": self._body_rate,
        }
        for name, limit in self.limits.given().items():
            yield self._yaw_rate(limit) if name == "yaw_rate" else self._used(name, limit, takers[name]())

    def _used(self, name: str, limit: float, found: Found) -> Utilisation:
        value, piece, s = found
        fraction = limit / value if name == "min_thrust" and value > 0.0 else value / limit
        if name == "min_thrust" and value <= 0.0:
            fraction = np.inf
        instant = float(self.traj.breaks[piece] + s * self.traj.durations[piece])
        return Utilisation(name, value, limit, float(max(fraction, 0.0)), piece // self.traj.pieces, instant)

    def _order(self, order: int) -> FloatArray:
        if order not in self._cache:
            points = differentiate(self.traj.control_points, order)
            self._cache[order] = points / self.traj.durations[:, None, None] ** order
        return self._cache[order]

    def _thrust(self) -> FloatArray:
        thrust = self._order(2).copy()
        thrust[..., 2] += self.limits.gravity
        return thrust

    def _normed(self, order: int) -> Callable[[], Found]:
        take = self._norm if self.limits.norm == "euclidean" else self._absolute
        return lambda: take(self._order(order))

    def _norm(self, points: FloatArray) -> Found:
        size = float(np.abs(points).max()) or 1.0
        value, piece, s = maximum(squared_norm(points / size))
        return size * float(np.sqrt(max(value, 0.0))), piece, s

    def _absolute(self, points: FloatArray) -> Found:
        both = np.concatenate((points, -points), axis=2).transpose(0, 2, 1)
        value, row, s = maximum(both.reshape(-1, points.shape[1]))
        return value, row // both.shape[1], s

    def _scaled(self, found: Found, factor: float) -> Found:
        return found[0] * factor, found[1], found[2]

    def _least_thrust(self) -> Found:
        value, piece, s = maximum(-squared_norm(self._thrust() / self.limits.gravity))
        return float(np.sqrt(max(-value, 0.0))), piece, s

    def _tilt(self) -> Found:
        """Largest angle of the thrust to the vertical; its tangent is a quotient while the thrust points up."""
        thrust = self._thrust() / self.limits.gravity
        lowest, piece, s = maximum(-thrust[..., 2])
        if lowest >= 0.0:
            return np.pi / 2.0 if lowest == 0.0 else np.pi, piece, s
        value, piece, s = largest_ratio(squared_norm(thrust[..., :2]), squared_norm(thrust[..., 2:]))
        return float(np.arctan(np.sqrt(max(value, 0.0)))), piece, s

    def _body_rate(self) -> Found:
        """Largest rate at which the thrust direction turns: |j x f|^2 over |f|^4, f over g for scale."""
        thrust = self._thrust() / self.limits.gravity
        jerk = self._order(3) / self.limits.gravity
        square = squared_norm(thrust)
        highest, piece, s = maximum(-square)
        if highest >= -VANISHING:
            return np.inf, piece, s
        cross = [
            multiply(jerk[..., a], thrust[..., b]) - multiply(jerk[..., b], thrust[..., a])
            for a, b in ((1, 2), (2, 0), (0, 1))
        ]
        top = sum(multiply(part, part) for part in cross)
        bottom = multiply(square, square)
        value, piece, s = largest_ratio(_elevated(np.asarray(top), bottom.shape[1]), bottom)
        return float(np.sqrt(max(value, 0.0))), piece, s

    def _yaw_rate(self, limit: float) -> Utilisation:
        heading: Heading = self.traj.yaw
        rate = 1.0
        while isinstance(heading, RemappedHeading) and heading.start == 0.0:
            rate *= heading.rate
            heading = heading.heading
        if isinstance(heading, PlannedHeading):
            value, instant = heading.trajectory.max_norm(1)
            return self._yaw_used(value * rate, limit, instant / rate, "exact")
        if isinstance(heading, (ConstantHeading, TiltHeading)):
            return self._yaw_used(0.0, limit, 0.0, "exact")
        if isinstance(heading, VelocityHeading):
            value, instant = largest_turn_rate(self.traj)
            return self._yaw_used(value, limit, instant, "exact")
        grid = self.traj.breaks[:-1, None] + self.traj.durations[:, None] * np.linspace(0.0, 1.0, YAW_RATE)
        instants = np.minimum(grid.reshape(-1), self.traj.duration)
        rates = np.abs(self.traj.yaw(instants, 1))
        return self._yaw_used(float(rates.max()), limit, float(instants[rates.argmax()]), "sampled")

    def _yaw_used(self, value: float, limit: float, instant: float, method: str) -> Utilisation:
        breaks = self.traj.leg_breaks
        leg = int(np.clip(np.searchsorted(breaks, instant, side="right") - 1, 0, len(breaks) - 2))
        return Utilisation("yaw_rate", value, limit, value / limit, leg, instant, method)


def _elevated(points: FloatArray, size: int) -> FloatArray:
    """Write the same scalar polynomials with ``size`` control points."""
    return multiply(points, np.ones((len(points), size - points.shape[1] + 1)))
