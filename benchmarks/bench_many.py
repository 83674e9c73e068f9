"""Many plans in one call, and datasets: time per problem, what Dask adds, and two workers against one.

Run it by hand: ``python benchmarks/bench_many.py [--large]``; ``--large`` makes 100,000 certified problems of 4 to 10
legs. Processor time is given beside the clock's, since it means something on a busy machine too.
"""

from __future__ import annotations

import os
import resource
import sys
import tempfile
import time
from contextlib import contextmanager
from functools import partial
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from measure import table

import minsnap
from minsnap.batch import read_mapping, run_batch
from minsnap.batch.folder import ShardJob, claimed, make_shard
from minsnap.batch.run import connected, write_shards
from minsnap.batch.solving import Solving

RECTANGLE = np.array([(0.0, 0.0, 1.0), (8.0, 0.0, 1.0), (8.0, 4.0, 1.0), (0.0, 4.0, 1.0), (0.0, 0.0, 1.0)])
WALKS = {"generator": "walks", "seed": 7, "legs": [4, 10], "corridor": [0.2, 0.5]}


def spent():
    """Clock and processor time of this process and of those that it waited for [s]."""
    own, below = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return time.perf_counter(), own.ru_utime + own.ru_stime + below.ru_utime + below.ru_stime


def measured(call, repeats=1):
    """Return the least clock and processor time of a call [s]."""
    found = []
    for _ in range(repeats):
        before = spent()
        call()
        found.append([b - a for a, b in zip(before, spent(), strict=True)])
    return np.min(found, axis=0)


def in_one_call():
    rng, rows = np.random.default_rng(0), []
    free = rng.normal(size=(100_000, 11, 3)), rng.uniform(0.7, 1.4, (100_000, 10))
    corners = np.broadcast_to(RECTANGLE, (10_000, 5, 3)), np.array([4.0, 2.0, 4.0, 2.0])
    many = partial(minsnap.plan_many, threads=1)
    tubes = partial(many, *corners, corridor=rng.uniform(0.05, 1.0, 10_000))
    for name, call, count in (
        ("10 legs, free", partial(many, *free), 100_000),
        ("10 legs, free, gradients", partial(many, *free, gradients=True), 100_000),
        ("rectangle, random width, certified", tubes, 10_000),
        ("the same, gradients", partial(tubes, gradients=True), 10_000),
    ):
        wall, cpu = measured(call, 3)
        rows.append((name, count, f"{wall:.3f} s", f"{cpu:.3f} s", f"{1e6 * cpu / count:.1f} us"))
    looped = measured(lambda: [minsnap.plan(p, durations=t) for p, t in zip(*(a[:5000] for a in free), strict=True)])
    rows.append(
        ("10 legs, free, a loop over plan", 5000, *(f"{t:.3f} s" for t in looped), f"{200.0 * looped[1]:.1f} us")
    )
    table(("problems", "count", "clock", "processor", "processor each"), rows)


def within_limits(count=200, legs=5):
    """Random courses within limits in one call, on one thread and on two, beside a loop over plan."""
    rng = np.random.default_rng(1)
    courses = np.cumsum(rng.normal(size=(count, legs + 1, 3)) * 3.0, axis=1)
    limits = minsnap.Limits(speed=3.0, acceleration=4.0, jerk=30.0)
    many = partial(minsnap.plan_many, courses, limits=limits)
    calls = {f"plan_many, {n} thread{'s'[: n - 1]}": partial(many, threads=n) for n in (1, 2)}
    calls["a loop over plan"] = lambda: [minsnap.plan(course, limits=limits) for course in courses]
    found = {name: measured(call) for name, call in calls.items()}
    loop = found["a loop over plan"]
    rows = [
        (name, *(f"{1e3 * t / count:.3f} ms" for t in own), *(f"{ratio:.2f}" for ratio in loop / own))
        for name, own in found.items()
    ]
    table((f"{count} courses of {legs} legs", "clock each", "processor each", "loop / it", "in processor time"), rows)


def rows_alone(count):
    """Plan rows in a process of their own, without Dask and files."""
    solving = Solving(read_mapping(WALKS | {"count": count}), 60.0)
    for _ in solving.rows(range(count)):
        pass
    solving.close()


def walks(count):
    return read_mapping(WALKS | {"count": count, "shard_rows": 1000})


def dataset(count, workers):
    with tempfile.TemporaryDirectory() as folder:
        run_batch(walks(count), folder, workers=workers)


def datasets(count):
    """Time of planning alone, and of datasets by one and two workers; starts are taken off."""
    few = 20
    cases = {
        "rows alone": (lambda n: lambda: rows_alone(n)),
        "dataset, 1 worker": (lambda n: lambda: dataset(n, 1)),
        "dataset, 2 workers": (lambda n: lambda: dataset(n, 2)),
    }
    rows = []
    for name, make in cases.items():
        wall, cpu = 1e6 * (measured(make(count)) - measured(make(few))) / (count - few)
        rows.append((name, count, f"{wall:.0f} us", f"{cpu:.0f} us" if name == "rows alone" else ""))
    table(("what", "problems", "clock each", "processor each"), rows)


@contextmanager
def job(count):
    spec = walks(count)
    with tempfile.TemporaryDirectory() as folder, claimed(Path(folder), spec, True):
        yield spec, ShardJob(Path(folder), spec, 60.0)


def besides_planning(count, repeats=3):
    """Processor time of all processes but those that plan, files without Dask and with it, for every problem [s]."""

    def files():
        with job(count) as (spec, wanted):
            before = time.process_time()
            for number in range(spec.shards):
                make_shard(wanted, number)
            return time.process_time() - before

    def with_dask():
        with job(count) as (spec, wanted):
            before = spent_by_dask()
            for _ in write_shards(wanted, range(spec.shards), client):
                pass
            return spent_by_dask() - before

    def spent_by_dask():  # the scheduler and the client are in this process
        return time.process_time() + sum(client.run(time.process_time).values())

    with connected(1, None) as client:
        found = np.array([(files(), with_dask()) for _ in range(repeats + 1)])[1:]  # the first one imports
    return found.min(axis=0) / count


def share_of_dask(count):
    planning = measured(lambda: rows_alone(count))[1] / count
    files, with_dask = besides_planning(count)
    share = (with_dask - files) / (planning + files)
    times = [f"{1e6 * t:.0f} us" for t in (planning, files, with_dask)]
    table(("planning", "files alone, besides", "with Dask, besides", "share of Dask"), [(*times, f"{share:.1%}")])


def main():
    in_one_call()
    print()
    datasets(100_000 if "--large" in sys.argv else 6_000)
    print()
    share_of_dask(6_000)


if __name__ == "__main__":
    main()
