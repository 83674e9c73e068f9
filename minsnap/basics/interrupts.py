"""Ctrl-C, SIGTERM and SIGHUP where they would come at a bad time: noted, kept from what is started, told in order."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Any


def noted_interrupts(pressed: list[int]) -> AbstractContextManager[None]:
    """Note Ctrl-C in a list instead of raising it: the interpreter drops what it raises as a callback begins.

    Nothing is noted in other threads than the main one, or where another handler is installed.
    """
    return _handled(signal.SIGINT, signal.default_int_handler, lambda number, frame: pressed.append(number))


HANGUP: signal.Signals | None = getattr(signal, "SIGHUP", None)
"""Of a terminal that is closed; both it and its shell may send it. None where the system has none."""


@contextmanager
def ended_in_order() -> Iterator[None]:
    """Let the first SIGTERM or SIGHUP raise SystemExit (143, 129) meanwhile, so that what was begun is ended.

    As it is in other threads than the main one, and where it has another handler.
    """
    with ExitStack() as handled:
        for number in filter(None, (signal.SIGTERM, HANGUP)):
            handled.enter_context(_handled(number, signal.SIG_DFL, _end))
        yield


def _end(number: int, _: Any) -> None:
    signal.signal(number, signal.SIG_IGN)  # a second one would stop the end
    sys.exit(128 + number)


@contextmanager
def _handled(number: signal.Signals, usual: Any, handler: Callable[[int, Any], None]) -> Iterator[None]:
    """Handle a signal meanwhile, in the main thread, where its usual handler is installed."""
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(number) is not usual:
        yield
        return
    signal.signal(number, handler)
    try:
        yield
    finally:
        signal.signal(number, usual)


@contextmanager
def started_without_interrupts() -> Iterator[None]:
    """Let threads that are started here, and all processes that they start at any time, never receive Ctrl-C."""
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # first: the thread that starts it receives Ctrl-C from then on
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
