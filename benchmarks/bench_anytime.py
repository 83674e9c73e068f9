"""Certified plans of a search that a time limit ends, beside the plan of the whole search in the same run.

``python benchmarks/bench_anytime.py`` prints a table: for each kind of limit, number of legs and time limit the flight
time relative to that of the whole search (median, most), how many rest at every waypoint, and how late plans are
(median, most). The routes are random walks in free space.
"""

from __future__ import annotations

import argparse
from time import perf_counter

import numpy as np

import minsnap
from minsnap import Limits
from minsnap.vehicle import Quadrotor

LIMITS = {
    "speed 4, acceleration 6, jerk 40": Limits(speed=4.0, acceleration=6.0, jerk=40.0),
    "thrust 1.8 g, tilt 0.7, body rate 4": Limits(speed=5.0, max_thrust=1.8, tilt=0.7, body_rate=4.0),
    "rotors of dji_f330, speed 6": Limits.of(Quadrotor.dji_f330(), speed=6.0),
}
TIMES = 0.01, 0.02, 0.05, 0.1, 0.2, 0.5


def route(seed, legs):
    """Return random waypoints (legs + 1, 3) [m]."""
    return np.cumsum(np.random.default_rng(seed).normal(size=(legs + 1, 3)) * (3.0, 3.0, 1.0), axis=0)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--routes", type=int, default=20)
    routes = range(parser.parse_args().routes)
    print("| limits | legs | time limit [ms] | flight: median | most | at rest | late [ms]: median | most |")
    print("|---|---|---|---|---|---|---|---|")
    for name, limits in LIMITS.items():
        for legs in (5, 25):
            whole = [minsnap.plan(route(seed, legs), limits=limits).duration for seed in routes]
            for allowed in TIMES:
                flights, late, rests = [], [], 0
                for seed in routes:
                    began = perf_counter()
                    path = minsnap.plan(route(seed, legs), limits=limits, search=minsnap.Search(time_limit=allowed))
                    late.append(1e3 * max(perf_counter() - began - allowed, 0.0))
                    flights.append(path.duration / whole[seed])
                    rests += int(np.abs(path(path.leg_breaks, 1)).max() < 1e-9)
                figures = np.median(flights), max(flights), rests, np.median(late), max(late)
                print(f"| {name} | {legs} | {1e3 * allowed:.0f} | {' | '.join(f'{one:.3g}' for one in figures)} |")


if __name__ == "__main__":
    main()
