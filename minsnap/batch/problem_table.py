"""Problems from a table in Parquet or CSV: one row each, one column for each argument of ``plan``."""

from __future__ import annotations

import hashlib
import json
import os
from functools import lru_cache
from pathlib import Path
from typing import Any

from minsnap.basics.messages import shown
from minsnap.basics.storage.text import check_regular, check_size, reading
from minsnap.errors import FileError

DRAWN = ("corridor", "waypoint_tolerance", "total_time", "time_weight")
"""Fields of a request that a batch may draw, in the order in which it does."""

FIXED = ("closed", "degree", "continuity", "split", "enforce", "pieces", "room", "solver")
"""Fields of a request that are the same for all problems of a batch."""

COLUMNS = ("waypoints", "durations", *DRAWN, "limits", "start", "end", "pins", *FIXED)
"""Columns that a table may have; an empty cell counts as left out."""

LARGEST_CSV = 256_000_000
"""Bytes of the largest CSV that is read: it is held in memory whole, Parquet is not."""


def count_rows(path: str) -> int:
    """Return the number of problems in a table, and check its columns.

    Raises
    ------
    FileError
        If there is none, it cannot be read, or it has a column that no argument has.
    """
    with reading(path, "a table of problems"):
        check_size(path, LARGEST_CSV if _is_csv(path) else 1 << 44)
        names, rows = _csv_columns(path) if _is_csv(path) else _parquet_columns(path)
    unknown = [name for name in names if name not in COLUMNS]
    if unknown or "waypoints" not in names:
        which = f"has a column {shown(unknown[0])}" if unknown else "has no column 'waypoints'"
        raise FileError(f"{path} {which}: the columns are {', '.join(COLUMNS)}")
    if not rows:
        raise FileError(f"{path} has no problems")
    return rows


def digest_of(path: str | os.PathLike[str]) -> str:
    """Return the SHA-256 of a file, as 64 hexadecimal digits."""
    with reading(path, "a file"), open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_cells(path: str, number: int) -> dict[str, Any]:
    """Return the cells of a row that are not empty, by column; text is read as JSON where it is.

    Raises
    ------
    FileError
        If the row cannot be read.
    """
    with reading(path, "a table of problems"):
        row = _csv_rows(path, _state(path))[number] if _is_csv(path) else _from_parquet(path, number)
    return {name: _value(cell) for name, cell in row.items() if cell is not None and cell != ""}


def _value(cell: Any) -> Any:
    """Return what a cell holds; a struct without its empty fields."""
    if isinstance(cell, str):
        try:
            return json.loads(cell)
        except ValueError:
            return cell
    if isinstance(cell, dict):
        return {name: value for name, value in cell.items() if value is not None}
    return cell


def _is_csv(path: str) -> bool:
    ending = Path(path).suffix.lower()
    if ending not in (".csv", ".parquet"):
        raise FileError(f"{path} is no table of problems: its name ends in .parquet or .csv")
    return ending == ".csv"


def _state(path: str) -> tuple[int, int]:
    """Return what changes when a file is written again: what was read of it before counts no more."""
    state = os.stat(path)
    return state.st_mtime_ns, state.st_size


@lru_cache(maxsize=1)
def _csv_rows(path: str, state: tuple[int, int]) -> list[dict[str, str]]:
    import csv

    csv.field_size_limit(LARGEST_CSV)
    check_regular(path)
    with open(path, newline="", encoding="utf-8-sig") as file:
        return list(csv.DictReader(file, strict=True))


def _csv_columns(path: str) -> tuple[list[str], int]:
    rows = _csv_rows(path, _state(path))
    return ([str(name) for name in rows[0]] if rows else ["waypoints"]), len(rows)


def _parquet_columns(path: str) -> tuple[list[str], int]:
    table = _parquet(path, _state(path))
    return list(table.schema_arrow.names), int(table.metadata.num_rows)


def _from_parquet(path: str, number: int) -> dict[str, Any]:
    """Return one row; the row group that holds it is kept for the next one."""
    state, first = _state(path), 0
    metadata = _parquet(path, state).metadata
    for group in range(metadata.num_row_groups):
        rows = metadata.row_group(group).num_rows
        if number < first + rows:
            return dict(_row_group(path, state, group).slice(number - first, 1).to_pylist()[0])
        first += rows
    raise FileError(f"{path} has {first} rows, not {number + 1}")


@lru_cache(maxsize=1)
def _parquet(path: str, state: tuple[int, int]) -> Any:
    return pyarrow_parquet().ParquetFile(path)


@lru_cache(maxsize=1)
def _row_group(path: str, state: tuple[int, int], group: int) -> Any:
    return _parquet(path, state).read_row_group(group)


def pyarrow_parquet() -> Any:
    """Return the module that reads and writes Parquet, or raise an ImportError that names the extra."""
    try:
        import pyarrow.parquet as parquet
    except ImportError as error:
        raise ImportError("a batch needs pyarrow: pip install minsnap[batch]") from error
    return parquet
