"""The commands of many plans: batch makes a dataset, and shows its progress; bench measures this machine."""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any, TextIO

import typer

import minsnap
from minsnap.basics.interrupts import ended_in_order
from minsnap.basics.messages import labelled
from minsnap.basics.progress import ProgressLine, rewritable
from minsnap.cli import options
from minsnap.cli.app import command, fail
from minsnap.cli.output import as_json
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.basics.arrays import FloatArray

FIRST = 100
"""Rows after the first ones with which the time that all of them will take is told, once."""

APART = 30.0
"""Seconds between two lines where no terminal is, which shows one in place."""


@command()
def batch(
    spec: Annotated[Path, "SPEC", "YAML: a generator with ranges and a seed, or a table."],
    *,
    output: Annotated[Path, "--output", "-o", "FOLDER", "Folder of the dataset."],
    workers: Annotated[int | None, "N", "Processes on this machine; by default all processors."] = None,
    scheduler: Annotated[str | None, "ADDRESS", "A Dask scheduler instead: tcp://host:8786."] = None,
    problem_timeout: Annotated[float, "S", "Processor time of a problem that is too slow [s]."] = 60.0,
    format: Annotated[str, "NAME", "parquet: a row per plan; lerobot: LeRobot v3 episodes."] = "parquet",
    rate: Annotated[int | None, "HZ", "Frames a second of LeRobot episodes; by default 20."] = None,
    resume: Annotated[bool, "--resume/--no-resume", "Continue in a folder that has results, or refuse it."] = True,
) -> None:
    """Plan many problems, and write a Parquet dataset.

    The same command continues a run that was killed. The files have the same bytes for every number of workers. A
    problem that fails is a row with its status and the reason.
    """
    from minsnap.basics.checks import check_number
    from minsnap.batch.folder import SPEC, refuse_mixed
    from minsnap.batch.run import run_batch
    from minsnap.batch.spec import read_spec

    if format not in ("parquet", "lerobot"):
        raise InputError(f"--format is {format!r}: it must be parquet or lerobot")
    if format == "lerobot":
        refuse_mixed(output, SPEC)  # before anything is planned
    elif rate is not None:
        raise InputError(f"--rate {rate} is of episodes: give --format lerobot with it")
    if workers is not None and scheduler is not None:
        raise InputError("--workers are of this machine, and --scheduler has its own: leave out one")
    fps = 20 if rate is None else rate
    check_number("--rate", fps, 1, 1000, "give a whole number of frames a second, 1 to 1000", whole=True)
    specification, folder = read_spec(spec), output / "_plans" if format == "lerobot" else output
    how: Any = {"workers": workers, "scheduler": scheduler, "problem_timeout": problem_timeout, "resume": resume}
    line = BatchLine(specification.count, sys.stderr)
    try:
        with ended_in_order():
            result = run_batch(specification, folder, **how, watch=line.begin)
    except (KeyboardInterrupt, SystemExit) as end:
        line.clear()
        status = int(getattr(end, "code", 130))
        fail("interrupted: finished files are kept, and the same command goes on from there", status)
    finally:
        line.clear()
    counts = ", ".join(f"{count} {status}" for status, count in sorted(result.statuses.items()))
    kept = f" ({result.present} were there already)" if result.present else ""
    if format == "lerobot":
        from minsnap.batch.lerobot import export_lerobot

        kept += f", {export_lerobot(folder, output, fps)} episodes"
    print(f"{output}: {result.rows} problems in {result.shards} files{kept}: {counts}")


