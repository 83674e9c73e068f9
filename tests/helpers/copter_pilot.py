"""A pilot like ArduCopter's in guided flight: it follows a target of its own, which moves within its limits.

After AC_PosControl, in outline: the target takes the setpoint's position, velocity and acceleration in, and pulls what
it is off by back with limits of acceleration and jerk; the integral of the velocity loop offsets drag.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from minsnap.flight import CascadeController
from minsnap.flight.simulation.controllers import Command, Estimate, Reference
from minsnap.vehicle import Quadrotor

GAINS = {
    "position_gain": (1.0, 1.0, 1.0),
    "velocity_gain": (2.0, 2.0, 5.0),
    "velocity_integral": (1.0, 1.0, 2.0),
    "velocity_derivative": (0.25, 0.25, 0.0),
    "tilt_limit": math.radians(30.0),
}


@dataclass(frozen=True)
class CopterController:
    """WP_ACC [m/s^2] and PSC_JERK_NE [m/s^3], by their defaults in 4.7."""

    acceleration: float = 2.5
    jerk: float = 5.0

    def pilot(self, vehicle: Quadrotor, step: float) -> CopterPilot:
        return CopterPilot(self, vehicle, step)


class CopterPilot:
    def __init__(self, limits: CopterController, vehicle: Quadrotor, step: float) -> None:
        self._limits, self._step = limits, step
        self._cascade = CascadeController(**GAINS).pilot(vehicle, step)
        self._target: list[list[float]] = []

    def command(self, estimate: Estimate, reference: Reference) -> Command:
        wanted = [list(each) for each in (reference.position, reference.velocity, reference.acceleration)]
        self._target = self._target or wanted
        place, speed, push = self._target
        most, jerk, step = self._limits.acceleration, self._limits.jerk, self._step
        pushes = []
        for axis in range(3):
            place[axis] += speed[axis] * step + 0.5 * push[axis] * step**2
            speed[axis] += push[axis] * step
            back = _root(wanted[0][axis] - place[axis], jerk / most, 0.5 * most)
            pushes.append(_root(wanted[1][axis] + back - speed[axis], jerk / most, jerk) + wanted[2][axis])
        size = math.hypot(*pushes[:2])
        pushes[:2] = [value * min(1.0, most / max(size, 1e-9)) for value in pushes[:2]]
        for axis in range(3):
            push[axis] += max(-jerk * step, min(jerk * step, pushes[axis] - push[axis]))
        shaped = reference._replace(position=tuple(place), velocity=tuple(speed), acceleration=tuple(push))
        return self._cascade.command(estimate, shaped)


def _root(error: float, gain: float, most: float) -> float:
    """Proportional near zero; beyond, the speed from which ``most`` stops within the error."""
    near = most / gain**2
    if abs(error) <= near:
        return gain * error
    return math.copysign(math.sqrt(2.0 * most * (abs(error) - 0.5 * near)), error)
