"""Strict reading of number tables in comma-separated text; an error names the line and the reason."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from itertools import chain

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.text import read_text
from minsnap.errors import FileError


def read_table(
    path: str | os.PathLike[str],
    required: Sequence[str],
    optional: Sequence[str] = (),
) -> dict[str, FloatArray]:
    """Read the columns of a comma-separated file whose first line names them, in any order.

    Parameters
    ----------
    path : str or path
        The file.
    required, optional : sequence of str
        Names of the columns that must and may be there; no other may.

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
    names = [cell.strip() for cell in lines[0].split(",")]
    _check_names(path, names, required, optional)
    rows = [_row(path, number, line, names) for number, line in enumerate(lines[1:], 2)]
    if not rows:
        raise FileError(f"{path} has a header and no rows")
    values = np.fromiter(chain.from_iterable(rows), dtype=np.float64, count=len(rows) * len(names))
    return dict(zip(names, values.reshape(len(rows), len(names)).T, strict=True))


def _check_names(
    path: str | os.PathLike[str], names: list[str], required: Sequence[str], optional: Sequence[str]
) -> None:
    missing = [name for name in required if name not in names]
    if missing:
        hint = "; waypoints have no instants before they are planned" if missing == ["t"] and "x" in names else ""
        header = ",".join(names)[:80]
        raise FileError(f"{path}, line 1: no column {', '.join(missing)}; the header reads {header!r}{hint}")
    for name in names:
        if name not in required and name not in optional:
            known = ",".join([*required, *optional])
            raise FileError(f"{path}, line 1: column {name[:40]!r} is not known; the columns are {known}")
        if names.count(name) > 1:
            raise FileError(f"{path}, line 1: column {name} is there twice")


def _row(path: str | os.PathLike[str], number: int, line: str, names: list[str]) -> list[float]:
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
    return [cell_number(where, name, cell.strip()) for name, cell in zip(names, cells, strict=True)]


def cell_number(where: str, name: str, cell: str) -> float:
    """Return the number in a cell, or raise an error that says what is wrong."""
    if not is_finite_number(cell):
        raise FileError(f"{where}: {name} is {cell[:40]!r}, not a finite number")
    return float(cell)


def _count(line: str, cells: list[str]) -> str:
    if not line.strip():
        return "it is empty"
    return "1 number" if len(cells) == 1 else f"{len(cells)} numbers"


def is_finite_number(cell: str) -> bool:
    """Whether a cell is a finite number; Python's underscores between digits are none."""
    try:
        return "_" not in cell and math.isfinite(float(cell))
    except ValueError:
        return False
