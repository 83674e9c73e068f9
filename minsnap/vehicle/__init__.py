"""The vehicle: its parameters, drag, fits, dynamics, and what a motion asks of it."""

from minsnap.arrays import GRAVITY
from minsnap.thesis.consistent import consistent_parasitic_drag, consistent_r_squared, consistent_rotor_drag
from minsnap.thesis.drag_fits import DragFit, fit_consistent_drag, fit_drag
from minsnap.thesis.published import (
    PUBLISHED_PARASITIC,
    PUBLISHED_PARASITIC_LINEAR,
    PUBLISHED_PARASITIC_REDUCED,
    PUBLISHED_PROPELLER,
    RPM,
    SurfaceDrag,
    published_drag,
)
from minsnap.thesis.surface import Surface
from minsnap.vehicle.drag import BodyDrag, Drag, RotorSpeedDrag, SumOfDrags, linear_rotor_drag
from minsnap.vehicle.dynamics import RigidBody
from minsnap.vehicle.flatness import body_rates, specific_thrust, thrust_vector, tilt, tilt_rate
from minsnap.vehicle.quadrotor import Quadrotor
from minsnap.vehicle.rotor_fit import CoefficientFit, fit_thrust_coefficient, fit_torque_coefficient
from minsnap.vehicle.states import FlatStates, check_rotor_limits, flat_states, flatness_of
from minsnap.vehicle.yaml import read_vehicle, write_vehicle

__all__ = [
    "GRAVITY",
    "PUBLISHED_PARASITIC",
    "PUBLISHED_PARASITIC_LINEAR",
    "PUBLISHED_PARASITIC_REDUCED",
    "PUBLISHED_PROPELLER",
    "RPM",
    "BodyDrag",
    "CoefficientFit",
    "Drag",
    "DragFit",
    "FlatStates",
    "Quadrotor",
    "RigidBody",
    "RotorSpeedDrag",
    "SumOfDrags",
    "Surface",
    "SurfaceDrag",
    "body_rates",
    "check_rotor_limits",
    "consistent_parasitic_drag",
    "consistent_r_squared",
    "consistent_rotor_drag",
    "fit_consistent_drag",
    "fit_drag",
    "fit_thrust_coefficient",
    "fit_torque_coefficient",
    "flat_states",
    "flatness_of",
    "linear_rotor_drag",
    "published_drag",
    "read_vehicle",
    "specific_thrust",
    "thrust_vector",
    "tilt",
    "tilt_rate",
    "write_vehicle",
]
