"""Columns of text, as commands print them and reports return them: the same on a terminal, in a pipe and in a file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any


def aligned(rows: Sequence[Sequence[str]]) -> str:
    """Return rows of text as aligned columns: the first column left-aligned, the others right-aligned."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def labelled(lines: Iterable[tuple[str, Any]]) -> str:
    """Return one line for each label and its value."""
    return "\n".join(f"{label:<19} {value}" for label, value in lines)
