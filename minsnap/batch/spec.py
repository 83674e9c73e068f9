"""The specification of a batch: ranges that it draws from, or a table of problems in Parquet or CSV."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.cached import cached_property
from minsnap.basics.messages import shown
from minsnap.basics.optional_packages import optional
from minsnap.basics.schema import NUMBER, TEXT, WHOLE, Form, Key, either, from_to, mapping, several, word
from minsnap.basics.storage.text import FileName, check_regular, check_size, digest_of, load_yaml, reading
from minsnap.errors import FileError
from minsnap.files import FURTHER, LIMIT_KEYS, PRESET

DRAWN = ("corridor", "waypoint_tolerance", "total_time", "time_weight")
"""Fields of a request that a batch may draw, in the order in which it does."""

FIXED = ("closed", "degree", "continuity", "split", "pieces", "room", "solver")
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
        if _is_csv(path):
            names, cells = _csv_rows(path, _state(path))
            rows = len(cells)
        else:
            table = _parquet(path, _state(path))
            names, rows = list(table.schema_arrow.names), int(table.metadata.num_rows)
    unknown = [name for name in names if name not in COLUMNS]
    if unknown or "waypoints" not in names:
        which = f"has a column {shown(unknown[0])}" if unknown else "has no column 'waypoints'"
        raise FileError(f"{path} {which}: the columns are {', '.join(COLUMNS)}")
    if len(set(names)) < len(names):
        raise FileError(f"{path} has a column twice: its columns are {', '.join(names)}")
    if not rows:
        raise FileError(f"{path} has no problems")
    return rows


def read_cells(path: str, number: int) -> dict[str, Any]:
    """Return the cells of a row that are not empty, by column; text is read as JSON where it is.

    Raises
    ------
    FileError
        If the row cannot be read.
    """
    with reading(path, "a table of problems"):
        row = _csv_rows(path, _state(path))[1][number] if _is_csv(path) else _from_parquet(path, number)
    if None in row:
        raise FileError(f'row {number} has more cells than columns: quote lists, such as "[[0, 0], [8, 0]]"')
    return {name: _value(cell) for name, cell in row.items() if cell is not None and cell != ""}


def _value(cell: Any) -> Any:
    """Return what a cell holds; a struct without its empty fields, a whole number as one.

    A column of whole numbers with empty cells is one of floats in a data frame.
    """
    if isinstance(cell, str):
        with suppress(ValueError):
            cell = json.loads(cell)
    if isinstance(cell, float) and cell.is_integer() and abs(cell) < BIGGEST:
        return int(cell)
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
def _csv_rows(path: str, state: tuple[int, int]) -> tuple[list[str], list[dict[str, str]]]:
    """Return the names of the columns, and the rows; cells beyond the columns are under None."""
    import csv

    csv.field_size_limit(LARGEST_CSV)
    check_regular(path)
    with open(path, newline="", encoding="utf-8-sig") as file:
        reader = csv.DictReader(file, strict=True)
        return list(reader.fieldnames or ["waypoints"]), list(reader)


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
    return optional("pyarrow.parquet", "a batch needs pyarrow", "batch")


BIGGEST = 1e6
"""Greatest length [m], duration [s] and limit that a specification may name."""

SHARD_BYTES = 64_000_000
"""Size of a shard, about [bytes]."""

SHARDS = 100
"""Least number of shards of a batch, so that many workers have something to do, unless it has fewer problems."""

LIMITS = tuple(LIMIT_KEYS)


@dataclass(frozen=True)
class Range:
    """Numbers from low to high, all equally likely; one number where both are the same.

    Parameters
    ----------
    low, high : float
    """

    low: float
    high: float

    def draw(self, rng: np.random.Generator, count: int | None = None) -> Any:
        """Return a number, or numbers (count,); takes a draw for each, also where there is only one number."""
        return rng.uniform(self.low, self.high, count)

    def whole(self, rng: np.random.Generator) -> int:
        """Return a whole number, both ends among them."""
        return int(rng.integers(int(self.low), int(self.high), endpoint=True))

    def plain(self) -> Any:
        """Return it as a specification says it: a number, or a list of two."""
        return self.low if self.low == self.high else [self.low, self.high]


def ranged(least: float, most: float, whole: bool = False) -> Form:
    """Return the form of a number or [low, high], ascending, from ``least`` to ``most``; read as a :class:`Range`."""
    number = from_to(WHOLE if whole else NUMBER, least, most)

    def fits(value: Any) -> bool:
        low_high = _ends(value)
        return len(low_high) == 2 and all(map(number.fits, low_high)) and bool(low_high[0] <= low_high[1])

    json = {"anyOf": [number.json, {"type": "array", "items": number.json, "minItems": 2, "maxItems": 2}]}
    kind = "a whole number" if whole else "a number"
    wording = f"{kind} or [low, high], from {least:g} to {most:g}"
    return Form(wording, fits, lambda where, value: Range(*map(int if whole else float, _ends(value))), json)


def _ends(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value, value]


_LENGTH = ranged(1e-3, BIGGEST)
_PACE = {"speed": ([1.0, 3.0], _LENGTH), "stretch": (1.0, ranged(0.01, 100.0))}
_LEGS = {"legs": ([4, 10], ranged(1, 1000, whole=True))}

SHAPES: Mapping[str, Mapping[str, tuple[Any, Form]]] = {
    "walks": {**_LEGS, "step": ([1.0, 5.0], _LENGTH), **_PACE},
    "gates": {**_LEGS, "step": ([3.0, 8.0], _LENGTH), **_PACE, "opening": ([0.8, 2.0], _LENGTH)},
    "boxes": {
        "extent": (20.0, ranged(2.0, BIGGEST)),
        "height": (5.0, ranged(1.0, BIGGEST)),
        "cell": (0.5, ranged(0.01, BIGGEST)),
        "occupied": ([0.05, 0.2], ranged(0.0, 0.9)),
        "clearance": (0.2, ranged(0.0, BIGGEST)),
        **_PACE,
    },
}
"""What each generator draws: the default, and the form of another."""


def seed_of(seed: int, number: int) -> int:
    """Return the seed of a problem, below 2^63: the same whoever plans it, and when."""
    return int(np.random.SeedSequence(seed, spawn_key=(number,)).generate_state(1, np.uint64)[0] >> np.uint64(1))


def draws_of(seed: int) -> np.random.Generator:
    """Return the random numbers of a problem with this seed."""
    return np.random.Generator(np.random.PCG64(seed))


COMMON = {
    "seed": Key(from_to(WHOLE, 0, 2**63 - 1), "from which every problem has its own"),
    "shard_rows": Key(from_to(WHOLE, 1, 10_000_000), "problems in one file"),
    "limits": Key(
        mapping(
            {name: Key(ranged(1e-9, BIGGEST), key.text) for name, key in LIMIT_KEYS.items()},
            "a mapping of limits by name, such as {speed: [1, 3]}",
        ),
        "drawn for each problem",
    ),
    "vehicle": Key(either(PRESET, several(PRESET, "a list of some")), "whose rotors keep within their range"),
    **{
        name: Key(ranged(1e-9, 1e12), FURTHER[name].text.removesuffix(", one for all or one per leg")) for name in DRAWN
    },
    **{name: FURTHER[name] for name in FIXED},
}

TABLE = mapping(
    {
        "table": Key(TEXT, "a .parquet or .csv file of problems, from the folder of this file", needed=True),
        "count": Key(from_to(WHOLE, 1, 10**12), "how many of its problems; all by default"),
        **COMMON,
    },
    "a mapping with table",
    ("table",),
)
"""A batch of the problems of a table."""


def _generated(source: str) -> Form:
    shape = {name: Key(form) for name, (_, form) in SHAPES[source].items()}
    head = {
        "generator": Key(word(source), "what draws the problems", needed=True),
        "count": Key(from_to(WHOLE, 1, 10**12), "how many problems", needed=True),
        "dim": Key(from_to(WHOLE, 2, 3), "coordinates"),
    }
    return mapping(head | COMMON | shape, f"a mapping with generator: {source}")


FORMS = {**{source: _generated(source) for source in SHAPES}, "table": TABLE}
"""The whole file, by generator."""

BATCH = either(*FORMS.values())
"""The whole file."""


@dataclass(frozen=True)
class Spec:
    """A batch of problems.

    Parameters
    ----------
    source : str
        Name of a generator, or ``"table"``.
    count : int
        Number of problems.
    seed : int
        From which, with a problem's number, its own seed comes.
    shard_rows : int
        Problems in one file.
    dim : int
        Number of coordinates of generated problems.
    shape : mapping of str to Range
        What the generator draws.
    drawn, limits : mapping of str to Range
        Arguments of ``plan``, and limits, that are drawn for each problem.
    fixed : mapping of str to object
        Arguments of ``plan`` for all.
    table : str
        Path of the table of problems; empty for a generator.
    vehicles : tuple of str
        Presets, of which each problem draws one whose rotors' limits it keeps; empty for none.
    """

    source: str
    count: int
    seed: int
    shard_rows: int
    dim: int
    shape: Mapping[str, Range]
    drawn: Mapping[str, Range]
    limits: Mapping[str, Range]
    fixed: Mapping[str, Any]
    table: str = ""
    vehicles: tuple[str, ...] = ()

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the table; empty for a generator."""
        return digest_of(self.table) if self.table else ""

    @property
    def shards(self) -> int:
        """Number of files."""
        return ceil(self.count / self.shard_rows)

    def rows_of(self, shard: int) -> range:
        """Numbers of the problems in a file."""
        return range(shard * self.shard_rows, min(self.count, (shard + 1) * self.shard_rows))

    def plain(self) -> dict[str, Any]:
        """Return it as plain values, every default written out; ``read_mapping`` takes them again."""
        head: dict[str, Any] = {"table": self.table} if self.table else {"generator": self.source, "dim": self.dim}
        head |= {"count": self.count, "seed": self.seed, "shard_rows": self.shard_rows}
        shape = {name: value.plain() for name, value in self.shape.items()}
        drawn = {name: value.plain() for name, value in self.drawn.items()}
        limits = {"limits": {name: value.plain() for name, value in self.limits.items()}} if self.limits else {}
        vehicles = {"vehicle": list(self.vehicles)} if self.vehicles else {}
        return head | shape | drawn | limits | vehicles | dict(self.fixed)

    def identity(self) -> dict[str, Any]:
        """Return what decides the content of every file: the specification, with a table by its digest."""
        return self.plain() | ({"table": self.digest} if self.table else {})

    def name(self) -> str:
        """Return the SHA-256 of its identity, as 64 hexadecimal digits."""
        return hashlib.sha256(json.dumps(self.identity(), sort_keys=True).encode()).hexdigest()


