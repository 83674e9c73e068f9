"""A heading that follows from the tilt alone: the body never spins about its thrust axis."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import YawError
from minsnap.trajectory.heading import Heading, Largest, RuledHeading, nearest_turn
from minsnap.trajectory.medium import AIRLESS, Medium
from minsnap.trajectory.path import Path
from minsnap.trajectory.transport import Frame, Transport, carried, least_rotation, lift_of

CELL_SAMPLES = 16
"""Instants a cell at which the turns of the yaw are counted."""

VERTICAL = 1e-12
"""Squared length of the lateral axis seen from above below which its direction, the yaw, is held."""


class TiltHeading(RuledHeading):
    r"""Yaw of a vehicle that turns only as its thrust axis tilts, and never spins about it.

    Called, it gives the yaw angle :math:`\psi` of that attitude, :math:`y_B \perp (\cos\psi, \sin\psi, 0)`, and its
    derivatives; ``axes`` and ``forward`` give the attitude itself (see :mod:`minsnap.trajectory.transport`), which is
    regular wherever there is thrust. The yaw angle is not: it has no value where the lateral axis is vertical, beyond
    a tilt of 90 degrees; its rate is zero there.

    The attitude depends on the whole path up to an instant: after a closed lap it has turned by the solid angle that
    the thrust axis went round.

    Parameters
    ----------
    path : Path
        Of two or three coordinates, z up.
    angle : float
        Turn about the thrust axis at the start, from the least rotation from upright [rad].
    medium : Medium
        Gravity, and drag across the thrust axis; drag along it does not matter.

    Raises
    ------
    YawError
        If the path has one coordinate, or more than three.
    """

    what, highest = "a heading from the tilt", 2
    medium: Medium

    def __init__(self, path: Path, angle: float = 0.0, medium: Medium = AIRLESS) -> None:
        if path.dim not in (2, 3):
            raise YawError(f"a heading from the tilt needs two or three coordinates, this path has {path.dim}")
        self.path, self.angle, self.medium = path, float(angle), Medium(*medium.values[:3])

    def _at(self, t: FloatArray, order: int) -> FloatArray:
        return self._yaw(t) if order == 0 else self._yaw_derivative(t, order)

    def axes(self, t: FloatArray) -> Frame:
        """Body axes x, y, z in the world frame at instants (m,), each of shape (3, m)."""
        return self._transport.frame(t)

    def forward(self, t: FloatArray) -> Frame:
        """Forward axis x and its two derivatives at instants (m,), each of shape (3, m)."""
        (x, y, z), (roll, pitch), (_, pitch_rate) = self._turning(t)
        return x, -pitch * z, -pitch_rate * z - pitch * (pitch * x - roll * y)

    def on(self, curve: Path, start: float = 0.0, rate: float = 1.0) -> TiltHeading:
        """Return the heading of another path that begins as this one is turned at an instant [s]."""
        if start == 0.0:
            return TiltHeading(curve, self.angle, self.medium)
        at, upright = np.array([start]), np.zeros(1, dtype=np.bool_)
        level = least_rotation(lift_of(self.path, self.medium, at)[0], upright)
        x = self.axes(at)[0]
        angle = np.arctan2((x * level[1]).sum(), (x * level[0]).sum())
        return TiltHeading(curve, float(angle), self.medium)

    def before(self, other: Heading, curve: Path, switch: float) -> Heading:
        """Return one heading from the tilt where both are one."""
        return super().before(other, curve, switch) if other.medium is None else self.on(curve)

    def largest_rate(self, start: float, end: float) -> Largest:
        """Return the spin about the thrust axis, which is limited in place of the yaw: there is none."""
        return 0.0, start

    def _rule(self) -> dict[str, Any]:
        gravity, *drag = self.medium.values[:3]
        return {"rule": "tilt", "angle_at_start": self.angle, "gravity": gravity, "drag": drag}

    @cached_property
    def _transport(self) -> Transport:
        return carried(self.path, self.angle, self.medium)

    def _turning(self, t: FloatArray) -> tuple[Frame, FloatArray, FloatArray]:
        """Axes, rates (roll, pitch) and their derivatives, (2, m) each, from x . f = y . f = 0 differentiated."""
        x, y, z = self.axes(t)
        thrust, jerk, snap = lift_of(self.path, self.medium, t, 2)
        size, across = np.linalg.norm(thrust, axis=0), np.stack([-y, x])
        rates = (across * jerk).sum(axis=1) / size
        pull = (z * jerk).sum(axis=0) / size
        return (x, y, z), rates, (across * snap).sum(axis=1) / size - 2.0 * pull * rates

    def _yaw(self, t: FloatArray) -> FloatArray:
        grid, known = self._unwrapped
        near, raw = np.interp(t, grid, known), _yaw_of(self.axes(t)[1])
        return nearest_turn(raw, near)

    def _yaw_derivative(self, t: FloatArray, order: int) -> FloatArray:
        """First or second derivative of the angle of the lateral axis, seen from above; y' = roll z without spin."""
        (x, y, z), (roll, pitch), (roll_rate, _) = self._turning(t)
        first = roll * z
        square = y[0] ** 2 + y[1] ** 2
        square = np.where(square > VERTICAL, square, np.inf)
        rate = (y[0] * first[1] - y[1] * first[0]) / square
        if order == 1:
            return np.asarray(rate)
        second = roll_rate * z + roll * (pitch * x - roll * y)
        along = y[0] * first[0] + y[1] * first[1]
        return np.asarray((y[0] * second[1] - y[1] * second[0] - 2.0 * rate * along) / square)

    @cached_property
    def _unwrapped(self) -> tuple[FloatArray, FloatArray]:
        """Instants and the continuous yaw there."""
        grid = self._transport.grid(CELL_SAMPLES)
        return grid, np.unwrap(_yaw_of(self.axes(grid)[1]))


def _yaw_of(lateral: FloatArray) -> FloatArray:
    """Angle of the horizontal direction to which lateral axes (3, m) are perpendicular."""
    return np.asarray(np.arctan2(-lateral[0], lateral[1]))
