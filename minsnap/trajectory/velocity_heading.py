"""A heading along the velocity that is held, and turned at a limited rate, where the path is slow."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, set_fields
from minsnap.basics.checks import check_positive
from minsnap.errors import YawError
from minsnap.native.shortest_time import InstantKind, InstantLimit
from minsnap.trajectory.heading import Heading, Largest, RuledHeading, nearest_turn
from minsnap.trajectory.held_turns import HeadingTable, Turns, turns_of
from minsnap.trajectory.instants import parted_instants
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.turn_rates import largest_turn_within

HELD_RATE = 2.0
"""Largest rate at which a held heading turns, by default [rad/s]."""

SLOW, SLOW_SHARE = 0.5, 0.1
"""Horizontal speed below which the heading is held, by default: 0.5 m/s, or that share of the top one if less."""

HELD_ROOM = 10.0
"""Allowance of a turn in a search where the heading is held, for rest; in units of the limit at typical speed."""

RESTING = 1e-6
"""Share of the top speed, climbing included, that no horizontal speed exceeds where a path only climbs."""

TURN_SAMPLES = 64
"""Instants a polynomial piece at which the turns of the velocity are counted."""


@dataclass(frozen=True)
class Velocity:
    """A yaw along the velocity, as :func:`minsnap.plan` takes it; ``yaw="velocity"`` is the one without parameters.

    Parameters
    ----------
    yaw_rate : float, optional
        Largest rate at which a held heading turns [rad/s]; by default the limit on the yaw rate, or 2 rad/s.
    hold_below : float, optional
        Horizontal speed below which the heading is held [m/s]; by default a tenth of the top one, at most 0.5 m/s.

    Raises
    ------
    YawError
        If a value is not positive; on use, if the rate is more than the limit.
    """

    yaw_rate: float | None = None
    hold_below: float | None = None

    def __post_init__(self) -> None:
        for name, unit in (("yaw_rate", "rad/s"), ("hold_below", "m/s")):
            if getattr(self, name) is not None:
                set_fields(self, **{name: check_positive(name, getattr(self, name), unit, YawError)})

    def within(self, limit: float | None) -> Velocity:
        """Return the same with the rate of a limit [rad/s] where it has none of its own."""
        if limit is None or (self.yaw_rate is not None and self.yaw_rate <= limit):
            return self
        if self.yaw_rate is not None:
            raise YawError(f"yaw_rate={self.yaw_rate:g} is more than the limit of {limit:g} rad/s: lower it")
        return replace(self, yaw_rate=limit)

    def heading(self, curve: Path) -> VelocityHeading:
        """Return the heading along the velocity of a curve."""
        return VelocityHeading(curve, self.yaw_rate, self.hold_below)


class VelocityHeading(RuledHeading):
    r"""Yaw along the horizontal velocity, continuous with a continuous rate over the whole path.

    :math:`\psi = \operatorname{atan2}(v_y, v_x)`,
    :math:`\dot\psi = (v_x a_y - v_y a_x) / (v_x^2 + v_y^2)`.  Where the path is slower than ``hold_below``, as where it
    rests, climbs or turns back, that rate has no bound.  There the heading is held and turns the shortest way to the
    direction in which the path goes on, at ``yaw_rate`` at most; where the time is too short for that, it begins to
    turn earlier and ends later (see :mod:`minsnap.trajectory.held_turns`).

    Parameters
    ----------
    path : Path
        Anything with a horizontal velocity: dim 2 or more.
    yaw_rate : float, optional
        Largest rate of a held heading [rad/s]; by default 2. Where the path itself turns faster, at speed, the
        heading does so too.
    hold_below : float, optional
        Horizontal speed below which the heading is held [m/s]; by default a tenth of the top one, at most 0.5 m/s.

    Raises
    ------
    YawError
        If the path has fewer than two coordinates or never moves horizontally, or a parameter is not positive.
    """

    what, highest, limited_last = "a yaw along the velocity", 2, True

    def __init__(self, path: Path, yaw_rate: float | None = None, hold_below: float | None = None) -> None:
        if path.dim < 2:
            raise YawError("a yaw along the velocity needs at least two coordinates, this path has one")
        self.path = path
        self.yaw_rate = HELD_RATE if yaw_rate is None else check_positive("yaw_rate", yaw_rate, "rad/s", YawError)
        self.hold_below = None if hold_below is None else check_positive("hold_below", hold_below, "m/s", YawError)
        self._grid = parted_instants(path, TURN_SAMPLES, 4095)
        velocity = path(self._grid, 1)
        speed = np.linalg.norm(velocity[:, :2], axis=1)
        if not speed.max() > RESTING * np.linalg.norm(velocity, axis=1).max():
            raise YawError("a yaw along the velocity needs a horizontal velocity, and this path has none")
        self._fast = self._moving(speed)
        self._angle = np.unwrap(_angle(velocity))

    def _moving(self, speed: FloatArray) -> BoolArray:
        """Where the heading follows the velocity: at the top speed in any case."""
        top = float(speed.max())
        slow = min(SLOW, SLOW_SHARE * top) if self.hold_below is None else self.hold_below
        return np.asarray(speed >= min(slow, top))

    @cached_property
    def _turns(self) -> Turns:
        """How the heading goes on, piece by piece."""
        rate = self._rate(self._grid, np.where(self._fast[:, None], self.path(self._grid, 1)[:, :2], 1.0))
        return turns_of(HeadingTable(self._grid, self._angle, rate, self._fast), self.yaw_rate)

    def held_rate(self, start: float, end: float) -> tuple[float, float]:
        """Largest rate between two instants where the heading does not follow the velocity [rad/s], and where [s]."""
        return self._turns.largest(start, end)

    @property
    def followed(self) -> FloatArray:
        """Intervals in which the heading follows the velocity, shape (m, 2) [s]."""
        starts = self._turns.starts
        both = np.stack((starts, np.append(starts[1:], self.path.duration)), axis=1)
        return np.asarray(both[self._turns.follows])

    def on(self, curve: Path, start: float = 0.0, rate: float = 1.0) -> Heading:
        """Return the heading along the velocity of the whole path at another pace, else the same angles."""
        return super().on(curve, start, rate) if start != 0.0 or rate in (1.0, -1.0) else self.by_rule(curve)

    def by_rule(self, curve: Path) -> VelocityHeading:
        """Return the heading along the velocity of another path, held by the same rules."""
        return VelocityHeading(curve, self.yaw_rate, self.hold_below)

    def largest_rate(self, start: float, end: float) -> Largest | None:
        """Return the larger one of held turns and of those of a trajectory's velocity."""
        path = self.path
        if not isinstance(path, Trajectory):
            return None
        start, end = max(start, 0.0), min(end, path.duration)
        return max(self.held_rate(start, end), largest_turn_within(path, self.followed.clip(start, end)))

    def rate_limits(self, most: float, length: float, speed: float) -> list[InstantLimit]:
        """Return the limit on the turns of the velocity, at speed."""
        held = min(SLOW, SLOW_SHARE * speed) if self.hold_below is None else self.hold_below
        return [InstantLimit(InstantKind.HEADING_RATE, (most, speed, held, HELD_ROOM))]

    def _rule(self) -> dict[str, Any]:
        return {"rule": "velocity", "yaw_rate": self.yaw_rate, "hold_below": self.hold_below}

    def _at(self, t: FloatArray, order: int) -> FloatArray:
        value = self._turns(t, order)
        follows = self._turns.follows[self._turns.piece(t)]
        value[follows] = self._following(t[follows], order)
        return value

    def _following(self, t: FloatArray, order: int) -> FloatArray:
        velocity = self.path(t, 1)[:, :2]
        if order == 1:
            return self._rate(t, velocity)
        if order == 2:
            return self._acceleration(t, velocity)
        turns = self._turns
        piece = turns.piece(t)
        began = np.interp(turns.starts[piece], self._grid, self._angle)
        near = turns.coefficients[piece, 0] + np.interp(t, self._grid, self._angle) - began
        raw = _angle(velocity)
        return nearest_turn(raw, near)

    def _rate(self, t: FloatArray, velocity: FloatArray) -> FloatArray:
        return np.asarray(_cross(velocity, self.path(t, 2)[:, :2]) / (velocity**2).sum(axis=1))

    def _acceleration(self, t: FloatArray, velocity: FloatArray) -> FloatArray:
        acceleration, jerk = self.path(t, 2)[:, :2], self.path(t, 3)[:, :2]
        square, along = (velocity**2).sum(axis=1), (velocity * acceleration).sum(axis=1)
        return np.asarray(_cross(velocity, jerk) / square - 2.0 * self._rate(t, velocity) * along / square)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _angle(velocity: FloatArray) -> FloatArray:
    return np.arctan2(velocity[:, 1], velocity[:, 0])
