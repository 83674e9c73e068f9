"""run_batch: the files of a dataset that are not there yet, then its datasheet and its manifest."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from minsnap.basics.checks import is_number, is_whole
from minsnap.basics.messages import shown
from minsnap.batch.cluster import Counted, connected, write_shards
from minsnap.batch.datasheet import write_datasheet
from minsnap.batch.folder import (
    Shard,
    ShardJob,
    claimed,
    is_complete,
    kept_shard,
    made_with,
    shard_name,
    write_manifest,
)
from minsnap.batch.spec import Spec
from minsnap.batch.tally import Tally
from minsnap.errors import BatchError, FileError, InputError

TIMEOUT = 60.0
"""Seconds of processor time that a problem may take, unless told otherwise."""

Watch = Callable[[int], Counted]
"""Called once with the number of rows that are there already; returns what is called with new rows."""


@dataclass(frozen=True)
class BatchResult:
    """A dataset that is complete.

    Parameters
    ----------
    folder : Path
    rows : int
        Problems.
    shards : int
        Files.
    statuses : dict of str to int
        Problems by status.
    present : int
        Files that were there already.
    """

    folder: Path
    rows: int
    shards: int
    statuses: dict[str, int]
    present: int


def run_batch(
    spec: Spec,
    folder: str | os.PathLike[str],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    problem_timeout: float = TIMEOUT,
    resume: bool = True,
    watch: Watch | None = None,
) -> BatchResult:
    """Plan every problem of a batch, and write the dataset.

    The bytes of its files do not depend on the number of workers, on their order, or on how often the run was killed.

    Parameters
    ----------
    spec : Spec
    folder : str or path
        Where the dataset is written; files that are there already are kept.
    workers : int, optional
        Processes on this machine; by default as many as it has processors.
    scheduler : str, optional
        Address of a Dask scheduler instead; its workers must reach the folder under the same name.
    problem_timeout : float
        Seconds of processor time after which a problem is given up; ten times as many by the clock end one that only
        waits.
    resume : bool
        Whether a folder that was begun already is taken.
    watch : callable, optional

    Returns
    -------
    BatchResult

    Raises
    ------
    FileError
        If the folder is that of another batch, or cannot be written.
    BatchError
        If the batch could not go on; whatever is finished is kept, and the same call goes on from there.
    ImportError
        If Dask or pyarrow is not there.
    """
    _check(workers, problem_timeout)
    if not os.fspath(folder):
        raise FileError("the folder of a dataset has no name: give one")
    where = Path(folder).resolve()
    made = made_with()
    job = ShardJob(str(where), spec.plain(), spec.name(), made, float(problem_timeout))
    with claimed(where, spec, made, resume):
        kept = [one for one in (kept_shard(where, job.name, n) for n in range(spec.shards)) if one is not None]
        there = [shard.number for shard in kept]
        if is_complete(where, spec, kept):
            return _result(where, spec, kept, len(kept))
        with _finished_files_named(spec, where):
            shards = _written(spec, job, workers, scheduler, _watching(watch, spec, there))
            result = _result(where, spec, shards, len(there))
            write_datasheet(where, spec, made, _joined(shards), shards)
            write_manifest(where, spec, made, shards, result.statuses)
    return result


def _written(
    spec: Spec, job: ShardJob, workers: int | None, scheduler: str | None, counted: Counted | None
) -> list[Shard]:
    """Return all files of a batch by number, after those that are not there have been written."""
    shards: dict[int, Shard] = {}

    def finished(shard: Shard) -> None:
        shards[shard.number] = shard

    with connected(workers, scheduler) as client:
        write_shards(job, range(spec.shards), client, finished, counted)
    return [shards[number] for number in sorted(shards)]


@contextmanager
def _finished_files_named(spec: Spec, folder: Path) -> Iterator[None]:
    """Add to what ends a run how far it came."""
    try:
        yield
    except (BatchError, FileError) as error:
        there = sum(1 for number in range(spec.shards) if (folder / shard_name(number)).exists())
        state = f"{there} of {spec.shards} files are finished, and the same command goes on from there"
        raise BatchError(f"{error}; {state}") from error


def _watching(watch: Watch | None, spec: Spec, there: list[int]) -> Counted | None:
    return None if watch is None else watch(sum(len(spec.rows_of(number)) for number in there))


def _result(folder: Path, spec: Spec, shards: list[Shard], present: int) -> BatchResult:
    return BatchResult(folder, spec.count, spec.shards, _joined(shards).statuses, present)


def _joined(shards: list[Shard]) -> Tally:
    tally = Tally()
    for shard in shards:
        tally.join(Tally(shard.tally))
    return tally


def _check(workers: Any, timeout: Any) -> None:
    if workers is not None and (not is_whole(workers) or not 1 <= workers <= 1024):
        raise InputError(f"workers is {shown(workers)}: use 1 to 1024")
    if not is_number(timeout) or not 1e-3 <= timeout <= 1e6:
        raise InputError(f"the timeout of a problem is {shown(timeout)}: use 0.001 to 1000000 seconds")