def read_spec(path: FileName) -> Spec:
    """Read a specification from YAML; a table's path is relative to the file.

    Raises
    ------
    FileError
        If it cannot be read, or a key is missing, unknown or has a value that it cannot have.
    """
    content = load_yaml(path)
    if not isinstance(content, dict):
        raise FileError(f"{path} holds no batch: give its keys by name, such as 'generator: walks'")
    try:
        return read_mapping(content, Path(path).parent)
    except FileError as error:
        raise FileError(f"{path}: {error}") from None


def read_mapping(content: Mapping[str, Any], folder: Path | None = None) -> Spec:
    """Return the specification that a mapping of keys and values means; see ``read_spec``."""
    source = _source(content)
    values = FORMS[source].read(source, content)
    table = str(((folder or Path()) / values["table"]).resolve()) if "table" in values else ""
    shapes = {name: values.get(name, usual) for name, (usual, *_) in SHAPES.get(source, {}).items()}
    shape = {name: one if isinstance(one, Range) else Range(*_ends(one)) for name, one in shapes.items()}
    drawn, fixed = ({name: values[name] for name in known if name in values} for known in (DRAWN, FIXED))
    named = values.get("limits", {})
    limits = {name: named[name] for name in LIMITS if name in named}
    vehicle = values.get("vehicle", ())
    vehicles = (vehicle,) if isinstance(vehicle, str) else vehicle
    count = _count_of(table, values.get("count")) if table else values["count"]
    rows = values.get("shard_rows") or _shard_rows(count, shape, fixed)
    dim, seed = values.get("dim", 3), values.get("seed", 0)
    return Spec(source, count, seed, rows, dim, shape, drawn, limits, fixed, table, vehicles)


