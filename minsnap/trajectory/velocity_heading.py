"""A heading along the velocity that is held, and turned at a limited rate, where the path is slow."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, set_fields
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import check_number, check_positive
from minsnap.basics.limit_kinds import KIND
from minsnap.basics.warn import warn_caller
from minsnap.errors import MagnitudeWarning, YawError
from minsnap.native.shortest_time import InstantKind, InstantLimit, YawRule
from minsnap.trajectory.heading import Heading, Largest, RuledHeading, nearest_turn
from minsnap.trajectory.instants import parted_instants
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.turn_rates import largest_turn_within


@dataclass(frozen=True)
class TurnSettings:
    """When a heading along the velocity is held, and how it turns meanwhile.

    Parameters
    ----------
    ease : float
        Time at most in which a turning heading comes to rest, or starts to turn, beside a hold [s].
    reserve : float
        Share of the rate that is left free for rounding.
    held_rate : float
        Largest rate at which a held heading turns, by default [rad/s].
    slow : float
        Horizontal speed below which the heading is held, by default [m/s].
    slow_share : float
        The same as a share of the top speed, if that is less.
    held_room : float
        Allowance of a turn in a search where the heading is held, for rest; in units of the limit at typical speed.
    resting : float
        Share of the top speed, climbing included, that no horizontal speed exceeds where a path only climbs.
    samples : int
        Instants a polynomial piece at which the turns of the velocity are counted.
    most : float
        Largest angle of a heading at the start [rad].
    """

    ease: float = 0.5
    reserve: float = 1e-9
    held_rate: float = 2.0
    slow: float = 0.5
    slow_share: float = 0.1
    held_room: float = 10.0
    resting: float = 1e-6
    samples: int = 64
    most: float = 4.0 * np.pi


TURNING = TurnSettings()


@dataclass(frozen=True, eq=False)
class HeadingTable:
    r"""A heading at instants: its angle, its rate, and where it follows the velocity.

    Between two instants a hold turns the heading in three steps: the rate goes to zero linearly, the heading turns by a
    cubic polynomial from rest to rest, and the rate grows linearly to that at the end.  Its largest rate is
    :math:`\max(|r_a|, |r_b|, 1.5\,|\Delta| / L)` with L the length of the middle step.

    Parameters
    ----------
    t : ndarray, shape (m,)
        Increasing [s].
    angle, rate : ndarray, shape (m,)
        Of the velocity [rad], not wrapped; [rad/s].
    fast : ndarray of bool, shape (m,)
        Where the heading follows the velocity.
    given : bool
        Whether the first angle is a given one, from which the heading turns in a hold: the first instant counts as
        fast, and the second one does not.
    """

    t: FloatArray
    angle: FloatArray
    rate: FloatArray
    fast: BoolArray
    given: bool = False

    def holds(self, most: float) -> list[tuple[int, int]]:
        """Return the holds, first and last instant by index, widened until each turns at ``most`` [rad/s] or less.

        An index of -1, or m, is that of a hold that begins, or ends, with the path; holds that meet are joined.
        """
        slow = np.concatenate(([False], ~self.fast, [False]))
        edges = np.flatnonzero(slow[1:] != slow[:-1]).reshape(-1, 2)
        runs, at = [(int(first) - 1, int(last)) for first, last in edges], 0
        while at < len(runs):
            low = runs[at - 1][1] if at else 0
            high = runs[at + 1][0] if at + 1 < len(runs) else len(self.t) - 1
            wide = self._widened(runs[at], (low, high), most * (1.0 - TURNING.reserve))
            runs = self._joined(runs, at, (low, high)) if wide is None else [*runs[:at], wide, *runs[at + 1 :]]
            # A joined hold takes room from the one before it, which may have to be wider now: go back to that one.
            at = at + 1 if wide is not None else max(at - 1, 0)
        return runs

    def turn(self, first: FloatArray, last: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return length of the eased ends, length and angle of the middle step between instants by index, each (w,)."""
        span = self.t[last] - self.t[first]
        ease = np.minimum(TURNING.ease, span / 4.0)
        eased = 0.5 * ease * (self.rate[first] + self.rate[last])
        angle = self.angle[last] - self.angle[first] - eased
        return ease, span - 2.0 * ease, np.asarray(angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi)))

    def _widened(self, hold: tuple[int, int], room: tuple[int, int], most: float) -> tuple[int, int] | None:
        """Return the narrowest hold around one that turns at ``most`` or less; None if the room is too narrow."""
        (first, last), (low, high) = hold, room
        begins, ends = first < 0, last >= len(self.t)
        if begins and ends:
            return hold
        free = begins or (self.given and first == 0)
        steps = np.arange(1 + min(len(self.t) if free else first - low, len(self.t) if ends else high - last))
        before, after = np.maximum(first - steps, 0), np.minimum(last + steps, len(self.t) - 1)
        largest = self._largest(after if begins else before, before if ends else after, begins or ends)
        good = np.flatnonzero(largest <= most)
        if not len(good):
            return None
        return (first if free else first - int(good[0]), last if ends else last + int(good[0]))

    def _largest(self, first: FloatArray, last: FloatArray, open_ended: bool) -> FloatArray:
        """Largest rates of holds by index; one that begins or ends with the path only eases."""
        ends = np.maximum(np.abs(self.rate[first]), np.abs(self.rate[last]))
        if open_ended:
            return np.asarray(ends)
        _, middle, angle = self.turn(first, last)
        # The middle step is a cubic from rest to rest: in its middle it turns 1.5 times as fast as on average.
        return np.asarray(np.maximum(ends, 1.5 * np.abs(angle) / middle))

    def _joined(self, runs: list[tuple[int, int]], at: int, room: tuple[int, int]) -> list[tuple[int, int]]:
        """Join a hold that has no room with its nearer neighbour, or let it begin or end with the path."""
        (first, last), (low, high), size = runs[at], room, len(self.t)
        if first >= 0 and not (self.given and first == 0) and (last >= size or first - low <= high - last):
            merged = (runs[at - 1][0] if at else -1, last)
            return [*runs[: max(at - 1, 0)], merged, *runs[at + 1 :]]
        merged = (first, runs[at + 1][1] if at + 1 < len(runs) else size)
        return [*runs[:at], merged, *runs[at + 2 :]]


