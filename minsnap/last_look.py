"""The last look at a plan before it leaves: every wall, limit, waypoint, pin, continuity and time of the request.

It judges the curve by its stored control points alone, with the proofs of ``certify``, whatever found it.  Of what the
solver believes it takes nothing over.  A margin that ``certify``'s own proof gave of this very curve and this very wall
counts as looked at, and so does the use of these very limits by this very curve: all are compared by identity, so that
another curve, the same one at another speed, or a wall or limits that the solver did not know are measured anew.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.certificate import continuity
from minsnap.corridors.constraint import Walls
from minsnap.corridors.knot_regions import STORED, Placement, passing
from minsnap.corridors.margins import Margin, margin_to
from minsnap.native.quick_look import keeps as keeps_states
from minsnap.polynomials.bernstein import derivative_basis_map
from minsnap.trajectory.trajectory import Trajectory, made

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits


@dataclass(frozen=True, eq=False)
class AskedCurve:
    """What was asked of a plan, besides its limits and its times.

    Parameters
    ----------
    placement : Placement
        Where the waypoints may be passed.
    pins : mapping of int to mapping of int to ndarray, shape (dim,)
        Derivatives at waypoints, by order [m/s^order].
    continuity : int
        Order up to which derivatives are continuous.
    closed : bool
        Whether the end is the start, in its derivatives too.
    pieces : int
        Polynomials a leg.
    walls : sequence of Walls
    """

    placement: Placement
    pins: Mapping[int, Mapping[int, FloatArray]]
    continuity: int
    closed: bool = False
    pieces: int = 1
    walls: Sequence[Walls] = ()

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self.placement.points) - 1

    @property
    def dim(self) -> int:
        """Number of coordinates."""
        return int(self.placement.points.shape[1])


def fault(
    asked: AskedCurve,
    curve: Trajectory,
    limits: Limits | None,
    times: FloatArray | float | None = None,
    limits_from: float = 0.0,
    margins: Mapping[int, Margin] | None = None,
) -> str | None:
    """Return which condition a curve does not keep, or None.

    Parameters
    ----------
    asked : AskedCurve
    curve : Trajectory
        With its yaw.
    limits : Limits, optional
    times : ndarray, shape (legs,), or float, optional
        Durations that were asked for, or their total [s].
    limits_from : float
        Instant from which the limits are asked for [s].
    margins : mapping of int to Margin, optional
        What ``certify``'s own proof gave of this very curve, by the identity of the walls.
    """
    return (
        _wrong_times(curve, times)
        or (None if _seen_at_once(asked, curve) else _wrong_waypoints(asked, curve) or _wrong_knots(asked, curve))
        or _left_walls(asked.walls, curve, margins or {})
        or _broken_limits(limits, curve, limits_from)
    )


def fault_as_one_leg(
    curve: Trajectory, ends: FloatArray, start: Mapping[int, FloatArray], half: int, duration: float
) -> str | None:
    """Return what a curve of whatever legs does not keep on its way from a state at the start to rest, or None.

    Parameters
    ----------
    curve : Trajectory
    ends : ndarray, shape (2, dim)
        Where it begins and ends [m].
    start : mapping of int to ndarray, shape (dim,)
        Derivatives at the start, by order; those that are not named are zero [m/s^order].
    half : int
        Derivatives 0 ... k - 1 are continuous, and those of order 1 ... k - 1 are zero at the end.
    duration : float
        [s]
    """
    times, points, moves = curve.durations, curve.control_points, any(value.any() for value in start.values())
    if not moves and curve.duration == duration and keeps_states(ends, times, points, half - 1, half - 1):
        return None
    still, exactly = {order: np.zeros(curve.dim) for order in range(1, half)}, np.zeros(ends.shape)
    pins = {0: still | dict(start), 1: still}
    asked = AskedCurve(Placement(ends, exactly, exactly), pins, half - 1, pieces=len(times))
    return fault(asked, made(points, times, len(times)), None, duration)


def _wrong_times(curve: Trajectory, times: FloatArray | float | None) -> str | None:
    if times is None:
        return None
    own: FloatArray | float = curve.duration if isinstance(times, float) else np.diff(curve.leg_breaks)
    apart = float(np.abs(np.subtract(own, times)).max())
    return (
        f"it takes {curve.duration:.9g} s, and other times were asked for" if apart > EXACT * curve.duration else None
    )


def _seen_at_once(asked: AskedCurve, curve: Trajectory) -> bool:
    """Whether the native core sees waypoints that are fixed, the states at both ends and no others, and every joint."""
    place = asked.placement
    if place.regions or asked.closed or len(curve.durations) != asked.legs * asked.pieces or curve.dim != asked.dim:
        return False
    start, end = (sorted(asked.pins.get(k, {}).items()) for k in (0, asked.legs))
    highest = len(start)
    orders = [*range(1, highest + 1)] * 2
    if [order for order, _ in start + end] != orders or any(asked.pins[k] for k in asked.pins if 0 < k < asked.legs):
        return False
    states = np.array([value for _, value in start + end])
    arrays = place.points, curve.durations, curve.control_points, asked.continuity, highest
    return keeps_states(*arrays, states=states if states.any() else None)


def _wrong_waypoints(asked: AskedCurve, curve: Trajectory) -> str | None:
    if curve.legs != asked.legs or curve.dim != asked.dim:
        return f"it has {curve.legs} legs and {curve.dim} coordinates, and {asked.legs} and {asked.dim} were asked for"
    outside, passes = passing(curve, asked.placement)
    return None if passes else f"it passes a waypoint {outside:.3g} m outside of where it may, or the wrong way"


def _wrong_knots(asked: AskedCurve, curve: Trajectory) -> str | None:
    if len(curve.durations) > 1 and continuity(curve) < asked.continuity:
        return f"its derivatives are continuous up to order {continuity(curve)}, and {asked.continuity} was asked for"
    for waypoint, state in asked.pins.items():
        if not state:
            continue
        orders = np.array(list(state))
        values = np.array(list(state.values()))
        allowed = EXACT * np.abs(values).max(axis=1)
        for value, rounding in _sides(curve, waypoint, max(state)):
            wrong = np.abs(value[orders] - values).max(axis=1) > rounding[orders] + allowed
            if wrong.any():
                return f"derivative {orders[wrong][0]} at waypoint {waypoint} is not the one that is pinned there"
    if asked.closed:
        first, last = _sides(curve, 0, asked.continuity), _sides(curve, asked.legs, asked.continuity)
        (start, room), (end, other) = (*first, *last)
        wrong = np.abs(end - start).max(axis=1)[1:] > np.maximum(room, other)[1:]
        if wrong.any():
            return f"derivative {1 + int(wrong.argmax())} at the end of the lap is not that at its start"
    return None


def _sides(curve: Trajectory, waypoint: int, highest: int) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield derivatives (highest + 1, dim) on both sides of a waypoint, and what rounding may make of them."""
    points, knot = curve.control_points, waypoint * curve.pieces
    if waypoint < curve.legs:
        yield _derivatives(points[knot], float(curve.durations[knot]), highest)
    if waypoint:
        yield _derivatives(points[knot - 1, ::-1], -float(curve.durations[knot - 1]), highest)


