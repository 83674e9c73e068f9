"""A progress line on a terminal during the search for durations; no output if there is no terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from minsnap.trajectory.report import Step

INTERVAL = 0.2
"""Least time between two lines, and before the first: a quick search shows none [s]."""

BAR, HALFWAY = 24, 20
"""Width of the bar, and the plans after which it is half full: nobody knows how many a search will take."""


class SearchLine:
    """A line with the progress of a search, rewritten in place.

    Parameters
    ----------
    stream : text file
        A terminal.
    """

    def __init__(self, stream: TextIO) -> None:
        self.stream, self.due, self.width = stream, monotonic() + 2.0 * INTERVAL, 0

    def __call__(self, step: Step) -> None:
        """Show one evaluation, unless another was shown very recently."""
        if monotonic() >= self.due:
            self.due = monotonic() + INTERVAL
            share = 1.0 - 0.5 ** (step.evaluation / HALFWAY)
            bar = f"{'#' * round(BAR * share):-<{BAR}}"
            self._show(f"searching [{bar}] {step.evaluation} plans, {step.total_time:.4g} s (Ctrl-C takes the best)")

    def clear(self) -> None:
        """Clear the line."""
        if self.width:
            self._show("")

    def _show(self, text: str) -> None:
        self.stream.write(f"\r{text:<{self.width}}" + ("" if text else "\r"))
        self.stream.flush()
        self.width = len(text)


@contextmanager
def searching(quiet: bool = False) -> Iterator[dict[str, Any]]:
    """Yield the ``progress`` argument of a plan that shows the search on a terminal's stderr; clear it afterwards."""
    if quiet or not sys.stderr.isatty():
        yield {}
        return
    line = SearchLine(sys.stderr)
    try:
        yield {"progress": line}
    finally:
        line.clear()
