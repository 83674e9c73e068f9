"""Random sequences of overlapping boxes."""

import numpy as np


def staircase(count, seed=0, dim=3):
    """Boxes that each begin in the last one, with the points where a path starts and ends."""
    draw = np.random.default_rng(seed)
    lower, upper, at = [], [], np.zeros(dim)
    for box in range(count):
        step = draw.uniform(0.2, 0.6, dim)
        step[box % 2] = draw.uniform(2.0, 4.0)
        step[: dim - 1] *= draw.choice([1.0, 1.0, -1.0])
        lower.append(np.minimum(at, at + step) - 0.4)
        upper.append(np.maximum(at, at + step) + 0.4)
        at = at + step
    return np.array(lower), np.array(upper), np.zeros(dim), at
