"""Tables of numbers: strictly comma-separated ones, those that people and programs write, and safe NumPy archives."""

from __future__ import annotations

import io
import math
import re
import zipfile
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, NDArray
from minsnap.basics.storage.text import FileName, check_size, read_text, reading
from minsnap.errors import FileError


def read_table(path: FileName, required: Sequence[str], optional: Sequence[str] | None = ()) -> dict[str, FloatArray]:
    """Read the columns of a comma-separated file whose first line names them, in any order.

    Parameters
    ----------
    path : str or path
        The file.
    required, optional : sequence of str
        Names of the columns that must and may be there; no other may, but where ``optional`` is None any other may.

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
    missing = [name for name in required if name not in names]
    if missing:
        plain = all(map(_is_finite, names)) or (missing == ["t"] and "x" in names)
        hint = "; waypoints have no instants before they are planned" if plain else ""
        header = ",".join(names)[:80]
        raise FileError(f"{path}, line 1: no column {', '.join(missing)}; the header reads {header!r}{hint}")
    _check_names(f"{path}, line 1", names, names if optional is None else [*required, *optional])
    if len(lines) == 1:
        raise FileError(f"{path} has a header and no rows")
    values = _plain_rows(lines[1:], len(names))
    if values is None:
        where = (f"{path}, line {number}" for number in count(2))
        rows = [number_row(next(where), line, line.split(","), names) for line in lines[1:]]
        values = np.array(rows, dtype=np.float64)
    return dict(zip(names, values.T, strict=True))


def _plain_rows(lines: Sequence[str], columns: int) -> FloatArray | None:
    """Return the numbers of lines, shape (lines, columns), ten times as fast; None where a line has to be looked at."""
    if not lines[0].strip():
        return None
    try:
        values = np.loadtxt(lines, delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None
    return values if values.shape == (len(lines), columns) and np.isfinite(values).all() else None


def _check_names(where: str, names: Sequence[str], known: Collection[str], hint: str = "") -> None:
    for name in names:
        if name not in known:
            raise FileError(f"{where}: column {name[:40]!r} is not known; the columns are {','.join(known)}{hint}")
        if names.count(name) > 1:
            raise FileError(f"{where}: column {name} is there twice")


def number_row(
    where: str, line: str, cells: Sequence[str], names: Sequence[str], blank: Sequence[str] = ()
) -> list[float]:
    """Return the numbers of a line; empty cells of the columns that may have them are not-a-number."""
    if len(cells) != len(names):
        count = _count(cells) if line.strip() else "it is empty"
        raise FileError(f"{where}: {count}, but there are {len(names)} columns")
    try:
        values = list(map(float, cells))
    except ValueError:
        values = [math.nan]
    if "_" not in line and all(map(math.isfinite, values)):
        return values
    pairs = zip(names, cells, strict=True)
    return [_number(f"{where}: {name}", cell.strip(), name in blank) for name, cell in pairs]


def _number(where: str, cell: str, may_be_blank: bool) -> float:
    if may_be_blank and not cell:
        return math.nan
    if not _is_finite(cell):
        raise FileError(f"{where} is {cell[:40]!r}, not a finite number")
    return float(cell)


def _count(cells: Sequence[str]) -> str:
    return "1 number" if len(cells) == 1 else f"{len(cells)} numbers"


def _is_finite(cell: str) -> bool:
    """Whether a cell is a finite number; Python's underscores between digits are none."""
    try:
        return "_" not in cell and math.isfinite(float(cell))
    except ValueError:
        return False


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


def read_loose_table(path: FileName, columns: LooseColumns) -> tuple[dict[str, FloatArray], dict[str, str]]:
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
    numbered, cells = _cells(path, raw)
    named = _named_by_comment(raw, columns)
    if not numbered:
        raise FileError(f"{path} has a header and no rows" if named else f"{path} is empty")
    names, units, first = named or _names(f"{path}, line {numbered[0][0]}", cells[0], columns)
    if first == len(cells):
        raise FileError(f"{path} has a header and no rows")
    rows = [
        number_row(f"{path}, line {number}", text, row, names, columns.blank)
        for (number, text), row in zip(numbered[first:], cells[first:], strict=True)
    ]
    return dict(zip(names, np.array(rows, dtype=np.float64).T, strict=True)), units


def read_cells(path: FileName) -> list[tuple[int, list[str]]]:
    """Return the cells of every line of a table that people or programs write, with the number of the line.

    As :func:`read_loose_table` takes them apart, whatever they are: words, numbers, nothing.

    Raises
    ------
    FileError
        If the file is missing, empty, no text, or mixes separators.
    """
    numbered, cells = _cells(path, read_text(path).splitlines())
    if not numbered:
        raise FileError(f"{path} is empty")
    return [(number, row) for (number, _), row in zip(numbered, cells, strict=True)]


