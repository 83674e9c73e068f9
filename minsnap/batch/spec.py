"""What a batch is asked for: read from YAML, checked once, and written in one form that names it."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from pathlib import Path
from typing import Any

from minsnap.basics.checks import is_whole
from minsnap.basics.messages import shown
from minsnap.basics.storage.text import load_yaml
from minsnap.batch.problem_table import count_rows, digest_of
from minsnap.batch.ranges import Range, read_range
from minsnap.errors import FileError
from minsnap.files.limits_in_files import NAMED
from minsnap.files.plan_request import SHORT_NAMES, VEHICLES
from minsnap.files.schema import refuse_unknown

BIGGEST = 1e6
"""Greatest length [m], duration [s] and limit that a specification may name."""

SHARD_BYTES = 64_000_000
"""Size of a shard, about [bytes]."""

SHARDS = 100
"""Least number of shards of a batch, so that many workers have something to do, unless it has fewer problems."""

SHAPES: Mapping[str, Mapping[str, tuple[Any, float, float, bool]]] = {
    "walks": {
        "legs": ([4, 10], 1, 1000, True),
        "step": ([1.0, 5.0], 1e-3, BIGGEST, False),
        "speed": ([1.0, 3.0], 1e-3, BIGGEST, False),
        "stretch": (1.0, 0.01, 100.0, False),
    },
    "gates": {
        "legs": ([4, 10], 1, 1000, True),
        "step": ([3.0, 8.0], 1e-3, BIGGEST, False),
        "speed": ([1.0, 3.0], 1e-3, BIGGEST, False),
        "stretch": (1.0, 0.01, 100.0, False),
        "opening": ([0.8, 2.0], 1e-3, BIGGEST, False),
    },
    "boxes": {
        "extent": (20.0, 2.0, BIGGEST, False),
        "height": (5.0, 1.0, BIGGEST, False),
        "cell": (0.5, 0.01, BIGGEST, False),
        "occupied": ([0.05, 0.2], 0.0, 0.9, False),
        "clearance": (0.2, 0.0, BIGGEST, False),
        "speed": ([1.0, 3.0], 1e-3, BIGGEST, False),
        "stretch": (1.0, 0.01, 100.0, False),
    },
}
"""What each generator draws: the default, least, greatest, and whether it is a whole number."""

DRAWN = ("corridor", "waypoint_tolerance", "total_time", "time_weight")
"""Arguments of ``plan`` that may be ranges, in the order in which they are drawn."""

FIXED = ("degree", "continuity", "closed", "split", "enforce", "pieces", "room", "solver")
"""Arguments of ``plan`` that are the same for all problems."""

LIMITS = tuple(NAMED)


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
        kinds = SHAPES.get(self.source, {})
        shape = {name: value.plain(kinds[name][3]) for name, value in self.shape.items()}
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


def read_spec(path: str | os.PathLike[str]) -> Spec:
    """Read a specification from YAML; a table's path is relative to the file.

    Raises
    ------
    FileError
        If it cannot be read, or a key is missing, unknown or has a value that it cannot have.
    """
    given = load_yaml(path)
    if not isinstance(given, dict):
        raise FileError(f"{path} holds no batch: give its keys by name, such as 'generator: walks'")
    try:
        return read_mapping(given, Path(path).parent)
    except FileError as error:
        raise FileError(f"{path}: {error}") from None


def read_mapping(given: Mapping[str, Any], folder: Path | None = None) -> Spec:
    """Return the specification that a mapping of keys and values means; see ``read_spec``."""
    values = dict(given)
    source, table = _source(values, folder or Path())
    shape = {
        name: read_range(values.pop(name, default), name, least, most, whole)
        for name, (default, least, most, whole) in SHAPES.get(source, {}).items()
    }
    drawn = {name: read_range(values.pop(name), name, 1e-9, 1e12) for name in DRAWN if name in values}
    limits = _limits(values.pop("limits", {}))
    vehicles = _vehicles(values.pop("vehicle", []))
    fixed = {name: values.pop(name) for name in FIXED if name in values}
    dim = 3 if source == "table" else _whole(values.pop("dim", 3), "dim", 2, 3)
    seed = _whole(values.pop("seed", 0), "seed", 0, 2**63 - 1)
    count = _count(values, table)
    rows = _shard_rows(values.pop("shard_rows", None), count, shape, fixed)
    known = ("count", "seed", "shard_rows", "dim", *SHAPES.get(source, {}), *DRAWN, "limits", "vehicle", *FIXED)
    refuse_unknown(source, values, dict.fromkeys(known))
    return Spec(source, count, seed, rows, dim, shape, drawn, limits, fixed, table, vehicles)


def _source(values: dict[str, Any], folder: Path) -> tuple[str, str]:
    """Take out which generator or which table is asked for."""
    generator, table = values.pop("generator", None), values.pop("table", None)
    if (generator is None) == (table is None):
        raise FileError(f"a batch needs either generator ({', '.join(SHAPES)}) or table, a file of problems")
    if table is not None:
        if not isinstance(table, str):
            raise FileError(f"table is {shown(table)}: give the name of a .parquet or .csv file")
        return "table", str((folder / table).resolve())
    if not isinstance(generator, str) or generator not in SHAPES:
        raise FileError(f"generator is {shown(generator)}: use {', '.join(SHAPES)}")
    return generator, ""


def _count(values: dict[str, Any], table: str) -> int:
    if not table:
        if "count" not in values:
            raise FileError("count is missing: say how many problems to generate")
        return _whole(values.pop("count"), "count", 1, 10**12)
    rows = count_rows(table)
    return _whole(values.pop("count", rows), "count", 1, rows)


def _limits(given: Any) -> dict[str, Range]:
    if not isinstance(given, dict):
        raise FileError(f"limits is {shown(given)}: give a mapping of limits by name, such as {{speed: [1, 3]}}")
    refuse_unknown("limits", given, NAMED)
    return {name: read_range(given[name], f"limits: {name}", 1e-9, BIGGEST) for name in LIMITS if name in given}


def _vehicles(given: Any) -> tuple[str, ...]:
    names = [given] if isinstance(given, str) else given
    known = [SHORT_NAMES.get(str(name), str(name)) for name in names] if isinstance(names, list) else [""]
    if not set(known) <= set(VEHICLES):
        raise FileError(f"vehicle is {shown(given)}: give one of {', '.join(VEHICLES)}, or a list of some")
    return tuple(known)


def _shard_rows(given: Any, count: int, shape: Mapping[str, Range], fixed: Mapping[str, Any]) -> int:
    """Return the rows of a file: as asked, or about 64 MB and at least a hundred files."""
    if given is not None:
        return _whole(given, "shard_rows", 1, 10_000_000)
    legs = shape["legs"].high if "legs" in shape else 10.0
    degree, pieces = fixed.get("degree", 7), fixed.get("pieces", 1)
    points = legs * ((degree if is_whole(degree) else 7) + 3) * (pieces if is_whole(pieces) else 6) * 3
    return max(1, min(ceil(SHARD_BYTES / (8.0 * points + 200.0)), ceil(count / SHARDS)))


def _whole(value: Any, name: str, least: int, most: int) -> int:
    if not is_whole(value) or not least <= value <= most:
        raise FileError(f"{name} is {shown(value)}: give a whole number from {least} to {most}")
    return int(value)
