"""Flights around published obstacles: the time of the flight, and of the processor for way, corridor and plan.

With seeds as arguments: flights through mighty_hard that is not known, from starts of these seeds, seen 15 m far.
"""

import sys
import time
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


GOAL, RANGE, BUDGET = np.array((305.0, 0.0)), 15.0, 0.05
ANGLES = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
RAYS = np.stack((np.cos(ANGLES), np.sin(ANGLES)), axis=1)


def seen(place, axes, radii):
    """Return where rays meet a trunk, which hides what is behind it, and the ends of those that meet none."""
    near = np.linalg.norm(axes - place, axis=1) < RANGE + radii
    to, radii = axes[near] - place, radii[near]
    along = RAYS @ to.T
    inside = radii**2 - (to**2).sum(axis=1) + along**2
    entry = np.where((inside >= 0.0) & (along > 0.0), along - np.sqrt(np.maximum(inside, 0.0)), np.inf)
    far = entry.min(axis=1, initial=np.inf)
    return place + far[far <= RANGE, None] * RAYS[far <= RANGE], place + RANGE * RAYS[far > RANGE]


def explored(seed, obstacles):
    """Fly through a forest that is not known from a start of a seed: a line of what came of it."""
    axes, radii = (np.array(each) for each in zip(*((trunk.center, trunk.radius) for trunk in obstacles), strict=True))
    start = np.array((0.0, np.random.default_rng(seed).uniform(-5.0, 5.0)))
    how = {"limits": NORMS, "clearance": CLEARANCE, "sensing": RANGE, "clock": time.process_time}
    explorer = minsnap.routes.Explorer(GOAL, **how)
    explorer.observe(start, *seen(start, axes, radii))
    flown, now, total, took, kept, least, wrong = explorer.replan(None, 0.0).trajectory, 0.0, 0.0, [], 0, np.inf, 0
    while total < 300.0 and not (now >= flown.duration and np.linalg.norm(flown(flown.duration) - GOAL) < 1e-6):
        explorer.observe(flown(min(now, flown.duration)), *seen(flown(min(now, flown.duration)), axes, radii))
        until, change, began = now + BUDGET, None, time.process_time()
        if np.linalg.norm(flown(flown.duration) - GOAL) > 1e-6:
            try:
                change = explorer.replan(None if now >= flown.duration else flown, now, BUDGET)
                until = now if now >= flown.duration else change.splice
            except minsnap.MinsnapError:
                wrong += 1
            took.append(1e3 * (time.process_time() - began))
        path = flown(np.minimum(np.linspace(now, until, 5), flown.duration))
        least = min(least, float((np.linalg.norm(path[:, None] - axes, axis=2) - radii).min()))
        total, now = total + until - now, until
        if change is not None:
            kept += "over" in change.reason
            wrong += not change.certified
            flown, now = (change.stop if not change.certified and change.stop else change.trajectory), 0.0
    arrived = np.linalg.norm(flown(min(now, flown.duration)) - GOAL) < 1e-6
    ms = f"{np.median(took):.1f} ms in the median, 99 % {np.quantile(took, 0.99):.1f}, most {max(took):.1f}"
    end = f"{total:.2f} s" if arrived else "not arrived"
    return f"start {start[1]:.2f}: {end}, {least:.3f} m clear, {len(took)} replans, {kept} late, {wrong} refused; {ms}"


if __name__ == "__main__":
    for seed in map(int, sys.argv[1:]):
        print(explored(seed, trunks("mighty_hard")), flush=True)
    if sys.argv[1:]:
        sys.exit()
    for name, (far, limits) in FORESTS.items():
        obstacles, start, goal = trunks(name), np.zeros(2), np.array((far, 0.0))
        kept = Kept(numbers_of(obstacles), np.zeros((0, 2)), CLEARANCE)
        (looked,), (way,) = least_times([partial(way_around, kept, start, goal)], 0.0)
        laid, _ = least_times([partial(polytopes_along, way, kept.obstacles, kept.points, kept.clearance)], 0.0)
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
