"""Columns of a dataset as Arrow arrays, a trajectory from a row that was read back, and what rows add up to."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.limit_kinds import KIND
from minsnap.basics.version import __version__
from minsnap.batch.dataset_rows import PROVED, REQUESTED, Row
from minsnap.batch.spec import LIMITS, pyarrow_parquet
from minsnap.errors import InputError
from minsnap.trajectory import Trajectory

COLUMNS: Mapping[str, str] = {
    **dict.fromkeys(("problem", "seed"), "int64"),
    **dict.fromkeys(("status", "error"), "string"),
    **dict.fromkeys(("dim", "legs", "degree", "pieces"), "int32"),
    **dict.fromkeys(("waypoints", "gates", "corridor", "boxes"), "list"),
    **dict.fromkeys((*REQUESTED, *(f"limit_{name}" for name in LIMITS)), "double"),
    "vehicle": "string",
    **dict.fromkeys(("durations", "control_points"), "list"),
    **dict.fromkeys(("cost", "duration"), "double"),
    "certified": "bool",
    **dict.fromkeys(PROVED, "double"),
    "version": "string",
}
"""Columns in their order, by type; a list is of doubles, in the order of the array that it was."""


@cache
def schema() -> Any:
    """Return the Arrow schema of every file."""
    import pyarrow

    types = {"list": pyarrow.list_(pyarrow.float64()), "double": pyarrow.float64(), "bool": pyarrow.bool_()}
    types |= {name: getattr(pyarrow, name)() for name in ("int64", "int32", "string")}
    return pyarrow.schema([(name, types[kind]) for name, kind in COLUMNS.items()])


def record_batch(rows: Sequence[Row]) -> Any:
    """Return rows as a pyarrow.RecordBatch."""
    import pyarrow

    columns = {name: [row.get(name) for row in rows] for name in COLUMNS} | {"version": [__version__] * len(rows)}
    for name in (name for name, kind in COLUMNS.items() if kind == "list"):
        columns[name] = [None if array is None else np.ravel(array).astype(np.float64) for array in columns[name]]
    return pyarrow.RecordBatch.from_pydict(columns, schema())


def trajectory_of(row: Mapping[str, Any]) -> Trajectory:
    """Return the trajectory of a row of a dataset, however it was read: equal to the planned one to the last bit.

    Parameters
    ----------
    row : mapping
        The columns ``status``, ``dim``, ``degree``, ``pieces``, ``durations`` and ``control_points``; a row of a pandas
        data frame is one.

    Raises
    ------
    InputError
        If the problem was not planned.
    """
    if row["status"] != "done":
        raise InputError(f"this problem was not planned, its status is {row['status']!r}: choose rows that are 'done'")
    durations = np.array(row["durations"], dtype=np.float64)
    points = np.array(row["control_points"], dtype=np.float64)
    shape = len(durations), int(row["degree"]) + 1, int(row["dim"])
    return Trajectory(points.reshape(shape), durations, pieces=int(row["pieces"]))


def planned_curves(file: Path) -> Iterator[Trajectory]:
    """Read the trajectories of a file of the dataset, of which some problems may have none."""
    columns = ["status", "dim", "degree", "pieces", "durations", "control_points"]
    with open(file, "rb") as opened, pyarrow_parquet().ParquetFile(opened) as table:
        for batch in table.iter_batches(1024, columns=columns):
            yield from (trajectory_of(row) for row in batch.to_pylist() if row["status"] == "done")


def parquet_writer(file: Any, notes: Mapping[str, str]) -> Any:
    """Return a pyarrow.parquet.ParquetWriter for an open file; notes become metadata of the file."""
    how = {"compression": "zstd", "use_dictionary": ["status", "error", "vehicle", "version"], "store_schema": False}
    writer = pyarrow_parquet().ParquetWriter(file, schema(), write_statistics=True, **how)
    writer.add_key_value_metadata(dict(notes))
    return writer


UNITS = {"legs": "", "duration": "s", "cost": "m²/s^(2k - 1)", "corridor_margin": "m"}
UNITS |= {f"max_{name}": KIND[name].unit for name in ("speed", "acceleration", "jerk", "snap")}
"""Columns whose ranges are kept, and their units."""

BINS = 8
"""Bins of a histogram for a factor of ten."""


class Tally:
    """Counts by status, and of every measured column its least, greatest and histogram over logarithms.

    Parameters
    ----------
    plain : mapping, optional
        One as ``plain`` returned it.
    """

    def __init__(self, plain: Mapping[str, Any] | None = None) -> None:
        known = plain or {"statuses": {}, "certified": 0, "ranges": {}, "bins": {}}
        self.statuses, self.certified = Counter[str](known["statuses"]), int(known["certified"])
        self.ranges: dict[str, list[float]] = {name: list(ends) for name, ends in known["ranges"].items()}
        self.bins = defaultdict[str, Counter[str]](Counter)
        self.bins.update((name, Counter(bins)) for name, bins in known["bins"].items())

    def add(self, table: Any) -> None:
        """Count the rows of a pyarrow.Table."""
        statuses = table.column("status").to_pylist()
        self.statuses.update(statuses)
        self.certified += table.column("certified").to_pylist().count(True)
        done = table.filter(np.array(statuses) == "done")
        for name in UNITS:
            self._measure(name, done.column(name).drop_null().to_numpy().astype(np.float64))

    def _measure(self, name: str, values: FloatArray) -> None:
        if not len(values):
            return
        self._widen(name, float(values.min()), float(values.max()))
        bins = np.floor(BINS * np.log10(values[values > 0.0])).astype(int)
        self.bins[name].update(map(str, bins.tolist()))

    def _widen(self, name: str, least: float, most: float) -> None:
        low, high = self.ranges.get(name, [np.inf, -np.inf])
        self.ranges[name] = [min(low, least), max(high, most)]

    def join(self, other: Tally) -> None:
        """Add another one."""
        self.certified += other.certified
        self.statuses.update(other.statuses)
        for name, ends in other.ranges.items():
            self._widen(name, *ends)
        for name, bins in other.bins.items():
            self.bins[name].update(bins)

    def plain(self) -> dict[str, Any]:
        """Return it as plain values."""
        return {"statuses": self.statuses, "certified": self.certified, "ranges": self.ranges, "bins": self.bins}

    def histogram(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Return the lower ends (bins,) of the bins of a column, without gaps, and how many values each has."""
        known = {int(number): count for number, count in self.bins.get(name, {}).items()}
        if not known:
            return np.zeros(0), np.zeros(0)
        numbers = np.arange(min(known), max(known) + 1)
        counts = np.array([known.get(int(number), 0) for number in numbers], dtype=np.float64)
        return 10.0 ** (numbers / BINS), counts