def _cells(path: FileName, raw: list[str]) -> tuple[list[tuple[int, str]], list[list[str]]]:
    """Return the lines that hold anything, with their numbers, and the cells of each: decimal commas are points."""
    lines = [(i, text.split("#")[0].rstrip(" \r")) for i, text in enumerate(raw, 1)]
    lines = [(number, text) for number, text in lines if text.strip()]
    if not lines:
        return [], []
    separator, decimal = _separator(path, lines)
    cells = [[cell.strip().strip("\"'").strip() for cell in text.split(separator)] for _, text in lines]
    if decimal:
        cells = [[_pointed(cell) for cell in row] for row in cells]
        lines = [(number, text.replace(",", ".")) for number, text in lines]
    return lines, cells


_DECIMAL = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
"""A number with a decimal comma, as spreadsheets of many countries write them."""


def _pointed(cell: str) -> str:
    return cell.replace(",", ".") if _DECIMAL.fullmatch(cell) else cell


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


def _separator(path: FileName, lines: list[tuple[int, str]]) -> tuple[str | None, bool]:
    """Return the separator of the cells, None for spaces, and whether commas stand in decimals."""
    present = [separator for separator in SEPARATORS if any(separator in text for _, text in lines)]
    if len(present) > 1 and present[-1] == ",":
        present, decimal = present[:-1], _decimal_commas(lines, present[0])
        if not decimal:
            present.append(",")
    else:
        decimal = False
    if len(present) > 1:
        number = next(number for number, text in lines if present[1] in text)
        raise FileError(
            f"{path}, line {number}: {SEPARATORS[present[0]]} and {SEPARATORS[present[1]]} are mixed: "
            "use one of them between the numbers, and a point for decimals"
        )
    return (present[0] if present else None), decimal


def _decimal_commas(lines: list[tuple[int, str]], separator: str) -> bool:
    """Whether every comma stands in a number, and no number has a point, in cells between other separators."""
    cells = [cell.strip().strip("\"'").strip() for _, text in lines for cell in text.split(separator)]
    with_comma = [cell for cell in cells if "," in cell]
    return all(map(_DECIMAL.fullmatch, with_comma)) and not any("." in cell and _is_finite(cell) for cell in cells)


def _names(where: str, cells: list[str], columns: LooseColumns) -> tuple[list[str], dict[str, str], int]:
    """Return names and units of the columns, and the number of header lines."""
    if all(map(_is_finite, cells)):
        fitting = [list(names) for names in columns.headerless if len(names) == len(cells)]
        if not fitting:
            raise FileError(f"{where}: {_count(cells)} without a header{columns.ambiguous}")
        return fitting[0], {}, 0
    if all(map(_is_finite, cells[:2])):
        wrong = next(cell for cell in cells if not _is_finite(cell))
        raise FileError(f"{where}: {wrong[:40]!r} is not a finite number")
    matches = [_UNIT.match(cell.lower()) for cell in _joined(cells)]
    names = [match["name"].strip() if match else "" for match in matches]
    _check_names(where, names, columns.known, "; setpoints are planned already" if {"vx", "ax"} & set(names) else "")
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


SMALL = 64_000_000
"""Bytes up to which an archive may unpack, however small it is."""

RATIO = 20
"""How many times its own size a larger one may have unpacked."""


def read_archive(path: FileName) -> dict[str, NDArray[Any]]:
    """Return the arrays of an ``.npz`` file by name: numbers as float64, text unchanged.

    Raises
    ------
    FileError
        If it cannot be read, is no such archive, holds other than numbers and text, or unpacks to too much.
    """
    size = check_size(path)
    with reading(path, "a NumPy archive of numbers"), zipfile.ZipFile(path) as archive:
        unpacked = sum(entry.file_size for entry in archive.infolist())
        if unpacked > max(SMALL, RATIO * size):
            raise FileError(f"{path} has {size} bytes and unpacks to {unpacked}: that is no archive of numbers")
        return {name.removesuffix(".npy"): _array(archive.read(name)) for name in archive.namelist()}


def _array(content: bytes) -> NDArray[Any]:
    """Return the array of an ``.npy`` member, of numbers or text, if its size agrees with its header."""
    stream = io.BytesIO(content)
    read_header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    shape, fortran, dtype = read_header[np.lib.format.read_magic(stream)](stream)
    body = content[stream.tell() :]
    if dtype.kind not in "fiubU" or math.prod(shape) * dtype.itemsize != len(body):
        raise ValueError("an array of another size or kind than its header says")
    array = np.frombuffer(body, dtype=dtype).reshape(shape, order="F" if fortran else "C")
    return array if dtype.kind == "U" else array.astype(np.float64)
