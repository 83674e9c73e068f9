"""Processor time and flight time of the search for shortest times, one row a problem.

Times are the least of several calls, of the process's processor time, on one thread. Where another bound of the flight
time is known in the same run (Ruckig's optimum, package ruckig) the row has the ratio to it.
Run it by hand: ``python benchmarks/bench_shortest.py [--random 200] [word ...]``; words choose rows by their names.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterator
from typing import Any

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from courses import read_course
from measure import least_times, machine, table
from random_times import problem

import minsnap
from minsnap import Limits, Polytopes

CHAINS = (3, 5, 8, 12, 20, 30)
AGILE = Limits(speed=4.0, tilt=np.radians(60.0), body_rate=2.1, min_thrust=0.33, max_thrust=2.0)
QUICK = Limits(speed=3.0, acceleration=6.0)
AXIS_PROBLEMS, BATCH, RANDOM_CHAINS = 200, 100, 60


def least(call: Callable[[], Any], seconds: float = 1.0) -> tuple[float, Any]:
    """Least processor time of a call [s], and what it returned."""
    (spent,), (found,) = least_times([call], seconds, rounds=1)
    return spent, found


def chain(count: int, seed: int) -> dict[str, Any]:
    """Arguments of ``plan`` through overlapping polytopes: turned boxes of 2 m around legs of 2 to 4 m."""
    draw = np.random.default_rng(seed)
    steps = draw.normal(size=(count, 3)) * (1.0, 1.0, 0.3)
    steps *= draw.uniform(2.0, 4.0, count)[:, None] / np.linalg.norm(steps, axis=1)[:, None]
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    spaces = []
    for start, end in zip(points[:-1], points[1:], strict=True):
        axes = np.linalg.qr(np.column_stack((end - start, draw.normal(size=(3, 2)))))[0].T
        rows = np.vstack((axes, -axes))
        spaces.append((rows, np.maximum(rows @ start, rows @ end) + 1.0))
    ends = {"start": {"position": points[0]}, "end": {"position": points[-1]}}
    return {"waypoints": None, "corridor": Polytopes(spaces), "limits": AGILE, **ends}


def planned(**asked: Any) -> Callable[[], minsnap.Trajectory]:
    return lambda: minsnap.plan(**asked)


def calls() -> Iterator[tuple[str, Callable[[], minsnap.Trajectory]]]:
    """Name and call of every single problem."""
    for pieces in (1, 3, "auto"):
        yield f"rectangle, {pieces}", planned(**read_course("rectangle").arguments, pieces=pieces)
    for count in CHAINS:
        yield f"chain of {count} polytopes, 1", planned(**chain(count, count))
    for name, pieces in (("split_s", 3), ("slalom", 1), ("maze", 3), ("gates", 1)):
        yield f"{name}, {pieces}", planned(**read_course(name).arguments, pieces=pieces)


def single(words: list[str]) -> Iterator[tuple[str, ...]]:
    for name, call in calls():
        if chosen(name, words):
            spent, path = least(call)
            yield name, f"{1e3 * spent:.2f}", f"{path.duration:.4f}", ""


def reading(words: list[str]) -> Iterator[tuple[str, ...]]:
    """Rows of reading polytopes, and of finding the passages between them."""
    for count in (3, 30):
        rows = chain(count, count)["corridor"].half_spaces
        if chosen(name := f"reading {count} polytopes", words):
            yield name, f"{1e3 * least(lambda rows=rows: Polytopes(list(rows)).passages())[0]:.2f}", "", ""


def axis_problem(number: int) -> tuple[float, float, float, float, float]:
    """Distance, start velocity, largest speed, acceleration and jerk of a motion along one axis to rest."""
    draw = np.random.default_rng(number)
    speed, acceleration, jerk = draw.uniform(1.0, 5.0), draw.uniform(2.0, 10.0), draw.uniform(10.0, 60.0)
    begun = draw.uniform(-0.8, 0.8) * speed if number % 2 else 0.0
    return draw.uniform(0.5, 20.0), begun, speed, acceleration, jerk


def optimum(distance: float, begun: float, speed: float, acceleration: float, jerk: float) -> float:
    """Least time of such a motion with bounded jerk, by Ruckig (L. Berscheid and T. Kroeger, RSS 2021) [s]."""
    from ruckig import InputParameter, Ruckig, Trajectory

    asked, found = InputParameter(1), Trajectory(1)
    asked.current_position, asked.current_velocity, asked.current_acceleration = [0.0], [begun], [0.0]
    asked.target_position, asked.target_velocity, asked.target_acceleration = [distance], [0.0], [0.0]
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = [speed], [acceleration], [jerk]
    Ruckig(1).calculate(asked, found)
    return float(found.duration)


def along_one_axis() -> Iterator[tuple[str, ...]]:
    spent, ratios, refused = [], [], 0
    for number in range(AXIS_PROBLEMS):
        distance, begun, speed, acceleration, jerk = numbers = axis_problem(number)
        limits = Limits(speed=speed, acceleration=acceleration, jerk=jerk)
        start = {"velocity": (begun,)} if begun else None
        call = planned(waypoints=[(0.0,), (distance,)], limits=limits, start=start, pieces="auto")
        try:
            taken, path = least(call, 0.05)
        except minsnap.MinsnapError:
            refused += 1
            continue
        spent.append(taken)
        ratios.append(path.duration / optimum(*numbers))
    ratio = f"Ruckig: median {np.median(ratios):.4f}, worst {max(ratios):.4f}; {refused} refused"
    yield f"{AXIS_PROBLEMS} along one axis, auto, median", f"{1e3 * np.median(spent):.2f}", "", ratio


def at_random(count: int) -> Iterator[tuple[str, ...]]:
    spent = [least(planned(**problem(number), pieces="auto"), 0.0)[0] for number in range(count)]
    yield f"{count} random courses, auto, median", f"{1e3 * np.median(spent):.2f}", "", ""


def of_chains() -> Iterator[tuple[str, ...]]:
    asked = [chain(CHAINS[number % 5], 1000 + number) for number in range(RANDOM_CHAINS)]
    spent, paths = zip(*(least(planned(**one), 0.0) for one in asked), strict=True)
    flown = sum(path.duration for path in paths)
    yield f"{RANDOM_CHAINS} random chains, 1, median; all", f"{1e3 * np.median(spent):.2f}", f"{flown:.2f}", ""


def in_batches() -> Iterator[tuple[str, ...]]:
    points = np.cumsum(np.random.default_rng(0).normal(size=(BATCH, 6, 3)) * 2.0, axis=1)
    for name, limits in (("speed and acceleration", QUICK), ("tilt, rate, thrust", AGILE)):
        spent, _ = least(lambda limits=limits: minsnap.plan_many(points, limits=limits, threads=1), 0.0)
        yield f"plan_many, 5 legs, {name}, each", f"{1e3 * spent / BATCH:.2f}", "", ""


def chosen(name: str, words: list[str]) -> bool:
    return not words or any(word in name for word in words)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*")
    parser.add_argument("--random", type=int, default=200)
    asked = parser.parse_args()
    rows = [*single(asked.words), *reading(asked.words)]
    rows += at_random(asked.random) if chosen("random courses", asked.words) else ()
    rows += of_chains() if chosen("random chains", asked.words) else ()
    rows += along_one_axis() if chosen("axis", asked.words) else ()
    rows += in_batches() if chosen("plan_many", asked.words) else ()
    print(*machine(), sep="\n")
    table(("problem, pieces", "ms", "s flown", "ratio to"), rows)


if __name__ == "__main__":
    main()
