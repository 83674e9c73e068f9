"""Line and rectangle: shapes with straight legs, flown from rest to rest with minimum snap."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.argument_names import explains_names
from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_positive, check_switch, is_whole, refuse_repeated
from minsnap.basics.messages import shown
from minsnap.errors import ShapeError, TimingError
from minsnap.paths.shapes.curves import check_finite, check_point
from minsnap.planning.planner import plan
from minsnap.time_allocation.search_options import is_priced
from minsnap.trajectory.heading import ConstantHeading
from minsnap.trajectory.trajectory import Trajectory

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits

SPEED = 1.0
"""Average speed of a line without a time and limits [m/s]."""

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
        Seconds; at 1 m/s on average unless this or limits are set.
    limits : Limits, optional
        What not to exceed: the line is then flown in the shortest time that keeps them.
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
    distance = float(np.linalg.norm(ends[1] - ends[0]))
    if distance == 0.0:
        raise ShapeError(f"the line starts and ends at {tuple(ends[0].tolist())}: give it two ends")
    if check_switch("constant_speed", constant_speed):
        return _constant_speed(ends, total_time, limits, **options)
    if total_time is None and limits is None and not is_priced(options):
        total_time = distance / SPEED
    return _plan(ends, total_time=total_time, limits=limits, **options)


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
    durations: npt.ArrayLike | None = None,
    limits: Limits | None = None,
    **options: Any,
) -> Trajectory:
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
        As :func:`minsnap.plan` takes them; by default the shortest time within 3 m/s and 6 m/s^2.
    **options
        More arguments of :func:`minsnap.plan`, such as ``yaw``, ``closed`` or ``search``.

    Returns
    -------
    Trajectory
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
    steps = np.arange(4 * turns + 1) * (-1 if check_switch("clockwise", clockwise) else 1)
    waypoints = corners[(first + steps) % 4]
    if total_time is None and durations is None and limits is None and not is_priced(options):
        from minsnap.limits.ordinary import ordinary_limits

        limits = ordinary_limits()
    times = {"total_time": total_time, "durations": durations, "limits": limits}
    return _plan(waypoints, corridor=corridor, **times, **options)


def leg_durations(waypoints: FloatArray) -> FloatArray:
    """Return leg durations for an average speed of 1 m/s, shape (n - 1,) [s], or refuse a leg without length."""
    refuse_repeated(waypoints, "give every leg a duration")
    return np.asarray(np.linalg.norm(np.diff(waypoints, axis=0), axis=1) / SPEED)


def _corners(width: float, length: float, altitude: float, center: Sequence[float]) -> FloatArray:
    half_x = check_positive("the width", width, "m", ShapeError) / 2.0
    half_y = check_positive("the length", length, "m", ShapeError) / 2.0
    x, y = check_point("center", center, 2)
    z = check_finite("altitude", altitude, "metres")
    return np.array([[x + i * half_x, y + j * half_y, z] for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def _check_count(name: str, value: int, least: int, most: int) -> int:
    if not is_whole(value) or not least <= value <= most:
        raise ShapeError(f"the {name} is {shown(value)}: it must be a whole number from {least} to {most}")
    return int(value)


def _constant_speed(
    ends: FloatArray, total_time: float | None, limits: Limits | None, yaw: float = 0.0, **options: Any
) -> Trajectory:
    if limits is not None or options:
        names = ", ".join([*(["limits"] if limits is not None else []), *options])
        raise TimingError(f"a line at constant speed has nothing to plan: leave out {names}")
    default = (LINE_SAMPLES - 1) / 20.0
    seconds = check_positive("the total time", default if total_time is None else total_time, "s", ShapeError)
    return Trajectory(ends[None], np.array([seconds]), ConstantHeading(yaw))


def _plan(waypoints: FloatArray, **arguments: Any) -> Trajectory:
    return plan(waypoints, **{name: value for name, value in arguments.items() if value is not None})
