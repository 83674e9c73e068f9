"""Where a new plan takes over: the state of the flown plan there, what is left of it, and its heading."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_positive, is_number
from minsnap.basics.messages import shown
from minsnap.errors import InputError, TimingError
from minsnap.polynomials.bernstein import split
from minsnap.time_allocation.recovery import state_at
from minsnap.trajectory.trajectory import Trajectory

RESTING = 1e-9
"""Derivative, in units of the metre and the second, below which a plan ends at rest."""

ROUNDING = 1e-12
"""Share of the duration by which a splice may be beyond the end."""


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
        whole, start = self.flown.rest_of or (self.flown, 0.0)
        return whole, min(start + self.instant, whole.duration)

    @property
    def over(self) -> bool:
        """Whether the flown plan has ended by then."""
        return self.instant >= self.flown.duration * (1.0 - ROUNDING)

    @cached_property
    def state(self) -> FloatArray:
        """Derivatives 0 ... k - 1, (k, dim)."""
        whole, at = self.source
        return state_at(whole, at, self.half)

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
        rest = Trajectory(points, durations, pieces=pieces, rest_of=(flown, at))
        return self.flown.turned(rest, self.instant)


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
        if not is_number(value) or not np.isfinite(value):
            raise InputError(f"{name} is {shown(value)}: give a number of seconds")
    check_positive("the budget", budget, "s", TimingError)
    if now < 0.0:
        raise TimingError(f"now is {now:.6g} s, before the start of the flown plan of {flown.duration:.6g} s")
    splice = Splice(flown, float(now) + float(budget), half)
    if splice.over and not ends_at_rest(flown):
        raise TimingError(
            f"the flown plan ends at {flown.duration:.6g} s, in motion, before the splice at {splice.instant:.6g} s: "
            "replan earlier"
        )
    return splice
