"""The requested heading of a plan: constant, along the velocity, from the tilt, or one yaw per waypoint."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, bounded, numbers
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import EXACT
from minsnap.errors import MagnitudeWarning, YawError
from minsnap.trajectory.heading import ConstantHeading, Heading, shortest_turns, wrap
from minsnap.trajectory.look_at import LookAt, heading_at
from minsnap.trajectory.medium import AIRLESS
from minsnap.trajectory.planned_heading import PlannedHeading
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
    rate, followed : float
        Rate at which a function of time is sampled [Hz], and the largest difference of the spline from it [rad].
    longest : float
        Longest time over which it is sampled [s]: some 200 MB of angles and their spline.
    """

    many: float = 4.0 * np.pi
    rate: float = 50.0
    followed: float = 1e-2
    longest: float = 1e5


YAW = YawSettings()

Yaw = float | str | ArrayLike | Velocity | LookAt | Callable[[Any], Any] | None
"""What a plan takes as its yaw."""

ChosenHeading = Callable[[Trajectory], Heading]
"""Gives a planned curve its heading."""


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
        return lambda curve: TiltHeading(curve, medium=medium)
    if isinstance(yaw, str) and yaw == "velocity":
        yaw = Velocity()
    if isinstance(yaw, Velocity):
        return yaw.within(limit).heading
    if isinstance(yaw, LookAt):
        return yaw.heading
    if callable(yaw):
        function = yaw
        return lambda curve: _sampled(function, curve.duration)
    angles = _angles(0.0 if yaw is None else yaw)
    if angles.ndim == 0:
        return lambda _: ConstantHeading(float(angles))
    if angles.shape != (legs + 1,):
        raise YawError(f"yaw has shape {angles.shape}: give one angle, or one for each of {legs + 1} waypoints")
    if closed and abs(wrap(angles[-1] - angles[0])) > EXACT:
        raise YawError(
            f"a closed lap begins at a yaw of {angles[0]:g} rad and ends at {angles[-1]:g} rad: give the same, but for "
            "whole turns"
        )
    turned = shortest_turns(angles)
    return lambda curve: PlannedHeading.through(turned, np.diff(curve.leg_breaks), closed)


def _sampled(function: Callable[[Any], Any], duration: float) -> Heading:
    """Return the heading that a function of time gives: a cubic spline through its angles at 50 instants a second."""
    from scipy.interpolate import CubicSpline, PPoly

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
    powers = Trajectory.from_ppoly(PPoly(spline.c[:, :, None], spline.x))
    return PlannedHeading(powers)


def _angles(yaw: Any) -> FloatArray:
    angles = None if isinstance(yaw, str) else numbers(yaw)
    if angles is None:
        raise YawError(
            f"yaw is {shown(yaw)}: give an angle [rad], one per waypoint, 'velocity', 'tilt', a Velocity, a LookAt or "
            "a function of time"
        )
    if not bounded(angles).all():
        raise YawError("yaw must be finite [rad]")
    largest = np.abs(angles).max(initial=0.0)
    if largest > YAW.many:
        message = f"yaw goes to {largest:g} rad, {largest / (2.0 * np.pi):.0f} turns: if it is degrees, give radians"
        warnings.warn(message, MagnitudeWarning, stacklevel=4)
    return angles
