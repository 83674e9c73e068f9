"""Simulated flights, measured and logged as flown ones are."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.basics.checks import check_kind, check_number, check_seed
from minsnap.files import FlightLog, InertialLog
from minsnap.flight.simulation.flight_inputs import drag_in_body, tabulate
from minsnap.flight.simulation.simulated_flight import STEP, Flight
from minsnap.flight.tracking.comparison import compare
from minsnap.flight.tracking.log_comparison import ComparedFlight
from minsnap.trajectory import Path, Samples
from minsnap.vehicle import Quadrotor, rotations

STATES = 50.0
"""States that are logged a second [Hz]; the accelerometer is logged at every step."""


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
    comparison = compare_simulated(flight).comparison
    upright = 1.0 - 2.0 * (flight.quaternion[:, 1:3] ** 2).sum(axis=1)
    return {
        "duration": flight.duration,
        "rmse": comparison.rmse_3d,
        "rmse_axes": comparison.rmse.tolist(),
        "max_error": comparison.max_error,
        "max_error_instant": comparison.worst_instant,
        "delay": comparison.delay,
        "max_speed": float(np.linalg.norm(flight.velocity, axis=1).max()),
        "max_tilt": float(np.arccos(np.clip(upright, -1.0, 1.0)).max()),
        "max_rotor_thrust": float(np.abs(vehicle.thrusts(flight.rotor_speed)).max()),
        "rotor_thrust_limit": float(vehicle.rotor_thrust_limits[1]),
        "saturated": float(flight.saturated.mean()),
    }


def compare_simulated(flight: Flight) -> ComparedFlight:
    """Compare a simulated flight with what was to be flown."""
    comparison = compare(flight.reference, flight.samples, max_delay=min(2.0, flight.duration / 4.0))
    return ComparedFlight(comparison, flight.reference, flight.samples)


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
    check_number("the noise", noise, 0.0, np.inf, "it must be 0 or more [m/s^2]")
    slow = slice(None, None, max(1, round((len(flight.t) - 1) / (STATES * flight.duration))))
    states = replace(flight.samples[slow], yaw=None)
    thrust = vehicle.wrench(flight.rotor_speed)[:, 0]
    drag = drag_in_body(vehicle.drag, rotations(flight.quaternion), flight.velocity - flight.wind, flight.rotor_speed)
    felt = (drag + thrust[:, None] * np.array([0.0, 0.0, 1.0])) / vehicle.mass
    felt += noise * np.random.default_rng(seed).normal(size=felt.shape)
    throttle = thrust / (vehicle.max_thrust_to_weight * vehicle.weight)
    inertial = InertialLog(flight.t[slow], flight.quaternion[slow], flight.t, felt, flight.t[slow], throttle[slow])
    return FlightLog(replace(sent, t=sent.t - sent.t[0]), states, 0.0, inertial=inertial)
