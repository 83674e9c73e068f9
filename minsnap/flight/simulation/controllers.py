"""Controllers of a simulated vehicle: the cascade of PX4, and geometric control on SE(3) (Lee, Mellinger).

A controller is an immutable value: gains and limits. Its ``pilot`` controls one vehicle and holds the state between
calls. Pilots use floats, which for single vectors are several times faster than arrays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import NamedTuple, Protocol

from minsnap.basics.arrays import ArrayLike, set_fields
from minsnap.basics.checks import check_array, check_positive, check_switch
from minsnap.basics.messages import shown
from minsnap.errors import InputError
from minsnap.vehicle import Quadrotor, body_axes

Vector = tuple[float, float, float]
Axes = tuple[Vector, Vector, Vector]
"""Three unit vectors of a body in the world frame: forward, left, up."""


class Reference(NamedTuple):
    """The setpoint at an instant in the world frame; rates and angular accelerations about the body axes."""

    position: Vector
    velocity: Vector
    acceleration: Vector
    feed_forward: Vector
    """Acceleration that offsets drag, added to the commanded acceleration [m/s^2]."""
    yaw: float
    yaw_rate: float
    body_rates: Vector
    angular_acceleration: Vector


class Estimate(NamedTuple):
    """The estimated state of the vehicle: world frame, quaternion w, x, y, z, rates about the body axes."""

    position: Vector
    velocity: Vector
    quaternion: tuple[float, float, float, float]
    body_rates: Vector


class Pilot(Protocol):
    """A running controller of one vehicle."""

    def command(self, estimate: Estimate, reference: Reference) -> Command:
        """Return the commanded rotor speeds, one step after the previous call."""


class Controller(Protocol):
    """Gains and limits of a controller, and the factory of its pilots."""

    def pilot(self, vehicle: Quadrotor, step: float) -> Pilot:
        """Return the running controller for a vehicle, to be called every ``step`` seconds."""


class Command(NamedTuple):
    """The commanded rotor speeds."""

    rotor_speed: list[float]
    """[rad/s], within the limits of the vehicle."""
    saturated: bool
    """Whether thrust or torques had to be cut to stay within them."""


def vector(name: str, values: ArrayLike) -> tuple[float, float, float]:
    """Return three finite floats, or raise InputError that names the argument."""
    x, y, z = check_array(name, values, ((3,),), "three finite numbers, x, y and z", InputError).tolist()
    return x, y, z


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    """Return the vector product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def unit(a: Sequence[float], otherwise: Vector) -> Vector:
    """Return the direction of a vector, or a fallback if the vector is zero."""
    length = math.sqrt(dot(a, a))
    return (a[0] / length, a[1] / length, a[2] / length) if length > 1e-9 else otherwise


def relative(body: Axes, desired: Axes) -> Axes:
    """Return the rows of ``R^T R_d``: scalar products of each body axis with each desired axis."""
    return times(desired, body[0]), times(desired, body[1]), times(desired, body[2])


def times(matrix: Sequence[Sequence[float]], vector: Sequence[float]) -> Vector:
    """Return the product of a matrix, as its rows, and a vector."""
    return dot(matrix[0], vector), dot(matrix[1], vector), dot(matrix[2], vector)


def clip(value: float, low: float, high: float) -> float:
    """Return a number moved inside its bounds."""
    return low if value < low else high if value > high else value


