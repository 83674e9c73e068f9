"""Open-loop simulation: the equations of motion under the inputs from flatness, without feedback."""

from __future__ import annotations

import itertools
import math

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_kind, is_number
from minsnap.basics.messages import shown
from minsnap.errors import DivergenceError, TimingError
from minsnap.flight.simulation.flight_record import Flight
from minsnap.flight.simulation.reference import check_steps
from minsnap.flight.simulation.wind import vector
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples
from minsnap.vehicle.dynamics import RigidBody
from minsnap.vehicle.flatness import spatial
from minsnap.vehicle.quadrotor import Quadrotor
from minsnap.vehicle.states import FlatStates, flatness_of

_INSIDE = 1e-9
"""Distance from the end of a step at which its last rotor speeds are taken, as a share of the step."""


def simulate_open_loop(
    vehicle: Quadrotor, path: Path, *, wind: tuple[float, float, float] = (0.0, 0.0, 0.0), step: float = 0.001
) -> Flight:
    """Integrate the equations of motion under the rotor speeds that flatness gives for a path.

    There is no feedback, so the deviation from the path measures the accuracy of the inverse dynamics and of the
    integration. Rotor speeds are functions of time; motor lag and limits are not applied. Snap, and with it torque, may
    jump at the knots of a trajectory: steps end at the knots and use the rotor speeds of the leg that ends there.

    Parameters
    ----------
    vehicle : Quadrotor
        With drag that can be inverted.
    path : Path
        Of two or three dimensions; four continuous derivatives between its ``breaks``, where it has them.
    wind : tuple of 3 floats
        Constant, known to the inverse dynamics [m/s].
    step : float
        Greatest step [s].

    Returns
    -------
    Flight
        At instants that are uniform within each leg.

    Raises
    ------
    TimingError
        If the step is not positive or longer than the path.
    """
    air = vector("wind velocity", wind)
    check_kind("the vehicle", vehicle, Quadrotor, "a Quadrotor")
    check_kind("the path", path, Path, "a path")
    if not (is_number(step) and 0 < step <= path.duration):
        raise TimingError(f"the step is {shown(step)} s: it must be above 0 and within the path's {path.duration} s")
    check_steps(path.duration, step)
    t = _instants(path, step)
    stages = np.stack([t[:-1], 0.5 * (t[:-1] + t[1:]), t[1:] - _INSIDE * np.diff(t)], axis=-1)
    states = flatness_of(vehicle, path, stages.ravel(), wind=air)
    try:
        log = _integrate(RigidBody(vehicle), path, states, air, np.diff(t).tolist())
    except OverflowError:
        log = [[np.inf]]
    if not np.isfinite(log[-1]).all():
        raise DivergenceError("the motion leaves the range of numbers: slow down the path or the wind")
    return _flight(path, t, log, states, air)


def _instants(path: Path, step: float) -> FloatArray:
    """Return instants from 0 to the end, the knots of a trajectory among them, no further apart than a step."""
    knots = np.asarray(getattr(path, "breaks", (0.0, path.duration)), dtype=np.float64)
    legs = [
        np.linspace(start, end, math.ceil((end - start) / step - 1e-9) + 1)[:-1]
        for start, end in itertools.pairwise(knots.tolist())
    ]
    return np.concatenate([*legs, knots[-1:]])


def _integrate(
    body: RigidBody, path: Path, states: FlatStates, wind: tuple[float, float, float], steps: list[float]
) -> list[list[float]]:
    """Return the state at the start and after every step, from three rotor speeds per step."""
    speeds = states.rotor_speed.tolist()
    start = (spatial(path(0.0)), spatial(path(0.0, 1)), states.quaternion[0], states.body_rates[0])
    log = [np.concatenate(start).tolist()]
    for index, step in enumerate(steps):
        first, middle, last = speeds[3 * index : 3 * index + 3]
        log.append(body.advance(log[-1], (first, middle, last), wind, step))
    return log


def _flight(path: Path, t: FloatArray, log: list[list[float]], states: FlatStates, wind: tuple[float, ...]) -> Flight:
    position, velocity, quaternion, rates = np.split(np.array(log), [3, 6, 10], axis=1)
    reference = Samples(t, spatial(path(t)), spatial(path(t, 1)), yaw=path.yaw(t))
    air, free = np.tile(wind, (len(t), 1)), np.zeros(len(t), dtype=bool)
    speeds = np.concatenate([states.rotor_speed[::3], states.rotor_speed[-1:]])
    return Flight(t, position, velocity, quaternion, rates, speeds, air, free, reference)
