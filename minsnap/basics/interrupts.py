"""Ctrl-C, SIGTERM and SIGHUP where they would come at a bad time: noted, kept from what is started, told in order."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any


@contextmanager
def noted_interrupts(pressed: list[int], ends: bool = False) -> Iterator[None]:
    """Note Ctrl-C in a list instead of raising it: the interpreter drops what it raises as a callback begins.

    With ``ends`` also SIGTERM and SIGHUP, where they would end in order. Nothing is noted in other threads than the
    main one, or where another handler is installed.
    """
    usual: dict[signal.Signals, Any] = {signal.SIGINT: signal.default_int_handler}
    with ExitStack() as handled:
        for number, handler in (usual | (dict.fromkeys(_ENDS, _end) if ends else {})).items():
            handled.enter_context(_handled(number, handler, lambda number, frame: pressed.append(number)))
        yield


HANGUP: signal.Signals | None = getattr(signal, "SIGHUP", None)
"""Of a terminal that is closed; both it and its shell may send it. None where the system has none."""

_ENDS = tuple(filter(None, (signal.SIGTERM, HANGUP)))


@contextmanager
def ended_in_order() -> Iterator[None]:
    """Let the first SIGTERM or SIGHUP raise SystemExit (143, 129) meanwhile, so that what was begun is ended.

    As it is in other threads than the main one, and where it has another handler.
    """
    with ExitStack() as handled:
        for number in _ENDS:
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
    """Let threads that are started here, and all processes that they start, never receive Ctrl-C or SIGHUP."""
    from multiprocessing import resource_tracker

    before = signal.pthread_sigmask(signal.SIG_BLOCK, _ENDS[1:])
    resource_tracker.ensure_running()  # before the next one: the thread that starts it receives Ctrl-C from then on
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
