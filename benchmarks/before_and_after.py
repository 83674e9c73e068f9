"""The same plans by two versions of this package, and by both cores of this one, in turn in one run.

Run it by hand: ``git worktree add ../before REVISION; python benchmarks/before_and_after.py ../before``. It prints the
least processor time of many calls, which other programs on the machine disturb least.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

from problems import DURATIONS, RECTANGLE, walk

ROUNDS = 2
HERE = Path(__file__).resolve().parents[1]


def plans(minsnap):
    """What is timed, by name."""
    found = {}
    for legs in (10, 100, 1_000, 10_000, 100_000):
        found[f"no walls, {legs:,} legs"] = partial(minsnap.plan, *walk(legs)[:2])
    for width in (1.0, 0.3, 0.1, 0.01, 0.001):
        found[f"rectangle, {width:g} m"] = partial(minsnap.plan, RECTANGLE, DURATIONS, corridor=width)
    for legs in (10, 30, 100, 300, 1_000, 3_000):
        points, durations, widths = walk(legs)
        found[f"corridor, {legs:,} legs"] = partial(minsnap.plan, points, durations, corridor=widths)
    found["rectangle, split of 12 s"] = partial(minsnap.plan, RECTANGLE, total_time=12)
    found["the same, 0.3 m"] = partial(minsnap.plan, RECTANGLE, total_time=12, corridor=0.3)
    found["round tube, 0.3 m"] = partial(minsnap.plan, RECTANGLE, DURATIONS, corridor=minsnap.RoundTube(0.3))
    limits = minsnap.Limits(speed=3, acceleration=4)
    found["rectangle, scaled to limits"] = partial(
        minsnap.plan, RECTANGLE, limits=limits, search=minsnap.Search(split="distance")
    )
    found["rectangle, 0.3 m, shortest time"] = partial(minsnap.plan, RECTANGLE, limits=limits, corridor=0.3)
    flown = minsnap.plan(RECTANGLE, DURATIONS, corridor=0.3)
    found["certificate of the rectangle"] = partial(minsnap.certify, flown, RECTANGLE, corridor=0.3, limits=limits)
    return found


def least(call, seconds=1.0):
    """Least processor time of at least three calls [s]."""
    call()
    taken, began = [], time.process_time()
    while len(taken) < 3 or time.process_time() - began < seconds:
        start = time.process_time()
        call()
        taken.append(time.process_time() - start)
    return min(taken)


def run(root, core):
    """Time all plans in a process that imports the package from a folder."""
    environment = os.environ | {"PYTHONPATH": str(root), "MINSNAP_CORE": core, "OPENBLAS_NUM_THREADS": "1"}
    printed = subprocess.run([sys.executable, __file__, "--here"], env=environment, capture_output=True, check=True)
    return json.loads(printed.stdout)


def main(before):
    from measure import table, text

    asked = {"before": (Path(before).resolve(), "auto"), "python": (HERE, "python"), "native": (HERE, "auto")}
    runs = {name: [] for name in asked}
    for _ in range(ROUNDS):
        for name, (root, core) in asked.items():
            runs[name].append(run(root, core))
    rows = []
    for name in runs["before"][0]:
        one = {which: min(found[name] for found in several) for which, several in runs.items()}
        ratios = (f"{one[which] / one['before']:.2f}" for which in ("python", "native"))
        rows.append((name, *(text(value) for value in one.values()), *ratios))
    table(("plan", "before", "Python core", "native core", "Python / before", "native / before"), rows)


if __name__ == "__main__":
    if sys.argv[1:] == ["--here"]:
        import minsnap

        print(json.dumps({name: least(call) for name, call in plans(minsnap).items()}))
    else:
        main(sys.argv[1])
