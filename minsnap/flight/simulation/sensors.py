"""State estimation in simulation: delayed and noisy motion-capture poses, fused with inertial sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.checks import check_positive, check_seed, is_number
from minsnap.basics.messages import shown
from minsnap.errors import InputError
from minsnap.flight.simulation.controller import Estimate, Vector

_BANDWIDTH = 5.0
"""Natural frequency with which the estimate follows the measured pose [rad/s]; ours, as slow as autopilots set it."""


@dataclass(frozen=True)
class Sensors:
    """Position from motion capture, everything else from inertial sensors without error.

    Velocity and position are predicted with the accelerometer and corrected with each pose, with the fixed gains of a
    critically damped second-order observer, similar to the estimators of autopilots. The delay of a pose is not
    compensated, so in steady motion the position estimate lags by velocity times delay.

    Parameters
    ----------
    pose_rate : float
        Poses a second [Hz].
    delay : float
        Age of a pose when it arrives [s].
    noise : float
        Standard deviation of a measured position, each axis [m].
    seed : int
        Repeats the same noise.

    Raises
    ------
    InputError
        If the rate is not positive, or delay or noise are negative.
    """

    pose_rate: float = 50.0
    delay: float = 0.0
    noise: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        check_positive("the pose rate", self.pose_rate, "poses per second", InputError)
        check_seed(self.seed)
        for name in ("delay", "noise"):
            value = getattr(self, name)
            if not (is_number(value) and value >= 0):
                raise InputError(f"the pose's {name} is {shown(value)}: it must be 0 or more")


class StateEstimator:
    """The state estimator of one flight, updated with the true state at every step.

    Parameters
    ----------
    sensors : Sensors
    step : float
        [s].
    count : int
        Most steps there will be.
    """

    def __init__(self, sensors: Sensors, step: float, count: int) -> None:
        self._step = step
        self._every = max(1, round(1.0 / (sensors.pose_rate * step)))
        self._late = round(sensors.delay / step)
        draws = np.random.default_rng(sensors.seed).normal(size=(count // self._every + 1, 3))
        self._noise: list[list[float]] = (sensors.noise * draws).tolist()
        gap = self._every * step
        self._gain = (min(2.0 * _BANDWIDTH * gap, 1.0), min(_BANDWIDTH**2 * gap, 1.0 / gap))
        self._past: list[Vector] = []
        self._position: list[float] = []
        self._velocity: list[float] = []
        self._truth: list[float] = []

    def estimate(self, state: list[float]) -> Estimate:
        """Return the estimate one step after the previous call, from the true state of 13 numbers."""
        count = len(self._past)
        self._past.append((state[0], state[1], state[2]))
        if count == 0:
            self._position, self._velocity = state[0:3], state[3:6]
        else:
            self._carry(state)
        if count % self._every == 0:
            self._correct(self._past[max(count - self._late, 0)], self._noise[count // self._every])
        self._truth = state[3:6]
        position, velocity = self._position, self._velocity
        return Estimate(
            (position[0], position[1], position[2]),
            (velocity[0], velocity[1], velocity[2]),
            (state[6], state[7], state[8], state[9]),
            (state[10], state[11], state[12]),
        )

    def _carry(self, state: list[float]) -> None:
        """Predict velocity and position with the measured acceleration."""
        for axis in range(3):
            change = state[3 + axis] - self._truth[axis]
            self._position[axis] += self._step * (self._velocity[axis] + 0.5 * change)
            self._velocity[axis] += change

    def _correct(self, pose: Vector, noise: list[float]) -> None:
        for axis in range(3):
            surprise = pose[axis] + noise[axis] - self._position[axis]
            self._position[axis] += self._gain[0] * surprise
            self._velocity[axis] += self._gain[1] * surprise