class Allocator:
    """Rotor speeds from thrust and torques within a vehicle's limits; priority: roll and pitch, thrust, yaw.

    Parameters
    ----------
    vehicle : Quadrotor
    """

    def __init__(self, vehicle: Quadrotor) -> None:
        self._inverse = vehicle.inverse_mixer.tolist()
        self._low, self._high = vehicle.rotor_thrust_limits
        self._coefficient = vehicle.thrust_coefficient

    def command(self, thrust: float, torque: Sequence[float]) -> Command:
        """Return rotor speeds for a thrust [N] and torques [N m]."""
        base = [row[0] * thrust + row[1] * torque[0] + row[2] * torque[1] for row in self._inverse]
        shift = self._shift(base)
        base = [clip(value + shift, self._low, self._high) for value in base]
        turn = [row[3] * torque[2] for row in self._inverse]
        share = min(self._room(one, other) for one, other in zip(base, turn, strict=True))
        thrusts = [one + share * other for one, other in zip(base, turn, strict=True)]
        speeds = [math.sqrt(max(value, 0.0) / self._coefficient) for value in thrusts]
        return Command(speeds, shift != 0.0 or share < 1.0)

    def _shift(self, thrusts: list[float]) -> float:
        """Return the common shift that brings all four inside the limits; if impossible, the upper limit is kept."""
        lift = max(self._low - min(thrusts), 0.0)
        return lift + min(self._high - max(thrusts) - lift, 0.0)

    def _room(self, thrust: float, change: float) -> float:
        """Return the largest share of a change, 0 to 1, that keeps one rotor inside its limits."""
        if change > 0.0:
            return min(1.0, (self._high - thrust) / change)
        return min(1.0, (self._low - thrust) / change) if change < 0.0 else 1.0


REFERENCES = ("position", "velocity", "acceleration")
"""How much of a reference a cascade follows: each includes what is before it."""


@dataclass(frozen=True)
class CascadeController:
    """Position P, velocity PID, attitude P and rate PID with saturations: the structure of PX4's multicopter control.

    Position, velocity and attitude gains and the limits are PX4's defaults (parameter reference of v1.14: ``MPC_XY_P``,
    ``MPC_XY_VEL_P_ACC``, ``MC_ROLL_P``, …). PX4 gives its rate gains in normalised torque, which has no physical
    meaning without a vehicle; the rate gains here are per inertia and suit motors with time constants of 40 to 70 ms.
    The derivative gain is 0 by default. The attitude error is that of Brescianini, Hehn and D'Andrea (2013), without
    PX4's reduced weight on yaw.

    Parameters
    ----------
    references : {"position", "velocity", "acceleration"}
        How much of the reference is followed: position alone, with velocity, or with both derivatives.
    position_gain : tuple of 3 floats
        [1/s].
    velocity_gain, velocity_integral, velocity_derivative : tuple of 3 floats
        [1/s], [1/s^2], [1].
    attitude_gain : tuple of 3 floats
        [1/s].
    rate_gain, rate_integral, rate_derivative : tuple of 3 floats
        [1/s], [1/s^2], [1].
    rate_limit : tuple of 3 floats
        [rad/s].
    horizontal_speed, climb_speed, descent_speed : float
        Limits of the velocity that the position loop asks for [m/s].
    tilt_limit : float
        Limit of the tilt that the velocity loop asks for [rad].
    outer_rate : float
        How often position and velocity loops run [Hz], in whole steps: 100 Hz are 125 in steps of 4 ms. Attitude and
        rate loops run every step.

    Raises
    ------
    InputError
        If a gain or limit is not a finite number, a limit is below 0, or ``references`` is not known.
    """

    references: str = "acceleration"
    position_gain: Vector = (0.95, 0.95, 1.0)
    velocity_gain: Vector = (1.8, 1.8, 4.0)
    velocity_integral: Vector = (0.4, 0.4, 2.0)
    velocity_derivative: Vector = (0.2, 0.2, 0.0)
    attitude_gain: Vector = (6.5, 6.5, 2.8)
    rate_gain: Vector = (25.0, 25.0, 10.0)
    rate_integral: Vector = (30.0, 30.0, 10.0)
    rate_derivative: Vector = (0.0, 0.0, 0.0)
    rate_limit: Vector = (math.radians(220.0), math.radians(220.0), math.radians(200.0))
    horizontal_speed: float = 12.0
    climb_speed: float = 3.0
    descent_speed: float = 1.5
    tilt_limit: float = math.radians(45.0)
    outer_rate: float = 50.0

    def __post_init__(self) -> None:
        if not isinstance(self.references, str) or self.references not in REFERENCES:
            raise InputError(f"references is {shown(self.references)}: it must be one of {', '.join(REFERENCES)}")
        for name, value in vars(self).items():
            if name in ("horizontal_speed", "climb_speed", "descent_speed", "tilt_limit", "outer_rate"):
                check_positive(name, value, "", InputError)
            elif name != "references":
                set_fields(self, **{name: vector(name.replace("_", " "), value)})
        if min(self.rate_limit) < 0.0:
            raise InputError(f"rate limit is {self.rate_limit}: no part may be below 0")
        if self.tilt_limit >= math.pi / 2:
            raise InputError(f"tilt_limit is {self.tilt_limit} rad: it must be below a quarter turn")

    def pilot(self, vehicle: Quadrotor, step: float) -> CascadePilot:
        """Return the running controller for a vehicle, to be called every ``step`` seconds."""
        return CascadePilot(self, vehicle, step)


