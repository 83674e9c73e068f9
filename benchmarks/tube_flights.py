"""Simulated flights in gusts against the tube of their control loop: how many leave it, and how much of it they fill.

``python -m benchmarks.tube_flights [FLIGHTS]`` flies three courses with PX4's cascade at its default gains, a third of
the flights in the worst gust of the loop, the others in gusts that switch at random. The simulation has attitude and
rate loops, motors and rotors, none of which the tube knows.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace

import numpy as np

import minsnap
from minsnap.flight import CascadeController, simulate
from minsnap.vehicle import BodyDrag, Quadrotor

RECTANGLE = [(0, 0, 2), (8, 0, 2), (8, 4, 2), (0, 4, 2), (0, 0, 2)]
COURSES = {
    "rectangle, 3 m/s": {"waypoints": RECTANGLE, "limits": minsnap.Limits(speed=3.0, acceleration=4.0, jerk=20.0)},
    "hover": {"waypoints": [(0, 0, 2), (0.01, 0, 2)], "total_time": 12.0},
    "climbing, 2 m/s": {"waypoints": [(0, 0, 2), (4, 3, 4), (8, 0, 3)], "total_time": 10.0},
}


@dataclass(frozen=True)
class Gusts:
    """A wind that changes by ``strength`` at most along a direction, from no wind."""

    loop: minsnap.Loop
    strength: float
    seed: int

    def sample(self, count: int, step: float) -> np.ndarray:
        """Return the wind at every step, shape (count, 3) [m/s]."""
        draw = np.random.default_rng(self.seed)
        t, angle = step * np.arange(count), draw.uniform(0.0, 2.0 * np.pi)
        if self.seed % 3 == 0:
            known, worst = self.loop.worst_gust(t[-1] * draw.uniform(0.3, 1.0), 1.0 / step)
            along = np.interp(t, known, worst, right=0.0)
        else:
            along = np.sign(np.sin(draw.uniform(0.2, 4.0) * t + draw.uniform(0.0, 6.0)))
        return self.strength * along[:, None] * np.array([np.cos(angle), np.sin(angle), 0.0])


DRAGS, WINDS = (0.2, 0.4, 0.6), (0.5, 1.5, 3.0)


def main(flights: int) -> None:
    """Fly, and print a line for each course."""
    base = Quadrotor.px4_sih()
    for name, course in COURSES.items():
        path, shares = minsnap.plan(**course), []
        tubes = {}
        for drag in DRAGS:
            loop = minsnap.Loop.px4(drag=drag, latency=0.0, descent_speed=5.0, climb_speed=5.0)
            for wind in WINDS:
                tubes[drag, wind] = loop, minsnap.certify(path, tracking=loop, wind=wind).tube
        for seed in range(flights // len(COURSES)):
            (drag, wind), (loop, tube) = list(tubes.items())[seed // 3 % len(tubes)]
            craft = replace(base, drag=BodyDrag(np.full(3, drag) * base.mass))
            flight = simulate(craft, CascadeController(), path, wind=Gusts(loop, wind, seed))
            shares.append(float(np.linalg.norm(flight.error, axis=1).max()) / tube)
        left = sum(share > 1.0 for share in shares)
        print(
            f"{name}: {len(shares)} flights, {left} left their tube, the most filled {max(shares):.3f} of it",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
