"""The progress of a search for durations as one line, rewritten in place."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from minsnap.trajectory.report import Progress, Step

INTERVAL = 0.2
"""Least time between two lines, and before the first: a quick search shows none [s]."""

BAR, HALFWAY = 24, 20
"""Width of the bar, and the plans after which it is half full: nobody knows how many a search will take."""


class SearchLine:
    """A line with the progress of a search, rewritten in place.

    Parameters
    ----------
    stream : text file
        A terminal, or what a notebook shows.
    hint : str
        Written after the figures.
    """

    def __init__(self, stream: TextIO, hint: str = "") -> None:
        self.stream, self.hint, self.due, self.width = stream, hint, monotonic() + 2.0 * INTERVAL, 0

    def __call__(self, step: Step) -> None:
        """Show one evaluation, unless another was shown very recently."""
        if monotonic() >= self.due:
            self.due = monotonic() + INTERVAL
            share = 1.0 - 0.5 ** (step.evaluation / HALFWAY)
            bar = f"{'#' * round(BAR * share):-<{BAR}}"
            self._show(f"searching [{bar}] {step.evaluation} plans, {step.total_time:.4g} s{self.hint}")

    def clear(self) -> None:
        """Clear the line."""
        if self.width:
            self._show("")

    def _show(self, text: str) -> None:
        self.stream.write(f"\r{text:<{self.width}}" + ("" if text else "\r"))
        self.stream.flush()
        self.width = len(text)


@contextmanager
def shown(progress: Progress | bool | None) -> Iterator[Progress | None]:
    """Yield what a search is to call: for True a line on standard error, which is cleared afterwards."""
    if not isinstance(progress, bool):
        yield progress
        return
    line = SearchLine(sys.stderr) if progress else None
    try:
        yield line
    finally:
        if line is not None:
            line.clear()
