"""Replanning in flight: how long a replan takes, cold and warm, a course of 20 gates replanned at 100 Hz, and budgets.

``python benchmarks/bench_replan.py [REPLANS [SECONDS [ANSWERS]]]`` prints all parts; the course is flown again and
again until so many replans were made, or so many seconds have passed. Its clock is simulated: every replan has 10 ms of
flight, and its own time, of the wall and of the processor, is measured beside. For budgets the clock is the processor
time of the thread, then that of the wall; each has so many answers.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field

import numpy as np
from measure import least_times, machine

import minsnap
from minsnap.replanning.splice import splice_of

POINTS = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2), (6, 1, 1), (8, 1, 1)], dtype=float)
LOWER, UPPER = np.minimum(POINTS[:-1], POINTS[1:]) - 0.5, np.maximum(POINTS[:-1], POINTS[1:]) + 0.5
BOXES = minsnap.Boxes(LOWER, UPPER)
LIMITS = minsnap.Limits(speed=3.0, acceleration=6.0)
START = {"velocity": (1.5, 0.2, 0.0), "acceleration": (0.5, 0.0, 0.0)}
BEST = 3.227
"""Best known time of P1 with one polynomial per leg, from box to box [s] (IPOPT)."""

GATES, WIDE, NOISE, PERIOD = 20, 1.0, 0.1, 0.01


def cold() -> minsnap.Trajectory:
    """P1, from box to box."""
    start, end = {"position": POINTS[0], **START}, {"position": POINTS[-1]}
    return minsnap.plan(None, limits=LIMITS, corridor=BOXES, start=start, end=end)


def still() -> float:
    """Read a clock that stands still."""
    return 0.0


def single_replans() -> None:
    """Print the table of P1."""
    flown = cold()
    print(f"P1: flight time {flown.duration:.4f} s, {100 * (flown.duration / BEST - 1):+.2f} % of the best known")
    rows = [("cold, from box to box", cold)]
    draw = np.random.default_rng(1)

    def warm(noise=0.01):
        shift = draw.uniform(-noise, noise, LOWER.shape)
        boxes = minsnap.Boxes(LOWER + shift, UPPER + shift)
        replanner = minsnap.Replanner(LIMITS, clock=still)
        return replanner.replan(flown, 0.0, None, 0.05, boxes=boxes, goal=POINTS[-1], began=10.0)

    rows.append(("warm, boxes shifted by 1 cm", warm))
    rows.append(("warm, limits raised by 1 %", lambda: _faster(flown)))
    times = np.diff(flown.leg_breaks)
    options = {"corridor": BOXES, "start": START}
    rows.append(("durations given", lambda: minsnap.plan(POINTS, durations=1.1 * times, **options)))
    rows.append(("total time split", lambda: minsnap.plan(POINTS, total_time=1.1 * flown.duration, **options)))
    print("| P1 | processor [ms] |\n|---|---|")
    for name, call in rows:
        print(f"| {name} | {1e3 * least_times([call], 0.0, 7)[0][0]:.2f} |")


def _faster(flown):
    limits, ample = minsnap.Limits(speed=3.03, acceleration=6.06), 10.0
    replanner = minsnap.Replanner(limits, clock=still)
    return replanner.replan(flown, 0.0, None, 0.05, boxes=BOXES, goal=POINTS[-1], began=ample)


@dataclass
class Tally:
    """What a course showed."""

    walls: list[float] = field(default_factory=list)
    own: list[float] = field(default_factory=list)
    jumps: np.ndarray = field(default_factory=lambda: np.zeros(4))
    new: int = 0
    uncertified: int = 0
    without_stop: int = 0
    searched: int = 0
    outside: int = 0

    def add(self, change, before, boxes, wall, own) -> None:
        """Count a change, and judge it against the plan before it."""
        self.walls.append(wall)
        self.own.append(own)
        self.new += not change.kept
        self.uncertified += not change.certified
        self.without_stop += change.stop is None
        self.searched += not change.reason.endswith("has changed")
        for order in range(4):
            value = before(min(change.splice, before.duration), order)
            gap = np.abs(change.trajectory(0.0, order) - value).max() / before.max_norm(order)[0]
            self.jumps[order] = max(self.jumps[order], float(gap))


def gates(seed: int) -> np.ndarray:
    """Start and 20 gates some 3 m apart."""
    draw = np.random.default_rng(seed)
    steps = np.stack((draw.uniform(2.0, 4.0, GATES), draw.uniform(-1.5, 1.5, GATES), draw.uniform(-0.4, 0.4, GATES)), 1)
    return np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0))) + [0.0, 0.0, 5.0]


def fly(seed: int, most: int, until: float, tally: Tally) -> None:
    """Fly one course, replanning every 10 ms with all boxes shifted anew."""
    points, draw = gates(seed), np.random.default_rng(seed)
    lower, upper = np.minimum(points[:-1], points[1:]) - WIDE, np.maximum(points[:-1], points[1:]) + WIDE
    inner = minsnap.Boxes(lower + 2 * NOISE, upper - 2 * NOISE)
    flown = minsnap.plan(points, limits=LIMITS, corridor=inner)
    replanner = minsnap.Replanner(LIMITS, clearance=2 * NOISE, horizon=4, clock=time.thread_time)
    done = 0
    while flown.duration > 5 * PERIOD and len(tally.walls) < most and time.perf_counter() < until:
        done += splice_of(flown, 0.0, PERIOD, 4).passed
        shift = draw.uniform(-NOISE, NOISE, (len(lower) - done, 3))
        boxes = minsnap.Boxes(lower[done:] + shift, upper[done:] + shift)
        began, used = time.perf_counter(), time.thread_time()
        change = replanner.replan(flown, 0.0, points[done + 1 :], PERIOD, boxes=boxes)
        tally.add(change, flown, boxes, time.perf_counter() - began, time.thread_time() - used)
        flown = change.trajectory


def course(most: int, seconds: float) -> None:
    """Print what courses of gates show."""
    tally, until, seed = Tally(), time.perf_counter() + seconds, 0
    while len(tally.walls) < most and time.perf_counter() < until:
        fly(seed, most, until, tally)
        seed += 1
    print(f"\n{GATES} gates, boxes shifted by up to {NOISE} m before each replan: {len(tally.walls)} replans")
    print(f"searched {tally.searched}, new plans {tally.new}, not certified {tally.uncertified}, ", end="")
    print(f"without a stop {tally.without_stop}, largest jumps of position to jerk, ", end="")
    print("relative to their largest value over the plan:", *(f"{jump:.0e}" for jump in tally.jumps))
    for name, values in (("wall", tally.walls), ("processor", tally.own)):
        median, high, highest = 1e3 * np.percentile(values, [50, 99, 100])
        print(f"{name}: median {median:.2f} ms, p99 {high:.2f} ms, longest {highest:.2f} ms")


@dataclass
class Answers:
    """What answers within one budget showed."""

    late: list[float] = field(default_factory=list)
    asked: int = 0
    refused: int = 0
    new: int = 0


def budgeted(seed: int, budget: float, most: int, clock, found: Answers) -> None:
    """Fly one course with waypoints moved, boxes shifted or made narrower before each replan, 20 a second of flight.

    A box that was made narrower may leave the vehicle outside: then a way back into it is part of the answer.
    """
    points, draw = gates(seed), np.random.default_rng(seed)
    lower, upper = np.minimum(points[:-1], points[1:]) - WIDE, np.maximum(points[:-1], points[1:]) + WIDE
    flown = minsnap.plan(points, limits=LIMITS, corridor=minsnap.Boxes(lower + 2 * NOISE, upper - 2 * NOISE))
    replanner = minsnap.Replanner(LIMITS, clearance=2 * NOISE, recover=WIDE, horizon=4, clock=clock)
    done, now = 0, 0.05
    while flown.duration > 3 * now + budget and found.asked < most:
        splice = splice_of(flown, now, budget, 4)
        done += splice.passed
        kind, shape = draw.integers(3), (len(lower) - done, 3)
        ahead = points[done + 1 :] + (kind == 0) * draw.uniform(-0.15, 0.15, shape)
        shift, inwards = (kind == 1) * draw.uniform(-0.05, 0.05, shape), 0.3 * (kind == 2)
        boxes = minsnap.Boxes(lower[done:] + shift + inwards, upper[done:] + shift - inwards)
        found.asked += 1
        try:
            began = clock()
            change = replanner.replan(flown, now, ahead, budget, boxes=boxes)
            found.late.append(clock() - began - budget)
            found.new += not change.kept
            flown = change.trajectory
        except minsnap.errors.TimingError:
            found.late.append(clock() - began - budget)
            found.refused += 1
            flown = splice.rest


def budgets(most: int) -> None:
    """Print how many answers were late, by budget and clock."""
    print("\n| clock | budget | answers | late | by at most | refused as too short | new plans |")
    print("|---|---|---|---|---|---|---|")
    for name, clock in (("processor", time.thread_time), ("wall", time.monotonic)):
        for budget in (0.002, 0.005, 0.01, 0.02):
            found, seed = Answers(), 0
            while found.asked < most:
                budgeted(seed, budget, most, clock, found)
                seed += 1
            late = 1e3 * np.array(found.late)
            print(f"| {name} | {1e3 * budget:g} ms | {found.asked} | {(late > 0.0).sum()} | ", end="")
            print(f"{max(late.max(), 0.0):.2f} ms | {found.refused} | {found.new} |", flush=True)


def main() -> None:
    """Print all parts."""
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 3600.0
    for line in machine():
        print(line)
    single_replans()
    course(most, seconds)
    budgets(int(sys.argv[3]) if len(sys.argv) > 3 else 2_000)


if __name__ == "__main__":
    main()
