"""The folder of a batch and the files in it."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

from minsnap.basics.messages import shown
from minsnap.basics.storage.atomic import atomic_write, make_folder, write_file
from minsnap.basics.storage.text import digest_of, read_text, reading
from minsnap.basics.version import __version__
from minsnap.batch.columns import Tally, parquet_writer, schema
from minsnap.batch.solving import solving
from minsnap.batch.spec import Spec, pyarrow_parquet
from minsnap.errors import BatchError, FileError
from minsnap.native import core

SPEC, MANIFEST, DATASHEET, DIGESTS = "_spec.json", "_manifest.json", "_datasheet", "_sha256"
DATA = "[!._]*.parquet"
"""Names that begin with an underscore or a dot are no data to whoever reads a folder of Parquet files."""

EPISODES = "meta/info.json"
"""What marks a folder of episodes."""


GROUP_ROWS = 1024
"""Rows of a row group, which are in memory at once."""

Told = Callable[[Mapping[str, int]], None]
"""Called with the number of new rows by status."""


def made_with() -> dict[str, str]:
    """Return what decides the bytes besides the specification: the version of the library, and which core plans."""
    return {"version": __version__, "core": "python" if core().library is None else "native"}


@contextmanager
def claimed(folder: Path, spec: Spec, resume: bool) -> Iterator[None]:
    """Make a folder the one of a batch, or check that it is, and keep other runs out of it.

    Parameters
    ----------
    folder : Path
    spec : Spec
    resume : bool
        Whether a folder that was begun already is taken.

    Raises
    ------
    FileError
        If the folder is that of another batch, was begun by another version, must not be there yet, holds other
        Parquet files or episodes, or cannot be written to.
    BatchError
        If another run writes into it.
    """
    began = {"name": spec.name(), "spec": spec.identity(), "made_with": made_with()}
    refuse_mixed(folder, EPISODES)
    make_folder(folder)
    with reading(folder, "a folder"):
        taken = not resume and any(folder.iterdir())
    if taken:
        raise FileError(f"{folder} is not empty: give a new folder, or leave out --no-resume")
    path, other = folder / SPEC, next(folder.glob(DATA), None)
    if other is not None and not path.exists():
        raise FileError(f"{folder} holds {other.name}, which no batch has written: give another folder")
    with _locked(path, folder) as file:
        if other is None and not path.stat().st_size:  # a file moved to its place has no lock
            _begin(file, json.dumps(began, indent=1) + "\n")
        _compare(folder, _begun(path), began)
        _refuse_strays(folder, spec)
        _remove_parts(folder)
        try:
            yield
        finally:
            _remove_parts(folder)


def refuse_mixed(folder: Path, mark: str) -> None:
    """Raise FileError where a folder has the file that marks a dataset of another format."""
    if (folder / mark).exists():
        raise FileError(f"{folder} holds a dataset of another format ({mark}): give another folder")


def _refuse_strays(folder: Path, spec: Spec) -> None:
    """Raise FileError where whoever reads the folder would take a file for data that is none of the batch."""
    strays = {path.name for path in folder.glob(DATA)} - set(map(shard_name, range(spec.shards)))
    if strays:
        raise FileError(f"{folder} holds {min(strays)}, which is no file of this batch: move it away")


def _remove_parts(folder: Path) -> None:
    """Remove what is left of files whose writers were killed."""
    for left in folder.rglob(".*.part"):
        left.unlink(missing_ok=True)


def belongs(folder: Path, name: str) -> bool:
    """Whether a folder is that of a batch."""
    try:
        return bool(_begun(folder / SPEC)["name"] == name)
    except FileError:
        return False


def _begin(file: BinaryIO, text: str) -> None:
    """Write what a folder is begun with, or leave the file empty."""
    try:
        file.write(text.encode())
        os.fsync(file.fileno())
    except OSError as error:
        file.truncate(0)
        raise FileError(f"{file.name} cannot be written: {error.strerror}") from error


@contextmanager
def _locked(path: Path, folder: Path) -> Iterator[BinaryIO]:
    """Hold a lock that the system gives up when this process ends, however it ends."""
    import fcntl

    try:
        opened = open(path, "a+b", buffering=0)  # noqa: SIM115
    except OSError as error:
        raise FileError(f"{folder} is no folder that can be written to: {error.strerror}") from error
    with opened as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise BatchError(f"another run writes into {folder}: wait for it, or end it") from None
        yield file


def _compare(folder: Path, known: Any, began: dict[str, Any]) -> None:
    """Refuse to go on with other problems, or with code that may give other bits."""
    for key in sorted(known["spec"].keys() | began["spec"].keys()):
        old, new = known["spec"].get(key), began["spec"].get(key)
        if old != new:
            raise FileError(f"{folder} was begun with {key}: {_told(old)}, not {_told(new)}: give another folder")
    for key, new in began["made_with"].items():
        if known["made_with"].get(key) != new:
            raise FileError(
                f"{folder} was begun with {key} {known['made_with'].get(key)}, this is {new}: the same problems may "
                f"give other last digits, so give another folder"
            )


def _told(value: Any) -> str:
    return "nothing" if value is None else shown(value)


def write_manifest(folder: Path, spec: Spec, shards: Sequence[Any], counts: Any) -> None:
    """Write the manifest: its presence says that the dataset is complete."""
    files = [{"name": shard_name(s.number), "rows": s.rows, "bytes": s.size, "sha256": s.digest} for s in shards]
    manifest = {"name": spec.name(), "spec": spec.identity(), "made_with": made_with(), "rows": spec.count}
    write_file(folder / MANIFEST, json.dumps(manifest | {"statuses": counts, "files": files}, indent=1) + "\n")


def is_complete(folder: Path, spec: Spec, shards: Sequence[Any]) -> bool:
    """Whether the manifest is there and names every file with its SHA-256."""
    digests = _manifest_digests(folder)
    return len(shards) == len(digests) == spec.shards and {s.digest for s in shards} == set(digests.values())


def known_digest(folder: Path, name: str) -> str | None:
    """Return the SHA-256 that a file had when it was finished; None where that is not known."""
    try:
        return read_text(folder / DIGESTS / f"{name}.sha256").strip()
    except FileError:
        return _manifest_digests(folder).get(name)


def write_digest(folder: Path, name: str, digest: str) -> None:
    """Note the SHA-256 of a file that is about to be moved to its place."""
    write_file(make_folder(folder / DIGESTS) / f"{name}.sha256", f"{digest}\n")


def _manifest_digests(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of every file that the manifest names; none where it is missing or damaged."""
    try:
        return {str(entry["name"]): str(entry["sha256"]) for entry in json.loads(read_text(folder / MANIFEST))["files"]}
    except (FileError, ValueError, KeyError, TypeError):
        return {}


