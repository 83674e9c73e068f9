"""The heading of a plan, from what a user gives: one rule or angle for all, one angle per waypoint, or a function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, NDArray, bounded, numbers
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import EXACT
from minsnap.basics.warn import warn_caller
from minsnap.errors import MagnitudeWarning, YawError
from minsnap.native.free_optimum import pinned_optimum
from minsnap.trajectory.heading import ConstantHeading, Heading, Largest, shortest_turns, turns_of, wrap
from minsnap.trajectory.look_at import LookAt, heading_at
from minsnap.trajectory.medium import AIRLESS
from minsnap.trajectory.tilt_heading import TiltHeading
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.velocity_heading import Velocity


@dataclass(frozen=True)
class YawSettings:
    """How a yaw is read.

    Parameters
    ----------
    many : float
        Angle beyond which it looks like degrees [rad].
    near : float
        How much less than a whole turn looks like one [rad].
    rate, followed : float
        Rate at which a function of time is sampled [Hz], and the largest difference of the spline from it [rad].
    longest : float
        Longest time over which it is sampled [s]: some 200 MB of angles and their spline.
    """

    many: float = 4.0 * np.pi
    near: float = 0.1
    rate: float = 50.0
    followed: float = 1e-2
    longest: float = 1e5


YAW = YawSettings()

TURN = 2.0 * np.pi * (1.0 + EXACT)
"""A whole turn, and what rounding adds [rad]."""

Angles = float | Sequence[float] | NDArray[Any]
"""One angle, or one for each waypoint [rad]."""

Yaw = Angles | Literal["velocity", "tilt", "free"] | Velocity | LookAt | Callable[[Any], Any] | None
"""What a plan takes as its yaw."""

ChosenHeading = Callable[[Any], Heading]
"""Gives a planned curve its heading."""


@dataclass(frozen=True, eq=False)
class PlannedHeading(Heading):
    """A yaw that is itself a one-dimensional trajectory.

    Parameters
    ----------
    polynomial : Trajectory
        Yaw [rad], dim 1, over the same interval as the path it belongs to; not wrapped.
    """

    polynomial: Trajectory

    @classmethod
    def through(cls, angles: FloatArray, durations: FloatArray, closed: bool, rate: float = 0.0) -> PlannedHeading:
        """Return the yaw through angles with the least integral of squared angular acceleration: a cubic spline.

        Parameters
        ----------
        angles : ndarray, shape (n,)
            Not wrapped [rad].
        durations : ndarray, shape (n - 1,)
            [s].
        closed : bool
            Whether the yaw rate at the end equals that at the start; else it is zero.
        rate : float
            Yaw rate at the start, where it is not closed [rad/s].
        """
        ends = {} if closed else {0: {1: np.array([rate])}, len(durations): {1: np.zeros(1)}}
        spline = pinned_optimum(angles[:, None], durations, 2, ends, closed)
        points = spline[0] if isinstance(spline, tuple) else _spline(angles, durations, closed, rate)
        return cls(Trajectory(points, durations))

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """Yaw or its derivative at ``t``, in the shape of ``t``."""
        return np.asarray(self.polynomial(t, order)[..., 0])

    def largest_rate(self, start: float, end: float) -> Largest:
        """Return it from the rate's control points, which keep their digits where little of a piece is left."""
        yaw = self.polynomial
        if start <= 0.0 and end >= yaw.duration:
            return yaw.max_norm(1)
        first, last = (min(max(t, 0.0), yaw.duration) for t in (start, end))
        if first >= last:
            return float(np.abs(yaw(last, 1)).max()), last
        value, instant = yaw.derivative(1).between(first, last).max_norm(0)
        return value, first + instant

    @property
    def largest_jerk(self) -> float:
        """The exact one."""
        return float(self.polynomial.max_norm(3)[0])


def chosen_heading(yaw: Yaw, legs: int, closed: bool, limits: Any = None) -> ChosenHeading:
    """Check the requested yaw and return the function that gives a curve its heading.

    Parameters
    ----------
    yaw : float, array_like of shape (legs + 1,), "velocity", "tilt", Velocity, LookAt, callable or None
        [rad]; zero where it is None.
    legs : int
        Of the curve.
    closed : bool
        Whether the yaw rate at the end equals that at the start.
    limits : Limits, optional
        Of the plan: their vehicle's drag is that of a heading from the tilt, their yaw rate that of one along the
        velocity.

    Raises
    ------
    YawError
        If the yaw is malformed, or that at the end of a closed lap is not that at its start, but for whole turns.
    """
    medium, limit = (AIRLESS, None) if limits is None else (limits.medium, limits.yaw_rate)
    if isinstance(yaw, str) and yaw == "tilt":
        return partial(TiltHeading, medium=medium)
    if isinstance(yaw, str) and yaw == "velocity":
        yaw = Velocity()
    if isinstance(yaw, Velocity):
        return yaw.within(limit).heading
    if isinstance(yaw, LookAt):
        return yaw.heading
    if callable(yaw):
        return partial(_sampled, yaw)
    angles = _angles(0.0 if yaw is None else yaw)
    if angles.ndim == 0:
        constant = ConstantHeading(float(angles))
        return lambda curve: constant
    if angles.shape != (legs + 1,):
        raise YawError(f"yaw has shape {angles.shape}: give one angle, or one for each of {legs + 1} waypoints")
    if closed and abs(wrap(angles[-1] - angles[0])) > EXACT:
        raise YawError(
            f"a closed lap begins at a yaw of {angles[0]:g} rad and ends at {angles[-1]:g} rad: give the same, but for "
            "whole turns"
        )
    turned = turns_of(angles)
    return lambda curve: PlannedHeading.through(turned, np.diff(curve.leg_breaks), closed)


