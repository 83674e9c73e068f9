"""The inputs of a simulated flight: setpoints with what offsets drag, wind, and poses that are late and noisy.

Each setpoint holds until the next. Wind, constant or in Dryden gusts, and noise are reproducible by their seeds. Poses
are fused with inertial sensors, as an autopilot's estimator does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from minsnap.basics.arrays import SMALLEST, FloatArray, IntArray, interpolated, set_fields
from minsnap.basics.checks import check_able, check_kind, check_number, check_positive, check_seed, is_number
from minsnap.basics.messages import shown
from minsnap.errors import InputError, TimingError
from minsnap.flight.simulation.controllers import Estimate, Reference, Vector, vector
from minsnap.flight.tracking.comparison import check_samples, position_at
from minsnap.trajectory import Path, Samples
from minsnap.vehicle import BodyDrag, Drag, FlatStates, Quadrotor, flat_states, spatial


def reference_states(vehicle: Quadrotor, reference: Samples, drag: Drag | None) -> FlatStates:
    """Return attitude and rates of a reference, with the drag if the motion is flat with it, else without drag.

    Parameters
    ----------
    vehicle : Quadrotor
    reference : Samples
        What it lacks (a derivative, yaw) is taken as zero.
    drag : Drag or None
        The model that is offset.

    Returns
    -------
    FlatStates
    """
    motion = _motion(reference, "velocity", "acceleration", "jerk", "snap", "yaw", "yaw_rate")
    return flat_states(vehicle, *motion, drag=drag if isinstance(drag, BodyDrag) else BodyDrag())


def _motion(samples: Samples, *names: str) -> list[FloatArray]:
    """Return quantities of samples in three coordinates; zero where there is none."""
    zero = {True: np.zeros(len(samples)), False: np.zeros((len(samples), 3))}
    known = [(name.startswith("yaw"), getattr(samples, name)) for name in names]
    return [zero[angle] if values is None else values if angle else spatial(values) for angle, values in known]


def drag_feed_forward(vehicle: Quadrotor, reference: Samples, drag: Drag | None = None) -> FloatArray:
    """Return the acceleration that compensates drag along a reference, in still air.

    The reference velocity is rotated into the body frame with the reference attitude from flatness. The drag force is
    rotated back to the world frame; the result is its negative divided by the mass.

    Parameters
    ----------
    vehicle : Quadrotor
    reference : Samples
        With velocity; without, nothing can be offset and the answer is zero.
    drag : Drag or None
        The model to offset; by default the vehicle's own.

    Returns
    -------
    ndarray, shape (m, 3)
        In the world frame [m/s^2].
    """
    check_kind("the vehicle", vehicle, Quadrotor, "a Quadrotor")
    check_kind("the reference", reference, Samples, "samples")
    drag = vehicle.drag if drag is None else drag
    check_able("the drag", drag, "force", "a model of drag")
    if reference.velocity is None:
        return np.zeros((len(reference), 3))
    states = reference_states(vehicle, reference, drag)
    force = drag_in_body(drag, states.rotation, spatial(reference.velocity), states.rotor_speed)
    return np.asarray(-np.einsum("mij,mj->mi", states.rotation, force) / vehicle.mass)


def drag_in_body(drag: Drag, rotation: FloatArray, air: FloatArray, rotor_speed: FloatArray) -> FloatArray:
    """Return the force of drag in the body, shape (m, 3) [N]; ``air`` are velocities through the air in the world."""
    pitch = -np.arcsin(np.clip(rotation[:, 2, 0], -1.0, 1.0))
    return drag.force(np.einsum("mji,mj->mi", rotation, air), pitch=pitch, rotor_speed=rotor_speed)


MOST_STEPS = 2_000_000
"""Steps of the longest flight that is simulated."""


class ReferenceTable:
    """A table of setpoints, and the index of the setpoint valid at an instant.

    The first is held until it has begun, and the last after its end: what is held does not turn.

    Parameters
    ----------
    samples : Samples
        Setpoints; between two of them the earlier one holds.
    vehicle : Quadrotor
        For attitude and rates of the reference.
    compensation : Drag or None
        Model of drag to offset by feed-forward; without one, that which the samples state is followed.
    """

    def __init__(self, samples: Samples, vehicle: Quadrotor, compensation: Drag | None) -> None:
        inflated: dict[str, Any] = {name: spatial(values) for name, values in samples.vectors().items()}
        self.samples = replace(samples, **inflated)
        self.states: FlatStates = reference_states(vehicle, self.samples, compensation)
        self.feed_forward: FloatArray = _added(vehicle, self.samples, compensation)
        moved = _motion(self.samples, "position", "velocity", "acceleration")
        turned = _motion(self.samples, "yaw", "yaw_rate")
        columns = (*moved, self.feed_forward, *turned, self.states.body_rates, self.states.angular_acceleration)
        rows = [Reference(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]
        still = (0.0, 0.0, 0.0)
        first, last = (row._replace(body_rates=still, angular_acceleration=still) for row in (rows[0], rows[-1]))
        self.rows = [*rows[:-1], last, first]

    def index(self, t: FloatArray, delay: float = 0.0) -> IntArray:
        """Return the row of the setpoint valid at each instant, shape (m,), with a delay of the setpoints [s].

        It is -1 where none is yet: the last row is the first setpoint, held.
        """
        start = self.samples.t[0]
        return np.asarray(np.searchsorted(self.samples.t - start, t - delay + 1e-9, side="right") - 1)

    def at(self, t: FloatArray, path: Path | Samples) -> Samples:
        """Return the plan at instants, shape (m,): exact for a path, between samples as flights are compared."""
        if isinstance(path, Path):
            inside = np.minimum(t, path.duration)
            velocity, acceleration = (spatial(path(inside, order)) for order in (1, 2))
            return Samples(t, spatial(path(inside)), velocity, acceleration, yaw=path.yaw(inside))
        own, known = t + (self.samples.t[0] - self.samples.lead), self.samples.velocity
        moving = None if known is None else interpolated(own, self.samples.t, known)
        return Samples(t, position_at(self.samples, own), moving)


def _added(vehicle: Quadrotor, samples: Samples, compensation: Drag | None) -> FloatArray:
    """Return the feed-forward of the samples themselves, or that of a model of drag."""
    if samples.feed_forward is not None and compensation is not None:
        raise InputError("the samples state their feed-forward: leave the compensation out")
    if compensation is not None:
        return drag_feed_forward(vehicle, samples, compensation)
    return np.zeros((len(samples), 3)) if samples.feed_forward is None else samples.feed_forward


def check_steps(duration: float, step: float) -> None:
    """Raise TimingError for a flight [s] of more steps [s] than are simulated."""
    if not duration <= MOST_STEPS * step:
        raise TimingError(f"{duration:g} s in steps of {step:g} s are too many: at most {MOST_STEPS} are simulated")


def tabulate(path: Path | Samples, rate: float | None, step: float) -> Samples:
    """Return the setpoints of a path at a rate [Hz], or per step without a rate; samples are not resampled.

    Raises
    ------
    TimingError
        If the rate is not positive, or samples come with a rate.
    InputError
        If it is neither a path nor samples whose instants rise and whose numbers are finite.
    """
    if isinstance(path, Path):
        return path.sample(1.0 / step if rate is None else rate)
    if not isinstance(path, Samples):
        raise InputError(f"the reference is of type {type(path).__name__}: give a path or samples")
    if rate is not None:
        raise TimingError("samples have their own instants: sample the path at that rate, and leave the rate out")
    check_samples("reference", path)
    return path


class Wind(Protocol):
    """Velocity of the air as a series in time."""

    def sample(self, count: int, step: float) -> FloatArray:
        """Return the wind at instants 0, step, 2 step, …, shape (count, 3) [m/s]."""


@dataclass(frozen=True)
class ConstantWind:
    """A constant wind.

    Parameters
    ----------
    velocity : tuple of 3 floats
        In the world frame [m/s].
    """

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        set_fields(self, velocity=vector("wind velocity", self.velocity))

    def sample(self, count: int, step: float) -> FloatArray:
        """Return the wind at every instant, shape (count, 3) [m/s]."""
        return np.tile(self.velocity, (count, 1))


@dataclass(frozen=True)
class DrydenWind:
    r"""A mean wind with gusts of the Dryden spectra, as a stationary random process.

    Gusts along the mean wind have the first-order spectrum, those across it and vertical ones the second-order spectrum
    of MIL-F-8785C,

    .. math:: H_u = \sigma\sqrt{2T}\,\frac{1}{1 + T s}, \qquad
              H_{v,w} = \sigma\sqrt{T}\,\frac{1 + \sqrt{3}\,T s}{(1 + T s)^2}, \qquad T = L / V,

    driven by white noise of unit spectral density. The discretisation is exact for any step: transition matrix and
    noise covariance are those of the continuous process. The series starts in the stationary state.

    Parameters
    ----------
    mean : tuple of 3 floats
        Mean wind in the world frame [m/s].
    intensity : tuple of 3 floats
        Standard deviation of the gusts along, across and up [m/s].
    length : tuple of 3 floats
        Scale lengths along, across and up [m]. Those of MIL-F-8785C at the 1.5 m of a flight room are 19, 19 and 1.5 m.
    airspeed : float or None
        V, at which the frozen gusts pass the vehicle [m/s]; by default the mean wind's speed, at least 1 m/s.
    seed : int
        Repeats the same gusts.

    Raises
    ------
    InputError
        If a value is not finite, or an intensity, length or airspeed is negative.
    """

    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    intensity: tuple[float, float, float] = (0.5, 0.5, 0.25)
    length: tuple[float, float, float] = (19.0, 19.0, 1.5)
    airspeed: float | None = None
    seed: int = 0
    _speed: float = field(init=False, repr=False)

    def __post_init__(self) -> None:
        set_fields(self, mean=vector("mean wind", self.mean))
        for name in ("intensity", "length"):
            values = vector(f"gust {name}", getattr(self, name))
            if min(values) < 0:
                raise InputError(f"gust {name} is {values}: no part may be below 0")
            set_fields(self, **{name: values})
        speed = max(math.hypot(*self.mean), 1.0) if self.airspeed is None else self.airspeed
        check_seed(self.seed)
        if not (is_number(speed) and speed >= SMALLEST) or min(self.length) < SMALLEST:
            given = f"{self.length} m and {shown(self.airspeed)} m/s"
            raise InputError(f"gusts need lengths and an airspeed above 0, not {given}")
        set_fields(self, _speed=float(speed))

    def sample(self, count: int, step: float) -> FloatArray:
        """Return the wind at 0, step, …, shape (count, 3) [m/s]; a shorter series is the start of a longer one."""
        streams = np.random.default_rng(self.seed).spawn(3)
        times = [length / self._speed for length in self.length]
        along = _first_order(streams[0].standard_normal(count), math.exp(-step / times[0]))
        across = _second_order(streams[1].standard_normal((count, 2)), step, times[1])
        upward = _second_order(streams[2].standard_normal((count, 2)), step, times[2])
        gusts = np.stack([along, across, upward], axis=-1) * self.intensity
        return np.asarray(self.mean + gusts @ self._axes())

    def _axes(self) -> FloatArray:
        """Return the along, across and up axes as rows; along is the direction of the mean wind, or x without wind."""
        heading = math.atan2(self.mean[1], self.mean[0])
        forward, side = math.cos(heading), math.sin(heading)
        return np.array([[forward, side, 0.0], [-side, forward, 0.0], [0.0, 0.0, 1.0]])


def _first_order(noise: FloatArray, decay: float) -> FloatArray:
    """Return the stationary process of unit variance with the spectrum of ``1 / (1 + T s)``, shape (count,)."""
    from scipy.signal import lfilter

    shocks = noise * math.sqrt(1.0 - decay * decay)
    shocks[:1] = noise[:1]
    return np.asarray(lfilter([1.0], [1.0, -decay], shocks))


def _second_order(noise: FloatArray, step: float, time: float) -> FloatArray:
    """Return the stationary process of unit variance with the spectrum of ``(1 + sqrt(3) T s) / (1 + T s)^2``.

    In the controllable form x1' = x2, x2' = -x1/T^2 - 2 x2/T + n, the stationary covariance is diagonal,
    diag(T^3, T) / 4, and the transition over a step is the exponential of a Jordan block.
    """
    rate = step / time
    decay = math.exp(-rate)
    transition = decay * np.array([[1.0 + rate, step], [-rate / time, 1.0 - rate]])
    stationary = np.diag([time**3 / 4.0, time / 4.0])
    shocks = noise[1:] @ _root(stationary - transition @ stationary @ transition.T).T
    (a, b), (c, d) = transition.tolist()
    first, second = (noise[0] * np.sqrt(np.diag(stationary))).tolist() if len(noise) else (0.0, 0.0)
    states = [(first, second)]
    for one, two in shocks.tolist():
        first, second = a * first + b * second + one, c * first + d * second + two
        states.append((first, second))
    output = np.array([1.0, math.sqrt(3.0) * time]) * math.sqrt(time) / time**2
    return np.asarray(np.array(states[: len(noise)]) @ output)


def _root(covariance: FloatArray) -> FloatArray:
    """Return a square root of a positive semidefinite matrix."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


