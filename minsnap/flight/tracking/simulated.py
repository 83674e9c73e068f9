"""What a simulated flight shows: how far it was from its reference, and how much of the vehicle it took."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.flight.simulation.flight_record import Flight
from minsnap.flight.tracking.comparison import compare
from minsnap.flight.tracking.log_comparison import ComparedFlight
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