class CascadePilot:
    """A cascade controller of one vehicle, with the state of its integrators.

    Parameters
    ----------
    controller : CascadeSettings
    vehicle : Quadrotor
    step : float
        [s].
    """

    def __init__(self, controller: CascadeController, vehicle: Quadrotor, step: float) -> None:
        self._gains, self._vehicle, self._step = controller, vehicle, step
        self._every = max(1, round(1.0 / (controller.outer_rate * step)))
        self._count = 0
        self._velocity_integral = [0.0, 0.0, 0.0]
        self._rate_integral = [0.0, 0.0, 0.0]
        self._last_velocity: Vector | None = None
        self._last_rates: Vector | None = None
        self._pull: Vector = (0.0, 0.0, vehicle.gravity)
        self._inertia: list[list[float]] = vehicle.inertia.tolist()
        self._allocator = Allocator(vehicle)
        self._saturated = False

    def command(self, estimate: Estimate, reference: Reference) -> Command:
        """Return the commanded rotor speeds."""
        if self._count % self._every == 0:
            self._pull = self._outer(estimate, reference)
        self._count += 1
        body = body_axes(*estimate.quaternion)
        turn = relative(body, heading_axes(self._pull, reference.yaw, body))
        torque = self._torque(self._rates(turn, body, reference.yaw_rate), estimate.body_rates)
        length = math.sqrt(sum(part * part for part in self._pull))
        command = self._allocator.command(self._vehicle.mass * length, torque)
        self._saturated = command.saturated
        return command

    def _outer(self, estimate: Estimate, reference: Reference) -> Vector:
        """Run the position and velocity loops; return thrust per mass as a vector in the world frame."""
        wanted = self._velocity_wanted(estimate, reference)
        errors = [wanted[axis] - estimate.velocity[axis] for axis in range(3)]
        change = self._velocity_change(estimate.velocity)
        follow = 1.0 if self._gains.references == "acceleration" else 0.0
        x, y, z = (
            follow * reference.acceleration[axis]
            + reference.feed_forward[axis]
            + self._gains.velocity_gain[axis] * errors[axis]
            + self._velocity_integral[axis]
            - self._gains.velocity_derivative[axis] * change[axis]
            for axis in range(3)
        )
        pull = self._limited((x, y, z + self._vehicle.gravity))
        if not self._saturated and pull == (x, y, z + self._vehicle.gravity):
            self._integrate(errors)
        return pull

    def _velocity_wanted(self, estimate: Estimate, reference: Reference) -> Vector:
        gains = self._gains
        follow = 0.0 if gains.references == "position" else 1.0
        x, y, z = (
            follow * reference.velocity[axis]
            + gains.position_gain[axis] * (reference.position[axis] - estimate.position[axis])
            for axis in range(3)
        )
        share = min(1.0, gains.horizontal_speed / max(math.hypot(x, y), 1e-9))
        return share * x, share * y, clip(z, -gains.descent_speed, gains.climb_speed)

    def _velocity_change(self, velocity: Vector) -> Vector:
        """Return the mean acceleration since the last run of the outer loops."""
        last, self._last_velocity = self._last_velocity or velocity, velocity
        period = self._every * self._step
        return (velocity[0] - last[0]) / period, (velocity[1] - last[1]) / period, (velocity[2] - last[2]) / period

    def _integrate(self, errors: list[float]) -> None:
        """Integrate the velocity error; not called while thrust or tilt are saturated (anti-windup)."""
        period, limit = self._every * self._step, self._vehicle.gravity
        for axis in range(3):
            more = self._velocity_integral[axis] + self._gains.velocity_integral[axis] * period * errors[axis]
            self._velocity_integral[axis] = clip(more, -limit, limit)

    def _limited(self, pull: Vector) -> Vector:
        """Return the thrust with a vertical part of at least a tenth of gravity and a tilt within the limit."""
        up = max(pull[2], 0.1 * self._vehicle.gravity)
        aside, most = math.hypot(pull[0], pull[1]), up * math.tan(self._gains.tilt_limit)
        share = min(1.0, most / max(aside, 1e-9))
        return share * pull[0], share * pull[1], up

    def _rates(self, turn: Axes, body: Axes, yaw_rate: float) -> Vector:
        """Return the desired body rates: attitude error times gain, plus the yaw rate of the reference."""
        half = 2.0 * math.sqrt(max(1.0 + turn[0][0] + turn[1][1] + turn[2][2], 1e-6))
        error = (turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1])
        gain, limit = self._gains.attitude_gain, self._gains.rate_limit
        x, y, z = (
            clip(gain[axis] * 2.0 * error[axis] / half + yaw_rate * body[axis][2], -limit[axis], limit[axis])
            for axis in range(3)
        )
        return x, y, z

    def _torque(self, wanted: Vector, rates: Vector) -> Vector:
        """Run the rate loop; its integral is frozen while a rotor is at a limit."""
        errors = [wanted[axis] - rates[axis] for axis in range(3)]
        if not self._saturated:
            for axis in range(3):
                self._rate_integral[axis] += self._gains.rate_integral[axis] * self._step * errors[axis]
        last, self._last_rates = self._last_rates or rates, rates
        x, y, z = (
            self._gains.rate_gain[axis] * errors[axis]
            + self._rate_integral[axis]
            - self._gains.rate_derivative[axis] * (rates[axis] - last[axis]) / self._step
            for axis in range(3)
        )
        return times(self._inertia, (x, y, z))


