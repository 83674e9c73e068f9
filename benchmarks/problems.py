"""The questions that benchmarks ask: the rectangle, random walks, random corridors."""

from __future__ import annotations

import numpy as np

RECTANGLE = np.array([(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)], dtype=float)
DURATIONS = np.array([4.0, 2.0, 4.0, 2.0])


def walk(legs, seed=0):
    """Random 3-D legs at about 1 m/s, with half-widths of 0.1 to 0.5 m: waypoints, durations, widths."""
    random = np.random.default_rng(seed)
    steps = random.normal(size=(legs, 3))
    steps *= (random.uniform(1.0, 4.0, legs) / np.linalg.norm(steps, axis=1))[:, None]
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    return points, np.linalg.norm(steps, axis=1) * random.uniform(0.7, 1.4, legs), random.uniform(0.1, 0.5, legs)


def corridor(random):
    """A random corridor: 2 to 12 legs of 0.1 to 50 m in any direction, widths of 1 mm to 3 m per leg."""
    legs, dim = int(random.integers(2, 13)), int(random.integers(2, 4))
    lengths = 10.0 ** random.uniform(-1.0, np.log10(50.0), legs)
    directions = random.normal(size=(legs, dim))
    kind = random.integers(3)
    if kind == 0:
        directions = np.eye(dim)[random.integers(dim, size=legs)] * random.choice((-1.0, 1.0), size=(legs, 1))
    elif kind == 1:
        directions[:, 0] *= 1e3
    steps = lengths[:, None] * directions / np.linalg.norm(directions, axis=1)[:, None]
    points = np.concatenate((np.zeros((1, dim)), np.cumsum(steps, axis=0))) + 10.0 * random.normal(size=dim)
    durations = lengths * 10.0 ** random.uniform(-0.5, 0.5, legs)
    return points, durations, 10.0 ** random.uniform(-3.0, np.log10(3.0), legs)
