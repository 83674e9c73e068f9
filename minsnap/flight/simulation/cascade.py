"""A controller like PX4's: position, velocity, attitude and rates in a cascade."""

from __future__ import annotations

import math
from dataclasses import dataclass

from minsnap.basics.checks import check_positive
from minsnap.basics.messages import shown
from minsnap.errors import InputError
from minsnap.flight.simulation.controller import (
    Allocator,
    Axes,
    Command,
    Estimate,
    Reference,
    Vector,
    axes_of,
    clip,
    cross,
    relative,
    times,
    unit,
)
from minsnap.flight.simulation.wind import vector
from minsnap.vehicle.quadrotor import Quadrotor

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
        How often position and velocity loops run [Hz]; attitude and rate loops run every step.

    Raises
    ------
    InputError
        If a gain or limit is not a finite number, or ``references`` is not known.
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
                object.__setattr__(self, name, vector(name.replace("_", " "), value))
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
        body = axes_of(estimate.quaternion)
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
