"""How even the search for shortest times is within rotors: own courses, each in forms that have one optimum.

A course as it is, reversed and mirrored takes the same least time at yaw 0, where the vehicle has no drag and turns as
easily to all sides. So what the three differ by is luck, and what a plan takes longer than the best of all forms and
numbers of pieces is a loss. Processor time stands beside that within thrust, tilt and body rate on the same course.
Run it by hand: ``python benchmarks/bench_rotors.py [COURSES [FIRST]] [--best FILE]``; the file keeps the shortest
flights that are known, which later runs are measured by and add to.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from dataclasses import replace
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from measure import machine, table

import minsnap
from minsnap import Limits
from minsnap.vehicle import BodyDrag, Quadrotor

PIECES = (1, 3, "auto")
FORMS = {"as it is": (1.0, 1), "reversed": (1.0, -1), "mirrored": (-1.0, 1)}
"""Factor on x, and step through the waypoints."""

SIMPLE = Limits(max_thrust=2.5, tilt=np.radians(60.0), body_rate=8.0)
CORRIDORS = (None, 0.3, 1.0)
COURSES = 12


def vehicle() -> Quadrotor:
    """Return dji_f330 without drag, and as easy to turn to all sides."""
    return replace(Quadrotor.dji_f330(), drag=BodyDrag(), inertia=np.array((0.0054, 0.0054, 0.0096)))


def course(seed: int) -> tuple[np.ndarray, float | None]:
    """Waypoints (n, 3) of one to seven legs of some metres, and the half-width of a tube or None [m]."""
    draw = np.random.default_rng([58, seed])
    steps = draw.normal(size=(int(draw.integers(1, 8)), 3)) * (4.0, 4.0, 1.5)
    return np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0))), CORRIDORS[seed % 3]


def form(points: np.ndarray, name: str) -> np.ndarray:
    factor, step = FORMS[name]
    return (points * (factor, 1.0, 1.0))[::step].copy()


def planned(points: np.ndarray, limits: Limits, corridor: float | None, pieces: int | str) -> tuple[float, float]:
    """Flight time, infinite where there is no plan, and processor time, both in seconds."""
    began = time.process_time()
    try:
        duration = minsnap.plan(points, limits=limits, corridor=corridor, pieces=pieces).duration
    except minsnap.MinsnapError as error:
        print(f"    refused: {error}", flush=True)
        duration = np.inf
    return duration, time.process_time() - began


def measured(seed: int, limits: Limits) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Flight times and processor times by pieces and form, and processor times by pieces within simpler limits."""
    points, corridor = course(seed)
    found = np.array([[planned(form(points, name), limits, corridor, each) for name in FORMS] for each in PIECES])
    simple = [min(planned(points, SIMPLE, corridor, each)[1] for _ in range(2)) for each in PIECES]
    return found[:, :, 0], found[:, :, 1], np.array(simple)


def percent(values: np.ndarray) -> str:
    """Median, nine tenths, most."""
    return " / ".join(f"{100.0 * value:.2f}" for value in np.quantile(values, (0.5, 0.9, 1.0)))


def main() -> None:
    """Print one row a course, then the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("courses", nargs="?", type=int, default=COURSES)
    parser.add_argument("first", nargs="?", type=int, default=0)
    parser.add_argument("--best", type=Path)
    asked = parser.parse_args()
    kept = json.loads(asked.best.read_text()) if asked.best and asked.best.exists() else {}
    limits, rows = Limits.of(vehicle()), []
    planned(course(0)[0], limits, None, 1)  # the first plan loads what all need
    for seed in range(asked.first, asked.first + asked.courses):
        flights, spent, simple = measured(seed, limits)
        best = kept[str(seed)] = min(float(flights.min()), kept.get(str(seed), np.inf))
        rows.append((flights / best - 1.0, flights.max(axis=1) / flights.min(axis=1) - 1.0, spent, simple))
        told = ", ".join(f"{name}: {np.round(each, 4)}" for name, each in zip(PIECES, flights, strict=True))
        print(f"{seed}: best {best:.4f} s; {told}; ms {np.round(1e3 * spent.mean(axis=1), 1)}", flush=True)
    if asked.best:
        asked.best.write_text(json.dumps(kept))
    print("\n", *machine(), sep="\n", end="\n\n")
    losses, spreads, spent, simple = (np.array(part) for part in zip(*rows, strict=True))
    table(
        (
            "pieces",
            "loss % (median / 90 % / most)",
            "spread %",
            "more than fewer, most %",
            "ms median",
            "simpler limits x",
        ),
        (
            (
                PIECES[k],
                percent(losses[:, k]),
                percent(spreads[:, k]),
                f"{100.0 * ((1 + losses[:, k]) / (1 + losses[:, 0]) - 1.0).max():.2f}" if k else "",
                f"{1e3 * np.median(spent[:, k]):.0f}",
                f"{np.median(np.median(spent[:, k], axis=1) / simple[:, k]):.1f}",
            )
            for k in range(len(PIECES))
        ),
    )


if __name__ == "__main__":
    main()