@dataclass(frozen=True, eq=False)
class Turns:
    r"""A piecewise cubic angle: :math:`\psi = c_0 + c_1 s + c_2 s^2 + c_3 s^3` with s the time since the piece began.

    Parameters
    ----------
    starts : ndarray, shape (m,)
        Where pieces begin [s]; those that follow the velocity are among them.
    coefficients : ndarray, shape (m, 4)
        Of an angle [rad]; those of a piece that follows the velocity say the angle where it begins, ``c_0``.
    follows : ndarray of bool, shape (m,)
        Which pieces follow the velocity.
    """

    starts: FloatArray
    coefficients: FloatArray
    follows: BoolArray

    def largest(self, start: float, end: float) -> tuple[float, float]:
        """Largest rate between two instants of all pieces that do not follow [rad/s], exact, and where [s]."""
        low = np.clip(self.starts, start, end)
        high = np.clip(np.append(self.starts[1:], end), start, end)
        own = ~self.follows & (low < high)
        began, low, high, (_, c1, c2, c3) = self.starts[own], low[own], high[own], self.coefficients[own].T
        top = began - c2 / np.where(c3 == 0.0, np.inf, 3.0 * c3)
        t = np.stack((low, np.clip(top, low, high), high))
        s = t - began
        rate = np.abs(c1 + s * (2.0 * c2 + 3.0 * s * c3))
        at = np.unravel_index(rate.argmax(), rate.shape) if rate.size else None
        return (0.0, start) if at is None else (float(rate[at]), float(t[at]))

    def piece(self, t: FloatArray) -> FloatArray:
        """Index of the piece at instants, shape (m,)."""
        return np.maximum(np.searchsorted(self.starts, t, side="right") - 1, 0)

    def __call__(self, t: FloatArray, order: int) -> FloatArray:
        """Angle, rate or acceleration (order 0, 1, 2) at instants (m,)."""
        piece = self.piece(t)
        s, (c0, c1, c2, c3) = t - self.starts[piece], self.coefficients[piece].T
        if order == 0:
            return np.asarray(c0 + s * (c1 + s * (c2 + s * c3)))
        return np.asarray(c1 + s * (2.0 * c2 + 3.0 * s * c3) if order == 1 else 2.0 * c2 + 6.0 * s * c3)


