"""Circle, helix and lemniscate with exact derivatives of any order; line and rectangle, at rest at both ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from minsnap.basics import checks
from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.basics.messages import explains_names, shown
from minsnap.durations.search_options import is_priced
from minsnap.errors import ShapeError, TimingError, YawError
from minsnap.planning.planner import plan
from minsnap.trajectory.heading import ConstantHeading
from minsnap.trajectory.look_at import LookAt
from minsnap.trajectory.phase import ComplexArray, PhaseLaw, PhasePath
from minsnap.trajectory.planned_heading import Yaw, chosen_heading
from minsnap.trajectory.trajectory import Plan, Trajectory

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits

RAMP = math.pi / 2.0
"""Angle over which shapes spin up and down unless told otherwise [rad]."""


def check_point(name: str, value: Sequence[float], size: int) -> tuple[float, ...]:
    """Return ``value`` as floats, or raise ShapeError unless it has this number of finite entries."""
    return tuple(
        checks.check_array(f"the {name}", value, ((size,),), f"{size} finite numbers [m]", ShapeError).tolist()
    )


def check_finite(name: str, value: float, unit: str) -> float:
    """Return ``value``, or raise ShapeError unless it is a finite number."""
    give = f"it must be a finite number [{unit}]"
    return float(checks.check_number(f"the {name}", value, -math.inf, math.inf, give, ShapeError))


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
    angle = 2.0 * math.pi * checks.check_positive("the number of laps", laps, "", ShapeError)
    half = angle / 2.0
    give = f"it must be between 0 and {half:.6g} ({math.degrees(half):.6g} degrees), half of the way round"
    highest = half * (1.0 + 1e-15)
    ramp = min(checks.check_number("the ramp", ramp, 0.0, highest, give, ShapeError, unit="rad"), half)
    if speed is not None:
        return PhaseLaw(checks.check_positive("the speed", speed, "m/s", ShapeError) / reach, angle, float(ramp))
    seconds = checks.check_positive("the period", 6.0 if period is None else period, "s", ShapeError)
    return PhaseLaw(2.0 * math.pi / seconds, angle, float(ramp))


def with_yaw(path: Shape, yaw: float | Literal["velocity", "tilt"] | LookAt) -> Shape:
    """Return the path with a constant yaw [rad], with the yaw ``"velocity"`` or ``"tilt"``, or towards a point."""
    if isinstance(yaw, LookAt) or (isinstance(yaw, str) and yaw in ("velocity", "tilt")):
        return replace(path, yaw=chosen_heading(yaw, 0, False)(path))
    give = "it must be an angle in radians, 'velocity', 'tilt' or a LookAt"
    return replace(path, yaw=ConstantHeading(checks.check_number("the yaw", yaw, -math.inf, math.inf, give, YawError)))


class Shape(PhasePath):
    """A circle, a helix or a lemniscate.

    It is sampled by its formula; where polynomials are wanted, to certify it or to join it with a plan, it is replaced
    by some that are within a micrometre.
    """

    def within(self, limits: Limits) -> Shape:
        """Return the same shape flown as fast as limits allow: one of them is just reached, none exceeded.

        This holds for the polynomials of :meth:`as_trajectory`. The acceleration of the formula differs from theirs by
        up to 0.02 %, and by more where the spin-up is only some micrometres long.

        Raises
        ------
        LimitError
            If a limit is exceeded at any pace.
        """
        from minsnap.durations.time_stretch import touching_factor
        from minsnap.limits.limits import check_one_speed

        check_one_speed(limits, "a shape")
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
    yaw: float | Literal["velocity", "tilt"] | LookAt = 0.0,
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
    checks.check_positive("the radius", radius, "m", ShapeError)
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
    yaw: float | Literal["velocity", "tilt"] | LookAt = 0.0,
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
    checks.check_positive("the radius", radius, "m", ShapeError)
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
    yaw: float | Literal["velocity", "tilt"] | LookAt = 0.0,
    limits: Limits | None = None,
) -> Shape:
    r"""Level figure of eight (the lemniscate of Gerono where the length is twice the width), from its crossing.

    :math:`r = c + (\tfrac{1}{2} L \sin\varphi, \mp\tfrac{1}{2} W \sin 2\varphi, 0)`, with the plus clockwise.

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
    reach_x = checks.check_positive("the length", length, "m", ShapeError) / 2.0
    reach_y = checks.check_positive("the width", width, "m", ShapeError) / 2.0
    law = phase_law(period, speed, math.hypot(reach_x, 2.0 * reach_y), laps, ramp, limits)
    side = 1.0 if checks.check_switch("clockwise", clockwise) else -1.0
    harmonics = np.array([[-1j * reach_x, 0.0, 0.0], [0.0, -1j * reach_y * side, 0.0]])
    return _paced(Shape(law, _center(center, altitude), np.zeros(3), harmonics), yaw, limits)


def _paced(path: Shape, yaw: float | Literal["velocity", "tilt"] | LookAt, limits: Limits | None) -> Shape:
    """Give a shape its heading, and its pace."""
    turned = with_yaw(path, yaw)
    return turned if limits is None else turned.within(limits)


def _center(center: Sequence[float], altitude: float) -> FloatArray:
    return np.array([*check_point("center", center, 2), check_finite("altitude", altitude, "metres")])


def _turned(radius: float, start_angle: float, clockwise: bool) -> ComplexArray:
    """Return the harmonics of a circle with a start angle and a direction."""
    amplitude = radius * np.array([1.0, -1j, 0.0]) * np.exp(1j * check_finite("start angle", start_angle, "radians"))
    return np.asarray([amplitude.conj() if checks.check_switch("clockwise", clockwise) else amplitude])