_BANDWIDTH = 5.0
"""Natural frequency with which the estimate follows the measured pose [rad/s]; ours, as slow as autopilots set it."""


@dataclass(frozen=True)
class Sensors:
    """Position from motion capture, everything else from inertial sensors without error.

    Velocity and position are predicted with the accelerometer and corrected with each pose, with the fixed gains of a
    critically damped second-order observer, similar to the estimators of autopilots. The delay of a pose is not
    compensated, so in steady motion the position estimate lags by velocity times delay.

    Parameters
    ----------
    pose_rate : float
        Poses a second [Hz]; their interval is rounded to whole steps.
    delay : float
        Age of a pose when it arrives [s], rounded likewise.
    noise : float
        Standard deviation of a measured position, each axis [m].
    seed : int
        Repeats the same noise.

    Raises
    ------
    InputError
        If the rate is not positive, or delay or noise are negative.
    """

    pose_rate: float = 50.0
    delay: float = 0.0
    noise: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        check_positive("the pose rate", self.pose_rate, "poses per second", InputError)
        check_seed(self.seed)
        for name in ("delay", "noise"):
            check_number(f"the pose's {name}", getattr(self, name), 0.0, math.inf, "it must be 0 or more")


class StateEstimator:
    """The state estimator of one flight, updated with the true state at every step.

    Parameters
    ----------
    sensors : Sensors
    step : float
        [s].
    count : int
        Most steps there will be.
    """

    def __init__(self, sensors: Sensors, step: float, count: int) -> None:
        self._step = step
        self._every = max(1, round(1.0 / (sensors.pose_rate * step)))
        self._late = round(sensors.delay / step)
        draws = np.random.default_rng(sensors.seed).normal(size=(count // self._every + 1, 3))
        self._noise: list[list[float]] = (sensors.noise * draws).tolist()
        gap = self._every * step
        self._gain = (min(2.0 * _BANDWIDTH * gap, 1.0), min(_BANDWIDTH**2 * gap, 1.0 / gap))
        self._past: list[Vector] = []
        self._position: list[float] = []
        self._velocity: list[float] = []
        self._truth: list[float] = []

    def estimate(self, state: list[float]) -> Estimate:
        """Return the estimate one step after the previous call, from the true state of 13 numbers."""
        count = len(self._past)
        self._past.append((state[0], state[1], state[2]))
        if count == 0:
            self._position, self._velocity = state[0:3], state[3:6]
        else:
            self._carry(state)
        if count % self._every == 0:
            self._correct(self._past[max(count - self._late, 0)], self._noise[count // self._every])
        self._truth = state[3:6]
        (x, y, z), (u, v, w), (a, b, c, d), (p, q, r) = self._position, self._velocity, state[6:10], state[10:13]
        return Estimate((x, y, z), (u, v, w), (a, b, c, d), (p, q, r))

    def _carry(self, state: list[float]) -> None:
        """Predict velocity and position with the measured acceleration."""
        for axis in range(3):
            change = state[3 + axis] - self._truth[axis]
            self._position[axis] += self._step * (self._velocity[axis] + 0.5 * change)
            self._velocity[axis] += change

    def _correct(self, pose: Vector, noise: list[float]) -> None:
        for axis in range(3):
            surprise = pose[axis] + noise[axis] - self._position[axis]
            self._position[axis] += self._gain[0] * surprise
            self._velocity[axis] += self._gain[1] * surprise