class _Piece(NamedTuple):
    """A piece of a heading: when it begins, its rate and the other coefficients, and the angle by which it turns."""

    start: float
    rates: tuple[float, float, float]
    angle: float
    follows: bool = False


def turns_of(table: HeadingTable, most: float) -> Turns:
    """Return how the heading of a table goes on: along the velocity, and through the holds at ``most`` or less."""
    holds, size = table.holds(most), len(table.t)
    ends, pieces = [0, *(index for hold in holds for index in hold), size - 1], list[_Piece]()
    for number, (since, until) in enumerate(zip(ends[::2], ends[1::2], strict=True)):
        if until >= 0 and since < size and not (table.given and until == 0):
            turned = float(table.angle[until] - table.angle[since])
            pieces.append(_Piece(float(table.t[since]), (0.0, 0.0, 0.0), turned, follows=True))
        pieces += _through(table, *holds[number]) if number < len(holds) else []
    # A hold that begins with the path ends where the velocity is then followed, or was fast first.
    first = 0 if pieces[0].follows else ends[2] if ends[2] < size else int(np.argmax(table.fast))
    first = 0 if table.given else first
    eases = not table.given and not pieces[0].follows
    before = sum(piece.angle for piece in pieces[1:2] if eases and not piece.follows)
    angles = np.cumsum([float(table.angle[first]) - before, *(piece.angle for piece in pieces[:-1])])
    starts, rates, _, follows = map(np.array, zip(*pieces, strict=True))
    return Turns(starts, np.column_stack((angles, rates)), follows)


def _through(table: HeadingTable, first: int, last: int) -> list[_Piece]:
    """Return the pieces of a hold: to rest, a turn, up to speed; one that begins or ends with the path only eases."""
    begins, ends = first < 0, last >= len(table.t)
    both = [max(first, 0), min(last, len(table.t) - 1)]
    (t, until), (rate, later) = table.t[both].tolist(), table.rate[both].tolist()
    ease, middle, angle = min(TURNING.ease, until - t), 1.0, 0.0
    if not begins and not ends:
        ease, middle, angle = map(float, table.turn(np.array(first), np.array(last)))
    turn = _Piece(t if begins else t + ease, (0.0, 3.0 * angle / middle**2, -2.0 * angle / middle**3), angle)
    if ease == 0.0:
        return [turn]
    slower = _Piece(t, (rate, -rate / (2.0 * ease), 0.0), 0.5 * rate * ease)
    faster = _Piece(until - ease, (0.0, later / (2.0 * ease), 0.0), 0.5 * later * ease)
    return [*([] if begins else [slower]), turn, *([] if ends else [faster])]


@dataclass(frozen=True)
class Velocity:
    """A yaw along the velocity, as :func:`minsnap.plan` takes it; ``yaw="velocity"`` is the one without parameters.

    Parameters
    ----------
    yaw_rate : float, optional
        Largest rate at which a held heading turns [rad/s]; by default the limit on the yaw rate, or 2 rad/s.
    hold_below : float, optional
        Horizontal speed below which the heading is held [m/s]; by default a tenth of the top one, at most 0.5 m/s.
    yaw_at_start : float, optional
        Heading of the vehicle at the start [rad], from which it turns; by default that in which the path sets out.

    Raises
    ------
    YawError
        If a value is not positive, or the heading no number; on use, if the rate is more than the limit.
    """

    yaw_rate: float | None = None
    hold_below: float | None = None
    yaw_at_start: float | None = None

    def __post_init__(self) -> None:
        for name, unit in (("yaw_rate", "rad/s"), ("hold_below", "m/s")):
            if getattr(self, name) is not None:
                set_fields(self, **{name: check_positive(name, getattr(self, name), unit, YawError)})
        doubt = "" if self.yaw_rate is None else KIND["yaw_rate"].doubt(self.yaw_rate)
        if doubt:
            warn_caller(doubt, MagnitudeWarning)
        if self.yaw_at_start is not None:
            most, give = TURNING.most, "give an angle [rad]"
            angle = check_number("yaw_at_start", self.yaw_at_start, -most, most, give, YawError)
            set_fields(self, yaw_at_start=float(angle))

    def within(self, limit: float | None) -> Velocity:
        """Return the same with the rate of a limit [rad/s] where it has none of its own."""
        if limit is None or (self.yaw_rate is not None and self.yaw_rate <= limit):
            return self
        if self.yaw_rate is not None:
            raise YawError(f"yaw_rate={self.yaw_rate:g} is more than the limit of {limit:g} rad/s: lower it")
        return replace(self, yaw_rate=limit)

    def heading(self, curve: Path) -> VelocityHeading:
        """Return the heading along the velocity of a curve."""
        return VelocityHeading(curve, self.yaw_rate, self.hold_below, self.yaw_at_start)


