"""Where a path is too slow for a heading along its velocity: for how long the heading is held, and how it turns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray

EASE = 0.5
"""Time at most in which a turning heading comes to rest, or starts to turn, beside a hold [s]."""

RESERVE = 1e-9
"""Share of the rate that is left free for rounding."""


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
    """

    t: FloatArray
    angle: FloatArray
    rate: FloatArray
    fast: BoolArray

    def holds(self, most: float) -> list[tuple[int, int]]:
        """Return the holds, first and last instant by index, widened until each turns at ``most`` [rad/s] or less.

        An index of -1, or m, is that of a hold that begins, or ends, with the path; holds that meet are joined.
        """
        runs, at = self._slow_runs, 0
        while at < len(runs):
            low = runs[at - 1][1] if at else 0
            high = runs[at + 1][0] if at + 1 < len(runs) else len(self.t) - 1
            wide = self._widened(runs[at], (low, high), most * (1.0 - RESERVE))
            runs = self._joined(runs, at, (low, high)) if wide is None else [*runs[:at], wide, *runs[at + 1 :]]
            # A joined hold takes room from the one before it, which may have to be wider now: go back to that one.
            at = at + 1 if wide is not None else max(at - 1, 0)
        return runs

    def turn(self, first: FloatArray, last: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return length of the eased ends, length and angle of the middle step between instants by index, each (w,)."""
        span = self.t[last] - self.t[first]
        ease = np.minimum(EASE, span / 4.0)
        eased = 0.5 * ease * (self.rate[first] + self.rate[last])
        angle = self.angle[last] - self.angle[first] - eased
        return ease, span - 2.0 * ease, np.asarray(angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi)))

    @cached_property
    def _slow_runs(self) -> list[tuple[int, int]]:
        slow = np.concatenate(([False], ~self.fast, [False]))
        edges = np.flatnonzero(slow[1:] != slow[:-1]).reshape(-1, 2)
        return [(int(first) - 1, int(last)) for first, last in edges]

    def _widened(self, hold: tuple[int, int], room: tuple[int, int], most: float) -> tuple[int, int] | None:
        """Return the narrowest hold around one that turns at ``most`` or less; None if the room is too narrow."""
        (first, last), (low, high) = hold, room
        begins, ends = first < 0, last >= len(self.t)
        if begins and ends:
            return hold
        steps = np.arange(1 + min(len(self.t) if begins else first - low, len(self.t) if ends else high - last))
        before, after = np.maximum(first - steps, 0), np.minimum(last + steps, len(self.t) - 1)
        largest = self._largest(after if begins else before, before if ends else after, begins or ends)
        good = np.flatnonzero(largest <= most)
        if not len(good):
            return None
        return (first if begins else first - int(good[0]), last if ends else last + int(good[0]))

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
        backwards = first >= 0 and (last >= size or first - low <= high - last)
        if backwards:
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


def turns_of(table: HeadingTable, most: float) -> Turns:
    """Return how the heading of a table goes on: along the velocity, and through the holds at ``most`` or less."""
    builder = _Builder(table)
    holds, size = table.holds(most), len(table.t)
    if not holds or holds[0][0] >= 0:
        builder.follow(0)
    for first, last in holds:
        builder.hold(first, last)
        if last < size:
            builder.follow(last)
    return Turns(np.array(builder.starts), np.array(builder.rows), np.array(builder.follows))


class _Builder:
    """The pieces so far, and the angle at which the last one ends."""

    def __init__(self, table: HeadingTable) -> None:
        self.table = table
        self.starts: list[float] = []
        self.rows: list[tuple[float, ...]] = []
        self.follows: list[bool] = []
        self.angle: float | None = None
        self.since = 0

    def follow(self, first: int) -> None:
        """Follow the velocity from an instant on."""
        self.angle = float(self.table.angle[first]) if self.angle is None else self.angle
        self.since = first
        self._add(float(self.table.t[first]), self.angle, follows=True)

    def hold(self, first: int, last: int) -> None:
        """Hold the heading between two instants by index."""
        if first < 0 or last >= len(self.table.t):
            self._open_hold(first, last)
            return
        t = self.table.t
        ease, middle, angle = (float(value) for value in self.table.turn(np.array(first), np.array(last)))
        self._slow_down(first, ease)
        self._add(float(t[first]) + ease, self.angle, 0.0, 3.0 * angle / middle**2, -2.0 * angle / middle**3)
        self.angle = (self.angle or 0.0) + angle
        self._speed_up(last, ease)

    def _open_hold(self, first: int, last: int) -> None:
        """Hold the heading from the beginning, to the end, or both."""
        t, size = self.table.t, len(self.table.t)
        if first >= 0:
            ease = min(EASE, float(t[-1] - t[first]))
            self._slow_down(first, ease)
            self._add(float(t[first]) + ease, self.angle)
            return
        until = last if last < size else int(np.argmax(self.table.fast))
        ease = min(EASE, float(t[until] - t[0])) if last < size else 0.0
        self.angle = float(self.table.angle[until]) - 0.5 * ease * float(self.table.rate[until]) * (last < size)
        self._add(float(t[0]), self.angle)
        if last < size:
            self._speed_up(last, ease)

    def _slow_down(self, first: int, ease: float) -> None:
        """Follow up to an instant, then bring the heading to rest."""
        t, rate = float(self.table.t[first]), float(self.table.rate[first])
        self.angle = (self.angle or 0.0) + float(self.table.angle[first] - self.table.angle[self.since])
        if ease > 0.0:
            self._add(t, self.angle, rate, -rate / (2.0 * ease))
        self.angle += 0.5 * rate * ease

    def _speed_up(self, last: int, ease: float) -> None:
        """Start to turn, up to the rate at an instant."""
        t, rate = float(self.table.t[last]), float(self.table.rate[last])
        if ease > 0.0:
            self._add(t - ease, self.angle, 0.0, rate / (2.0 * ease))
        self.angle = (self.angle or 0.0) + 0.5 * rate * ease

    def _add(self, start: float, angle: float | None, *rates: float, follows: bool = False) -> None:
        self.starts.append(start)
        self.rows.append((angle or 0.0, *rates, *(0.0,) * (3 - len(rates))))
        self.follows.append(follows)
