"""Plans with given durations: without walls beside scipy's septic spline, in corridors by both cores, and evaluation.

Run it by hand: ``python benchmarks/bench_plan.py [--large]``; ``--large`` adds a million legs (some 5 GiB).
Calls that are compared are made in turn, and the least processor time of each counts.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from ctypes import c_int64, c_void_p
from functools import partial
from time import perf_counter

import numpy as np
from measure import least_times, machine, peak_memory, table, text
from problems import DURATIONS, RECTANGLE, walk
from scipy.interpolate import make_interp_spline

import minsnap
from minsnap import RoundTube
from minsnap.native.library import core, using

SIZES = (10, 100, 1_000, 10_000, 100_000)
PEER_LIMIT = 300
"""Legs up to which the namesake is asked: its time grows with the cube of their number."""


def spline(points, durations):
    """The same curve by scipy, in B-splines, not yet in a form that can be flown."""
    times = np.concatenate(([0.0], np.cumsum(durations)))
    rest = [(order, np.zeros(points.shape[1])) for order in (1, 2, 3)]
    return make_interp_spline(times, points, k=7, bc_type=(rest, rest))


def namesake(points, durations):
    """A call that makes the same curve by minsnap_trajectories, where it is installed; else None."""
    try:
        import minsnap_trajectories as peer
    except ImportError:
        return None
    times = np.concatenate(([0.0], np.cumsum(durations)))
    references = [peer.Waypoint(time=float(t), position=p) for t, p in zip(times, points, strict=True)]
    rest = dict.fromkeys(("velocity", "acceleration", "jerk"), np.zeros(points.shape[1]))
    for end in (0, -1):
        references[end] = peer.Waypoint(time=float(times[end]), position=points[end], **rest)
    orders = {"degree": 7, "idx_minimized_orders": 4, "num_continuous_orders": 4}
    return partial(peer.generate_trajectory, references, **orders, algorithm="closed-form")


def native(points, durations):
    """A call of the native core that makes the same curve, with arguments made before: what Python adds to it."""
    curve = np.empty((len(durations), 8, points.shape[1]))
    arrays = [c_void_p(array.ctypes.data) for array in (points, durations, curve)]
    solve = core().library.minsnap_unconstrained
    return partial(solve, *arrays[:2], c_int64(len(durations)), points.shape[1], 4, arrays[2]), (
        points,
        durations,
        curve,
    )


def free(legs):
    points, durations, _ = walk(legs)
    (alone, _kept), calls = native(points, durations), [partial(minsnap.plan, points, durations)]
    calls += [partial(spline, points, durations), alone]
    peer = namesake(points, durations) if legs <= PEER_LIMIT else None
    (mine, theirs, core_alone, *others), (traj, other, *_) = least_times(calls + ([peer] if peer else []))
    with using("python"):
        (reference,), _ = least_times([calls[0]])
    t = np.linspace(0.0, traj.duration, 1001)
    apart = f"{np.abs(traj(t) - other(t)).max():.0e} m"
    named = f"{others[0] / mine:.0f}" if others else "-"
    ratios = f"{mine / core_alone:.2f}", f"{mine / theirs:.2f}"
    return legs, text(mine), *ratios, named, apart, text(reference)


def corridors():
    """Names and questions: the rectangle and random legs, in tubes square and round, laps, and free waypoints."""
    for width in (1.0, 0.3, 0.1, 0.01, 1e-3, 1e-4):
        yield f"rectangle, {width:g} m", {"waypoints": RECTANGLE, "durations": DURATIONS, "corridor": width}
    for radius in (1.0, 0.3, 0.01):
        asked = {"waypoints": RECTANGLE, "durations": DURATIONS, "corridor": RoundTube(radius)}
        yield f"rectangle, round, {radius:g} m", asked
    for legs in (10, 30, 100, 1_000):
        points, durations, widths = walk(legs)
        asked = {"waypoints": points, "durations": durations, "corridor": widths}
        yield f"{legs:,} random legs", asked
        yield f"{legs:,} random legs, round", asked | {"corridor": RoundTube(widths)}
    points, durations, widths = walk(1_000)
    lap = np.concatenate((points[:-1], points[:1]))
    yield "1,000 legs, closed", {"waypoints": lap, "durations": durations, "corridor": widths, "closed": True}
    asked = {"waypoints": points, "durations": durations, "waypoint_tolerance": 0.05}
    yield "1,000 legs, waypoints in boxes", asked
    yield "the same in the tube", asked | {"corridor": widths}


def cornered(name, asked):
    call = partial(minsnap.plan, **asked)
    (native,), (traj,) = least_times([call])
    place, tolerance = asked["waypoints"], asked.get("waypoint_tolerance", 0.0)
    if not minsnap.certify(traj, place, asked.get("corridor"), None, tolerance).ok or traj.report.core != "native":
        raise RuntimeError(f"{name}: not certified, or not by the native core")
    with using("python"):
        (reference,), (other,) = least_times([call])
    share = f"{traj.cost() / other.cost() - 1.0:.0e}"
    return name, text(native), text(reference), f"{reference / native:.1f}", share, f"{peak_memory():.2f} GiB"


def evaluation():
    traj = minsnap.plan(*walk(10)[:2])
    many = np.linspace(0.0, traj.duration, 100_000)
    for order in range(5):
        (one, all_of_them), _ = least_times([partial(traj, 3.3, order), partial(traj, many, order)])
        yield order, text(one), text(all_of_them)


def processes():
    for name, command in (
        ("an empty Python", ["-c", "pass"]),
        ("import minsnap", ["-c", "import minsnap"]),
        (
            "minsnap rect --corridor 0.3 --time 12",
            ["-m", "minsnap", "rect", "--corridor", "0.3", "--time", "12", "-o", "-"],
        ),
        ("minsnap rect --corridor 0.3", ["-m", "minsnap", "rect", "--corridor", "0.3", "-o", "-"]),
    ):
        call = partial(subprocess.run, [sys.executable, *command], check=True, capture_output=True)
        yield name, text(least_times([call], 4.0, clock=perf_counter)[0][0])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--large", action="store_true", help="a million legs too")
    sizes = (*SIZES, 1_000_000) if parser.parse_args().large else SIZES
    print(*machine(), sep="\n")
    head = ("legs", "plan", "ours / its native call's", "ours / scipy's", "minsnap_trajectories / ours", "apart")
    table((*head, "reference core"), (free(legs) for legs in sizes))
    head = ("corridor", "plan", "reference core", "ratio", "cost of ours / its - 1", "peak memory")
    table(head, (cornered(*case) for case in corridors()))
    table(("order", "one instant", "100,000 instants"), evaluation())
    table(("process", "clock"), processes())


if __name__ == "__main__":
    main()