def _source(content: Mapping[str, Any]) -> str:
    """Return which generator is named, or ``"table"``."""
    generator, table = content.get("generator"), content.get("table")
    if (generator is None) == (table is None):
        raise FileError(f"a batch needs either generator ({', '.join(SHAPES)}) or table, a file of problems")
    if table is None and (not isinstance(generator, str) or generator not in SHAPES):
        raise FileError(f"generator is {shown(generator)}: use {', '.join(SHAPES)}")
    return "table" if table is not None else str(generator)


def _count_of(table: str, count: int | None) -> int:
    """Return how many problems of a table there are, or are wanted."""
    rows = count_rows(table)
    if count is not None and count > rows:
        raise FileError(f"count is {count}: the table has {rows} problems")
    return rows if count is None else count


def _shard_rows(count: int, shape: Mapping[str, Range], fixed: Mapping[str, Any]) -> int:
    """Return the rows of a file of about 64 MB, and of at least a hundred files."""
    legs = shape["legs"].high if "legs" in shape else 10.0
    pieces = fixed.get("pieces", 1)
    points = float(legs * (fixed.get("degree", 7) + 3) * (6 if pieces == "auto" else pieces) * 3)
    return max(1, min(ceil(SHARD_BYTES / (8.0 * points + 200.0)), ceil(count / SHARDS)))
