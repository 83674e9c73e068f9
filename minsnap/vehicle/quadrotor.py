"""A quadrotor as an immutable value: body, rotors, drag, and the quantities derived from them."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import GRAVITY, FloatArray, ReadOnly
from minsnap.basics.messages import shown
from minsnap.errors import VehicleError
from minsnap.vehicle.drag import BodyDrag, Drag
from minsnap.vehicle.mixer import mixer_matrix, rotor_positions
from minsnap.vehicle.parameter_checks import checked_inertia, non_negative, positive


@dataclass(frozen=True, eq=False)
class Quadrotor(ReadOnly):
    """Four rotors on a rigid body; SI units, body axes forward, left, up.

    Parameters
    ----------
    mass : float
        [kg], positive.
    inertia : array_like, shape (3,) or (3, 3)
        Moments about the body's axes, or the whole matrix [kg m^2]; positive definite, principal moments that obey the
        triangle inequality.
    arm_length : float
        From the center to a rotor's hub [m].
    thrust_coefficient : float
        Thrust over the square of rotor speed [N/(rad/s)^2].
    torque_coefficient : float
        Reaction torque over the square of rotor speed [N m/(rad/s)^2].
    rotor_speed_max, rotor_speed_min : float
        [rad/s].
    layout : {"x", "+"}
        See :mod:`minsnap.vehicle.mixer` for the numbering.
    drag : Drag
        Force of the air; none by default.
    motor_time_constant : float
        Of the first-order response of rotor speed to its command [s]; 0 is instantaneous.
    gravity : float
        [m/s^2].
    name : str
        What it is called.
    delay : float
        Of its position after a setpoint, under the controller that flies it [s]; 0 where it is not known.

    Raises
    ------
    VehicleError
        If a value is not that of a physical vehicle; says which.
    """

    mass: float
    inertia: FloatArray
    arm_length: float
    thrust_coefficient: float
    torque_coefficient: float
    rotor_speed_max: float
    rotor_speed_min: float = 0.0
    layout: str = "x"
    drag: Drag = field(default_factory=BodyDrag)
    motor_time_constant: float = 0.0
    gravity: float = GRAVITY
    name: str = "quadrotor"
    delay: float = 0.0

    def __post_init__(self) -> None:
        for name in ("mass", "arm_length", "thrust_coefficient", "torque_coefficient", "rotor_speed_max", "gravity"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        for name in ("rotor_speed_min", "motor_time_constant", "delay"):
            object.__setattr__(self, name, non_negative(name, getattr(self, name)))
        object.__setattr__(self, "inertia", checked_inertia(self.inertia))
        rotor_positions(self.layout, self.arm_length)
        if self.rotor_speed_min >= self.rotor_speed_max:
            limits = f"{self.rotor_speed_min} and {self.rotor_speed_max} rad/s"
            raise VehicleError(f"the rotor speed limits are {limits}: the lower must be below the upper")
        if not isinstance(self.drag, Drag):
            raise VehicleError(f"drag is {shown(self.drag)}: give a model with a force method, such as BodyDrag(...)")

    @cached_property
    def rotor_positions(self) -> FloatArray:
        """Rotor hubs in the body frame, shape (4, 3) [m]."""
        return _read_only(rotor_positions(self.layout, self.arm_length))

    @cached_property
    def mixer(self) -> FloatArray:
        """Matrix from rotor thrusts to thrust and torques, shape (4, 4)."""
        return _read_only(mixer_matrix(self.rotor_positions, self.torque_coefficient / self.thrust_coefficient))

    @cached_property
    def inverse_mixer(self) -> FloatArray:
        """Matrix from thrust and torques to rotor thrusts, shape (4, 4)."""
        return _read_only(np.asarray(np.linalg.inv(self.mixer), dtype=np.float64))

    @property
    def weight(self) -> float:
        """Mass times gravity [N]."""
        return self.mass * self.gravity

    @property
    def hover_thrust(self) -> float:
        """Thrust of each rotor in hover [N]."""
        return self.weight / 4.0

    @property
    def hover_rotor_speed(self) -> float:
        """Speed of each rotor in hover [rad/s]."""
        return math.sqrt(self.hover_thrust / self.thrust_coefficient)

    @property
    def rotor_thrust_limits(self) -> tuple[float, float]:
        """Least and most thrust of one rotor [N]."""
        least, most = self.rotor_speed_min, self.rotor_speed_max
        return self.thrust_coefficient * least**2, self.thrust_coefficient * most**2

    @property
    def max_thrust_to_weight(self) -> float:
        """Greatest total thrust divided by weight."""
        return 4.0 * self.rotor_thrust_limits[1] / self.weight

    def wrench(self, rotor_speed: npt.ArrayLike) -> FloatArray:
        """Total thrust [N] and torques about x, y, z [N m] of rotor speeds.

        Parameters
        ----------
        rotor_speed : array_like, shape (..., 4)
            [rad/s].

        Returns
        -------
        ndarray, shape (..., 4)
        """
        speeds = np.asarray(rotor_speed, dtype=np.float64)
        return np.asarray(self.thrust_coefficient * (speeds * np.abs(speeds)) @ self.mixer.T)

    def rotor_thrusts(self, wrench: npt.ArrayLike) -> FloatArray:
        """Return the rotor thrusts [N] for a total thrust and torques, both of shape (..., 4)."""
        return np.asarray(np.asarray(wrench, dtype=np.float64) @ self.inverse_mixer.T)

    def rotor_speeds(self, wrench: npt.ArrayLike) -> FloatArray:
        """Return the rotor speeds [rad/s] for a total thrust and torques, both of shape (..., 4).

        No limit is applied; a negative thrust gives a negative speed.
        """
        thrusts = self.rotor_thrusts(wrench)
        return np.asarray(np.sign(thrusts) * np.sqrt(np.abs(thrusts) / self.thrust_coefficient))

    @classmethod
    def dji_f330(cls) -> Quadrotor:
        """Return a DJI F330; see ``minsnap.vehicle.presets`` for the source of each parameter."""
        from minsnap.vehicle.presets import dji_f330_parameters

        return cls(**dji_f330_parameters())

    @classmethod
    def px4_sih(cls) -> Quadrotor:
        """Return the quadrotor of PX4's simulation in hardware; see ``minsnap.vehicle.presets``."""
        from minsnap.vehicle.presets import px4_sih_parameters

        return cls(**px4_sih_parameters())

    @classmethod
    def crazyflie(cls) -> Quadrotor:
        """Return a Crazyflie 2.x; see :func:`minsnap.vehicle.presets.crazyflie_parameters` for its sources."""
        from minsnap.vehicle.presets import crazyflie_parameters

        return cls(**crazyflie_parameters())

    @classmethod
    def from_yaml(cls, path: str | os.PathLike[str]) -> Quadrotor:
        """Read a vehicle from a file; see :func:`minsnap.vehicle.read_vehicle`."""
        from minsnap.vehicle.yaml import read_described

        return read_described(cls, path)

    def to_yaml(self, path: str | os.PathLike[str]) -> None:
        """Write the vehicle to a file; see :func:`minsnap.vehicle.write_vehicle`."""
        from minsnap.vehicle.yaml import write_description

        write_description(self, path)


def _read_only(array: FloatArray) -> FloatArray:
    array.flags.writeable = False
    return array