MOST_LAPS = 100_000
"""Laps of a rectangle, which has four legs for each."""

LINE_SAMPLES = 120
"""Samples of the constant-speed line at 20 Hz, both ends included, without a time."""


@explains_names({"length": "start= and end=, two points"})
def line(
    start: Sequence[float] = (0.0, 1.0, 1.5),
    goal: Sequence[float] = (7.0, 1.0, 1.5),
    *,
    total_time: float | None = None,
    limits: Limits | None = None,
    constant_speed: bool = False,
    **options: Any,
) -> Trajectory:
    """Straight line, from rest to rest with minimum snap, or at constant speed.

    Parameters
    ----------
    start, goal : sequence of 3 floats
        Ends [m].
    total_time : float, optional
        Seconds.
    limits : Limits, optional
        What not to exceed: the line is then flown in the shortest time that keeps them. Without a time they are 3 m/s,
        6 m/s^2 and 30 m/s^3 by default.
    constant_speed : bool
        Equal steps from start to goal, at speed from the first instant to the last; 120 samples at 20 Hz unless a
        total time is set.
    **options
        More arguments of :func:`minsnap.plan`, such as ``yaw``.

    Returns
    -------
    Trajectory
        One leg.

    Raises
    ------
    ShapeError
        If an end is not 3 finite numbers, or both are the same point.
    TimingError
        If the time is not positive, or limits are set with a constant speed.
    """
    ends = np.array([check_point("start", start, 3), check_point("goal", goal, 3)])
    if (ends[0] == ends[1]).all():
        raise ShapeError(f"the line starts and ends at {tuple(ends[0].tolist())}: give it two ends")
    if checks.check_switch("constant_speed", constant_speed):
        return _constant_speed(ends, total_time, limits, **options)
    return plan(ends, **timed({"total_time": total_time, "limits": limits} | options))


@explains_names({"size": "width= and length=", "height": "altitude=", "speed": "limits=Limits(speed=3)"})
def rectangle(
    width: float = 6.0,
    length: float = 4.0,
    *,
    altitude: float = 1.5,
    corridor: Any = 0.3,
    laps: int = 1,
    start_corner: int = 0,
    clockwise: bool = False,
    center: Sequence[float] = (0.0, 0.0),
    total_time: float | None = None,
    durations: ArrayLike | None = None,
    limits: Limits | None = None,
    **options: Any,
) -> Plan:
    """Level rectangle through its corners with minimum snap, inside a corridor around its sides at every instant.

    Parameters
    ----------
    width, length : float
        Sides along x and along y [m].
    altitude : float
        z [m].
    corridor : float, sequence or Corridor, or None
        Half-width around each side [m], as :func:`minsnap.plan` takes it.
    laps : int
        Times round.
    start_corner : int
        0 to 3: corners counted counter-clockwise from the one with the least x and y.
    clockwise : bool
        Go round clockwise seen from above.
    center : sequence of 2 floats
        Center in the plane [m].
    total_time, durations, limits
        As :func:`minsnap.plan` takes them; by default the shortest time within 3 m/s, 6 m/s^2 and
        30 m/s^3.
    **options
        More arguments of :func:`minsnap.plan`, such as ``yaw``, ``closed`` or ``search``.

    Returns
    -------
    Plan
        ``4 * laps`` legs.

    Raises
    ------
    ShapeError
        If a side is not positive, the laps are not a whole number from 1, or the corner is not one of 0 to 3.
    MinsnapError
        Whatever else :func:`minsnap.plan` raises.
    """
    corners = _corners(width, length, altitude, center)
    turns = _check_count("number of laps", laps, 1, MOST_LAPS)
    first = _check_count("start corner", start_corner, 0, 3)
    steps = np.arange(4 * turns + 1) * (-1 if checks.check_switch("clockwise", clockwise) else 1)
    waypoints = corners[(first + steps) % 4]
    times = {"total_time": total_time, "durations": durations, "limits": limits}
    return plan(waypoints, corridor=corridor, **timed(times | options))


def timed(planning: dict[str, Any]) -> dict[str, Any]:
    """Return arguments of a plan, with ordinary limits where nothing among them says how fast it is flown."""
    if is_priced(planning) or any(planning.get(name) is not None for name in ("durations", "total_time", "limits")):
        return planning
    from minsnap.limits.ordinary import ordinary_limits

    return planning | {"limits": ordinary_limits()}


def _corners(width: float, length: float, altitude: float, center: Sequence[float]) -> FloatArray:
    half_x = checks.check_positive("the width", width, "m", ShapeError) / 2.0
    half_y = checks.check_positive("the length", length, "m", ShapeError) / 2.0
    x, y = check_point("center", center, 2)
    z = check_finite("altitude", altitude, "metres")
    return np.array([[x + i * half_x, y + j * half_y, z] for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def _check_count(name: str, value: int, least: int, most: int) -> int:
    give = f"it must be a whole number from {least} to {most}"
    return int(checks.check_number(f"the {name}", value, least, most, give, ShapeError, whole=True))


def _constant_speed(
    ends: FloatArray, total_time: float | None, limits: Limits | None, yaw: Yaw = None, **options: Any
) -> Trajectory:
    if limits is not None or options:
        names = ", ".join([*(["limits"] if limits is not None else []), *options])
        raise TimingError(f"a line at constant speed has nothing to plan: leave out {names}")
    default = (LINE_SAMPLES - 1) / 20.0
    seconds = checks.check_positive("the total time", default if total_time is None else total_time, "s", ShapeError)
    curve = Trajectory(ends[None], np.array([seconds]))
    return curve.with_yaw(chosen_heading(yaw, 1, False)(curve))
