"""Text and YAML files, read whole, with failures in one sentence."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from minsnap.errors import FileError


def read_text(path: str | os.PathLike[str]) -> str:
    """Return a UTF-8 file's text, with or without a byte-order mark.

    Raises
    ------
    FileError
        If there is no such file, it cannot be read, or it is not text.
    """
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise FileError(f"{path} cannot be read: {error.strerror}") from error
    except UnicodeDecodeError:
        raise FileError(f"{path} is not a text file") from None


def load_yaml(path: str | os.PathLike[str]) -> Any:
    """Return the content of a YAML file, loaded safely: numbers, text, lists and mappings, never other objects.

    Raises
    ------
    FileError
        If the file cannot be read or is not YAML; says which line.
    ImportError
        If PyYAML is not there.
    """
    try:
        import yaml
    except ImportError as error:
        raise ImportError("reading YAML needs PyYAML: pip install minsnap[yaml]") from error
    text = read_text(path)
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        line = getattr(getattr(error, "problem_mark", None), "line", None)
        where = f"{path}, line {line + 1}" if line is not None else f"{path}"
        raise FileError(f"{where}: {getattr(error, 'problem', None) or 'this is not YAML'}") from None
