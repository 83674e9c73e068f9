"""Plans without walls: the banded solve against scipy's septic spline and a namesake; the import; a whole process.

Run it by hand: ``python benchmarks/bench_plan.py [--large]``; ``--large`` adds a million legs (some 5 GiB).
"""

from __future__ import annotations

import subprocess
import sys
import time
from functools import partial

import numpy as np
from measure import alternating, median_time, peak_memory, table, text
from problems import walk
from scipy.interpolate import make_interp_spline

import minsnap

SIZES = (10, 100, 1_000, 10_000, 100_000)
PEER_LIMIT = 300
"""Legs up to which the namesake is asked: its time grows with the cube of their number."""


def spline(points, durations):
    """The same curve by scipy, in B-splines, not yet in a form that can be flown."""
    times = np.concatenate(([0.0], np.cumsum(durations)))
    rest = [(order, np.zeros(points.shape[1])) for order in (1, 2, 3)]
    return make_interp_spline(times, points, k=7, bc_type=(rest, rest))


def namesake(points, durations):
    """The same curve by minsnap_trajectories, where it is installed; else None."""
    try:
        import minsnap_trajectories as peer
    except ImportError:
        return None
    times = np.concatenate(([0.0], np.cumsum(durations)))
    zero = np.zeros(points.shape[1])
    references = [peer.Waypoint(time=float(t), position=p) for t, p in zip(times, points, strict=True)]
    for end in (0, -1):
        references[end] = peer.Waypoint(
            time=float(times[end]), position=points[end], velocity=zero, acceleration=zero, jerk=zero
        )
    return partial(
        peer.generate_trajectory,
        references,
        degree=7,
        idx_minimized_orders=4,
        num_continuous_orders=4,
        algorithm="closed-form",
    )


class TimePlan:
    """What asv calls: one plan through that many legs."""

    params = SIZES

    def setup(self, legs):
        self.points, self.durations, _ = walk(legs)

    def time_minsnap(self, legs):
        minsnap.plan(self.points, self.durations)

    def time_spline(self, legs):
        spline(self.points, self.durations)


def compare(legs):
    points, durations, _ = walk(legs)
    calls = [partial(minsnap.plan, points, durations), partial(spline, points, durations)]
    peer = namesake(points, durations) if legs <= PEER_LIMIT else None
    mine, theirs, *others = alternating(calls + ([peer] if peer else []))
    traj, other = minsnap.plan(points, durations), spline(points, durations)
    t = np.linspace(0.0, traj.duration, 1001)
    away = np.abs(traj(t) - other(t)).max()
    last = f"{others[0] / mine:.1f}" if others else "-"
    return legs, text(mine), text(theirs), f"{mine / theirs:.2f}", last, f"{away:.0e} m", f"{peak_memory():.2f} GiB"


def whole_process(arguments):
    began = time.perf_counter()
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
    return time.perf_counter() - began


def main():
    sizes = (*SIZES, 1_000_000) if "--large" in sys.argv else SIZES
    head = (
        "legs",
        "minsnap",
        "make_interp_spline(k=7)",
        "ours / scipy's",
        "minsnap_trajectories / ours",
        "apart",
        "peak",
    )
    table(head, (compare(legs) for legs in sizes))
    nothing = median_time(lambda: whole_process(["-c", "pass"]), most=15)
    loading = median_time(lambda: whole_process(["-c", "import minsnap"]), most=15)
    command = ["-m", "minsnap", "rect", "--corridor", "0.3", "-o", "-"]
    process = median_time(lambda: whole_process(command), seconds=3.0, most=15)
    rows = (
        ("import minsnap, less an empty Python", text(loading - nothing)),
        ("minsnap rect --corridor 0.3", text(process)),
    )
    table(("process", "median"), rows)


if __name__ == "__main__":
    main()
