"""Tasks made by hand, for what works on them rather than on arguments of ``plan``."""

import numpy as np

from minsnap.limits.vehicle_use import medium_of
from minsnap.optimisation.task import Task
from minsnap.trajectory.tilt_heading import TiltHeading

REFERENCE = np.array([(0.0, 0.0, 1.0), (8.0, 0.0, 1.0), (8.0, 4.0, 1.0), (0.0, 4.0, 1.0), (0.0, 0.0, 1.0)])
"""The rectangle of 8 m by 4 m."""


def task_of(points, corridor=None, limits=None, half=4, pieces=1, closed=False, pins=None, continuity=None):
    """Task from rest to rest, or of a closed lap, through points (n, dim)."""
    points = np.asarray(points, dtype=float)
    zero = np.zeros(points.shape)
    rest = {order: np.zeros(points.shape[1]) for order in range(1, half)}
    ends = {} if closed else {0: rest, len(points) - 1: rest}
    walls = [] if corridor is None else list(corridor.walls(points))
    walls += [] if limits is None else list(limits.walls(points))
    inner = half - 1 if continuity is None else continuity
    return Task(points, -zero, zero, ends | (pins or {}), half, inner, closed, pieces, walls, "auto")


def random_legs(seed, legs=None, dim=3):
    """Points of a random walk, and durations not far from its lengths."""
    random = np.random.default_rng(seed)
    legs = int(random.integers(2, 6)) if legs is None else legs
    steps = random.normal(size=(legs, dim))
    points = np.concatenate((np.zeros((1, dim)), np.cumsum(steps, axis=0)))
    return points, np.linalg.norm(steps, axis=1) * random.uniform(0.6, 1.6, legs)


def spinless(path, vehicle):
    """Give a path the heading of a vehicle that never spins about its thrust axis, drag included."""
    medium = medium_of(vehicle)
    return path.with_yaw(TiltHeading(path, medium=medium))


def many_legs(count, seed=0):
    """Points of a random walk, durations like its lengths, and half-widths."""
    random = np.random.default_rng(seed)
    steps = random.normal(size=(count, 3))
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    return points, np.linalg.norm(steps, axis=1), random.uniform(0.05, 0.3, count)
