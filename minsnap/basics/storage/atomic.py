"""Atomic writing of files: written to a temporary file in the same folder, then renamed."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from minsnap.basics.interrupts import ended_in_order
from minsnap.basics.messages import shown
from minsnap.basics.storage.text import STANDARD_INPUT, FileName
from minsnap.errors import FileError


@contextmanager
def atomic_write(path: FileName, mode: str = "w", *, clobber: bool = True, **options: Any) -> Iterator[IO[Any]]:
    """Open a file for writing that appears under its name only when it is complete.

    A temporary file in the same folder is opened; it is flushed to the disk and renamed when the block ends without an
    exception, and removed otherwise, so a partial file is never visible and after a failure an existing file is
    unchanged. A symbolic link is followed; a device or a pipe is written to directly.

    Parameters
    ----------
    path : str or path
        Destination.
    mode : str
        ``"w"`` for text (UTF-8, newlines as written) or ``"wb"`` for bytes.
    clobber : bool
        False: an existing destination is an error, checked before the block and again when publishing.
    **options
        Passed to :func:`open`.

    Yields
    ------
    file object

    Raises
    ------
    FileError
        If the destination exists and must not be replaced, is a folder, or its folder is missing or cannot be written.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> with atomic_write(folder / "a.txt") as file:
    ...     _ = file.write("whole")
    >>> (folder / "a.txt").read_text()
    'whole'
    """
    destination = check_destination(path, clobber=clobber)
    if "b" not in mode:
        options = {"encoding": "utf-8", "newline": ""} | options
    if destination.exists() and not destination.is_file():
        with _named(destination, destination), open(destination, mode, opener=_open_at_once, **options) as file:
            yield file
        return
    beside = destination.with_name(f".{secrets.token_hex(8)}.part")
    with ended_in_order(), _named(beside, destination):
        try:
            with open(beside, mode.replace("w", "x"), **options) as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            _publish(beside, destination, clobber)
        finally:
            beside.unlink(missing_ok=True)


def write_file(path: FileName, content: str | bytes, *, clobber: bool = True) -> None:
    """Write a text or bytes whole or not at all, as :func:`atomic_write` does."""
    with atomic_write(path, "w" if isinstance(content, str) else "wb", clobber=clobber) as file:
        file.write(content)


def make_folder(path: FileName) -> Path:
    """Return a folder, made with those that it is in where they are missing; raise FileError where it cannot be."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except (TypeError, ValueError):
        raise FileError(f"{shown(path)} is no name of a folder") from None
    except OSError as error:
        raise FileError(f"{path} is no folder that can be written to: {error.strerror}") from error
    return Path(path)


def check_folder(path: FileName) -> Path:
    """Return a folder that is there, or can be made, or raise FileError where none can be written to; none is made."""
    place = Path(os.path.realpath(path))
    try:
        os.stat(place)
    except FileNotFoundError:
        pass
    except OSError as error:
        raise FileError(f"{path} is no folder that can be written to: {error.strerror}") from error
    there = next(each for each in (place, *place.parents) if each.exists())
    if not there.is_dir():
        raise FileError(f"{path} is a file: give the name of a folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise FileError(f"{path} is no folder that can be written to: {there} is read-only")
    return place


def check_destination(path: FileName, *, clobber: bool = True) -> Path:
    """Return the file that a name refers to, with links resolved.

    Raises
    ------
    FileError
        If it is no name of a file, a folder, in none, read-only, in a folder that is, or there and must not be
        replaced.
    """
    if str(path) == str(STANDARD_INPUT):  # what is read is the standard input, and not a file of this name
        raise FileError("- is no file here: give the name of one")
    try:
        destination = Path(os.path.realpath(path))
        state = os.stat(destination)
    except (TypeError, ValueError):
        raise FileError(f"{shown(path)} is no name of a file") from None
    except OSError as error:
        missing = isinstance(error, FileNotFoundError)
        if missing and not destination.parent.exists():
            raise FileError(
                f"{path} cannot be written: there is no folder {destination.parent}; make it first"
            ) from error
        if not missing or not destination.parent.is_dir():
            raise FileError(f"{path} cannot be written: {error.strerror}") from error
        return _in_writable_folder(path, destination)
    if stat.S_ISDIR(state.st_mode):
        raise FileError(f"{path} is a folder: give the name of a file")
    if not clobber:
        raise _taken(Path(path))
    if not state.st_mode & 0o222:
        raise FileError(f"{path} is read-only: choose another name, or make it writable")
    return _in_writable_folder(path, destination) if stat.S_ISREG(state.st_mode) else destination


def _in_writable_folder(path: FileName, destination: Path) -> Path:
    """Return a file, in whose folder a temporary one is made, or raise FileError where none can be."""
    if not os.access(destination.parent, os.W_OK | os.X_OK):
        raise FileError(f"{path} cannot be written: its folder is read-only")
    return destination


def refuse_source(path: FileName | None, *sources: FileName | None) -> None:
    """Raise FileError if a file to write is one of those that are read, under another name too; None is no file."""
    for source in sources:
        if path is None or source is None or not Path(path).is_file():
            continue
        if Path(source).exists() and os.path.samefile(path, source):
            raise FileError(f"{path} is the file that is read: choose another name")


def _open_at_once(path: str, flags: int) -> int:
    """Open a device or a pipe, or raise FileError where nobody reads the pipe, instead of waiting for a reader."""
    try:
        opened = os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
    except OSError as error:
        if error.errno == errno.ENXIO:
            raise FileError(f"{path} is a pipe that nobody reads: begin to read it first") from None
        raise
    os.set_blocking(opened, True)
    return opened


@contextmanager
def _named(beside: Path, destination: Path) -> Iterator[None]:
    """Report system errors with the requested name instead of the temporary one."""
    try:
        yield
    except BrokenPipeError:  # its reader has gone, which is no fault of the file
        raise
    except OSError as error:
        if error.filename not in (None, str(beside)):
            raise
        raise FileError(f"{destination} cannot be written: {error.strerror or error}") from error


def _publish(beside: Path, destination: Path, clobber: bool) -> None:
    if clobber:
        if destination.exists():
            shutil.copymode(destination, beside)
        os.replace(beside, destination)
        return
    try:
        os.link(beside, destination)  # unlike a rename, fails if the name exists by now
    except FileExistsError:
        raise _taken(destination) from None


def _taken(destination: Path) -> FileError:
    return FileError(f"{destination} is there already: choose another name, or allow it to be replaced")
