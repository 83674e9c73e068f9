"""The folder of a dataset: whose it is, who writes into it, what an earlier run left, and its manifest."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from minsnap.basics.messages import shown
from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.text import read_text
from minsnap.batch.spec import Spec
from minsnap.errors import BatchError, FileError

SPEC, MANIFEST, DATASHEET, DIGESTS = "_spec.json", "_manifest.json", "_datasheet", "_sha256"
"""Names that begin with an underscore are no data to whoever reads a folder of Parquet files."""


@contextmanager
def claimed(folder: Path, spec: Spec, made_with: dict[str, str], resume: bool) -> Iterator[None]:
    """Make a folder the one of a batch, or check that it is, and keep other runs out of it.

    Parameters
    ----------
    folder : Path
    spec : Spec
    made_with : dict
        What else decides the bytes: the version of the library and its core.
    resume : bool
        Whether a folder that was begun already is taken.

    Raises
    ------
    FileError
        If the folder is that of another batch, was begun by another version, must not be there yet, or holds other
        Parquet files.
    BatchError
        If another run writes into it.
    """
    began = {"name": spec.name(), "spec": spec.identity(), "made_with": made_with}
    _make(folder, resume)
    path = folder / SPEC
    if not path.exists():
        _refuse_foreign(folder)
        with atomic_write(path) as file:
            file.write(json.dumps(began, indent=1) + "\n")
    with _locked(path, folder):
        _compare(folder, _begun(path), began)
        for left in folder.glob(".*.part"):
            left.unlink(missing_ok=True)
        yield


def belongs(folder: Path, name: str) -> bool:
    """Whether a folder is that of a batch."""
    try:
        return bool(_begun(folder / SPEC)["name"] == name)
    except FileError:
        return False


def _make(folder: Path, resume: bool) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        taken = not resume and any(folder.iterdir())
    except OSError as error:
        raise FileError(f"{folder} is no folder that can be written to: {error.strerror}") from error
    if taken:
        raise FileError(f"{folder} is not empty: give a new folder, or leave out --no-resume")


def _refuse_foreign(folder: Path) -> None:
    other = next(folder.glob("*.parquet"), None)
    if other is not None:
        raise FileError(f"{folder} holds {other.name}, which no batch has written: give another folder")


@contextmanager
def _locked(path: Path, folder: Path) -> Iterator[None]:
    """Hold a lock that the system gives up when this process ends, however it ends."""
    import fcntl

    with open(path, "r+b") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise BatchError(f"another run writes into {folder}: wait for it, or end it") from None
        yield


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


def write_manifest(folder: Path, spec: Spec, made_with: dict[str, str], shards: Sequence[Any], counts: Any) -> None:
    """Write the manifest: its presence says that the dataset is complete."""
    files = [
        {"name": f"part-{s.number:05d}.parquet", "rows": s.rows, "bytes": s.size, "sha256": s.digest} for s in shards
    ]
    manifest = {"name": spec.name(), "spec": spec.identity(), "made_with": made_with, "rows": spec.count}
    with atomic_write(folder / MANIFEST) as file:
        file.write(json.dumps(manifest | {"statuses": counts, "files": files}, indent=1) + "\n")


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
    (folder / DIGESTS).mkdir(exist_ok=True)
    with atomic_write(folder / DIGESTS / f"{name}.sha256") as file:
        file.write(f"{digest}\n")


def file_digest(path: str | os.PathLike[str]) -> str:
    """Return the SHA-256 of a file."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


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
