"""Circle, helix and lemniscate: analytic paths with exact derivatives of any order, and the checks of all shapes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.argument_names import explains_names
from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_array, check_positive, check_switch, is_number
from minsnap.basics.messages import shown
from minsnap.errors import ShapeError, YawError
from minsnap.trajectory.heading import ConstantHeading, Heading
from minsnap.trajectory.look_at import LookAt
from minsnap.trajectory.phase import ComplexArray, PhaseLaw, PhasePath
from minsnap.trajectory.tilt_heading import TiltHeading
from minsnap.trajectory.velocity_heading import VelocityHeading

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits


RAMP = math.pi / 2.0
"""Angle over which shapes spin up and down unless told otherwise [rad]."""


def check_point(name: str, value: Sequence[float], size: int) -> tuple[float, ...]:
    """Return ``value`` as floats, or raise ShapeError unless it has this number of finite entries."""
    return tuple(check_array(f"the {name}", value, ((size,),), f"{size} finite numbers [m]", ShapeError).tolist())


def check_finite(name: str, value: float, unit: str) -> float:
    """Return ``value``, or raise ShapeError unless it is a finite number."""
    if not is_number(value):
        raise ShapeError(f"the {name} is {shown(value)}: it must be a finite number [{unit}]")
    return float(value)


def phase_law(
    period: float | None, speed: float | None, reach: float, laps: float, ramp: float, limits: Limits | None
) -> PhaseLaw:
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
    limits : Limits or None
        With them there is neither a period nor a speed.
    """
    if limits is not None and (period is not None or speed is not None):
        raise ShapeError("limits say how fast a shape is flown: give no period and no speed with them")
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


def with_yaw(path: Shape, yaw: float | str | LookAt) -> Shape:
    """Return the path with a constant yaw [rad], with the yaw ``"velocity"`` or ``"tilt"``, or towards a point."""
    heading: Heading
    if isinstance(yaw, str) and yaw in ("velocity", "tilt"):
        heading = VelocityHeading(path) if yaw == "velocity" else TiltHeading(path)
    elif isinstance(yaw, LookAt):
        heading = yaw.heading(path)
    elif is_number(yaw):
        heading = ConstantHeading(float(yaw))
    else:
        raise YawError(f"the yaw is {shown(yaw)}: it must be an angle in radians, 'velocity', 'tilt' or a LookAt")
    return replace(path, yaw=heading)


class Shape(PhasePath):
    """A circle, a helix or a lemniscate.

    It is sampled by its formula; where polynomials are wanted, to certify it or to join it with a plan, it is replaced
    by some that are within a micrometre.
    """

    def within(self, limits: Limits) -> Shape:
        """Return the same shape flown as fast as limits allow: one of them is just reached, none exceeded.

        Raises
        ------
        LimitError
            If a limit is exceeded at any pace.
        """
        from minsnap.limits.limits import check_limits
        from minsnap.time_allocation.time_stretch import touching_factor

        check_limits(limits)
        factor = touching_factor(limits, self.as_trajectory())
        slower = replace(self, law=replace(self.law, rate=self.law.rate / factor))
        return replace(slower, yaw=self.yaw.by_rule(slower))


@explains_names(
    {
        "diameter": "radius=, half of it",
        "duration": "period=, of one lap, or limits=",
        "total_time": "period=, of one lap",
    }
)
def circle(
    radius: float = 3.0,
    *,
    period: float | None = None,
    speed: float | None = None,
    laps: float = 1.0,
    ramp: float = RAMP,
    center: Sequence[float] = (0.0, 0.0),
    altitude: float = 1.5,
    start_angle: float = 0.0,
    clockwise: bool = False,
    yaw: float | str | LookAt = 0.0,
    limits: Limits | None = None,
) -> Shape:
    r"""Level circle, from rest to rest unless ``ramp=0``.

    :math:`r = c + R\,(\cos(\varphi_0 + \varphi), \sin(\varphi_0 + \varphi), 0)`. The laps include spin-up and
    spin-down, so the circle ends where it starts after a whole number of them. With ``ramp=0`` and the default period
    it is the literal circle of 120 steps at 20 Hz, which starts and ends at full speed.

    Parameters
    ----------
    radius : float
        R [m].
    period, speed : float, optional
        Seconds per lap at full speed, or that speed [m/s]; one of them. By default 6 s.
    laps : float
        Turns, spin-up and spin-down included.
    ramp : float
        Angle over which it spins up, and again down, at most half of the way [rad]; each takes twice the time of that
        angle at full speed. 0 starts and ends at speed.
    center : sequence of 2 floats
        Center in the plane [m].
    altitude : float
        z [m].
    start_angle : float
        Where it begins, counter-clockwise from the x axis [rad].
    clockwise : bool
        Turn clockwise seen from above.
    yaw : float, "velocity", "tilt" or LookAt
        Constant heading [rad], or along the velocity.
    limits : Limits, optional
        Flown as fast as they allow, instead of in a period or at a speed.

    Returns
    -------
    Shape
        dim 3.

    Raises
    ------
    ShapeError
        If a measure is not a positive or finite number, or both a period and a speed are set.
    YawError
        If the yaw is neither a number nor "velocity", "tilt" or a LookAt.

    Examples
    --------
    >>> import minsnap
    >>> path = minsnap.circle(radius=2.0, period=8.0)
    >>> path.duration
    12.0
    >>> path(0.0), path(0.0, order=1)
    (array([2. , 0. , 1.5]), array([0., 0., 0.]))
    """
    check_positive("the radius", radius, "m", ShapeError)
    law = phase_law(period, speed, float(radius), laps, ramp, limits)
    harmonics = _turned(radius, start_angle, clockwise)
    return _paced(Shape(law, _center(center, altitude), np.zeros(3), harmonics), yaw, limits)


