"""The files of a dataset: each written whole or not at all, and with a summary of itself inside."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.reading import reading
from minsnap.basics.version import __version__
from minsnap.batch.columns import parquet_writer, schema
from minsnap.batch.folder import belongs, file_digest, known_digest, write_digest
from minsnap.batch.problem_table import pyarrow_parquet
from minsnap.batch.solving import solving
from minsnap.batch.spec import read_mapping
from minsnap.batch.tally import Tally
from minsnap.errors import BatchError, FileError
from minsnap.native.library import core

GROUP_ROWS = 1024
"""Rows of a row group, which are in memory at once."""

Told = Callable[[Mapping[str, int]], None]
"""Called with the number of new rows by status."""


@dataclass(frozen=True)
class Shard:
    """A finished file.

    Parameters
    ----------
    number : int
    rows, size : int
        Problems, bytes.
    digest : str
        SHA-256.
    tally : dict
        Counts, ranges and histograms of its columns.
    """

    number: int
    rows: int
    size: int
    digest: str
    tally: dict[str, Any]


@dataclass(frozen=True)
class ShardJob:
    """What a worker must know to write any file of a batch.

    Parameters
    ----------
    folder : str
        Absolute.
    content : mapping
        The specification as plain values.
    name : str
        That of the specification.
    made_with : dict of str to str
        See ``made_with``.
    timeout : float
        Seconds of processor time that a problem may take.
    """

    folder: str
    content: Mapping[str, Any]
    name: str
    made_with: dict[str, str]
    timeout: float


def shard_name(number: int) -> str:
    """Return the name of a file of the dataset."""
    return f"part-{number:05d}.parquet"


def make_shard(job: ShardJob, number: int, told: Told | None = None) -> Shard:
    """Write a file of a batch, or take the one that is there; called in a worker.

    Parameters
    ----------
    job : ShardJob
    number : int
        Of the file.
    told : callable, optional

    Raises
    ------
    BatchError
        If the folder is not that of this batch, such as where a worker does not share the disk, or the library is
        another one here.
    FileError
        If the file cannot be written: the disk is full.
    """
    folder = Path(job.folder)
    if not belongs(folder, job.name):
        raise BatchError(f"{folder} is not the folder of this batch on this machine: use a disk that all workers share")
    if made_with() != job.made_with:
        raise BatchError(f"a worker has minsnap {made_with()} and not {job.made_with}: install the same on all workers")
    kept = kept_shard(folder, job.name, number)
    if kept is not None:
        return kept
    path, spec = folder / shard_name(number), read_mapping(job.content)
    notes = {"minsnap": job.made_with["version"], "batch": job.name, "shard": str(number)}
    _write(path, solving(spec, job.timeout).rows, spec.rows_of(number), notes, told)
    return read_shard(path, job.name, number)


def kept_shard(folder: Path, name: str, number: int) -> Shard | None:
    """Return what is known of a file that is finished and whole; None where it has to be made, or made anew.

    Its SHA-256 was written before it was moved to its place, and stands in the manifest later.

    Raises
    ------
    BatchError
        If a file of that name has no SHA-256, and is of another batch.
    """
    path, known = folder / shard_name(number), known_digest(folder, shard_name(number))
    try:
        if not path.exists() or (known is not None and file_digest(path) != known):
            return None
        shard = read_shard(path, name, number)
    except (FileError, OSError):
        return None
    return None if known is None else shard


def made_with() -> dict[str, str]:
    """Return what decides the bytes besides the specification: the version of the library, and which core plans."""
    return {"version": __version__, "core": "python" if core().library is None else "native"}


def _write(
    path: Path, rows_of: Callable[[range], Iterator[Any]], numbers: range, notes: dict[str, str], told: Told | None
) -> None:
    """Plan the problems of a file, one row group after the other."""
    tally = Tally()
    with atomic_write(path, "wb") as file:
        writer = parquet_writer(file, notes)
        for first in range(numbers.start, numbers.stop, GROUP_ROWS):
            table = _group(rows_of(range(first, min(first + GROUP_ROWS, numbers.stop))), told)
            tally.add(table)
            writer.write_table(table, row_group_size=GROUP_ROWS)
        writer.add_key_value_metadata({"tally": json.dumps(tally.plain(), sort_keys=True)})
        writer.close()
        file.flush()
        write_digest(path.parent, path.name, file_digest(file.name))


def _group(batches: Iterator[Any], told: Told | None) -> Any:
    """Join the rows of a group into one table."""
    import pyarrow

    parts = []
    for batch in batches:
        parts.append(batch)
        if told is not None:
            counts = batch.column("status").value_counts().to_pylist()
            told({entry["values"]: entry["counts"] for entry in counts})
    return pyarrow.Table.from_batches(parts, schema=schema()).combine_chunks()


def read_shard(path: Path, name: str, number: int) -> Shard:
    """Return what is known of a file that is there.

    Raises
    ------
    BatchError
        If it is another file than it should be.
    FileError
        If it cannot be read.
    """
    with reading(path, "a file of this batch"):
        digest = file_digest(path)
        with pyarrow_parquet().ParquetFile(path) as table:
            notes = {key.decode(): value.decode() for key, value in (table.metadata.metadata or {}).items()}
            rows = int(table.metadata.num_rows)
    if (notes.get("batch"), notes.get("shard")) != (name, str(number)):
        raise BatchError(f"{path} is not of this batch: move it away, and run the same command again")
    return Shard(number, rows, path.stat().st_size, digest, json.loads(notes["tally"]))
