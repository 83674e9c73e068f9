"""How near flights are to the least time of any curve: gaps, and the processor time of the bound over that of the plan.

Every bound is verified in exact rationals.
Run it by hand: ``python benchmarks/bench_bound.py [--random 180] [course ...]``.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from typing import Any

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from bench_rotors import vehicle
from courses import names, read_course
from measure import least_times, machine, table

import minsnap
from minsnap import Limits

KINDS = (
    *("speed, acceleration", "along axes", "thrust", "thrust, tilt", "speed, thrust, tilt"),
    *("speed, acceleration, jerk", "thrust, body rate", "rotors", "rotors, yaw free"),
)


def question(number: int) -> dict[str, Any]:
    """Return a random course of two to nine legs, from rest to rest, within limits that a bound knows in part."""
    draw = np.random.default_rng(number)
    points = np.cumsum(draw.normal(size=(int(draw.integers(3, 11)), 3)) * (3, 3, 1), axis=0)
    speed, acceleration, thrust, tilt = draw.uniform((2, 3, 1.5, 0.4), (8, 12, 3.5, 1.1))
    limits = {
        "speed, acceleration": Limits(speed=speed, acceleration=acceleration),
        "along axes": Limits(speed=speed, acceleration=acceleration, norm="axis"),
        "thrust": Limits(max_thrust=thrust),
        "thrust, tilt": Limits(max_thrust=thrust, tilt=tilt),
        "speed, thrust, tilt": Limits(speed=speed, max_thrust=thrust, tilt=tilt),
        "speed, acceleration, jerk": Limits(speed=speed, acceleration=acceleration, jerk=5.0 * acceleration),
        "thrust, body rate": Limits(max_thrust=thrust, body_rate=6.0),
        "rotors": Limits.of(vehicle()),
        "rotors, yaw free": Limits.of(vehicle()),
    }
    kind = KINDS[number % len(KINDS)]
    return {"waypoints": points, "limits": limits[kind], **({"yaw": "tilt"} if kind == "rotors, yaw free" else {})}


def bounded(arguments: dict[str, Any], pieces: int | str, seconds: float) -> tuple[float, Any, float, float]:
    """Return the flight's duration, its bound, and the least processor times of both [s]."""
    kept = ("waypoints", "limits", "corridor", "waypoint_tolerance", "start", "end", "closed")
    asked = {name: arguments[name] for name in kept if name in arguments}
    calls = [lambda: minsnap.plan(**arguments, pieces=pieces), lambda: minsnap.least_time(**asked)]
    (planning, bounding), (path, bound) = least_times(calls, seconds, rounds=1)
    if not (bound.verify() and bound.seconds <= path.duration * (1.0 + 1e-9)):
        raise SystemExit(f"a bound is not proved, or a flight is quicker: {bound.seconds} s, {path.duration} s")
    return path.duration, bound, planning, bounding


def of_courses(chosen: list[str]) -> Iterator[tuple[str, ...]]:
    for name in chosen or names():
        course = read_course(name)
        duration, bound, planning, bounding = bounded(dict(course.arguments), "auto", 0.5)
        best = min([duration, *([course.best.seconds] if course.best else [])])
        gaps = (f"{100.0 * (time / bound.seconds - 1.0):.2f} %" for time in (duration, best))
        times = f"{1e3 * bounding:.1f}", f"{bounding / planning:.2f}"
        yield (
            course.name,
            f"{bound.seconds:.4f}",
            f"{duration:.4f}",
            *gaps,
            *times,
            ", ".join(bound.left_out) or "nothing",
        )


def at_random(count: int) -> Iterator[tuple[str, ...]]:
    found: dict[str, list[tuple[float, float]]] = {kind: [] for kind in KINDS}
    for number in range(count):
        duration, bound, planning, bounding = bounded(question(number), "auto", 0.0)
        found[KINDS[number % len(KINDS)]].append((100.0 * (duration / bound.seconds - 1.0), bounding / planning))
    for kind, rows in found.items():
        gaps, ratios = zip(*rows, strict=True)
        yield kind, f"{np.median(gaps):.2f} %", f"{max(gaps):.2f} %", f"{np.median(ratios):.2f}"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("courses", nargs="*", help="names of files in benchmarks/courses; all of them by default")
    parser.add_argument("--random", type=int, default=180)
    asked = parser.parse_args()
    print(*machine(), sep="\n")
    print()
    head = (
        "course",
        "at least [s]",
        "flown [s]",
        "gap",
        "gap of the best known",
        "bound [ms]",
        "over the plan",
        "left out",
    )
    table(head, list(of_courses(asked.courses)))
    if asked.random:
        table(("random courses within", "gap, median", "most", "time over the plan's"), list(at_random(asked.random)))


if __name__ == "__main__":
    main()
