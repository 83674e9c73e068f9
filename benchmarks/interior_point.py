"""The interior point for shortest times beside the sequential cone programmes, in the same run.

Run it by hand: ``python benchmarks/interior_point.py [--problems 90] [--pieces 1 3 auto]`` prints a table for four
courses, then a summary of random problems (``random_times.py``) that both searches know.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
from problems import RECTANGLE
from random_times import problem

import minsnap
from minsnap import Ball, Boxes, Limits
from minsnap.time_allocation import strategy

LOOP = [(-1.1, -1.6, 3.6), (9.2, 6.6, 1), (9.2, -4, 1.2), (-4.5, -6, 3.5), (-4.5, -6, 0.8), (4.75, -0.9, 1.2)]
LAPS = [*LOOP, (-2.8, 6.8, 1.2)] * 2
MAZE = Boxes(
    [(0.3, 0.3), (0.3, 5.7), (2.4, 0.3), (2.4, 0.3), (4.4, 0.3), (4.4, 5.7), (6.4, 0.3), (6.4, 0.3), (8.4, 0.3)],
    [(1.8, 7.7), (3.8, 7.7), (3.8, 7.7), (5.8, 2.3), (5.8, 7.7), (7.8, 7.7), (7.8, 7.7), (9.7, 2.3), (9.7, 7.7)],
)
ROOMS = Boxes(
    [(-0.5, -0.5, 0.5), (1.5, -0.5, 0.5), (3.5, -0.5, 0.5), (5.5, 0.5, 0.5)],
    [(2.5, 1.0, 1.5), (4.5, 1.0, 1.7), (6.5, 1.5, 1.7), (8.5, 1.5, 1.5)],
)
COURSES: dict[str, dict[str, Any]] = {
    "rectangle": {"waypoints": RECTANGLE, "corridor": 0.3, "limits": Limits(speed=3, acceleration=6)},
    "maze": {
        "waypoints": None,
        "start": {"position": (1.05, 0.55)},
        "end": {"position": (9.05, 7.05)},
        "corridor": MAZE,
        "limits": Limits(speed=2, acceleration=4),
    },
    "moving start": {
        "waypoints": None,
        "corridor": ROOMS,
        "limits": Limits(speed=3, acceleration=6),
        "start": {"position": (0, 0, 1), "velocity": (1.5, 0.2, 0.0), "acceleration": (0.5, 0.0, 0.0)},
        "end": {"position": (8, 1, 1)},
    },
    "Split-S, thrust": {
        "waypoints": [(-5, 4.5, 1.2), *LAPS, *LOOP],
        "waypoint_tolerance": Ball(0.3),
        "limits": Limits(max_thrust=3.3),
    },
}


def timed(asked: dict[str, Any], pieces: int | str, native: bool, repeats: int) -> tuple[float, float]:
    """Seconds of flight, and the least processor time in milliseconds."""
    serves = strategy.serves
    least = np.inf
    if not native:
        strategy.serves = lambda task, limits: False
    try:
        for _ in range(repeats):
            began = time.process_time()
            path = minsnap.plan(**asked, pieces=pieces)
            least = min(least, time.process_time() - began)
    finally:
        strategy.serves = serves
    if not minsnap.certify(path, limits=asked["limits"], corridor=asked.get("corridor")).ok:
        raise SystemExit(f"a plan of {path.duration} s is not certified")
    return path.duration, 1e3 * least


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--problems", type=int, default=90)
    parser.add_argument("--pieces", nargs="*", default=["1", "3", "auto"])
    asked = parser.parse_args()
    pieces = [int(word) if word.isdigit() else word for word in asked.pieces]
    print("| course | pieces | interior point: s / ms | cone programmes: s / ms |\n|---|---|---|---|")
    for name, course in COURSES.items():
        for number in pieces:
            ours, theirs = timed(course, number, True, 5), timed(course, number, False, 3)
            print(
                f"| {name} | {number} | {ours[0]:.3f} / {ours[1]:.1f} | {theirs[0]:.3f} / {theirs[1]:.0f} |", flush=True
            )
    for number in pieces:
        random = [problem(k) for k in range(asked.problems) if problem(k)["limits"].body_rate is None]
        found = np.array([(*timed(one, number, True, 2), *timed(one, number, False, 1)) for one in random])
        flights, work = found[:, 0] / found[:, 2], found[:, 1] / found[:, 3]
        print(
            f"{number}: {len(found)} problems, flight times x {np.median(flights):.5f} ({flights.min():.4f} to "
            f"{flights.max():.4f}), processor time x {np.median(work):.3f}, {np.median(found[:, 1]):.1f} for "
            f"{np.median(found[:, 3]):.1f} ms",
            flush=True,
        )


if __name__ == "__main__":
    main()