def _sampled(function: Callable[[Any], Any], curve: Trajectory) -> Heading:
    """Return the heading that a function of time gives: a cubic spline through its angles at 50 instants a second."""
    from scipy.interpolate import CubicSpline, PPoly

    duration = curve.duration
    if duration > YAW.longest:
        raise YawError(
            f"a yaw that is a function of time is followed over {YAW.longest:g} s at most, and the plan takes "
            f"{duration:.6g} s: give angles at the waypoints"
        )
    t = np.linspace(0.0, duration, max(int(np.ceil(YAW.rate * duration)), 8) + 1)
    spline = CubicSpline(t, shortest_turns(heading_at(function, t)))
    between = (t[1:] + t[:-1]) / 2.0
    apart = np.abs(wrap(spline(between) - heading_at(function, between)))
    if apart.max() > YAW.followed:
        raise YawError(
            f"the function that gives the yaw jumps, or turns too fast, near t = {between[apart.argmax()]:.3g} s: "
            "give one that is smooth over 20 ms"
        )
    return PlannedHeading(Trajectory.from_ppoly(PPoly(spline.c[:, :, None], spline.x)))


def _angles(yaw: Any) -> FloatArray:
    angles = None if isinstance(yaw, str) else numbers(yaw)
    if angles is None:
        raise YawError(
            f"yaw is {shown(yaw)}: give an angle [rad], one per waypoint, 'velocity', 'tilt', a Velocity, a LookAt or "
            "a function of time"
        )
    if not bounded(angles).all():
        raise YawError("yaw must be finite [rad]")
    doubt = _doubt(angles)
    if doubt:
        warn_caller(doubt, MagnitudeWarning)
    return angles


def _doubt(angles: FloatArray) -> str:
    """Return a sentence on angles [rad] that may be degrees, or nearly a whole turn; empty for others.

    More than a turn may be degrees where it turns nothing, as one angle; and more than one and a half where all angles
    are whole numbers, and two that follow each other are more than half a turn apart.
    """
    steps = np.abs(np.diff(angles)) if angles.ndim == 1 else np.zeros(0)
    whole = bool((angles == np.round(angles)).all() and steps.max(initial=0.0) > np.pi)
    many = TURN if angles.ndim == 0 else 1.5 * TURN if whole else YAW.many
    near = np.flatnonzero((steps < 2.0 * np.pi * (1.0 - EXACT)) & (steps > 2.0 * np.pi - YAW.near))
    if not near.size:
        return in_degrees(angles, many)
    leg = int(near[0])
    return (
        f"yaw goes from {angles[leg]:g} to {angles[leg + 1]:g} rad on leg {leg}, nearly a turn, and turns the shorter "
        f"way: for a whole turn, give a difference of 2 pi, {2.0 * np.pi:.10g}"
    )


def in_degrees(angles: FloatArray, many: float = YAW.many) -> str:
    """Return a sentence on angles [rad] that may be degrees, since they make many turns; empty for others."""
    largest = np.abs(angles).max(initial=0.0)
    turns = f"{largest / (2.0 * np.pi):.2g} turns"
    return f"yaw goes to {largest:g} rad, {turns}: if it is degrees, give radians" if largest > many else ""


def _spline(angles: FloatArray, durations: FloatArray, closed: bool, rate: float) -> FloatArray:
    """Return control points (n - 1, 4, 1) of the same spline without the native core, from its rates at the angles."""
    from scipy.interpolate import CubicSpline

    t = np.concatenate(([0.0], np.cumsum(durations)))
    steady = (angles[-1] - angles[0]) / t[-1] if closed else 0.0  # whole turns of a lap
    rest = angles - steady * t
    if closed:
        rest[-1] = rest[0]
    ends: Any = "periodic" if closed else ((1, rate), (1, 0.0))
    rates = steady + CubicSpline(t, rest, bc_type=ends)(t, 1)
    bends = angles[:-1] + durations * rates[:-1] / 3.0, angles[1:] - durations * rates[1:] / 3.0
    return np.asarray(np.stack((angles[:-1], *bends, angles[1:]), axis=1)[:, :, None])
