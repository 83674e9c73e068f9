"""What every benchmark needs: least times, tables, and the name of the machine."""

from __future__ import annotations

import os
import platform
import resource
import time
from importlib.metadata import PackageNotFoundError, version

PACKAGES = (
    "numpy",
    "scipy",
    "qpsolvers",
    "daqp",
    "piqp",
    "clarabel",
    "osqp",
    "fastpathplanning",
    "minsnap_trajectories",
)


def least_times(calls, seconds=1.0, rounds=3, clock=time.process_time):
    """Least times of calls made in turn, so that all see the same machine [s], and their last values: two lists.

    After a round that does not count there are so many rounds, and then as many as fit into some seconds on the wall.
    """
    values = [call() for call in calls]
    best, made, began = [float("inf")] * len(calls), 0, time.perf_counter()
    while made < rounds or time.perf_counter() - began < seconds:
        for index, call in enumerate(calls):
            start = clock()
            values[index] = call()
            best[index] = min(best[index], clock() - start)
        made += 1
    return best, values


def peak_memory():
    """Largest memory that this process has held [GiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def text(seconds):
    """A duration in the unit that suits it."""
    for unit, scale in (("s", 1.0), ("ms", 1e3)):
        if seconds * scale >= 1.0:
            return f"{seconds * scale:.3g} {unit}"
    return f"{seconds * 1e6:.3g} µs"


def table(head, rows):
    """Print a table in Markdown."""
    print("| " + " | ".join(head) + " |")
    print("|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |", flush=True)
    print()


def machine():
    """One line on the machine and one on the versions."""
    found = []
    for name in PACKAGES:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} not installed")
    system = f"{platform.system()}, Python {platform.python_version()}, load {os.getloadavg()[0]:.1f}"
    return (
        f"{_processor()}, {os.cpu_count()} cores, {system}",
        ", ".join(found),
    )


def _processor():
    try:
        with open("/proc/cpuinfo") as lines:
            return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()
