"""Checks before a file is read: its name and size; and one exception type for all errors of a reader."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from typing import Any

from minsnap.basics.checks import is_number
from minsnap.basics.messages import shown
from minsnap.errors import FileError, MinsnapError

LARGEST = 1 << 30
"""Bytes of the largest file that is read."""


@contextmanager
def reading(path: str | os.PathLike[str], what: str) -> Iterator[None]:
    """Convert any exception of a file reader to a FileError that names the file.

    Parameters
    ----------
    path : str or path
        The file that is read in the block.
    what : str
        What it should be, for the message: ``"a NumPy archive of numbers"``.

    Raises
    ------
    FileError
        In place of any exception of the block but ImportError, which says that a library is missing.
    """
    check_regular(path)
    try:
        yield
    except (FileError, ImportError):
        raise
    except MinsnapError as error:
        raise FileError(f"{path}: {error}") from error
    except OSError as error:
        raise FileError(f"{path} cannot be read: {error.strerror or error}") from error
    except Exception as error:
        raise FileError(f"{path} is not {what}") from error


def check_regular(path: str | os.PathLike[str]) -> None:
    """Raise FileError for a device, a pipe or a socket, which may have no end; what is not there is said on opening."""
    if not isinstance(path, (str, os.PathLike)):
        return
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return
    if not (S_ISREG(mode) or S_ISDIR(mode)):
        raise FileError(f"{path} is no regular file but a device, a pipe or a socket: give a file")


def check_size(path: str | os.PathLike[str], largest: int = LARGEST) -> int:
    """Return the size of a file in bytes.

    Raises
    ------
    FileError
        If there is no such file, it is no regular one, or it is larger than is read.
    """
    check_regular(path)
    try:
        size = Path(path).stat().st_size
    except OSError as error:
        raise FileError(f"{path} cannot be read: {error.strerror}") from error
    except (TypeError, ValueError, OverflowError):
        raise FileError(f"{shown(path)} is no name of a file") from None
    if size > largest:
        raise FileError(f"{path} has {size / 1e6:.0f} MB: files of this kind are read up to {largest / 1e6:.0f} MB")
    return size


def finite_number(where: str, value: Any) -> float:
    """Return a finite number of a file as a float, or raise FileError, which says where it is."""
    if not is_number(value):
        raise FileError(f"{where} is {shown(value)}, not a finite number")
    return float(value)