class BatchLine:
    """A line that says how far a batch is: on a terminal in place, elsewhere a line every half a minute.

    Parameters
    ----------
    count : int
        Problems in all.
    stream : text file
    clock : callable
        Returns seconds.
    """

    def __init__(self, count: int, stream: TextIO, clock: Callable[[], float] = monotonic) -> None:
        self.count, self.stream, self.clock = count, stream, clock
        self.line = ProgressLine("batch") if rewritable(stream) else None
        self.present, self.statuses, self.estimated = 0, Counter[str](), False
        self.began = self.due = clock()
        self.early = 0

    def begin(self, present: int) -> Callable[[dict[str, int]], None]:
        """Begin with the rows that are there already; return what takes new ones."""
        self.present, self.began = present, self.clock()
        self.due = self.began + APART
        return self.add

    def add(self, counts: dict[str, int]) -> None:
        """Count new rows by status, and show the line if another was not shown recently."""
        self.statuses.update(counts)
        if not self.early:
            self.began, self.early = self.clock(), self.statuses.total()
        if not self.estimated and self.statuses.total() - self.early >= FIRST:
            self.estimated = True
            self._estimate()
        if self.line is not None:
            self.line.show(self.there / self.count, self.text())
        elif self.clock() >= self.due:
            self.due = self.clock() + APART
            print(self.text(), file=self.stream, flush=True)

    def _estimate(self) -> None:
        """Say once how long the rest will take; nothing where it is a matter of seconds."""
        left = (self.count - self.there) / self.rate if self.rate else 0.0
        if left > APART:
            self.clear()
            text = f"about {_told(left)} for {self.count} problems, by the first {self.there}"
            print(text, file=self.stream, flush=True)

    @property
    def there(self) -> int:
        """Rows that are there."""
        return min(self.present + self.statuses.total(), self.count)

    @property
    def rate(self) -> float:
        """Rows a second since the first ones came, before which workers start; 0 where none came since."""
        elapsed = self.clock() - self.began
        return (self.statuses.total() - self.early) / elapsed if elapsed > 0.0 else 0.0

    def text(self) -> str:
        """Return the line."""
        rate = self.rate
        pace = f", {rate:.4g} a second, {_told((self.count - self.there) / rate)} left" if rate else ""
        failures = "".join(f", {n} {kind}" for kind, n in sorted(self.statuses.items()) if kind != "done")
        return f"{self.there} of {self.count} problems{pace}{failures}"

    def clear(self) -> None:
        """Clear the line."""
        if self.line is not None:
            self.line.clear()


def _told(seconds: float) -> str:
    """Return a time as people say it."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"


SPARE = 1.5
"""Factor from the longest replan to the budget that is advised."""

MANY = 1000
"""Problems of one call of plan_many."""


@command()
def bench(
    *,
    seconds: Annotated[
        float, typer.Option("--seconds", metavar="S", min=0.0, max=600.0, help="Least time of each measurement [s].")
    ] = 0.5,
    json: options.Json = False,
) -> None:
    """Measure this machine: plans, corridors, limits, replan budget.

    Each line is the median of repeated calls in one process that does nothing else. The budget is 1.5 times the longest
    replan.
    """
    results = dict(_measured(seconds))
    if json:
        print(as_json(results))
        return
    times = [(name, f"{1e3 * took:.3g} ms") for name, took in results.items() if isinstance(took, float)]
    print(labelled([*((name, text) for name, text in results.items() if isinstance(text, str)), *times]))


def _measured(seconds: float) -> Iterator[tuple[str, Any]]:
    """Yield name and seconds of each measurement; names of core and processors first."""
    import numpy as np

    import minsnap
    from minsnap.native import describe

    yield "core", f"{describe()}, {os.cpu_count()} processors"
    draw = np.random.default_rng(0)
    points = np.cumsum(draw.uniform((2.0, -1.5, -0.4), (4.0, 1.5, 0.4), (11, 3)), axis=0)
    limits, times, many = minsnap.Limits(speed=3.0, acceleration=6.0), np.full(10, 2.0), np.tile(points, (MANY, 1, 1))
    plan = minsnap.plan
    calls: dict[str, Callable[[], Any]] = {
        "plan, 10 legs": lambda: plan(points, durations=times),
        "plan in a corridor": lambda: plan(points, durations=times, corridor=0.3),
        "best split": lambda: plan(points, total_time=20.0, corridor=0.3),
        "within limits": lambda: plan(points, limits=limits, corridor=0.3),
        "with pieces=auto": lambda: plan(points, limits=limits, corridor=0.3, pieces="auto"),
        f"plan_many, {MANY}": lambda: minsnap.plan_many(many, durations=times),
    }
    for name, call in calls.items():
        yield name, median(_times(call, seconds))
    replans = list(_replans(points[:5], limits, seconds))
    yield "replan, 4 legs", median(replans)
    yield "longest replan", max(replans)
    yield "budget to give", SPARE * max(replans)


def _times(call: Callable[[], Any], seconds: float) -> list[float]:
    """Return how long each of at least three calls took [s], the first left out."""
    call()
    took: list[float] = []
    while sum(took) < seconds or len(took) < 3:
        began = time.perf_counter()
        call()
        took.append(time.perf_counter() - began)
    return took


def _replans(points: FloatArray, limits: minsnap.Limits, seconds: float) -> Iterator[float]:
    """Yield how long replans took whose waypoints ahead have moved by up to 5 cm [s]."""
    import numpy as np

    flown, draw = minsnap.plan(points, limits=limits, corridor=1.0), np.random.default_rng(1)
    total, count = 0.0, 0
    while total < seconds or count < 20:
        replanner = minsnap.Replanner(limits, 1.0)
        ahead = points[1:] + draw.uniform(-0.05, 0.05, points[1:].shape)
        change = replanner.replan(flown, 0.1 * flown.leg_breaks[1], ahead, min(1.0, 0.5 * flown.leg_breaks[1]))
        total, count = total + change.took, count + 1
        yield change.took