def _derivatives(points: FloatArray, duration: float, highest: int) -> tuple[FloatArray, FloatArray]:
    """Return derivatives at the first control point, of a duration that is negative backwards, and their rounding."""
    differences = np.array([derivative_basis_map(len(points) - 1, order)[0] for order in range(highest + 1)])
    offsets, sums = points - points[0], np.abs(differences).sum(axis=1)
    powers = duration ** -np.arange(highest + 1.0)
    rounding = EXACT * np.abs(offsets).max() + STORED * np.abs(points).max()
    return (differences @ offsets) * powers[:, None], sums * np.abs(powers) * rounding


def _left_walls(walls: Sequence[Walls], curve: Trajectory, known: Mapping[int, Margin]) -> str | None:
    for wall in walls:
        if not len(wall.leg):
            continue
        margin = known.get(id(wall)) or margin_to(curve, wall)
        if not margin.value >= 0.0:
            return (
                f"it leaves the {wall.name} of leg {margin.leg} by {-margin.value:.3g} at {margin.instant:.4g} s"
                f"{f', in derivative {wall.order}' if wall.order else ''}"
            )
    return None


def _broken_limits(limits: Limits | None, curve: Trajectory, start: float) -> str | None:
    if limits is None:
        return None
    from minsnap.limits.compliance import KEPT, keeps, use_from

    if start <= 0.0 and keeps(limits, curve):
        return None
    for used in use_from(limits, curve, start):
        if not used.fraction <= 1.0 + KEPT:
            return f"{used.name} reaches {used.value:.9g} at {used.instant:.4g} s where {used.limit:.9g} is allowed"
    return None
