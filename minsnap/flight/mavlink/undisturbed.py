"""Keep a flight from being disturbed: real-time priority, memory that stays in place, no garbage collection."""

from __future__ import annotations

import ctypes
import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager

PRIORITY = 9
"""SCHED_FIFO priority of the thread that decides: one less than that of the thread that sends."""

_LOCK_ALL = 3  # MCL_CURRENT | MCL_FUTURE of Linux


@contextmanager
def undisturbed(real_time: bool, within: bool = False) -> Iterator[str]:
    """Let this thread go first, lock the memory and stop garbage collection; undo all of it at the end.

    Objects made before are never collected meanwhile, and those made meanwhile are freed by their reference counts.

    Parameters
    ----------
    real_time : bool
        False: only garbage collection is stopped, as for a clock that is not real.
    within : bool
        True: another thread does this for the process, and its memory and collector are left alone.

    Yields
    ------
    str
        What the system granted, in words; empty without a request.
    """
    collecting = gc.isenabled()
    if not within:
        gc.collect()
        gc.freeze()
        gc.disable()
    first, locked = (_go_first(), not within and _locked()) if real_time else (None, False)
    try:
        yield _in_words(first is not None, locked) if real_time else ""
    finally:
        if first is not None:
            os.sched_setscheduler(0, *first)
        if locked:
            ctypes.CDLL(None).munlockall()
        if not within:
            gc.unfreeze()
            if collecting:
                gc.enable()


def _go_first() -> tuple[int, os.sched_param] | None:
    """Give this thread real-time priority; return what it had before, None if that is not granted."""
    if not hasattr(os, "sched_setscheduler"):
        return None
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except OSError:
        return None
    return before


def _locked() -> bool:
    """Keep all memory of the process, that to come too, from being swapped out."""
    try:
        return int(ctypes.CDLL(None).mlockall(_LOCK_ALL)) == 0
    except (OSError, AttributeError):
        return False


def _in_words(first: bool, locked: bool) -> str:
    if first:
        return f"the flight's logic has real-time priority{' and locked memory' if locked else ''}"
    grant = "sudo prlimit --pid $$ --rtprio=20 --memlock=unlimited"
    return (
        f"the flight's logic has no real-time priority: a busy computer may delay it; '{grant}' in this shell grants it"
    )