class VelocityHeading(RuledHeading):
    r"""Yaw along the horizontal velocity, continuous with a continuous rate over the whole path.

    :math:`\psi = \operatorname{atan2}(v_y, v_x)`,
    :math:`\dot\psi = (v_x a_y - v_y a_x) / (v_x^2 + v_y^2)`.  Where the path is slower than ``hold_below``, as where it
    rests, climbs or turns back, that rate has no bound.  There the heading is held and turns the shortest way to the
    direction in which the path goes on, at ``yaw_rate`` at most; where the time is too short for that, it begins to
    turn earlier and ends later (see :mod:`minsnap.trajectory.velocity_heading`).

    Parameters
    ----------
    path : Path
        Anything with a horizontal velocity: dim 2 or more.
    yaw_rate : float, optional
        Largest rate of a held heading [rad/s]; by default 2. Where the path itself turns faster, at speed, the
        heading does so too.
    hold_below : float, optional
        Horizontal speed below which the heading is held [m/s]; by default a tenth of the top one, at most 0.5 m/s.
    yaw_at_start : float, optional
        Heading at the start [rad], from which the path's is turned to in a hold; by default the path's own.

    Raises
    ------
    YawError
        If the path has fewer than two coordinates or never moves horizontally, or a parameter is not positive.
    """

    what, highest = "a yaw along the velocity", 2

    def __init__(
        self,
        path: Path,
        yaw_rate: float | None = None,
        hold_below: float | None = None,
        yaw_at_start: float | None = None,
    ) -> None:
        if path.dim < 2:
            raise YawError("a yaw along the velocity needs at least two coordinates, this path has one")
        rule = Velocity(yaw_rate, hold_below, yaw_at_start)
        self.path, self.hold_below, self.yaw_at_start = path, rule.hold_below, rule.yaw_at_start
        self.yaw_rate = TURNING.held_rate if rule.yaw_rate is None else rule.yaw_rate
        grid = parted_instants(path, TURNING.samples, 4095)
        velocity = path(grid, 1)
        speed = np.linalg.norm(velocity[:, :2], axis=1)
        if not speed.max() > TURNING.resting * np.linalg.norm(velocity, axis=1).max():
            raise YawError("a yaw along the velocity needs a horizontal velocity, and this path has none")
        slow = min(self._slow(float(speed.max())), float(speed.max()))
        dips = _dips(path, grid, speed, slow)
        if len(dips):
            grid = np.sort(np.append(grid, dips))
            velocity = path(grid, 1)
            speed = np.linalg.norm(velocity[:, :2], axis=1)
        self._grid, self._fast = grid, speed >= slow
        self._angle = np.unwrap(_angle(velocity))

    def _slow(self, top: float) -> float:
        """Speed from which on the heading follows the velocity of a path with this top speed [m/s]."""
        return min(TURNING.slow, TURNING.slow_share * top) if self.hold_below is None else self.hold_below

    @cached_property
    def turns(self) -> Turns:
        """How the heading goes on, piece by piece."""
        rate = self._rate(self._grid, np.where(self._fast[:, None], self.path(self._grid, 1)[:, :2], 1.0))
        angle, fast = self._angle, self._fast
        if self.yaw_at_start is not None:
            angle, fast = angle.copy(), fast.copy()
            angle[0], rate[0], fast[:2] = self.yaw_at_start, 0.0, (True, False)
        return turns_of(HeadingTable(self._grid, angle, rate, fast, self.yaw_at_start is not None), self.yaw_rate)

    @property
    def breaks(self) -> FloatArray:
        """Where it begins and ends to follow the velocity, and to turn while it is held [s]."""
        return self.turns.starts

    @property
    def asked(self) -> tuple[YawRule, tuple[float, float, float]]:
        """The largest rate of a held heading, the speed below which it is held, and the angle at the start, or none."""
        start = np.inf if self.yaw_at_start is None else self.yaw_at_start
        return YawRule.VELOCITY, (self.yaw_rate, self.hold_below or 0.0, start)

    def on(self, curve: Path, start: float = 0.0, rate: float = 1.0) -> Heading:
        """Return the heading along the velocity of the whole path at another pace, else the same angles."""
        return super().on(curve, start, rate) if start != 0.0 or rate in (1.0, -1.0) else self.by_rule(curve)

    def by_rule(self, curve: Path) -> VelocityHeading:
        """Return the heading along the velocity of another path, held by the same rules."""
        return VelocityHeading(curve, self.yaw_rate, self.hold_below, self.yaw_at_start)

    def largest_rate(self, start: float, end: float) -> Largest | None:
        """Return the larger one of held turns and of those of a trajectory's velocity."""
        path, turns = self.path, self.turns
        if not isinstance(path, Trajectory):
            return None
        start, end = max(start, 0.0), min(end, path.duration)
        parts = np.stack((turns.starts, np.append(turns.starts[1:], path.duration)), axis=1)
        return max(turns.largest(start, end), largest_turn_within(path, parts[turns.follows].clip(start, end)))

    def rate_limits(self, most: float, length: float, speed: float) -> list[InstantLimit]:
        """Return the limit on the turns of the velocity, at speed."""
        return [InstantLimit(InstantKind.HEADING_RATE, (most, speed, self._slow(speed), TURNING.held_room))]

    def _rule(self) -> dict[str, Any]:
        given = {} if self.yaw_at_start is None else {"yaw_at_start": self.yaw_at_start}
        return {"rule": "velocity", "yaw_rate": self.yaw_rate, "hold_below": self.hold_below} | given

    def _at(self, t: FloatArray, order: int) -> FloatArray:
        value = self.turns(t, order)
        follows = self.turns.follows[self.turns.piece(t)]
        value[follows] = self._following(t[follows], order)
        return value

    def _following(self, t: FloatArray, order: int) -> FloatArray:
        velocity = self.path(t, 1)[:, :2]
        if order == 1:
            return self._rate(t, velocity)
        if order == 2:
            acceleration, jerk = self.path(t, 2)[:, :2], self.path(t, 3)[:, :2]
            square, along = (velocity**2).sum(axis=1), (velocity * acceleration).sum(axis=1)
            return np.asarray(_cross(velocity, jerk) / square - 2.0 * self._rate(t, velocity) * along / square)
        piece = self.turns.piece(t)
        began = np.interp(self.turns.starts[piece], self._grid, self._angle)
        near = self.turns.coefficients[piece, 0] + np.interp(t, self._grid, self._angle) - began
        return nearest_turn(_angle(velocity), near)

    def _rate(self, t: FloatArray, velocity: FloatArray) -> FloatArray:
        return np.asarray(_cross(velocity, self.path(t, 2)[:, :2]) / (velocity**2).sum(axis=1))


def _dips(path: Path, t: FloatArray, speed: FloatArray, slow: float) -> FloatArray:
    """Return instants at which a horizontal speed is below ``slow`` between samples (m,) that are not."""
    least = np.flatnonzero((speed[1:-1] <= np.minimum(speed[:-2], speed[2:])) & (speed[1:-1] >= slow))
    low, high, dips = t[least], t[least + 2], t[least + 1]
    for _ in range(4):  # of Newton's method, from where the path is nearly straight
        velocity, acceleration = path(dips, 1)[:, :2], path(dips, 2)[:, :2]
        square = np.maximum((acceleration**2).sum(axis=1), np.finfo(float).tiny)
        dips = np.clip(dips - (velocity * acceleration).sum(axis=1) / square, low, high)
    return np.asarray(dips[np.linalg.norm(path(dips, 1)[:, :2], axis=1) < slow])


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _angle(velocity: FloatArray) -> FloatArray:
    return np.arctan2(velocity[:, 1], velocity[:, 0])
