"""Geometric control on SE(3), after Lee and after Mellinger."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

from minsnap.flight.simulation.controller import (
    Allocator,
    Axes,
    Command,
    Estimate,
    Reference,
    Vector,
    axes_of,
    cross,
    dot,
    relative,
    times,
    unit,
)
from minsnap.flight.simulation.wind import vector
from minsnap.vehicle.quadrotor import Quadrotor


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
            object.__setattr__(self, name, vector(name.replace("_", " "), getattr(self, name)))

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
        body = axes_of(estimate.quaternion)
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
