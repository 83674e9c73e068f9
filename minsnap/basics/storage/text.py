"""Reading of text and YAML files: name and size are checked first, and all errors of a reader have one type."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from typing import Any

from minsnap.basics.messages import shown
from minsnap.errors import FileError, MinsnapError

FileName = str | os.PathLike[str]
"""A path of a file, as text or as what stands for one."""

LARGEST = 1 << 30
"""Bytes of the largest file that is read."""


@contextmanager
def reading(path: FileName, what: str, largest: int | None = None) -> Iterator[None]:
    """Convert any exception of a file reader to a FileError that names the file.

    Parameters
    ----------
    path : str or path
        The file that is read in the block.
    what : str
        What it should be, for the message: ``"a NumPy archive of numbers"``.
    largest : int or None
        Bytes up to which it is read; None of what may be no file, or of any size.

    Raises
    ------
    FileError
        In place of any exception of the block but ImportError, which says that a library is missing.
    """
    if largest is not None:
        check_size(path, largest)
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


def name_as_text(name: FileName) -> str:
    """Return a name for figures and pages, which hold text alone: bytes of it that are no text become ``\ufffd``."""
    return os.fsencode(name).decode(errors="replace")


def check_regular(path: FileName) -> None:
    """Raise FileError for a device, a pipe or a socket, which may have no end; what is not there is said on opening."""
    if not isinstance(path, (str, os.PathLike)):
        return
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return
    if not (S_ISREG(mode) or S_ISDIR(mode)):
        raise FileError(f"{path} is no regular file but a device, a pipe or a socket: give a file")


def check_size(path: FileName, largest: int = LARGEST) -> int:
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


def read_bytes(path: FileName, largest: int = LARGEST) -> bytes:
    """Read a whole file.

    Raises
    ------
    FileError
        If it cannot be read, or is too large.
    """
    with reading(path, "a file", largest):
        return Path(path).read_bytes()


BEGINNING = 4096
"""Bytes of a file that say what it is."""


def beginning(path: FileName) -> str:
    """Return how a file begins, as text whatever it is; nothing where no file is, or a pipe, which would be waited for.

    Raises
    ------
    FileError
        If it is a device, a pipe or a socket.
    """
    check_regular(path)
    try:
        if not Path(path).is_file():
            return ""
        with open(path, "rb") as file:
            return file.read(BEGINNING).decode("utf-8", "replace")
    except (OSError, ValueError, TypeError):
        return ""


def digest_of(path: FileName) -> str:
    """Return the SHA-256 of a file, as 64 hexadecimal digits."""
    total = hashlib.sha256()
    with reading(path, "a file"), open(path, "rb") as file:
        while part := file.read(1 << 20):
            total.update(part)
    return total.hexdigest()


LARGEST_YAML = 32_000_000
"""Bytes of the largest YAML file that is read."""

STANDARD_INPUT = Path("-")
"""What stands for the standard input in place of a file's name."""

DEEPEST = 32
"""Levels of nesting up to which YAML is read."""


def read_text(path: FileName, largest: int = LARGEST) -> str:
    """Return a UTF-8 file's text, with or without a byte-order mark; ``-`` is the standard input.

    Raises
    ------
    FileError
        If there is no such file, it cannot be read, is larger than ``largest`` bytes, or is not text.
    """
    if str(path) == str(STANDARD_INPUT):
        return _standard_input()
    with reading(path, "a text file", largest):
        return Path(path).read_text(encoding="utf-8-sig")


@cache
def _standard_input() -> str:
    """Return the text of standard input; it is read once, and later calls return the same."""
    with reading(STANDARD_INPUT, "text"):
        content = sys.stdin.buffer.read(LARGEST_YAML + 1)
        if len(content) > LARGEST_YAML:
            raise FileError(f"the standard input has more than {LARGEST_YAML / 1e6:.0f} MB: give a file")
        return content.decode("utf-8-sig")


def load_yaml(path: FileName) -> Any:
    """Return the content of a YAML file, loaded safely: numbers, text, lists and mappings only.

    Numbers are those of YAML 1.2: ``1:30`` and ``yes`` are text. Aliases, duplicate keys, and deep nesting are refused.

    Raises
    ------
    FileError
        If the file cannot be read, is not YAML, or is one that is refused; says which line.
    """
    import yaml

    text = read_text(path, LARGEST_YAML)
    with reading(path, "YAML"):
        try:
            return yaml.load(text, Loader=_loader())
        except yaml.YAMLError as error:
            line = getattr(getattr(error, "problem_mark", None), "line", None)
            where = f"{path}, line {line + 1}" if line is not None else f"{path}"
            raise FileError(f"{where}: {getattr(error, 'problem', None) or 'this is not YAML'}") from None


@cache
def _loader() -> Any:
    """Make PyYAML's safe loader strict."""
    import re

    import yaml

    def problem(what: str, node: Any) -> Exception:
        return yaml.composer.ComposerError(None, None, what, node.start_mark)

    class StrictLoader(yaml.SafeLoader):
        yaml_implicit_resolvers: dict[str, Any] = {}
        depth = 0

        def compose_node(self, parent: Any, index: Any) -> Any:
            event = self.peek_event()  # type: ignore[no-untyped-call]
            if isinstance(event, yaml.AliasEvent):
                raise problem("aliases are not read: write the values out", event)
            if self.depth >= DEEPEST:
                raise problem(f"more than {DEEPEST} levels of nesting", event)
            self.depth += 1
            node = super().compose_node(parent, index)
            self.depth -= 1
            return node

        def construct_mapping(self, node: Any, deep: bool = False) -> Any:
            seen = set()
            for key, _ in node.value:
                if key.value in seen:
                    raise problem(f"{str(key.value)[:40]!r} is there twice", key)
                if isinstance(key, yaml.ScalarNode):
                    seen.add(key.value)
            return super().construct_mapping(node, deep)

        def construct_yaml_int(self, node: Any) -> Any:
            return float(node.value) if len(node.value) > 18 else int(node.value)

    patterns = {
        "null": (r"~|null|Null|NULL|", ["~", "n", "N", ""]),
        "bool": (r"true|True|TRUE|false|False|FALSE", list("tTfF")),
        "int": (r"[-+]?[0-9]+", list("-+0123456789")),
        "float": (
            r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
            list("-+0123456789."),
        ),
    }
    for name, (pattern, first) in patterns.items():
        StrictLoader.add_implicit_resolver(f"tag:yaml.org,2002:{name}", re.compile(f"^(?:{pattern})$"), first)
    StrictLoader.add_constructor("tag:yaml.org,2002:int", StrictLoader.construct_yaml_int)
    return StrictLoader
