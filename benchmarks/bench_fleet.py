"""Plans and certificates of fleets: published missions, with flight times over their bounds, and processor time.

Run it by hand: ``python benchmarks/bench_fleet.py [words of names]``. It prints one row a mission: flight time, over
what was published, over the trapezoid of the slowest vehicle, and over that vehicle alone; least distance over what was
asked; processor time of one thread until the first certified fleet and in all. Then certificates of random fleets.
"""

from __future__ import annotations

import resource
import sys
import time

import numpy as np
from fleet_missions import missions

import minsnap
from minsnap.fleet.auction import auction

SIZES = ((1000, 10, 60.0), (1000, 100, 60.0), (10_000, 10, 300.0))
CROWDS = (1000, 5000, 20_000, 50_000)
"""Vehicles at one density, each on a way of about 24 m."""


def curved(vehicles, pieces, span, seed=0):
    """Return vehicles on curves across a cube, all with the same pieces of degree 7."""
    draw = np.random.default_rng(seed)
    s = np.linspace(0.0, 1.0, 7 * pieces + 1)[None, :, None]
    begin, end = draw.uniform(0.0, span, (2, vehicles, 1, 3))
    places = begin + (end - begin) * s * s * (3.0 - 2.0 * s)
    places += draw.normal(0.0, 0.2, places.shape) * np.sin(np.pi * s)
    durations = np.full(pieces, 10.0 / pieces)
    parts = 7 * np.arange(pieces)[:, None] + np.arange(8)
    return minsnap.Fleet([minsnap.Trajectory(each[parts], durations) for each in places])


def local(vehicles, pieces=10, spacing=6.0, way=15.0, seed=0):
    """Return vehicles at one density, however many they are, on curves of one length."""
    draw = np.random.default_rng(seed)
    s = np.linspace(0.0, 1.0, 7 * pieces + 1)[None, :, None]
    begin = draw.uniform(0.0, spacing * vehicles ** (1 / 3), (vehicles, 1, 3))
    places = begin + draw.normal(0.0, way, begin.shape) * s * s * (3.0 - 2.0 * s)
    places += draw.normal(0.0, 0.2, places.shape) * np.sin(np.pi * s)
    parts = 7 * np.arange(pieces)[:, None] + np.arange(8)
    return minsnap.Fleet([minsnap.Trajectory(each[parts], np.ones(pieces)) for each in places])


def assigned(vehicles):
    """Print how long the assignment of a grid to a ball above it takes, and how near the least it is proved to be."""
    side, cube = int(np.ceil(np.sqrt(vehicles))), np.stack(np.meshgrid(*[np.arange(-12.0, 13.0)] * 3), axis=-1)
    grid = 4.0 * np.stack([np.arange(vehicles) % side, np.arange(vehicles) // side, np.zeros(vehicles)], axis=1)
    ball = 3.2 * cube.reshape(-1, 3)[np.argsort((cube**2).sum(axis=-1).ravel(), kind="stable")[:vehicles]]
    began = time.process_time()
    found = auction(grid, ball + [2.0 * side, 2.0 * side, 60.0])
    gap = (found.cost - found.bound) / found.cost
    print(f"assignment of {vehicles}: {time.process_time() - began:.2f} s, at most {gap:.1e} above the least")


def certified(fleet, name):
    """Print how long the certificate of a fleet takes."""
    _ = fleet.arrays
    began = time.process_time()
    found = minsnap.certify_fleet(fleet, 0.3, threads=1)
    print(f"certificate of {name}: {1e3 * (time.process_time() - began):.0f} ms, {len(found.nearest)} pairs near")


def planned(mission):
    """Print the row of one mission."""
    began, first = time.process_time(), []
    told = lambda *_: first or first.append(time.process_time() - began)  # noqa: E731
    fleet = minsnap.plan_fleet(**mission.asked, threads=1, progress=told)
    seconds = time.process_time() - began
    others = {name: value for name, value in mission.asked.items() if name != "waypoints"}
    found, report = minsnap.certify_fleet(fleet, **others), fleet.report
    over = f"{fleet.duration / mission.published:.2f}" if mission.published else "-"
    share = found.nearest[0].share if found.nearest else float("inf")
    print(
        f"| {mission.name} | {fleet.duration:.2f} | {over} | {fleet.duration / report.bound:.3f} | "
        f"{fleet.duration / report.alone:.3f} | {share:.4f} | {'yes' if found.ok else 'NO'} | "
        f"{first[0] if first else seconds:.2f} | {seconds:.2f} |",
        flush=True,
    )


def main():
    """Print the table of missions that have all words given in their names, then that of certificates."""
    words = sys.argv[1:]
    print("| mission | s | / published | / bound | / alone | least / asked | certified | first, CPU s | CPU s |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name, mission in missions().items():
        if all(word in name for word in words):
            planned(mission)
    for vehicles, pieces, span in () if words else SIZES:
        certified(curved(vehicles, pieces, span), f"{vehicles} x {pieces}")
    for vehicles in () if words else CROWDS:
        certified(local(vehicles), f"{vehicles} x 10, at one density")
    for vehicles in () if words else (1000, 5000):
        assigned(vehicles)
    print(f"memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
