"""A progress line on a terminal during the search for durations; no output if there is no terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def searching(quiet: bool = False) -> Iterator[dict[str, Any]]:
    """Yield the ``progress`` argument of a plan that shows the search on a terminal's stderr; clear it afterwards."""
    if quiet or not sys.stderr.isatty():
        yield {}
        return
    from minsnap.time_allocation.search_line import SearchLine

    line = SearchLine(sys.stderr, " (Ctrl-C takes the best)")
    try:
        yield {"progress": line}
    finally:
        line.clear()
