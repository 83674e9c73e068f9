"""Where a new plan takes over: the flown state there, what is left of the plan, and headings that begin as its own."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import check_number, check_positive
from minsnap.basics.tolerances import EXACT, ROUNDING
from minsnap.errors import InputError, TimingError
from minsnap.polynomials.bernstein import powers_to_points, split
from minsnap.trajectory.heading import ConstantHeading, Heading, shortest_turns, turned_to, wrap
from minsnap.trajectory.instants import as_instants, check_order
from minsnap.trajectory.planned_heading import ChosenHeading, PlannedHeading
from minsnap.trajectory.trajectory import Trajectory, as_rest_of, rest_of, turned

RESTING = 1e-9
"""Derivative, in units of the metre and the second, below which a plan ends at rest."""


@dataclass(frozen=True, eq=False)
class Splice:
    """An instant of a flown plan.

    Parameters
    ----------
    flown : Trajectory
    instant : float
        On its clock [s].
    half : int
        Derivatives 0 ... k - 1 are taken over.
    """

    flown: Trajectory
    instant: float
    half: int

    @property
    def source(self) -> tuple[Trajectory, float]:
        """The plan of which the flown one is the rest, and the instant on its clock [s]: cuts do not add up."""
        whole, start = rest_of(self.flown) or (self.flown, 0.0)
        return whole, min(start + self.instant, whole.duration)

    @property
    def over(self) -> bool:
        """Whether the flown plan has ended by then."""
        return self.instant >= self.flown.duration * (1.0 - ROUNDING)

    @cached_property
    def state(self) -> FloatArray:
        """Derivatives 0 ... k - 1, (k, dim)."""
        whole, at = self.source
        return whole.states(at, self.half)

    @property
    def passed(self) -> int:
        """Legs of the flown plan that end before."""
        inner = self.flown.leg_breaks[1:-1]
        return int(np.searchsorted(inner, self.instant * (1.0 + ROUNDING), side="right"))

    @property
    def leg_start(self) -> FloatArray:
        """Position where the leg that is being flown begins, the end of a plan that is over, (dim,) [m]."""
        if self.over:
            return np.asarray(self.flown.control_points[-1, -1])
        return np.asarray(self.flown.control_points[self.passed * self.flown.pieces, 0])

    @cached_property
    def rest(self) -> Trajectory | None:
        """What is left, from time 0, with as many pieces on every leg; None where it is over."""
        if self.over:
            return None
        (flown, at), pieces = self.source, self.flown.pieces
        piece = int(np.searchsorted(flown.breaks, at * (1.0 + ROUNDING), side="right")) - 1
        low = max(float((at - flown.breaks[piece]) / flown.durations[piece]), 0.0)
        first = split(flown.control_points[piece], low)[1]
        parts = (piece - len(flown.durations)) % pieces + 1
        points = np.concatenate((divided(first, parts), flown.control_points[piece + 1 :]))
        own = np.full(parts, (flown.breaks[piece + 1] - at) / parts)
        durations = np.concatenate((own, flown.durations[piece + 1 :]))
        rest = as_rest_of(Trajectory(points, durations, pieces=pieces), flown, at)
        return turned(self.flown, rest, self.instant)


def divided(points: FloatArray, parts: int) -> FloatArray:
    """Control points (parts, n + 1, dim) of equal parts of a polynomial."""
    pieces = []
    for part in range(parts, 1, -1):
        first, points = split(points, 1.0 / part)
        pieces.append(first)
    return np.stack([*pieces, points])


def ends_at_rest(curve: Trajectory) -> bool:
    """Whether velocity, acceleration and jerk are zero at the end."""
    return all(np.abs(curve(curve.duration, order)).max() <= RESTING for order in (1, 2, 3))


def splice_of(flown: Trajectory, now: float, budget: float, half: int) -> Splice:
    """Check the arguments and return the splice.

    Raises
    ------
    InputError
        If ``flown`` is no trajectory, or ``now`` or ``budget`` is no number.
    TimingError
        If ``now`` is before the flown plan, or that ends before the splice and not at rest: after an end at rest the
        vehicle hovers there.
    """
    if not isinstance(flown, Trajectory):
        raise InputError(f"a Trajectory is replanned, not a {type(flown).__name__}")
    for name, value in (("now", now), ("budget", budget)):
        check_number(name, value, -inf, inf, "give a number of seconds")
    check_positive("the budget", budget, "s", TimingError)
    if now < 0.0:
        raise TimingError(
            f"now is {now:.6g} s, before the start of the flown plan of {flown.duration:.6g} s: a change begins at its "
            "splice; fly the former plan until change.splice, and give its clock until then"
        )
    splice = Splice(flown, float(now) + float(budget), half)
    if splice.over and not ends_at_rest(flown):
        raise TimingError(
            f"the flown plan ends at {flown.duration:.6g} s, in motion, before the splice at {splice.instant:.6g} s: "
            "replan earlier"
        )
    return splice


RATE = 1.0
"""Rate at which a difference of headings is turned away where no limit says more [rad/s]."""

SHORTEST_TURN = 0.5
"""Seconds over which one is turned away at least."""

STEEPEST = 1.875
"""Largest rate of the quintic 1 - 10 s^3 + 15 s^4 - 6 s^5."""


@dataclass(frozen=True, eq=False)
class SplicedHeading(Heading):
    """A heading plus a difference that a quintic takes away.

    Parameters
    ----------
    heading : Heading
        Where it ends.
    gap, rate : float
        Difference at the start [rad] and its rate [rad/s].
    span : float
        After so long the difference is zero [s].
    """

    heading: Heading
    gap: float
    rate: float
    span: float

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
        """Yaw or its derivative at ``t``, in the shape of ``t``."""
        instants = as_instants(t)
        s = np.clip(instants / self.span, 0.0, 1.0)
        offset = np.polynomial.Polynomial(quintic(self.gap, self.rate * self.span)).deriv(check_order(order))(s)
        inside = instants < self.span
        return np.asarray(self.heading(t, order) + np.where(inside, offset / self.span**order, 0.0))


def quintic(a: float, b: float) -> FloatArray:
    """Coefficients of 1, s, s^2, ... of the quintic with value a and slope b at 0, no bend there, and all zero at 1."""
    return np.array([a, b, 0.0, -10.0 * a - 6.0 * b, 15.0 * a + 8.0 * b, -6.0 * a - 3.0 * b])


def through_angles(flown: Trajectory, instant: float, angles: FloatArray) -> ChosenHeading:
    """Return what gives a curve a spline through one angle per waypoint, from a flown heading and its rate.

    Parameters
    ----------
    flown : Trajectory
    instant : float
        Where the curve begins, on its clock [s].
    angles : ndarray, shape (n,)
        At the ends of the legs of the curve, which has n at most [rad].
    """
    at = min(instant, flown.duration)
    start, rate = flown.yaw(at), float(flown.yaw(at, 1))

    def heading(curve: Trajectory) -> Heading:
        turned = shortest_turns(np.append(start, angles[: curve.legs]))
        return PlannedHeading.through(turned, np.diff(curve.leg_breaks), False, rate)

    return heading


def has_angles(curve: Trajectory, angles: FloatArray | None) -> bool:
    """Whether a curve has these headings at the ends of its legs, but for whole turns; true without headings."""
    return angles is None or bool(np.abs(wrap(curve.yaw(curve.leg_breaks[1:]) - angles[: curve.legs])).max() <= EXACT)


def spliced(
    flown: Trajectory, instant: float, chosen: ChosenHeading | None, limit: float | None, curve: Trajectory
) -> Heading:
    """Return the heading of a curve that begins as a flown one is turned at an instant.

    Parameters
    ----------
    flown : Trajectory
    instant : float
        On its clock [s].
    chosen : callable or None
        Gives a curve its heading; None holds the flown heading.
    limit : float or None
        Of the yaw rate [rad/s].
    curve : Trajectory
        From the splice on.
    """
    at = min(instant, flown.duration)
    if chosen is None and flown.yaw.constant is not None:
        return flown.yaw
    if flown.yaw.medium is not None and (chosen is None or chosen(curve).medium is not None):
        return turned_to(flown.yaw.on(curve, at), float(flown.yaw(at)))
    yaw, rate = float(flown.yaw(at)), float(flown.yaw(at, 1))
    base = ConstantHeading(yaw) if chosen is None else turned_to(chosen(curve), yaw)
    gap, excess = yaw - float(base(0.0)), rate - float(base(0.0, 1))
    if abs(gap) <= ROUNDING and abs(excess) <= ROUNDING:
        return base
    span = max(SHORTEST_TURN, STEEPEST * abs(gap) / (RATE if limit is None else 0.5 * limit))
    if base.constant is not None:
        return _turned_away(base.constant, gap, excess, span, curve.duration)
    return SplicedHeading(base, gap, excess, span)


def braked(flown: Trajectory, instant: float, curve: Trajectory) -> Heading:
    """Return the heading of a stop: a turn that is flown ends with it, as gently as it can, and never turns faster."""
    yaw, rate = float(flown.yaw(min(instant, flown.duration))), float(flown.yaw(min(instant, flown.duration), 1))
    if flown.yaw.constant is not None or flown.yaw.medium is not None or abs(rate) <= ROUNDING:
        return spliced(flown, instant, None, None, curve)
    span = max(SHORTEST_TURN, curve.duration)
    return _turned_away(yaw + 0.5 * rate * span, -0.5 * rate * span, rate, span, curve.duration)


def _turned_away(angle: float, gap: float, rate: float, span: float, duration: float) -> PlannedHeading:
    """Return a constant heading plus a difference as a polynomial yaw, whose largest rate is exact."""
    turn = angle + powers_to_points(5) @ quintic(gap, rate * span)
    turn[3:] = angle
    points = np.stack((turn, np.full(6, angle)))[:, :, None]
    whole = Trajectory(points, np.array([span, max(duration - span, span)]))
    return PlannedHeading(whole.between(0.0, min(duration, whole.duration)))  # whose sum may round down