@explains_names({"turns": "laps="})
def helix(
    radius: float = 1.0,
    pitch: float = 0.5,
    *,
    period: float | None = None,
    speed: float | None = None,
    laps: float = 3.0,
    ramp: float = RAMP,
    center: Sequence[float] = (0.0, 0.0),
    altitude: float = 1.0,
    start_angle: float = 0.0,
    clockwise: bool = False,
    yaw: float | str | LookAt = 0.0,
    limits: Limits | None = None,
) -> Shape:
    r"""Circle with constant climb per turn.

    :math:`r = c + (R\cos(\varphi_0 + \varphi), R\sin(\varphi_0 + \varphi), p\,\varphi / 2\pi)`.

    Parameters
    ----------
    radius : float
        R [m].
    pitch : float
        p, the climb a lap [m]; negative to descend.
    period, speed : float, optional
        Seconds per lap at full speed, or that speed along the helix [m/s]; one of them. By default 6 s.
    laps, ramp, center, start_angle, clockwise, yaw, limits
        As for :func:`circle`.
    altitude : float
        z at the start [m].

    Returns
    -------
    Shape
        dim 3.

    Raises
    ------
    ShapeError, YawError
        As for :func:`circle`.
    """
    climb = check_finite("pitch", pitch, "metres") / (2.0 * math.pi)
    check_positive("the radius", radius, "m", ShapeError)
    law = phase_law(period, speed, math.hypot(radius, climb), laps, ramp, limits)
    harmonics = _turned(radius, start_angle, clockwise)
    return _paced(Shape(law, _center(center, altitude), np.array([0.0, 0.0, climb]), harmonics), yaw, limits)


@explains_names({"size": "length= and width="})
def lemniscate(
    length: float = 6.0,
    width: float = 3.0,
    *,
    period: float | None = None,
    speed: float | None = None,
    laps: float = 1.0,
    ramp: float = RAMP,
    center: Sequence[float] = (0.0, 0.0),
    altitude: float = 1.5,
    clockwise: bool = False,
    yaw: float | str | LookAt = 0.0,
    limits: Limits | None = None,
) -> Shape:
    r"""Level figure of eight (the lemniscate of Gerono where the length is twice the width), from its crossing.

    :math:`r = c + (\tfrac{1}{2} L \sin\varphi, \tfrac{1}{2} W \sin 2\varphi, 0)`.

    Parameters
    ----------
    length : float
        L, its extent along x [m].
    width : float
        W, its extent along y [m].
    period, speed : float, optional
        Seconds per lap at full rate, or the greatest speed, that at the crossing [m/s]; one of them. By default 6 s.
    laps, ramp, center, altitude, yaw, limits
        As for :func:`circle`.
    clockwise : bool
        Turn clockwise, seen from above, on the first half.

    Returns
    -------
    Shape
        dim 3.

    Raises
    ------
    ShapeError, YawError
        As for :func:`circle`.
    """
    reach_x = check_positive("the length", length, "m", ShapeError) / 2.0
    reach_y = check_positive("the width", width, "m", ShapeError) / 2.0
    law = phase_law(period, speed, math.hypot(reach_x, 2.0 * reach_y), laps, ramp, limits)
    side = 1.0 if check_switch("clockwise", clockwise) else -1.0
    harmonics = np.array([[-1j * reach_x, 0.0, 0.0], [0.0, -1j * reach_y * side, 0.0]])
    return _paced(Shape(law, _center(center, altitude), np.zeros(3), harmonics), yaw, limits)


def _paced(path: Shape, yaw: float | str | LookAt, limits: Limits | None) -> Shape:
    """Give a shape its heading, and its pace."""
    turned = with_yaw(path, yaw)
    return turned if limits is None else turned.within(limits)


def _center(center: Sequence[float], altitude: float) -> FloatArray:
    return np.array([*check_point("center", center, 2), check_finite("altitude", altitude, "metres")])


def _turned(radius: float, start_angle: float, clockwise: bool) -> ComplexArray:
    """Return the harmonics of a circle with a start angle and a direction."""
    amplitude = radius * np.array([1.0, -1j, 0.0]) * np.exp(1j * check_finite("start angle", start_angle, "radians"))
    return np.asarray([amplitude.conj() if check_switch("clockwise", clockwise) else amplitude])
