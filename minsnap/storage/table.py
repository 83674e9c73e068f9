"""Strict reading of number tables in comma-separated text; an error names the line and the reason."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from itertools import chain

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.errors import FileError
from minsnap.storage.text import read_text


def read_table(
    path: str | os.PathLike[str],
    required: Sequence[str],
    optional: Sequence[str] = (),
    may_be_blank: Sequence[str] = (),
    headerless: Sequence[str] = (),
) -> dict[str, FloatArray]:
    """Read the columns of a comma-separated file whose first line names them, in any order.

    Parameters
    ----------
    path : str or path
        The file.
    required, optional : sequence of str
        Names of the columns that must and may be there; no other may.
    may_be_blank : sequence of str
        Columns whose cells may be empty: they read as not-a-number.
    headerless : sequence of str
        The columns, in order, of a file that starts with numbers at once; it may have the first few only.

    Returns
    -------
    dict of str to ndarray, shape (rows,)
        One array a column, in the order of the file.

    Raises
    ------
    FileError
        If the file is missing, empty, ragged, not numeric, not finite, or has other columns; says which line.
    """
    lines = read_text(path).rstrip().splitlines()
    if not lines:
        raise FileError(f"{path} is empty")
    names, first = _header(path, lines[0], headerless)
    _check_names(path, names, required, optional)
    rows = [_row(path, number, line, names, may_be_blank) for number, line in enumerate(lines[first:], first + 1)]
    if not rows:
        raise FileError(f"{path} has a header and no rows")
    values = np.fromiter(chain.from_iterable(rows), dtype=np.float64, count=len(rows) * len(names))
    return dict(zip(names, values.reshape(len(rows), len(names)).T, strict=True))


def _header(path: str | os.PathLike[str], line: str, headerless: Sequence[str]) -> tuple[list[str], int]:
    """Return the names of the columns and the number of header lines."""
    cells = [cell.strip() for cell in line.split(",")]
    if not headerless or not all(_is_number(cell) for cell in cells):
        return cells, 1
    if len(cells) > len(headerless):
        wanted = ",".join(headerless)
        raise FileError(f"{path}, line 1: {len(cells)} numbers without a header; name the columns, or give {wanted}")
    return list(headerless[: len(cells)]), 0


def _check_names(
    path: str | os.PathLike[str], names: list[str], required: Sequence[str], optional: Sequence[str]
) -> None:
    missing = [name for name in required if name not in names]
    if missing:
        raise FileError(f"{path}, line 1: no column {', '.join(missing)}; the header reads {','.join(names)[:80]!r}")
    for name in names:
        if name not in required and name not in optional:
            known = ",".join([*required, *optional])
            raise FileError(f"{path}, line 1: column {name[:40]!r} is not known; the columns are {known}")
        if names.count(name) > 1:
            raise FileError(f"{path}, line 1: column {name} is there twice")


def _row(path: str | os.PathLike[str], number: int, line: str, names: list[str], blank: Sequence[str]) -> list[float]:
    cells = line.split(",")
    if len(cells) != len(names):
        raise FileError(f"{path}, line {number}: {_count(line, cells)}, but there are {len(names)} columns")
    try:
        values = list(map(float, cells))
    except ValueError:
        values = [math.nan]
    if "_" not in line and all(map(math.isfinite, values)):
        return values
    where = f"{path}, line {number}"
    return [_cell(where, name, cell.strip(), name in blank) for name, cell in zip(names, cells, strict=True)]


def _cell(where: str, name: str, cell: str, may_be_blank: bool) -> float:
    """Return the number in a cell, or raise an error that says what is wrong."""
    if may_be_blank and not cell:
        return math.nan
    if not _is_number(cell):
        raise FileError(f"{where}: {name} is {cell[:40]!r}, not a finite number")
    return float(cell)


def _count(line: str, cells: list[str]) -> str:
    if not line.strip():
        return "it is empty"
    return "1 number" if len(cells) == 1 else f"{len(cells)} numbers"


def _is_number(cell: str) -> bool:
    try:
        return "_" not in cell and math.isfinite(float(cell))
    except ValueError:
        return False
