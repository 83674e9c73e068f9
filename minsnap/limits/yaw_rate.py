"""The largest yaw rate of a trajectory over all time: exact for the headings that plans have, however they were cut."""

from __future__ import annotations

import numpy as np

from minsnap.trajectory.trajectory import Trajectory

SAMPLES = 200
"""Samples per leg of a yaw rate that is no polynomial and no quotient of polynomials."""


def largest_yaw_rate(traj: Trajectory) -> tuple[float, float, str]:
    """Largest yaw rate [rad/s], its instant [s], and its method, ``"exact"`` or ``"sampled"``."""
    largest = traj.yaw.largest_rate(0.0, traj.duration)
    return _sampled(traj) if largest is None else (*largest, "exact")


def _sampled(traj: Trajectory) -> tuple[float, float, str]:
    grid = traj.breaks[:-1, None] + traj.durations[:, None] * np.linspace(0.0, 1.0, SAMPLES)
    instants = np.minimum(grid.reshape(-1), traj.duration)
    rates = np.abs(traj.yaw(instants, 1))
    return float(rates.max()), float(instants[rates.argmax()]), "sampled"
