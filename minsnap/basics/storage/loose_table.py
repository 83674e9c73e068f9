"""Tables of numbers as people and programs write them: any usual separator, comments, a header or none."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.table import cell_number, is_finite_number
from minsnap.basics.storage.text import read_text
from minsnap.errors import FileError

SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas"}
"""What may stand between two cells, beside spaces; the first one in a file counts."""

_UNIT = re.compile(r"^(?P<name>[^\[\(]*?)\s*(?:[\[\(](?P<unit>[^\]\)]*)[\]\)])?$")


@dataclass(frozen=True)
class LooseColumns:
    """What a table may hold.

    Parameters
    ----------
    known : mapping of str to sequence of str
        Names of columns, in lower case, with the units that may stand behind them in brackets.
    blank : sequence of str
        Columns whose cells may be empty: they read as not-a-number.
    headerless : sequence of sequence of str
        Columns of a table without a header, for each number of them that is not ambiguous.
    ambiguous : str
        What a table of another number of columns could be, for the message.
    """

    known: Mapping[str, Sequence[str]]
    blank: Sequence[str]
    headerless: Sequence[Sequence[str]]
    ambiguous: str


@dataclass(frozen=True)
class _Line:
    number: int
    text: str


def read_loose_table(
    path: str | os.PathLike[str], columns: LooseColumns
) -> tuple[dict[str, FloatArray], dict[str, str]]:
    """Read a table with commas, semicolons, tabs or spaces between the cells.

    Empty lines and what follows a ``#`` are left out, but for a comment in the first line that names the columns, as
    :func:`numpy.savetxt` writes it. Names of columns may be in capitals, and have a unit in brackets.

    Returns
    -------
    columns : dict of str to ndarray, shape (rows,)
        In the order of the file, by their names in lower case.
    units : dict of str to str
        Of the columns that say one.

    Raises
    ------
    FileError
        If the file is missing, empty, ragged, not numeric, not finite, or ambiguous; says which line.
    """
    raw = read_text(path).splitlines()
    lines = [_Line(i, text.split("#")[0].rstrip(" \r")) for i, text in enumerate(raw, 1)]
    lines = [line for line in lines if line.text.strip()]
    named = _named_by_comment(raw, columns)
    if not lines:
        raise FileError(f"{path} has a header and no rows" if named else f"{path} is empty")
    separator = _separator(path, lines)
    cells = [_cells(line.text, separator) for line in lines]
    names, units, first = named or _names(path, lines[0], cells[0], columns)
    if first == len(cells):
        raise FileError(f"{path} has a header and no rows")
    rows = [
        _row(f"{path}, line {line.number}", row, names, columns.blank)
        for line, row in zip(lines[first:], cells[first:], strict=True)
    ]
    return dict(zip(names, np.array(rows, dtype=np.float64).T, strict=True)), units


def _named_by_comment(raw: list[str], columns: LooseColumns) -> tuple[list[str], dict[str, str], int] | None:
    """Return the names that the comment in the first line gives, if all its words are names of columns."""
    if not raw or not raw[0].lstrip().startswith("#"):
        return None
    text = raw[0].lstrip().lstrip("#")
    words = [word for word in re.split(r"[;,\t ]+", text.strip()) if word]
    names = [_UNIT.match(word.strip("\"'").lower()) for word in words]
    titles = [match["name"] for match in names if match]
    if len(titles) < 2 or any(name not in columns.known for name in titles) or len(set(titles)) < len(titles):
        return None
    return titles, {}, 0


def _separator(path: str | os.PathLike[str], lines: list[_Line]) -> str | None:
    """Return the separator of the cells; None for spaces."""
    text = "\n".join(line.text for line in lines)
    present = [separator for separator in SEPARATORS if separator in text]
    if len(present) > 1:
        line = next(line for line in lines if present[1] in line.text)
        raise FileError(
            f"{path}, line {line.number}: {SEPARATORS[present[0]]} and {SEPARATORS[present[1]]} are mixed: "
            "use one of them between the numbers, and a point for decimals"
        )
    return present[0] if present else None


def _cells(text: str, separator: str | None) -> list[str]:
    cells = text.split(separator)
    return [cell.strip().strip("\"'").strip() for cell in cells]


def _names(
    path: str | os.PathLike[str], line: _Line, cells: list[str], columns: LooseColumns
) -> tuple[list[str], dict[str, str], int]:
    """Return names and units of the columns, and the number of header lines."""
    where = f"{path}, line {line.number}"
    if all(is_finite_number(cell) for cell in cells):
        fitting = [list(names) for names in columns.headerless if len(names) == len(cells)]
        if not fitting:
            count = "1 number" if len(cells) == 1 else f"{len(cells)} numbers"
            raise FileError(f"{where}: {count} without a header{columns.ambiguous}")
        return fitting[0], {}, 0
    if all(is_finite_number(cell) for cell in cells[:2]):
        wrong = next(cell for cell in cells if not is_finite_number(cell))
        raise FileError(f"{where}: {wrong[:40]!r} is not a finite number")
    matches = [_UNIT.match(cell.lower()) for cell in _joined(cells)]
    names = [match["name"].strip() if match else "" for match in matches]
    _check_names(where, names, columns)
    units = {name: match["unit"].strip() for name, match in zip(names, matches, strict=True) if match and match["unit"]}
    for name, unit in units.items():
        if unit not in columns.known[name]:
            wanted = " or ".join(columns.known[name])
            raise FileError(f"{where}: {name} is in {unit[:40]!r}: convert it to {wanted}")
    return names, units, 1


def _joined(cells: list[str]) -> list[str]:
    """Return the cells of a header with units that stand apart, as in ``x [m] y [m]``, joined to their names."""
    entries: list[str] = []
    for cell in cells:
        if entries and cell[:1] in "[(" and cell:
            entries[-1] += cell
        else:
            entries.append(cell)
    return entries


def _check_names(where: str, names: list[str], columns: LooseColumns) -> None:
    for name in names:
        if name not in columns.known:
            known = ",".join(columns.known)
            hint = "; setpoints are planned already" if {"vx", "ax"} & set(names) else ""
            raise FileError(f"{where}: column {name[:40]!r} is not known; the columns are {known}{hint}")
        if names.count(name) > 1:
            raise FileError(f"{where}: column {name} is there twice")


def _row(where: str, cells: list[str], names: list[str], blank: Sequence[str]) -> list[float]:
    if len(cells) != len(names):
        count = "1 number" if len(cells) == 1 else f"{len(cells)} numbers"
        raise FileError(f"{where}: {count}, but there are {len(names)} columns")
    return [_cell(where, name, cell, name in blank) for name, cell in zip(names, cells, strict=True)]


def _cell(where: str, name: str, cell: str, may_be_blank: bool) -> float:
    if may_be_blank and not cell:
        return math.nan
    return cell_number(where, name, cell)
