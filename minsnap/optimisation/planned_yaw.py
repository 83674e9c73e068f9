"""The requested heading of a plan: constant, along the velocity, from the tilt, or one yaw per waypoint."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.arrays import GRAVITY, FloatArray
from minsnap.errors import YawError
from minsnap.optimisation.problem import Task
from minsnap.optimisation.solve import solve
from minsnap.trajectory.heading import VelocityHeading, shortest_turns, wrap
from minsnap.trajectory.path import ConstantHeading, Heading
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.tilt_heading import TiltHeading
from minsnap.trajectory.trajectory import Trajectory

SAME = 1e-9
"""Difference of two yaws that counts as rounding [rad]."""

ChosenHeading = Callable[[Trajectory], Heading]
"""Gives a planned curve its heading."""


def asked_heading(
    yaw: float | str | npt.ArrayLike | None, legs: int, closed: bool, gravity: float = GRAVITY
) -> ChosenHeading:
    """Check the requested yaw and return the function that gives a curve its heading.

    Parameters
    ----------
    yaw : float, array_like of shape (legs + 1,), "velocity", "tilt" or None
        [rad]; zero where it is None.
    legs : int
        Of the curve.
    closed : bool
        Whether the yaw rate at the end equals that at the start.
    gravity : float
        For a heading from the tilt [m/s^2].

    Raises
    ------
    YawError
        If the yaw is malformed, or that at the end of a closed lap is not that at its start, but for whole turns.
    """
    if isinstance(yaw, str):
        if yaw not in ("velocity", "tilt"):
            raise _unknown(yaw)
        return VelocityHeading if yaw == "velocity" else lambda curve: TiltHeading(curve, gravity=gravity)
    angles = _angles(0.0 if yaw is None else yaw)
    if angles.ndim == 0:
        return lambda _: ConstantHeading(float(angles))
    if angles.shape != (legs + 1,):
        raise YawError(f"yaw has shape {angles.shape}: give one angle, or one for each of {legs + 1} waypoints")
    if closed and abs(wrap(angles[-1] - angles[0])) > SAME:
        raise YawError(
            f"a closed lap begins at a yaw of {angles[0]:g} rad and ends at {angles[-1]:g} rad: give the same, but for "
            "whole turns"
        )
    turned = shortest_turns(angles)
    return lambda curve: PlannedHeading(smooth_yaw(turned, np.diff(curve.leg_breaks), closed))


def smooth_yaw(angles: FloatArray, durations: FloatArray, closed: bool) -> Trajectory:
    """Return the yaw through angles (n,) [rad] with the least integral of squared angular acceleration: a cubic spline.

    Parameters
    ----------
    angles : ndarray, shape (n,)
        Not wrapped [rad].
    durations : ndarray, shape (n - 1,)
        [s].
    closed : bool
        Whether the yaw rate at the end equals that at the start; else both are zero.
    """
    column = angles[:, None]
    ends = {} if closed else {0: {1: np.zeros(1)}, len(angles) - 1: {1: np.zeros(1)}}
    zero = np.zeros(column.shape)
    return solve(Task(column, zero, zero, ends, 2, 1, closed, 1, (), "auto"), durations).trajectory


def _angles(yaw: Any) -> FloatArray:
    try:
        angles = np.array(yaw, dtype=np.float64)
    except (TypeError, ValueError):
        raise _unknown(yaw) from None
    if not np.isfinite(angles).all():
        raise YawError("yaw must be finite [rad]")
    return angles


def _unknown(yaw: Any) -> YawError:
    return YawError(f"yaw is {yaw!r}: give an angle [rad], one per waypoint, 'velocity' or 'tilt'")
