"""The progress of a batch: share, rate, time left, and failures by kind."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from time import monotonic
from typing import TextIO

BAR = 24
"""Width of the bar."""

IN_PLACE, APART = 0.3, 30.0
"""Seconds between two lines on a terminal, where one takes the place of the other, and elsewhere."""


class BatchLine:
    """A line that says how far a batch is.

    Parameters
    ----------
    count : int
        Problems in all.
    stream : text file
    clock : callable
        Returns seconds.
    """

    def __init__(self, count: int, stream: TextIO, clock: Callable[[], float] = monotonic) -> None:
        self.count, self.stream, self.clock = count, stream, clock
        self.in_place = stream.isatty()
        self.found, self.statuses, self.width = 0, Counter[str](), 0
        self.began = self.due = clock()

    def begin(self, found: int) -> Callable[[dict[str, int]], None]:
        """Begin with so many rows that were there already; return what takes new ones."""
        self.found, self.began = found, self.clock()
        self.due = self.began + (IN_PLACE if self.in_place else APART)
        return self.add

    def add(self, counts: dict[str, int]) -> None:
        """Count new rows by status, and show the line if another was not shown very recently."""
        self.statuses.update(counts)
        if self.clock() >= self.due:
            self.due = self.clock() + (IN_PLACE if self.in_place else APART)
            self._show(self.text())

    def text(self) -> str:
        """Return the line."""
        new = self.statuses.total()
        there, seconds = min(self.found + new, self.count), max(self.clock() - self.began, 1e-9)
        rate = new / seconds
        left = f", {_told((self.count - there) / rate)} left" if rate > 0.0 else ""
        failures = "".join(f", {n} {kind}" for kind, n in sorted(self.statuses.items()) if kind != "done")
        bar = f"{'#' * (BAR * there // self.count):-<{BAR}}"
        return f"[{bar}] {there} of {self.count} problems, {rate:.4g} a second{left}{failures}"

    def clear(self) -> None:
        """Clear the line."""
        if self.in_place and self.width:
            self._show("")

    def _show(self, text: str) -> None:
        if self.in_place:
            self.stream.write(f"\r{text:<{self.width}}" + ("" if text else "\r"))
        else:
            self.stream.write(text + "\n")
        self.stream.flush()
        self.width = len(text)


def _told(seconds: float) -> str:
    """Return a time as people say it."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"