def _begun(path: Path) -> dict[str, Any]:
    """Return the specification that a folder was begun with.

    Raises
    ------
    FileError
        If it is damaged.
    """
    try:
        known = json.loads(read_text(path))
        if isinstance(known["name"], str) and isinstance(known["spec"], dict) and isinstance(known["made_with"], dict):
            return dict(known)
    except (ValueError, KeyError, TypeError):
        pass
    raise FileError(f"{path} is damaged, so that it is not known what this folder was begun with: give another folder")


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
    folder : Path
        Absolute.
    spec : Spec
    timeout : float
        Seconds of processor time that a problem may take.
    made_with : dict of str to str
        What the function of this name returns where the run was started.
    """

    folder: Path
    spec: Spec
    timeout: float
    made_with: dict[str, str] = field(default_factory=made_with)


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
    folder, spec, name = job.folder, job.spec, job.spec.name()
    if not belongs(folder, name):
        raise BatchError(f"{folder} is not the folder of this batch on this machine: use a disk that all workers share")
    if made_with() != job.made_with:
        raise BatchError(f"a worker has minsnap {made_with()} and not {job.made_with}: install the same on all workers")
    kept = kept_shard(folder, name, number)
    if kept is not None:
        return kept
    path = folder / shard_name(number)
    notes = {"minsnap": job.made_with["version"], "batch": name, "shard": str(number)}
    _write(path, solving(spec, job.timeout).rows, spec.rows_of(number), notes, told)
    return read_shard(path, name, number)


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
        if not path.exists() or (known is not None and digest_of(path) != known):
            return None
        shard = read_shard(path, name, number)
    except (FileError, OSError):
        return None
    return None if known is None else shard


def _write(
    path: Path, rows_of: Callable[[range], Iterator[Any]], numbers: range, notes: dict[str, str], told: Told | None
) -> None:
    """Plan the problems of a file, one row group after the other."""
    tally = Tally()
    with atomic_write(path, "wb") as file:
        with parquet_writer(file, notes) as writer:
            for first in range(0, len(numbers), GROUP_ROWS):
                table = _group(rows_of(numbers[first : first + GROUP_ROWS]), told)
                tally.add(table)
                writer.write_table(table, row_group_size=GROUP_ROWS)
            writer.add_key_value_metadata({"tally": json.dumps(tally.plain(), sort_keys=True)})
        file.flush()
        write_digest(path.parent, path.name, digest_of(file.name))


def _group(batches: Iterator[Any], told: Told | None) -> Any:
    """Join the rows of a group into one table."""
    import pyarrow

    parts = []
    for batch in batches:
        parts.append(batch)
        if told is not None:
            told(Counter(batch.column("status").to_pylist()))
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
        digest = digest_of(path)
        with open(path, "rb") as file, pyarrow_parquet().ParquetFile(file) as table:
            notes = {key.decode(): value.decode() for key, value in (table.metadata.metadata or {}).items()}
            rows = int(table.metadata.num_rows)
    if (notes.get("batch"), notes.get("shard")) != (name, str(number)):
        raise BatchError(f"{path} is not of this batch: move it away, and run the same command again")
    return Shard(number, rows, path.stat().st_size, digest, json.loads(notes["tally"]))
