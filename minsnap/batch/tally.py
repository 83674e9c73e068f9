"""Counts, ranges and histograms of rows, which can be added up: what a datasheet shows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray

MEASURED = ("legs", "duration", "cost", "corridor_margin", "max_speed", "max_acceleration", "max_jerk", "max_snap")
"""Columns whose ranges are kept."""

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
        self.statuses: dict[str, int] = dict(plain["statuses"]) if plain else {}
        self.certified = int(plain["certified"]) if plain else 0
        self.ranges: dict[str, list[float]] = {k: list(v) for k, v in plain["ranges"].items()} if plain else {}
        self.bins: dict[str, dict[str, int]] = {k: dict(v) for k, v in plain["bins"].items()} if plain else {}

    def add(self, table: Any) -> None:
        """Count the rows of a pyarrow.Table."""
        for entry in table.column("status").value_counts().to_pylist():
            _count(self.statuses, entry["values"], entry["counts"])
        self.certified += sum(1 for value in table.column("certified").to_pylist() if value)
        done = table.filter(np.array(table.column("status").to_pylist()) == "done")
        for name in MEASURED:
            self._measure(name, done.column(name).drop_null().to_numpy().astype(np.float64))

    def _measure(self, name: str, values: FloatArray) -> None:
        if not len(values):
            return
        low, high = self.ranges.get(name, [np.inf, -np.inf])
        self.ranges[name] = [min(low, float(values.min())), max(high, float(values.max()))]
        positive = values[values > 0.0]
        bins, counts = np.unique(np.floor(BINS * np.log10(positive)).astype(int), return_counts=True)
        known = self.bins.setdefault(name, {})
        for number, count in zip(bins.tolist(), counts.tolist(), strict=True):
            _count(known, str(number), count)

    def join(self, other: Tally) -> None:
        """Add another one."""
        self.certified += other.certified
        for status, count in other.statuses.items():
            _count(self.statuses, status, count)
        for name, (low, high) in other.ranges.items():
            least, most = self.ranges.get(name, [np.inf, -np.inf])
            self.ranges[name] = [min(least, low), max(most, high)]
        for name, bins in other.bins.items():
            for number, count in bins.items():
                _count(self.bins.setdefault(name, {}), number, count)

    def plain(self) -> dict[str, Any]:
        """Return it as plain values."""
        return {"statuses": self.statuses, "certified": self.certified, "ranges": self.ranges, "bins": self.bins}

    @property
    def rows(self) -> int:
        """Number of all rows."""
        return sum(self.statuses.values())

    def histogram(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Return the lower ends (bins,) of the bins of a column, without gaps, and how many values each has."""
        known = {int(number): count for number, count in self.bins.get(name, {}).items()}
        if not known:
            return np.zeros(0), np.zeros(0)
        numbers = np.arange(min(known), max(known) + 1)
        counts = np.array([known.get(int(number), 0) for number in numbers], dtype=np.float64)
        return 10.0 ** (numbers / BINS), counts


def _count(counts: dict[str, int], name: str, more: int) -> None:
    counts[name] = counts.get(name, 0) + more
