"""What a simulated flight shows: its figures, its comparison, and the log that its autopilot would have written."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_kind, check_seed, is_number
from minsnap.basics.messages import shown
from minsnap.errors import InputError
from minsnap.files.logs.flight_log import FlightLog, InertialLog
from minsnap.flight.simulation.reference import drag_in_body, tabulate
from minsnap.flight.simulation.simulated_flight import STEP, Flight
from minsnap.flight.tracking.comparison import compare
from minsnap.flight.tracking.log_comparison import ComparedFlight
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples
from minsnap.vehicle.attitude import rotations
from minsnap.vehicle.quadrotor import Quadrotor


def flight_figures(flight: Flight, vehicle: Quadrotor) -> dict[str, Any]:
    """Return the figures of a simulated flight.

    Parameters
    ----------
    flight : Flight
    vehicle : Quadrotor
        That flew.

    Returns
    -------
    dict
        duration [s]; rmse, rmse_axes, max_error [m]; max_error_instant [s]; delay [s]: by how much it was late;
        max_speed [m/s]; max_tilt [rad]; max_rotor_thrust and rotor_thrust_limit [N]; saturated: share of the time in
        which the rotors could not do what the controller commanded.
    """
    comparison = compared(flight).comparison
    apart = np.linalg.norm(flight.error, axis=1)
    upright = 1.0 - 2.0 * (flight.quaternion[:, 1:3] ** 2).sum(axis=1)
    return {
        "duration": flight.duration,
        "rmse": comparison.rmse_3d,
        "rmse_axes": comparison.rmse.tolist(),
        "max_error": float(apart.max()),
        "max_error_instant": float(flight.t[apart.argmax()]),
        "delay": comparison.delay,
        "max_speed": float(np.linalg.norm(flight.velocity, axis=1).max()),
        "max_tilt": float(np.arccos(np.clip(upright, -1.0, 1.0)).max()),
        "max_rotor_thrust": float(vehicle.thrust_coefficient * (flight.rotor_speed**2).max()),
        "rotor_thrust_limit": float(vehicle.rotor_thrust_limits[1]),
        "saturated": float(flight.saturated.mean()),
    }


def compared(flight: Flight) -> ComparedFlight:
    """Return a simulated flight beside what was to be flown."""
    comparison = compare(flight.reference, flight.samples, max_delay=min(2.0, flight.duration / 4.0))
    return ComparedFlight(comparison, flight.reference, flight.samples)


STATES = 50.0
"""States that are logged a second [Hz]; the accelerometer is logged at every step."""


def simulated_log(
    vehicle: Quadrotor, flight: Flight, setpoints: Path | Samples, noise: float = 0.05, seed: int = 0
) -> FlightLog:
    """Return the log of a simulated flight: setpoints, states, attitude, specific force and throttle.

    Parameters
    ----------
    vehicle : Quadrotor
        What flew.
    flight : Flight
        How.
    setpoints : Path or Samples
        What was sent, from the start of the flight on; a path at every step of a simulation.
    noise : float
        Standard deviation of the accelerometer along each axis [m/s^2].
    seed : int
        Of the noise.

    Returns
    -------
    FlightLog
        As :func:`minsnap.flight.fit_flight` takes it.
    """
    check_kind("the vehicle", vehicle, Quadrotor, "a Quadrotor")
    check_kind("the flight", flight, Flight, "a Flight")
    sent = tabulate(setpoints, None, STEP)
    check_seed(seed)
    if not (is_number(noise) and noise >= 0.0):
        raise InputError(f"the noise is {shown(noise)}: it must be 0 or more [m/s^2]")
    every = max(1, round((len(flight.t) - 1) / (STATES * flight.duration)))
    slow = slice(None, None, every)
    states = replace(flight.samples[slow], yaw=None)
    thrust = vehicle.wrench(flight.rotor_speed)[:, 0]
    felt = _specific_force(vehicle, flight, thrust)
    felt = felt + noise * np.random.default_rng(seed).normal(size=felt.shape)
    throttle = thrust / (vehicle.max_thrust_to_weight * vehicle.weight)
    inertial = InertialLog(flight.t[slow], flight.quaternion[slow], flight.t, felt, flight.t[slow], throttle[slow])
    return FlightLog(replace(sent, t=sent.t - sent.t[0]), states, 0.0, inertial=inertial)


def _specific_force(vehicle: Quadrotor, flight: Flight, thrust: FloatArray) -> FloatArray:
    """Return the measurements of an accelerometer in the body, shape (m, 3) [m/s^2]."""
    air = flight.velocity - flight.wind
    force = drag_in_body(vehicle.drag, rotations(flight.quaternion), air, flight.rotor_speed)
    return np.asarray((force + thrust[:, None] * np.array([0.0, 0.0, 1.0])) / vehicle.mass)
