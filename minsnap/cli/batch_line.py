"""The progress of a batch: share, rate, time left, and failures by kind."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from time import monotonic
from typing import TextIO

from minsnap.basics.progress import ProgressLine

FIRST = 100
"""New rows after which the time that all of them will take is told, once."""

APART = 30.0
"""Seconds between two lines where no terminal is, which shows one in place."""


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
        self.line = ProgressLine("batch") if stream.isatty() else None
        self.present, self.statuses, self.estimated = 0, Counter[str](), False
        self.began = self.due = clock()

    def begin(self, present: int) -> Callable[[dict[str, int]], None]:
        """Begin with the rows that are there already; return what takes new ones."""
        self.present, self.began = present, self.clock()
        self.due = self.began + APART
        return self.add

    def add(self, counts: dict[str, int]) -> None:
        """Count new rows by status, and show the line if another was not shown recently."""
        self.statuses.update(counts)
        if not self.estimated and self.statuses.total() >= FIRST:
            self.estimated = True
            self._estimate()
        if self.line is not None:
            self.line.show(self.there / self.count, self.text())
        elif self.clock() >= self.due:
            self.due = self.clock() + APART
            print(self.text(), file=self.stream, flush=True)

    def _estimate(self) -> None:
        """Say once how long the rest will take; nothing where it is a matter of seconds."""
        left = (self.count - self.there) * (self.clock() - self.began) / self.statuses.total()
        if left > APART:
            self.clear()
            text = f"about {_told(left)} for {self.count} problems, by the first {self.there}"
            print(text, file=self.stream, flush=True)

    @property
    def there(self) -> int:
        """Rows that are there."""
        return min(self.present + self.statuses.total(), self.count)

    def text(self) -> str:
        """Return the line."""
        rate = self.statuses.total() / max(self.clock() - self.began, 1e-9)
        left = f", {_told((self.count - self.there) / rate)} left" if rate > 0.0 else ""
        failures = "".join(f", {n} {kind}" for kind, n in sorted(self.statuses.items()) if kind != "done")
        return f"{self.there} of {self.count} problems, {rate:.4g} a second{left}{failures}"

    def clear(self) -> None:
        """Clear the line."""
        if self.line is not None:
            self.line.clear()


def _told(seconds: float) -> str:
    """Return a time as people say it."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"
