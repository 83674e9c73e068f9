"""Reading of text and YAML files."""

from __future__ import annotations

import os
import sys
from functools import cache
from pathlib import Path
from typing import Any

from minsnap.basics.storage.reading import LARGEST, check_size, reading
from minsnap.errors import FileError

LARGEST_YAML = 32_000_000
"""Bytes of the largest YAML file that is read."""

STANDARD_INPUT = Path("-")
"""What stands for the standard input in place of a file's name."""

DEEPEST = 32
"""Levels of nesting up to which YAML is read."""


def read_text(path: str | os.PathLike[str], largest: int = LARGEST) -> str:
    """Return a UTF-8 file's text, with or without a byte-order mark; ``-`` is the standard input.

    Raises
    ------
    FileError
        If there is no such file, it cannot be read, is larger than ``largest`` bytes, or is not text.
    """
    if str(path) == str(STANDARD_INPUT):
        return _standard_input()
    check_size(path, largest)
    with reading(path, "a text file"):
        return Path(path).read_text(encoding="utf-8-sig")


@cache
def _standard_input() -> str:
    """Return the text of standard input; it is read once, and later calls return the same."""
    with reading(STANDARD_INPUT, "text"):
        content = sys.stdin.buffer.read(LARGEST_YAML + 1)
        if len(content) > LARGEST_YAML:
            raise FileError(f"the standard input has more than {LARGEST_YAML / 1e6:.0f} MB: give a file")
        return content.decode("utf-8-sig")


def load_yaml(path: str | os.PathLike[str]) -> Any:
    """Return the content of a YAML file, loaded safely: numbers, text, lists and mappings only.

    Numbers are those of YAML 1.2: ``1:30`` and ``yes`` are text. Aliases, duplicate keys, and deep nesting are refused.

    Raises
    ------
    FileError
        If the file cannot be read, is not YAML, or is one that is refused; says which line.
    """
    import yaml

    text = read_text(path, LARGEST_YAML)
    try:
        with reading(path, "YAML"):
            return parse_yaml(text)
    except FileError as error:
        cause = error.__cause__
        if not isinstance(cause, yaml.YAMLError):
            raise
        line = getattr(getattr(cause, "problem_mark", None), "line", None)
        where = f"{path}, line {line + 1}" if line is not None else f"{path}"
        raise FileError(f"{where}: {getattr(cause, 'problem', None) or 'this is not YAML'}") from None


def parse_yaml(text: str) -> Any:
    """Return the content of YAML text, as :func:`load_yaml` does; errors are PyYAML's."""
    import yaml

    return yaml.load(text, Loader=_loader())


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
            if len(node.value) > 18:
                return float(node.value)
            return int(node.value)

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
