"""Simulation of a flight by steps: controller, sensors, motors and wind, or open loop under inputs from flatness."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import SMALLEST, BoolArray, FloatArray, OwnsArrays
from minsnap.basics.checks import check_able, check_kind, check_number, is_number
from minsnap.basics.messages import shown
from minsnap.basics.progress import progress_line
from minsnap.basics.tolerances import ROUNDING
from minsnap.errors import DivergenceError, TimingError
from minsnap.flight.simulation.controllers import Controller, Pilot, Reference, Vector, vector
from minsnap.flight.simulation.flight_inputs import (
    ConstantWind,
    ReferenceTable,
    Sensors,
    StateEstimator,
    Wind,
    check_steps,
    tabulate,
)
from minsnap.trajectory import Path, Samples, sample_times
from minsnap.vehicle import Drag, FlatStates, Quadrotor, RigidBody, flatness_of, headings, spatial


@dataclass(frozen=True, eq=False)
class Flight(OwnsArrays):
    """State of a vehicle at increasing instants, the first at 0; SI units, world z up, read-only arrays.

    Parameters
    ----------
    t : ndarray, shape (m,)
        Instants [s].
    position, velocity : ndarray, shape (m, 3)
        [m], [m/s].
    quaternion : ndarray, shape (m, 4)
        Attitude w, x, y, z.
    body_rates : ndarray, shape (m, 3)
        About the body's axes [rad/s].
    rotor_speed : ndarray, shape (m, 4)
        [rad/s].
    wind : ndarray, shape (m, 3)
        In the world frame [m/s].
    saturated : ndarray of bool, shape (m,)
        Instants when the rotors could not do what the controller commanded.
    reference : Samples
        What was to be flown, at the same instants.
    """

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    quaternion: FloatArray
    body_rates: FloatArray
    rotor_speed: FloatArray
    wind: FloatArray
    saturated: BoolArray
    reference: Samples

    def __len__(self) -> int:
        return len(self.t)

    @property
    def duration(self) -> float:
        """Last instant [s]."""
        return float(self.t[-1])

    @property
    def samples(self) -> Samples:
        """The flight as samples: position, velocity and heading, as files and comparisons take them."""
        return Samples(self.t, self.position, self.velocity, yaw=headings(self.quaternion))

    def at_rate(self, rate: float) -> Samples:
        """Return the flight as samples at a lower rate [Hz]: those instants that are nearest to its grid, each once."""
        wanted = sample_times(self.duration, rate)
        nearest = np.interp(wanted[wanted <= self.duration * (1.0 + 1e-9)], self.t, np.arange(len(self)))
        return self.samples[np.unique(np.round(nearest).astype(np.intp))]

    @property
    def error(self) -> FloatArray:
        """Position less reference, shape (m, 3) [m]."""
        return np.asarray(self.position - self.reference.position)


STEP = 0.004
"""Step of control and integration unless told otherwise: 250 Hz [s]."""

_BOUNDS = (("position error", 50.0, "m"), ("speed", 100.0, "m/s"), ("body rate", 100.0, "rad/s"))
"""What a simulated vehicle must stay within to be worth simulating further."""


def simulate(
    vehicle: Quadrotor,
    controller: Controller,
    path: Path | Samples,
    *,
    setpoint_rate: float | None = None,
    setpoint_delay: float = 0.0,
    compensation: Drag | None = None,
    sensors: Sensors | None = None,
    wind: Wind | None = None,
    duration: float | None = None,
    step: float = STEP,
    progress: Callable[[float], None] | bool | None = None,
) -> Flight:
    """Simulate a flight along a path with a controller.

    The vehicle starts in the initial state of the reference, with the rotor speeds that keep this state. In each step
    the controller reads the setpoint and the estimate, its command is held, motors respond to first order (exactly),
    and the equations of motion are integrated by the classical fourth-order Runge-Kutta method, which for equal
    accuracy is several times faster than an adaptive method restarted at every command (docs/vehicle.rst).

    Parameters
    ----------
    vehicle : Quadrotor
        What flies.
    controller : Controller
        Such as :class:`~minsnap.flight.CascadeController` or :class:`~minsnap.flight.GeometricController`.
    path : Path or Samples
        What is to be flown; samples are setpoints that hold until the next.
    setpoint_rate : float or None
        Setpoints of a path a second, each held until the next [Hz]; None is one per step.
    setpoint_delay : float
        Time from the instant of a setpoint until the controller reads it [s]: transport, the autopilot's own cycles.
    compensation : Drag or None
        Model of drag that is offset by feed-forward.
    sensors : Sensors or None
        How position is known; None is exactly.
    wind : Wind or None
        None is still air.
    duration : float or None
        How long to fly [s]; None is to the end of the reference, with the lead of samples before it.
    step : float
        [s].
    progress : callable, bool or None
        Called about a hundred times with the part that is done, 0 to 1; True shows a line on standard error.

    Returns
    -------
    Flight

    Raises
    ------
    DivergenceError
        If the vehicle leaves every bound of flight; carries ``instant`` and the ``flight`` until then.
    TimingError
        If step, rate or duration are not positive, the delay is negative, or there are more steps than are simulated.
    InputError
        If an argument is of another kind.
    """
    check_kind("the vehicle", vehicle, Quadrotor, "a Quadrotor")
    check_able("the controller", controller, "pilot", "a controller")
    sensors, wind = Sensors() if sensors is None else sensors, ConstantWind() if wind is None else wind
    check_kind("sensors", sensors, Sensors, "Sensors")
    check_able("the wind", wind, "sample", "a wind such as ConstantWind")
    check_number("the step", step, SMALLEST, 0.1, "it must be above 0 and at most 0.1 s", TimingError, unit="s")
    check_number("the delay of setpoints", setpoint_delay, 0.0, math.inf, "it must be 0 or more", TimingError, unit="s")
    table = ReferenceTable(tabulate(path, setpoint_rate, step), vehicle, compensation)
    length = table.samples.duration + table.samples.lead if duration is None else duration
    if not (is_number(length) and length > 0):
        raise TimingError(f"the flight lasts {shown(length)} s: give a duration above 0")
    check_steps(length, step)
    count = max(round(length / step), 1)
    t, air = step * np.arange(count + 1.0), wind.sample(count + 1, step)
    rows = table.index(t, setpoint_delay).tolist()
    pilot, observer = controller.pilot(vehicle, step), StateEstimator(sensors, step, count + 1)
    inputs = zip([table.rows[row] for row in rows], air.tolist(), strict=True)
    start = _start(vehicle, table, rows[0] < 0)
    log, reason, states = [], "", _states(vehicle, start, pilot, observer, inputs, step)
    with progress_line(progress, "flying", lambda line: line.show) as watch:
        try:
            for index, state in zip(range(count + 1), states, strict=False):
                log.append(state)
                if watch is not None and (index % max(1, count // 100) == 0 or index == count):
                    watch(index / count)
        except _OutOfBoundsError as error:
            reason = str(error)
    position, velocity, quaternion, rates, speeds, cut = np.split(np.array(log), [3, 6, 10, 13, 17], axis=1)
    t, air, saturated = t[: len(log)], air[: len(log)], cut[:, 0] > 0.0
    flight = Flight(t, position, velocity, quaternion, rates, speeds, air, saturated, table.at(t, path))
    if reason:
        message = f"the simulation diverged at t = {flight.duration:.3f} s: {reason}"
        raise DivergenceError(message, instant=flight.duration, flight=flight)
    return flight


class _OutOfBoundsError(Exception):
    """Says which bound of flight the vehicle has left."""


def _states(
    vehicle: Quadrotor,
    start: tuple[list[float], list[float]],
    pilot: Pilot,
    observer: StateEstimator,
    inputs: Iterable[tuple[Reference, list[float]]],
    step: float,
) -> Iterator[list[float]]:
    """Yield the state, rotor speeds and whether these are saturated, for every setpoint and wind, a step [s] apart."""
    body, lag, (state, speeds) = RigidBody(vehicle), vehicle.motor_time_constant, start
    ends = np.minimum(lag * np.array([0.0, 1.0, 2.0, 4.0, 8.0]), step)  # a step in which rotors settle is divided
    parts = np.diff(np.unique(np.append(ends, step))).tolist()
    left = [[math.exp(-share * part / lag) if lag else 0.0 for share in (0.5, 1.0)] for part in parts]  # of a gap
    for setpoint, wind in inputs:
        command = pilot.command(observer.estimate(state), setpoint)
        yield [*state, *speeds, command.saturated]
        for part, (half, whole) in zip(parts, left, strict=True):
            gaps = [(goal, speed - goal) for goal, speed in zip(command.rotor_speed, speeds, strict=True)]
            middle, end = ([goal + share * gap for goal, gap in gaps] for share in (half, whole))
            first = command.rotor_speed if whole == 0.0 else speeds
            try:
                state, speeds = body.advance(state, (first, middle, end), wind, part), end
            except OverflowError:
                raise _OutOfBoundsError("numbers overflowed") from None
        _check_bounds(state, setpoint.position)


def _start(vehicle: Quadrotor, table: ReferenceTable, waits: bool) -> tuple[list[float], list[float]]:
    """Return state and rotor speeds at the start; those of a vehicle that waits for its setpoints do not turn it."""
    samples, states = table.samples, table.states
    velocity = np.zeros(3) if samples.velocity is None else samples.velocity[0]
    parts = (samples.position[0], velocity, states.quaternion[0], states.body_rates[0])
    known = vehicle.rotor_speeds([states.thrust[0], 0.0, 0.0, 0.0]) if waits else states.rotor_speed[0]
    speeds = np.clip(known, vehicle.rotor_speed_min, vehicle.rotor_speed_max)
    return np.concatenate(parts).tolist(), speeds.tolist()


def _check_bounds(state: list[float], goal: Vector) -> None:
    """Raise an error that names the bound that a state exceeds."""
    away = math.dist(state[0:3], goal) if all(map(math.isfinite, state)) else math.nan
    values = (away, math.hypot(*state[3:6]), math.hypot(*state[10:13]))
    for (name, bound, unit), value in zip(_BOUNDS, values, strict=True):
        if not value <= bound:
            raise _OutOfBoundsError(f"the {name} passed {bound:g} {unit}")


_INSIDE = 1e-9
"""Distance from the end of a step at which its last rotor speeds are taken, as a share of the step."""


def simulate_open_loop(
    vehicle: Quadrotor, path: Path, *, wind: tuple[float, float, float] = (0.0, 0.0, 0.0), step: float = 0.001
) -> Flight:
    """Integrate the equations of motion under the rotor speeds that flatness gives for a path.

    There is no feedback, so the deviation from the path measures the accuracy of the inverse dynamics and of the
    integration. Rotor speeds are functions of time; motor lag and limits are not applied. Snap, and with it torque, may
    jump at the knots of a trajectory, and where a heading begins or ends to follow the velocity: steps end there and
    use the rotor speeds before.

    Parameters
    ----------
    vehicle : Quadrotor
        With drag that can be inverted.
    path : Path
        Of two or three dimensions; four continuous derivatives between its ``breaks``, where it has them.
    wind : tuple of 3 floats
        Constant, known to the inverse dynamics [m/s].
    step : float
        Greatest step [s].

    Returns
    -------
    Flight
        At instants that are uniform between them.

    Raises
    ------
    TimingError
        If the step is not positive or longer than the path.
    """
    air = vector("wind velocity", wind)
    check_kind("the vehicle", vehicle, Quadrotor, "a Quadrotor")
    check_kind("the path", path, Path, "a path")
    give = f"it must be above 0 and within the path's {path.duration} s"
    check_number("the step", step, SMALLEST, path.duration, give, TimingError, unit="s")
    check_steps(path.duration, step)
    t = _instants(path, step)
    stages = np.stack([t[:-1], 0.5 * (t[:-1] + t[1:]), t[1:] - _INSIDE * np.diff(t)], axis=-1)
    states = flatness_of(vehicle, path, stages.ravel(), wind=air)
    try:
        log = _integrate(RigidBody(vehicle), path, states, air, np.diff(t).tolist())
    except OverflowError:
        log = [[np.inf]]
    if not np.isfinite(log[-1]).all():
        raise DivergenceError("the motion leaves the range of numbers: slow down the path or the wind")
    position, velocity, quaternion, rates = np.split(np.array(log), [3, 6, 10], axis=1)
    reference = Samples(t, spatial(path(t)), spatial(path(t, 1)), yaw=path.yaw(t))
    winds, free = np.tile(air, (len(t), 1)), np.zeros(len(t), dtype=bool)
    speeds = np.concatenate([states.rotor_speed[::3], states.rotor_speed[-1:]])
    return Flight(t, position, velocity, quaternion, rates, speeds, winds, free, reference)


def _instants(path: Path, step: float) -> FloatArray:
    """Return instants from 0 to the end, knots of path and yaw among them, no further apart than a step."""
    knots = np.asarray(getattr(path, "breaks", (0.0, path.duration)), dtype=np.float64)
    turns = np.array([t for t in path.yaw.breaks if np.abs(knots - t).min() > ROUNDING * path.duration])
    knots = np.sort(np.append(knots, turns))
    ends = itertools.pairwise(knots.tolist())
    legs = [np.linspace(start, end, math.ceil((end - start) / step - 1e-9) + 1)[:-1] for start, end in ends]
    return np.concatenate([*legs, knots[-1:]])


def _integrate(
    body: RigidBody, path: Path, states: FlatStates, wind: tuple[float, float, float], steps: list[float]
) -> list[list[float]]:
    """Return the state at the start and after every step, from three rotor speeds per step."""
    speeds = states.rotor_speed.tolist()
    start = (spatial(path(0.0)), spatial(path(0.0, 1)), states.quaternion[0], states.body_rates[0])
    log = [np.concatenate(start).tolist()]
    for index, step in enumerate(steps):
        first, middle, last = speeds[3 * index : 3 * index + 3]
        log.append(body.advance(log[-1], (first, middle, last), wind, step))
    return log
