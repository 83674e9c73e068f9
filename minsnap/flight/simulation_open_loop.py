"""Flying the inputs of flatness with no feedback at all: what the inverse dynamics promise, integrated."""

from __future__ import annotations

import numpy as np

from minsnap.errors import TimingError
from minsnap.flight.simulation_flight import Flight
from minsnap.flight.wind import vector
from minsnap.path import Path
from minsnap.samples import FloatArray, Samples
from minsnap.vehicle.dynamics import RigidBody
from minsnap.vehicle.flatness import spatial
from minsnap.vehicle.quadrotor import Quadrotor
from minsnap.vehicle.states import FlatStates, flatness_of


def simulate_open_loop(
    vehicle: Quadrotor, path: Path, *, wind: tuple[float, float, float] = (0.0, 0.0, 0.0), step: float = 0.001
) -> Flight:
    """Integrate the equations of motion under the rotor speeds that flatness gives for a path.

    Nothing corrects an error, so how far the flight strays tells how exact the inverse dynamics and the integration
    are. Rotor speeds are given as functions of time; motors do not lag, and limits are not applied.

    Parameters
    ----------
    vehicle : Quadrotor
        With drag that can be inverted.
    path : Path
        Of two or three dimensions, with four continuous derivatives for the integration to be of fourth order.
    wind : tuple of 3 floats
        Constant, known to the inverse dynamics [m/s].
    step : float
        [s].

    Returns
    -------
    Flight

    Raises
    ------
    TimingError
        If the step is not positive or longer than the path.
    """
    air = vector("wind velocity", wind)
    if not 0 < step <= path.duration:
        raise TimingError(f"the step is {step!r} s: it must be above 0 and within the path's {path.duration} s")
    count = max(1, round(path.duration / step))
    halves = np.linspace(0.0, path.duration, 2 * count + 1)
    states = flatness_of(vehicle, path, halves, wind=air)
    log = _integrate(RigidBody(vehicle), path, states, air, path.duration / count)
    return _flight(path, halves[::2], log, states, air)


def _integrate(
    body: RigidBody, path: Path, states: FlatStates, wind: tuple[float, float, float], step: float
) -> list[list[float]]:
    """Return the state at the start and after every step."""
    speeds = states.rotor_speed.tolist()
    start = (spatial(path(0.0)), spatial(path(0.0, 1)), states.quaternion[0], states.body_rates[0])
    log = [np.concatenate(start).tolist()]
    for index in range(0, len(speeds) - 2, 2):
        log.append(body.advance(log[-1], (speeds[index], speeds[index + 1], speeds[index + 2]), wind, step))
    return log


def _flight(path: Path, t: FloatArray, log: list[list[float]], states: FlatStates, wind: tuple[float, ...]) -> Flight:
    position, velocity, quaternion, rates = np.split(np.array(log), [3, 6, 10], axis=1)
    reference = Samples(t, spatial(path(t)), spatial(path(t, 1)), yaw=path.yaw(t))
    air, free = np.tile(wind, (len(t), 1)), np.zeros(len(t), dtype=bool)
    return Flight(t.copy(), position, velocity, quaternion, rates, states.rotor_speed[::2].copy(), air, free, reference)