def heading_axes(pull: Vector, yaw: float, body: Axes) -> Axes:
    """Return the attitude with thrust along ``pull`` and the forward axis headed along ``yaw``, as PX4 does."""
    up = unit(pull, body[2])
    forward = unit(cross((-math.sin(yaw), math.cos(yaw), 0.0), up), body[0])
    return forward, cross(up, forward), up


@dataclass(frozen=True)
class GeometricController:
    r"""Force from position and velocity errors, torque from the attitude error on the rotation group.

    With ``feed_forward`` the torque is that of Lee, Leok and McClamroch (*Geometric tracking control of a quadrotor UAV
    on SE(3)*, CDC 2010), which cancels the gyroscopic torque and adds the reference's angular acceleration; without,
    that of Mellinger and Kumar (ICRA 2011), which uses the errors only. Gains are per mass and per inertia, so one set
    suits vehicles of any size.

    .. math:: F = m(-k_x e_x - k_v e_v + g e_z + a_{ref}), \qquad
              \tau = J(-k_R e_R - k_\Omega e_\Omega) + \Omega\times J\Omega
                     - J(\hat\Omega R^\top R_d\Omega_d - R^\top R_d\dot\Omega_d)

    Parameters
    ----------
    position_gain, velocity_gain : tuple of 3 floats
        [1/s^2], [1/s].
    attitude_gain, rate_gain : tuple of 3 floats
        [1/s^2], [1/s].
    feed_forward : bool
        Lee's torque, or else Mellinger's.
    """

    position_gain: Vector = (6.0, 6.0, 8.0)
    velocity_gain: Vector = (4.0, 4.0, 5.0)
    attitude_gain: Vector = (144.0, 144.0, 60.0)
    rate_gain: Vector = (19.0, 19.0, 12.0)
    feed_forward: bool = True

    def __post_init__(self) -> None:
        for name in ("position_gain", "velocity_gain", "attitude_gain", "rate_gain"):
            set_fields(self, **{name: vector(name.replace("_", " "), getattr(self, name))})
        set_fields(self, feed_forward=check_switch("feed_forward", self.feed_forward))

    def pilot(self, vehicle: Quadrotor, step: float) -> GeometricPilot:
        """Return the running controller for a vehicle; it has no state between steps."""
        return GeometricPilot(self, vehicle)


