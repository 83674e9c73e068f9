"""How many threads a call may use."""

from __future__ import annotations

import os

from minsnap.basics.checks import is_whole
from minsnap.basics.messages import shown
from minsnap.errors import FleetError


def processors(threads: int | None) -> int:
    """Return how many threads to use: by default as many as processors."""
    if threads is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not is_whole(threads) or not 1 <= threads <= 256:
        raise FleetError(f"threads is {shown(threads)}: use 1 to 256")
    return int(threads)
