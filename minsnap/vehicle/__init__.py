"""The vehicle: parameters, drag models, fits, equations of motion, and the thrust, rates and torques a motion needs."""

from minsnap.basics.arrays import GRAVITY
from minsnap.vehicle.drag import BodyDrag, Drag, RotorSpeedDrag, SumOfDrags, linear_rotor_drag
from minsnap.vehicle.dynamics import RigidBody
from minsnap.vehicle.flatness import body_rates, specific_thrust, thrust_vector, tilt, tilt_rate
from minsnap.vehicle.quadrotor import Quadrotor
from minsnap.vehicle.rotor_fit import CoefficientFit, fit_thrust_coefficient, fit_torque_coefficient
from minsnap.vehicle.states import FlatStates, check_rotor_limits, flat_states, flatness_of
from minsnap.vehicle.surface import RPM, Surface, SurfaceDrag
from minsnap.vehicle.vehicle_file import read_vehicle, write_vehicle

__all__ = [
    "GRAVITY",
    "RPM",
    "BodyDrag",
    "CoefficientFit",
    "Drag",
    "FlatStates",
    "Quadrotor",
    "RigidBody",
    "RotorSpeedDrag",
    "SumOfDrags",
    "Surface",
    "SurfaceDrag",
    "body_rates",
    "check_rotor_limits",
    "fit_thrust_coefficient",
    "fit_torque_coefficient",
    "flat_states",
    "flatness_of",
    "linear_rotor_drag",
    "read_vehicle",
    "specific_thrust",
    "thrust_vector",
    "tilt",
    "tilt_rate",
    "write_vehicle",
]
