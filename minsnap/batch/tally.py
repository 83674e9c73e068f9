"""Counts, ranges and histograms of rows, which can be added up: what a datasheet shows."""

from __future__ import annotations

from collections import Counter, defaultdict
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
        known = plain or {"statuses": {}, "certified": 0, "ranges": {}, "bins": {}}
        self.statuses, self.certified = Counter[str](known["statuses"]), int(known["certified"])
        self.ranges: dict[str, list[float]] = {name: list(ends) for name, ends in known["ranges"].items()}
        self.bins = defaultdict[str, Counter[str]](Counter)
        self.bins.update((name, Counter(bins)) for name, bins in known["bins"].items())

    def add(self, table: Any) -> None:
        """Count the rows of a pyarrow.Table."""
        for entry in table.column("status").value_counts().to_pylist():
            self.statuses[entry["values"]] += entry["counts"]
        self.certified += sum(1 for value in table.column("certified").to_pylist() if value)
        done = table.filter(np.array(table.column("status").to_pylist()) == "done")
        for name in MEASURED:
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
