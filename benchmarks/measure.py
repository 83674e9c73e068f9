"""What every benchmark needs: medians, tables, and the name of the machine."""

from __future__ import annotations

import os
import platform
import resource
import time
from importlib.metadata import PackageNotFoundError, version

import numpy as np

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


def median_time(call, seconds=1.0, least=3, most=200):
    """Median wall time of a call [s] over as many repeats as fit, after one to warm up."""
    call()
    times = []
    began = time.perf_counter()
    while len(times) < least or (time.perf_counter() - began < seconds and len(times) < most):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def alternating(calls, seconds=2.0, least=3, most=200):
    """Median times of several calls made in turn, so that all see the same machine: a list [s]."""
    for call in calls:
        call()
    times = [[] for _ in calls]
    began = time.perf_counter()
    while len(times[0]) < least or (time.perf_counter() - began < seconds and len(times[0]) < most):
        for call, mine in zip(calls, times, strict=True):
            start = time.perf_counter()
            call()
            mine.append(time.perf_counter() - start)
    return [float(np.median(mine)) for mine in times]


def peak_memory():
    """Largest memory that this process has held [GiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def text(seconds):
    return f"{seconds:.2f} s" if seconds >= 1.0 else f"{1e3 * seconds:.2f} ms"


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
