"""Flights around published obstacles: the time of the flight, and of the processor for way, corridor and plan."""

from functools import partial
from pathlib import Path

import numpy as np
from measure import least_times

import minsnap
from minsnap.corridors.tangent_polytopes import numbers_of, polytopes_along
from minsnap.corridors.way_around import Kept, way_around

MAPS = Path(__file__).parent / "maps"
NORMS = minsnap.Limits(speed=4.0, acceleration=10.0, jerk=30.0)
AXES = minsnap.Limits(speed=5.0, acceleration=20.0, jerk=100.0, norm="axis")
FORESTS = {
    "mighty_easy": (305.0, NORMS),
    "mighty_hard": (305.0, NORMS),
    "sando_easy": (105.0, AXES),
    "sando_hard": (105.0, AXES),
}
CLEARANCE = 0.2

SMALL = minsnap.Limits(speed=1.0, acceleration=2.0, jerk=3.0, norm="axis")
POSTS = [minsnap.Cylinder(center, 0.6) for center in ((-1.0, 2.0), (-1.0, -2.0), (1.0, 0.0))]
"""Three posts of 0.5 m and the vehicle's 0.1 m: SANDO's standard cases, from (-3, 0, 1) to (3.5, y, 1)."""


def trunks(name):
    rows = np.genfromtxt(MAPS / f"{name}.csv", delimiter=",", comments="#")
    rows = rows[np.isfinite(rows).all(axis=1)]
    return [minsnap.Cylinder(row[:2], row[3]) for row in rows]


if __name__ == "__main__":
    for name, (far, limits) in FORESTS.items():
        obstacles, start, goal = trunks(name), np.zeros(2), np.array((far, 0.0))
        kept = Kept(numbers_of(obstacles), np.zeros((0, 2)), CLEARANCE)
        (looked,), (way,) = least_times([partial(way_around, kept, start, goal)], 0.0)
        laid, _ = least_times([partial(polytopes_along, way, *kept)], 0.0)
        whole = partial(minsnap.routes.plan_through, obstacles, start, goal, CLEARANCE, limits=limits, pieces="auto")
        (seconds,), (route,) = least_times([whole], 0.0)
        flown = f"{len(obstacles)} trunks, flight {route.duration:.3f} s, {route.distance:.3f} m clear"
        spent = f"{1e3 * looked:.0f} ms for the way, {1e3 * laid[0]:.1f} for polytopes, {1e3 * seconds:.0f} in all"
        print(f"{name}: {flown}; processor {spent}")
    times, took = [], []
    for y in np.linspace(-3.0, 3.0, 61):
        question = partial(minsnap.plan, [(-3, 0, 1), (3.5, y, 1)], limits=SMALL, avoid=POSTS, pieces="auto")
        (seconds,), (curve,) = least_times([question], 0.0, rounds=1)
        times.append(curve.duration)
        took.append(1e3 * seconds)
    spent = f"{np.median(took):.1f} ms in the median, {max(took):.1f} at most"
    print(f"SANDO's 61 cases: mean flight {np.mean(times):.3f} s; processor {spent}")
