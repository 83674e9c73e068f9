"""Display of a flight on a terminal, drawn by a separate thread so that a blocked terminal does not delay it."""

from __future__ import annotations

import os
import queue
import select
import sys
import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minsnap.flight.mavlink.stream_options import StreamStatus

_WIDTH = 30
_INTERVAL = 0.2


class EnterKey:
    """A trigger that fires when Enter is pressed; the end of the input does not count as Enter."""

    def __init__(self) -> None:
        self._ended = False

    def __call__(self) -> bool:
        """Return whether Enter has been pressed."""
        if self._ended or not select.select([sys.stdin], [], [], 0.0)[0]:
            return False
        typed = os.read(sys.stdin.fileno(), 4096)
        self._ended = not typed
        return b"\n" in typed


class Display:
    """Events as lines on stderr and, on a terminal, a progress bar below them.

    Parameters
    ----------
    prompt : bool
        True: say when Enter is waited for.
    """

    def __init__(self, prompt: bool = False) -> None:
        self._prompt = prompt
        self._events: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._status: StreamStatus | None = None
        self._bar = sys.stderr.isatty()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Display:
        self._thread.start()
        return self

    def __exit__(self, *raised: object) -> None:
        self._events.put(None)
        self._thread.join(timeout=1.0)

    def event(self, text: str) -> None:
        """Show a sentence without blocking."""
        self._events.put(text)
        if self._prompt and text == "ready":
            self._events.put("press Enter to fly (the vehicle must be in its mode)")

    def status(self, status: StreamStatus) -> None:
        """Show the status of the flight without blocking."""
        self._status = status

    def _run(self) -> None:
        try:
            while self._show():
                pass
        except OSError:  # the terminal is closed: the flight continues without it
            return

    def _show(self) -> bool:
        try:
            text = self._events.get(timeout=_INTERVAL)
        except queue.Empty:
            self._draw()
            return True
        clear = "\r\x1b[K" if self._bar else ""
        sys.stderr.write(clear + ("" if text is None else f"{text}\n"))
        sys.stderr.flush()
        return text is not None

    def _draw(self) -> None:
        if self._bar and self._status is not None:
            sys.stderr.write("\r\x1b[K" + progress_line(self._status))
            sys.stderr.flush()


def progress_line(status: StreamStatus) -> str:
    """Return one line: the phase, a bar, the time, the tracking error."""
    share = status.elapsed / status.duration if status.duration else 1.0
    bar = "#" * round(_WIDTH * share)
    error = "" if status.error is None else f"  {status.error:.2f} m from its setpoint"
    return f"{status.phase.value} [{bar:<{_WIDTH}}] {status.elapsed:.1f}/{status.duration:.1f} s{error}"
