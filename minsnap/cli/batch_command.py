"""The command that makes a dataset of plans, and its progress: share, rate, time left, and failures by kind."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, TextIO

from minsnap.basics.progress import ProgressLine
from minsnap.cli.command import command
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.batch.run import Watch


FIRST = 100
"""New rows after which the time that all of them will take is told, once."""

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
    rate: Annotated[int, "HZ", "Frames a second of LeRobot episodes."] = 20,
    resume: Annotated[bool, "--resume/--no-resume", "Continue in a folder that has results, or refuse it."] = True,
) -> None:
    """Plan many problems, and write them as a Parquet dataset that can go on after it was killed.

    The files are the same bytes whatever the number of workers. A problem that fails is a row with its status and the
    reason.
    """
    from minsnap.batch.run import run_batch
    from minsnap.batch.spec import read_spec

    if format not in ("parquet", "lerobot"):
        raise InputError(f"--format is {format!r}: it must be parquet or lerobot")
    specification, folder = read_spec(spec), output / "_plans" if format == "lerobot" else output
    with _line(specification.count) as watch:
        result = run_batch(
            specification,
            folder,
            workers=workers,
            scheduler=scheduler,
            problem_timeout=problem_timeout,
            resume=resume,
            watch=watch,
        )
    counts = ", ".join(f"{count} {status}" for status, count in sorted(result.statuses.items()))
    kept = f" ({result.present} were there already)" if result.present else ""
    if format == "lerobot":
        from minsnap.batch.lerobot import export_lerobot

        kept += f", {export_lerobot(folder, output, rate)} episodes"
    print(f"{output}: {result.rows} problems in {result.shards} files{kept}: {counts}")


@contextmanager
def _line(count: int) -> Iterator[Watch]:
    """Yield what shows the progress on stderr; on a terminal in place, elsewhere a line every half a minute."""
    line = BatchLine(count, sys.stderr)
    try:
        yield line.begin
    finally:
        line.clear()


class BatchLine:
    """A line that says how far a batch is.

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
        self.line = ProgressLine("batch") if stream.isatty() else None
        self.present, self.statuses, self.estimated = 0, Counter[str](), False
        self.began = self.due = clock()

    def begin(self, present: int) -> Callable[[dict[str, int]], None]:
        """Begin with the rows that are there already; return what takes new ones."""
        self.present, self.began = present, self.clock()
        self.due = self.began + APART
        return self.add

    def add(self, counts: dict[str, int]) -> None:
        """Count new rows by status, and show the line if another was not shown recently."""
        self.statuses.update(counts)
        if not self.estimated and self.statuses.total() >= FIRST:
            self.estimated = True
            self._estimate()
        if self.line is not None:
            self.line.show(self.there / self.count, self.text())
        elif self.clock() >= self.due:
            self.due = self.clock() + APART
            print(self.text(), file=self.stream, flush=True)

    def _estimate(self) -> None:
        """Say once how long the rest will take; nothing where it is a matter of seconds."""
        left = (self.count - self.there) * (self.clock() - self.began) / self.statuses.total()
        if left > APART:
            self.clear()
            text = f"about {_told(left)} for {self.count} problems, by the first {self.there}"
            print(text, file=self.stream, flush=True)

    @property
    def there(self) -> int:
        """Rows that are there."""
        return min(self.present + self.statuses.total(), self.count)

    def text(self) -> str:
        """Return the line."""
        rate = self.statuses.total() / max(self.clock() - self.began, 1e-9)
        left = f", {_told((self.count - self.there) / rate)} left" if rate > 0.0 else ""
        failures = "".join(f", {n} {kind}" for kind, n in sorted(self.statuses.items()) if kind != "done")
        return f"{self.there} of {self.count} problems, {rate:.4g} a second{left}{failures}"

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
