"""Arbitrary trajectories for the formats."""

import numpy as np

from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.trajectory import Trajectory


def curve(pieces=4, degree=7, dim=3, seed=1, turning=True):
    """Random pieces, joined in position; a planned heading that turns more than once round."""
    rng = np.random.default_rng(seed)
    durations = rng.uniform(0.5, 3.0, pieces)
    points = rng.normal(size=(pieces, degree + 1, dim))
    points[1:, 0] = points[:-1, -1]
    if not turning:
        return Trajectory(points, durations)
    angles = np.cumsum(rng.uniform(0, 0.5, pieces * (degree + 1))).reshape(pieces, degree + 1, 1)
    angles[1:, 0] = angles[:-1, -1]
    return Trajectory(points, durations, PlannedHeading(Trajectory(angles, durations)))
