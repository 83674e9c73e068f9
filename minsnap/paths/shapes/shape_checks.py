"""Checks of the parameters of a shape, shared by all shapes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from minsnap.basics.checks import check_array, check_positive, is_number
from minsnap.basics.messages import shown
from minsnap.errors import ShapeError, YawError
from minsnap.trajectory.heading import ConstantHeading
from minsnap.trajectory.look_at import LookAt
from minsnap.trajectory.phase import PhaseLaw, PhasePath

Turning = TypeVar("Turning", bound=PhasePath)


def check_point(name: str, value: Sequence[float], size: int) -> tuple[float, ...]:
    """Return ``value`` as floats, or raise ShapeError unless it has this number of finite entries."""
    return tuple(check_array(f"the {name}", value, ((size,),), f"{size} finite numbers [m]", ShapeError).tolist())


def check_finite(name: str, value: float, unit: str) -> float:
    """Return ``value``, or raise ShapeError unless it is a finite number."""
    if not is_number(value):
        raise ShapeError(f"the {name} is {shown(value)}: it must be a finite number [{unit}]")
    return float(value)


def phase_law(period: float | None, speed: float | None, reach: float, laps: float, ramp: float) -> PhaseLaw:
    """Return the phase law of a lap's period or of a speed.

    Parameters
    ----------
    period : float or None
        Seconds per lap at full rate; 6 by default.
    speed : float or None
        Greatest speed [m/s].
    reach : float
        Greatest metres travelled a radian of phase.
    laps : float
        Whole phase in turns.
    ramp : float
        Angle of the spin-up, and of the spin-down [rad].
    """
    if period is not None and speed is not None:
        raise ShapeError(f"a period ({shown(period)} s) and a speed ({shown(speed)} m/s) exclude each other: give one")
    angle = 2.0 * math.pi * check_positive("the number of laps", laps, "", ShapeError)
    if not (is_number(ramp) and 0.0 <= ramp <= angle / 2.0):
        raise ShapeError(
            f"the ramp is {shown(ramp)} rad: it must be between 0 and {angle / 2.0:.6g}, half of the way round"
        )
    if speed is not None:
        return PhaseLaw(check_positive("the speed", speed, "m/s", ShapeError) / reach, angle, float(ramp))
    seconds = check_positive("the period", 6.0 if period is None else period, "s", ShapeError)
    return PhaseLaw(2.0 * math.pi / seconds, angle, float(ramp))


def with_yaw(path: Turning, yaw: float | str | LookAt) -> Turning:
    """Return the path with a constant yaw [rad], with the yaw ``"velocity"`` or ``"tilt"``, or towards a point."""
    if isinstance(yaw, str) and yaw == "velocity":
        from minsnap.trajectory.velocity_heading import VelocityHeading

        return replace(path, yaw=VelocityHeading(path))
    if isinstance(yaw, str) and yaw == "tilt":
        from minsnap.trajectory.tilt_heading import TiltHeading

        return replace(path, yaw=TiltHeading(path))
    if isinstance(yaw, LookAt):
        return replace(path, yaw=yaw.heading(path))
    if not is_number(yaw):
        raise YawError(f"the yaw is {shown(yaw)}: it must be an angle in radians, 'velocity', 'tilt' or a LookAt")
    return replace(path, yaw=ConstantHeading(float(yaw)))
