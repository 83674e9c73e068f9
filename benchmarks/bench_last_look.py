"""What the last look costs: its share of the processor time of whole plans, both from the same calls.

``python benchmarks/bench_last_look.py [REPEATS]``
"""

from __future__ import annotations

import sys
from time import perf_counter

import numpy as np
from measure import machine

import minsnap
from minsnap import Boxes, Limits, RoundTube
from minsnap.durations import allocate, resting
from minsnap.vehicle import Quadrotor

DRAW = np.random.default_rng(1)
POINTS = np.cumsum(DRAW.normal(size=(11, 3)), axis=0)
TIMES = np.linalg.norm(np.diff(POINTS, axis=0), axis=1) + 0.3
BOXES = Boxes(np.minimum(POINTS[:-1], POINTS[1:]) - 0.2, np.maximum(POINTS[:-1], POINTS[1:]) + 0.2)
ROTORS = Limits.of(Quadrotor.crazyflie(), reserve=0.25, speed=2.0)
PLAIN = Limits(speed=3.0, acceleration=6.0)

QUESTIONS = {
    "durations, tube": {"durations": TIMES, "corridor": 0.3},
    "durations and a yaw": {"durations": TIMES, "yaw": 0.3},
    "durations, moving start": {"durations": TIMES, "start": {"velocity": (0.3, 0.1, 0.0)}},
    "durations, tube and a yaw": {"durations": TIMES, "corridor": 0.3, "yaw": 0.3},
    "durations, round tube": {"durations": TIMES, "corridor": RoundTube(0.3)},
    "durations, boxes": {"durations": TIMES, "corridor": BOXES},
    "durations, boxes, 3 pieces": {"durations": TIMES, "corridor": BOXES, "pieces": 3},
    "durations, limits": {"durations": 4.0 * TIMES, "limits": PLAIN},
    "a total, limits": {"total_time": float(4.0 * TIMES.sum()), "limits": PLAIN},
    "shortest time": {"limits": PLAIN},
    "shortest time, boxes": {"limits": PLAIN, "corridor": BOXES},
    "shortest time, rotors": {"limits": ROTORS},
    "shortest time, rotors, tilt": {"limits": ROTORS, "yaw": "tilt"},
}


class Looks:
    """Counts the time inside of looks, less what the counting takes."""

    def __init__(self) -> None:
        self.seconds, self.empty = 0.0, 0.0
        empty = self.timed(lambda *asked: None)
        for _ in range(10_000):
            empty(1, 2, 3, 4, 5)
        self.empty = self.seconds / 10_000
        for room, name in ((allocate, "fault"), (resting, "keeps")):
            setattr(room, name, self.timed(getattr(room, name)))

    def timed(self, look):
        """Return a look that counts its time."""

        def counted(*asked, **named):
            began = perf_counter()
            found = look(*asked, **named)
            self.seconds += perf_counter() - began - self.empty
            return found

        return counted


def main() -> None:
    """Print the table."""
    repeats, looks = int(sys.argv[1]) if len(sys.argv) > 1 else 15, Looks()
    print(machine(), end="\n\n")
    print("| question | plan µs | look µs | share |\n|---|---|---|---|")
    for name, asked in QUESTIONS.items():
        rows = []
        for _ in range(repeats if "rotors" not in name else 3):
            began, looks.seconds = perf_counter(), 0.0
            minsnap.plan(POINTS, **asked)
            rows.append((looks.seconds, perf_counter() - began))
        look, plan = 1e6 * np.median(np.array(rows), axis=0)
        print(f"| {name} | {plan:,.0f} | {look:,.0f} | {100 * look / plan:.2g} % |", flush=True)


if __name__ == "__main__":
    main()
