r"""Where a loop flies a trajectory without wind, as polynomials on cells, with a proved bound of their error.

The loop's delay equation (:mod:`minsnap.vehicle.loop_response`) with the setpoints as input is advanced cell by cell.
What the polynomials leave of the equation is bounded over every cell, breaks of the trajectory among the ends of cells;
the responses of the loop to that bound the error of the position and of the command.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import ceil

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import VehicleError
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle.loop import Loop
from minsnap.vehicle.loop_response import (
    Response,
    Stepper,
    bernstein_of_ends,
    bernstein_values,
    ends_of_cell,
    slopes_of,
)

SETTLING = 3.0
"""How long a vehicle that ends at rest is followed after the end [s]."""

LONGEST = 3600.0
"""Longest flight that is computed [s]: some ten seconds of computing."""

STILL = 1e-6
"""Speed below which a plan ends at rest [m/s]."""


ASIDE = 1e-3
"""How far from the end of a cell its inputs are taken, as a share of it."""


@dataclass(frozen=True, eq=False)
class ExpectedFlight:
    """A flight in a loop without wind.

    Parameters
    ----------
    starts : ndarray, shape (cells,)
        Instant at which each cell begins [s].
    cell : float
        Their length [s].
    points : ndarray, shape (cells, 6, dim)
        Control points of the position [m].
    position_error : float
        By how much the position may differ from them, at most [m]: what is proved of the model, and the error of the
        model itself.
    ends : ndarray, shape (parts + 1,)
        Ends of the parts on which the command is a polynomial [s].
    commands : ndarray, shape (parts, n, dim)
        Control points of the commanded acceleration [m/s^2].
    command_error : float
        By how much it may differ from them, at most [m/s^2].
    asked : ndarray, shape (parts, n, dim)
        Control points of the velocity that the position loop asks for [m/s].
    lag : float
        Largest distance from where the plan is at the same instant [m]: an upper bound.
    speed : float
        Largest speed [m/s]: an upper bound.
    """

    starts: FloatArray
    cell: float
    points: FloatArray
    position_error: float
    ends: FloatArray
    commands: FloatArray
    command_error: float
    asked: FloatArray
    lag: float
    speed: float

    @property
    def curve(self) -> Trajectory:
        """The position as a trajectory from the first cell on."""
        return Trajectory(self.points, np.full(len(self.points), self.cell))

    @property
    def from_start(self) -> Trajectory:
        """The same from the instant 0 of the plan on."""
        whole = self.curve
        return whole.between(-float(self.starts[0]), whole.duration) if self.starts[0] < 0.0 else whole

    def at(self, t: FloatArray) -> FloatArray:
        """Return positions at instants (m,), shape (m, dim) [m]; before and after the flight those of its ends."""
        share = (np.asarray(t) - self.starts[0]) / self.cell
        index = np.clip(np.floor(share).astype(np.intp), 0, len(self.points) - 1)
        local = np.clip(share - index, 0.0, 1.0)
        return np.asarray(np.einsum("mk,mkd->md", bernstein_values(local, 5), self.points[index]))


class _Setpoints:
    """The trajectory as the autopilot gets it: later by the latency less the lead, and extended beyond its ends."""

    def __init__(self, curve: Trajectory, shift: float) -> None:
        self._curve, self._shift, self.duration, self.degree = curve, shift, curve.duration, curve.degree
        self._ends = [_state(curve, t) for t in (0.0, curve.duration)]
        self.breaks = curve.breaks + shift

    def __call__(self, t: FloatArray, order: int, shift: float | None = None) -> FloatArray:
        """Return a derivative of instants of any shape, counted from the start of the plan."""
        t = t - (self._shift if shift is None else shift)
        inside = self._curve(np.clip(t, 0.0, self.duration), order)
        beyond = zip(self._ends, (t, t - self.duration), strict=True)
        first, last = (_extended(known, past[..., None], order) for known, past in beyond)
        return np.asarray(np.where((t < 0.0)[..., None], first, np.where((t > self.duration)[..., None], last, inside)))

    def before(self, t: FloatArray, order: int) -> FloatArray:
        """Return a derivative of the motion up to the start, as it is planned, at instants (m,): (m, dim)."""
        return _extended(self._ends[0], t[:, None], order)


def _state(curve: Trajectory, t: float) -> FloatArray:
    """Return position, velocity and acceleration at an end, (3, dim): those of a hover where it is at rest."""
    state = np.stack([curve(t, order) for order in range(3)])
    state[1:] *= np.linalg.norm(state[1]) >= STILL
    return state


def _extended(known: FloatArray, t: FloatArray, order: int) -> FloatArray:
    """Return a derivative of the motion with constant acceleration through a state (3, dim)."""
    position, velocity, acceleration = known
    if order == 0:
        return np.asarray(position + t * (velocity + 0.5 * t * acceleration))
    return np.asarray(velocity + t * acceleration if order == 1 else acceleration + 0.0 * t)


def expected_flight(loop: Loop, curve: Trajectory, begin: float = 0.0, end: float = 0.0) -> ExpectedFlight:
    """Return the flight of a trajectory in a loop without wind, begun in the state of the plan.

    Parameters
    ----------
    loop : Loop
    curve : Trajectory
        With two or three coordinates, the third one upwards.
    begin, end : float
        From when, and until when, at least; those of the plan and of its setpoints are within them [s].

    Raises
    ------
    VehicleError
        If the flight is longer than an hour.
    """
    if curve.duration > LONGEST:
        raise VehicleError(f"the flight lasts {curve.duration:.4g} s: loops are computed for up to {LONGEST:g} s")
    setpoints = _Setpoints(curve, loop.latency - loop.lead)
    cell, begin = loop.axes[0].cell, min(begin, loop.latency - loop.lead, 0.0)
    resting = float(np.linalg.norm(curve(curve.duration, 1))) < STILL
    count = ceil((max(end, curve.duration + (SETTLING if resting else 0.0)) - begin) / cell)
    starts = np.asarray(begin + cell * np.arange(count), dtype=np.float64)
    late = setpoints.breaks + loop.delay
    inner = np.concatenate((curve.breaks, setpoints.breaks, late))
    last = starts[-1] + cell
    ends = np.unique(np.concatenate((starts, inner[(inner > begin) & (inner < last)], [last])))
    ends = ends[np.append(np.diff(ends) > 1e-12, True)]
    axes = [(slice(0, 2), 0)] if curve.dim == 2 else [(slice(0, 2), 0), (slice(2, 3), 1)]
    parts = [_Axis(loop, which, setpoints, starts, ends, axis) for axis, which in axes]
    points, commands, asked, flown = (
        np.concatenate([getattr(part, name) for part in parts], axis=-1)
        for name in ("points", "commands", "asked", "positions")
    )
    errors = [np.hypot.reduce([part.errors[i] for part in parts]) for i in (0, 1)]
    plan = _converted(lambda t: setpoints(t, 0, 0.0), ends, max(5, curve.degree))
    away = float(np.linalg.norm(flown - plan, axis=-1).max())
    doubt = float(errors[0]) + loop.model_error * away
    speed = float(np.linalg.norm(slopes_of(points, cell), axis=-1).max())
    known = doubt, ends, commands, float(errors[1]), asked
    return ExpectedFlight(starts, cell, points, *known, away + doubt, speed)


class _Axis:
    """The flight along some axes whose loop is the same."""

    def __init__(
        self, loop: Loop, which: int, setpoints: _Setpoints, starts: FloatArray, ends: FloatArray, axis: slice
    ) -> None:
        self._axis, self._setpoints, self._loop = axis, setpoints, loop.axes[which]
        self._offset, self._of_error = loop.offset_drag[which], loop.of_error
        self._origin = setpoints(np.zeros(1), 0, 0.0)[0, axis]
        self._starts, self._ends = starts, ends
        stepper = Stepper(self._loop)
        states = self._flown(stepper, starts)
        self.points = states[stepper.steps :, :, 0] + self._origin
        self._bound(states, stepper.steps, loop.responses[which])

    def _feed(self, t: FloatArray) -> FloatArray:
        """Return what setpoints add to the command: (..., axes)."""
        loop, axis = self._loop, self._axis
        place, speed, push = (self._setpoints(t, order)[..., axis] for order in range(3))
        gain = 1.0 + (loop.velocity_derivative if self._of_error else 0.0)
        moved = (self._offset + loop.velocity_gain) * speed
        return np.asarray(gain * push + moved + loop.velocity_gain * loop.position_gain * (place - self._origin))

    def _input(self, t: FloatArray) -> FloatArray:
        """Return what setpoints add to the derivative of the state: (..., order, axes)."""
        loop, axis = self._loop, self._axis
        fed = np.zeros((*t.shape, loop.order, len(self._origin)))
        fed[..., 2, :] = self._feed(t - loop.delay) / loop.lag
        if loop.order == 4:
            place, speed = (self._setpoints(t, order)[..., axis] for order in range(2))
            fed[..., 3, :] = loop.velocity_integral * (speed + loop.position_gain * (place - self._origin))
        return fed

    def _start(self, t: FloatArray) -> FloatArray:
        """State of the vehicle before the start at instants (m,): (m, order, axes)."""
        loop, axis = self._loop, self._axis
        place, speed, push = (self._setpoints.before(t, order)[..., axis] for order in range(3))
        state = np.zeros((len(t), loop.order, len(self._origin)))
        state[:, 0], state[:, 1], state[:, 2] = place - self._origin, speed, push + loop.drag * speed
        if loop.order == 4:
            state[:, 3] = state[:, 2] - self._feed(t) - np.einsum("j,mja->ma", loop.command, state)
        return state

    def _flown(self, stepper: Stepper, starts: FloatArray) -> FloatArray:
        """Control points of the state, first those of as many cells before the start as the delay has."""
        cell, lag = self._loop.cell, stepper.steps
        forced = stepper.forced(self._input(starts[:, None] + cell * stepper.nodes))
        sides = [self._one_sided(starts, ASIDE * cell), self._one_sided(starts + cell, -ASIDE * cell)]
        ends = [self._before(starts[0] + cell * (index - lag)) for index in range(lag)]
        state = self._start(starts[:1])[0]
        for index in range(len(starts)):
            old = ends[index] if lag else None
            after = stepper.advance(state, old) + forced[index]
            known = [(values[index], rates[index]) for values, rates in sides]
            ends.append(ends_of_cell(stepper, state, after, old, known))
            state = after
        return bernstein_of_ends(np.stack(ends), cell)

    def _one_sided(self, t: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
        """Return the input and its derivative at instants (m,), from one side: the trajectory may jump there."""
        near, far = self._input(t + step), self._input(t + 2.0 * step)
        return 2.0 * near - far, (far - near) / step

    def _before(self, start: float) -> FloatArray:
        """Return the ends of a cell before the start: the motion of the plan, extended backwards."""
        half = 0.5 * self._loop.cell
        t = np.asarray(start + half * np.arange(3), dtype=np.float64)
        one, two, three = self._start(t)
        second = (one - 2.0 * two + three) / half**2
        slopes = (three - one) / (2.0 * half) - half * second, (three - one) / (2.0 * half) + half * second
        return np.stack((one, slopes[0], second, three, slopes[1], second))

    def _bound(self, states: FloatArray, lag: int, response: Response) -> None:
        """Find position and command on parts, and bound what the polynomials leave of the equation."""
        loop, degree = self._loop, max(5, self._setpoints.degree)
        nodes = _nodes(degree)
        widths = np.diff(self._ends)
        t = self._ends[:-1, None] + widths[:, None] * nodes
        cells = np.clip(((t.mean(axis=1) - self._starts[0]) / loop.cell).astype(np.intp), 0, len(self._starts) - 1)
        local = np.clip((t - self._starts[cells, None]) / loop.cell, 0.0, 1.0)
        basis = bernstein_values(local, 5)
        now, old = (np.einsum("mgk,mkja->mgja", basis, states[cells + step]) for step in (lag, 0))
        slope = np.einsum("mgk,mkja->mgja", basis, slopes_of(states, loop.cell)[cells + lag])
        felt = np.einsum("ij,mgja->mgia", loop.plant, now) + np.einsum("ij,mgja->mgia", loop.feedback, old)
        left = np.einsum("kg,mgja->mkja", _to_bernstein(degree), slope - felt - self._input(t))
        size = np.linalg.norm(left, axis=-1)
        self.errors = response.moved_by(size.max(axis=(0, 1)), (widths[:, None] * size.mean(axis=1)).sum(axis=0))
        command = np.einsum("j,mgja->mga", loop.command, now) + self._feed(t)
        self.commands = np.einsum("kg,mga->mka", _to_bernstein(degree), command)
        self.positions = np.einsum("kg,mga->mka", _to_bernstein(degree), now[:, :, 0]) + self._origin
        place, speed = (self._setpoints(t, order)[..., self._axis] for order in range(2))
        asked = speed + loop.position_gain * (place - self._origin - now[:, :, 0])
        self.asked = np.einsum("kg,mga->mka", _to_bernstein(degree), asked)


def _nodes(degree: int) -> FloatArray:
    """Points inside of [0, 1] at which a polynomial of a degree is told."""
    count = degree + 1
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * (np.arange(count) + 0.5) / count))


@cache
def _to_bernstein(degree: int) -> FloatArray:
    """Matrix from the values of a polynomial at the nodes to its control points."""
    return np.asarray(np.linalg.inv(bernstein_values(_nodes(degree), degree)))


def _converted(path: Callable[[FloatArray], FloatArray], ends: FloatArray, degree: int) -> FloatArray:
    """Control points of a function that is a polynomial of a degree between each two ends: (parts, n, dim)."""
    t = ends[:-1, None] + np.diff(ends)[:, None] * _nodes(degree)
    return np.asarray(np.einsum("kg,mgd->mkd", _to_bernstein(degree), path(t)))
