"""The command that makes a dataset of plans."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from minsnap.cli.command import command
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.batch.run import Watch


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
    from minsnap.cli.batch_line import BatchLine

    line = BatchLine(count, sys.stderr)
    try:
        yield line.begin
    finally:
        line.clear()