class GeometricPilot:
    """A running geometric controller of one vehicle.

    Parameters
    ----------
    controller : GeometricController
    vehicle : Quadrotor
    """

    def __init__(self, controller: GeometricController, vehicle: Quadrotor) -> None:
        self._controller, self._mass, self._gravity = controller, vehicle.mass, vehicle.gravity
        self._inertia: list[list[float]] = vehicle.inertia.tolist()
        self._allocator = Allocator(vehicle)

    def command(self, estimate: Estimate, reference: Reference) -> Command:
        """Return the commanded rotor speeds."""
        body = body_axes(*estimate.quaternion)
        pull = self._pull(estimate, reference)
        turn = relative(body, desired_axes(pull, reference.yaw, body))
        torque = self._torque(estimate.body_rates, turn, reference)
        return self._allocator.command(self._mass * dot(pull, body[2]), torque)

    def _pull(self, estimate: Estimate, reference: Reference) -> Vector:
        """Return the desired thrust per mass as a vector in the world frame."""
        gains = zip(self._controller.position_gain, self._controller.velocity_gain, strict=True)
        x, y, z = (
            stiff * (reference.position[axis] - estimate.position[axis])
            + damp * (reference.velocity[axis] - estimate.velocity[axis])
            + reference.acceleration[axis]
            + reference.feed_forward[axis]
            for axis, (stiff, damp) in enumerate(gains)
        )
        return x, y, z + self._gravity

    def _torque(self, rates: Vector, turn: Axes, reference: Reference) -> Vector:
        """Return torques from the errors in attitude and rates, and Lee's feed-forward."""
        error = (turn[1][2] - turn[2][1], turn[2][0] - turn[0][2], turn[0][1] - turn[1][0])
        wanted = times(turn, reference.body_rates)
        stiff, damp = self._controller.attitude_gain, self._controller.rate_gain
        p, q, r = (-0.5 * stiff[axis] * error[axis] - damp[axis] * (rates[axis] - wanted[axis]) for axis in range(3))
        if not self._controller.feed_forward:
            return times(self._inertia, (p, q, r))
        change, coupling = times(turn, reference.angular_acceleration), cross(rates, wanted)
        following = (p + change[0] - coupling[0], q + change[1] - coupling[1], r + change[2] - coupling[2])
        torque, gyroscopic = times(self._inertia, following), cross(rates, times(self._inertia, rates))
        return torque[0] + gyroscopic[0], torque[1] + gyroscopic[1], torque[2] + gyroscopic[2]


def desired_axes(pull: Vector, yaw: float, body: Axes) -> Axes:
    """Return the attitude with thrust along ``pull`` and the yaw of flatness, or the current one where undefined."""
    up = unit(pull, body[2])
    left = unit(cross(up, (cos(yaw), sin(yaw), 0.0)), body[1])
    return cross(left, up), left, up
