"""The clock of a page: the time slider, and the flight of the vehicle along the plan."""

from __future__ import annotations

import threading
from collections.abc import Callable
from math import ceil
from time import monotonic
from typing import Any

from minsnap.studio.page_inputs import follow, when_changed

PERIOD = 0.05
"""Seconds between two poses of a flying vehicle."""


class Player:
    """A time in the duration of the plan.

    Parameters
    ----------
    gui : viser.GuiApi
        Where its inputs are added, in the present container.
    moved : callable
        Called with the time [s] when it has changed.
    label : str
        Of the box that lets it run.
    """

    def __init__(self, gui: Any, moved: Callable[[float], None], label: str = "Fly along the plan") -> None:
        self._moved = moved
        self.now, self._duration = 0.0, 1.0
        self._slider = gui.add_slider("Time [s]", min=0.0, max=1.0, step=0.01, initial_value=0.0)
        when_changed(self._slider, self._set)
        self._flying = threading.Event()
        self._closed = threading.Event()
        self._box = when_changed(gui.add_checkbox(label, False), self._fly)
        self._thread = threading.Thread(target=self._run, name="studio clock", daemon=True)
        self._thread.start()

    @property
    def duration(self) -> float:
        """Of what is flown [s]."""
        return self._duration

    def show(self, duration: float) -> None:
        """Take up the duration of another plan [s]; the time stays where it is, or at the end."""
        self._duration = duration
        self.now = min(self.now, duration)
        most = ceil(100.0 * duration - 1e-6) / 100.0
        if self._slider.max != most:
            if self._slider.value > most:
                self._slider.value = round(self.now, 2)
            self._slider.max = most

    def seek(self, now: float) -> None:
        """Go to a time [s]."""
        self._set(min(max(now, 0.0), self._duration))
        follow(self._slider, round(self.now, 2))

    def switch(self) -> None:
        """Fly, or stop."""
        self._box.value = not self._box.value
        self._fly(self._box.value)

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._flying.set()
        self._thread.join(1.0)

    def _set(self, now: float) -> None:
        self.now = min(float(now), self._duration)
        self._moved(self.now)

    def _fly(self, wanted: bool) -> None:
        (self._flying.set if wanted else self._flying.clear)()

    def _run(self) -> None:
        before = monotonic()
        while not self._closed.wait(PERIOD):
            waited = not self._flying.is_set()
            self._flying.wait()
            if self._closed.is_set():
                return
            elapsed, before = (0.0 if waited else monotonic() - before), monotonic()
            self.now = (self.now + elapsed) % self._duration
            follow(self._slider, round(self.now, 2))
            self._moved(self.now)
