"""Random courses within limits by the planner of C and C++ and by ``plan``: the same bits, where C does not hand over.

``python benchmarks/compare_planners.py [--count 210] [--first 0]``. Two to eight legs from seeds, a third of them in
tubes, within a thrust, a tilt, a body rate and norms of derivatives in six combinations.
"""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np

import minsnap
from minsnap.planning.many_limits import PlainProblem, plan_together

RANGES = {
    "speed": (2.0, 8.0),
    "acceleration": (3.0, 8.0),
    "jerk": (15.0, 60.0),
    "max_thrust": (1.3, 2.5),
    "min_thrust": (0.3, 0.8),
    "tilt": (0.2, 0.8),
    "body_rate": (1.5, 6.0),
}
KINDS = (
    ("max_thrust", "speed"),
    ("max_thrust", "min_thrust", "tilt", "jerk"),
    ("max_thrust", "body_rate"),
    ("speed", "acceleration", "body_rate"),
    ("max_thrust", "min_thrust", "tilt", "body_rate", "jerk"),
    ("tilt", "speed"),
)


def compared(seed: int) -> str:
    """Return how both planners' flights of a random course compare."""
    rng = np.random.default_rng(seed)
    legs = int(rng.integers(2, 9))
    points = np.cumsum(np.vstack((np.zeros(3), rng.normal(size=(legs, 3)) * (4.0, 4.0, 1.0))), axis=0)
    limits = minsnap.Limits(**{name: round(float(rng.uniform(*RANGES[name])), 3) for name in KINDS[seed % len(KINDS)]})
    widths = None if rng.integers(3) else rng.uniform(0.3, 1.0, legs).round(3)
    own = minsnap.plan(points, limits=limits, corridor=widths)
    found = plan_together([PlainProblem.of(points, limits, widths)], 1, lambda done: None)[0]
    if found is None:
        return "left to plan"
    if np.array_equal(found.control_points, own.control_points) and np.array_equal(found.durations, own.durations):
        return "the same bits"
    print(f"seed {seed}: {found.duration:.9g} s from C, {own.duration:.9g} s from plan")
    return "others"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=210)
    parser.add_argument("--first", type=int, default=0)
    chosen = parser.parse_args()
    ends = Counter(compared(seed) for seed in range(chosen.first, chosen.first + chosen.count))
    print(", ".join(f"{count} {end}" for end, count in ends.most_common()))
