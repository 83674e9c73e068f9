"""The folder that a studio writes to: names from the page never lead out of it."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from minsnap.errors import FileError, MinsnapError

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}")
"""Names of files: letters, digits, blanks, dots, dashes; no separators, no leading dot."""


class WorkingFolder:
    """A folder with files of plain names.

    Parameters
    ----------
    path : str or path
        An existing folder.

    Raises
    ------
    FileError
        If it is none.
    """

    def __init__(self, path: str | os.PathLike[str] = ".") -> None:
        self.path = Path(os.path.realpath(path))
        if not self.path.is_dir():
            raise FileError(f"{path} is no folder: give one that exists")

    def destination(self, name: str, ending: str) -> Path:
        """Return where a file of this name is to be written.

        Parameters
        ----------
        name : str
            As typed; the ending is added if it is missing.
        ending : str
            Such as ``".csv"``.

        Raises
        ------
        FileError
            If the name could lead out of the folder: it has a separator, a leading dot or other characters than those
            of plain names, or is a link.
        """
        full = name if name.endswith(ending) else f"{name}{ending}"
        if not NAME.fullmatch(full):
            raise FileError(
                f"{name[:60]!r} is no name of a file in the working folder: use letters, digits, dots and dashes"
            )
        target = self.path / full
        if target.is_symlink() or (target.exists() and not target.is_file()):
            raise FileError(f"{full} in the working folder is a link or no file: choose another name")
        return target

    @contextmanager
    def scratch(self, ending: str, name: str = "") -> Iterator[Path]:
        """Yield the path of a file with that ending, in a folder of its own inside, which is removed afterwards.

        Errors say the name that the user knows instead.

        Raises
        ------
        FileError
            If nothing can be written here.
        """
        try:
            folder = TemporaryDirectory(prefix=".studio-", dir=self.path)
        except OSError as error:
            raise FileError(f"the working folder {self.path} cannot be written: {error.strerror}") from error
        with folder as place:
            path = Path(place) / (name if NAME.fullmatch(name) else f"file{ending}")
            try:
                yield path
            except MinsnapError as error:
                error.args = (f"{error}".replace(f"{path}", name or path.name), *error.args[1:])
                raise
