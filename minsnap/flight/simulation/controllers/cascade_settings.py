"""Gains and limits of the cascade of position, velocity, attitude and rate loops, with the structure of PX4."""

from __future__ import annotations

import math
from dataclasses import dataclass

from minsnap.basics.checks import check_positive
from minsnap.basics.messages import shown
from minsnap.errors import InputError
from minsnap.flight.simulation.controllers.controller import Vector
from minsnap.flight.simulation.wind import vector

REFERENCES = ("position", "velocity", "acceleration")
"""How much of a reference a cascade follows: each includes what is before it."""

_VECTORS = (
    "position_gain",
    "velocity_gain",
    "velocity_integral",
    "velocity_derivative",
    "attitude_gain",
    "rate_gain",
    "rate_integral",
    "rate_derivative",
    "rate_limit",
)


@dataclass(frozen=True)
class CascadeSettings:
    """Gains and limits of position P, velocity PID, attitude P and rate PID loops.

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
        for name in _VECTORS:
            object.__setattr__(self, name, vector(name.replace("_", " "), getattr(self, name)))
        for name in ("horizontal_speed", "climb_speed", "descent_speed", "tilt_limit", "outer_rate"):
            check_positive(name, getattr(self, name), "", InputError)
        if self.tilt_limit >= math.pi / 2:
            raise InputError(f"tilt_limit is {self.tilt_limit} rad: it must be below a quarter turn")
