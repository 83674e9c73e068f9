"""Undo and redo of a document that is a value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import monotonic

from minsnap.planning.request import PlanRequest

PAUSE = 1.0
"""Edits of one thing that follow each other within this time are undone together [s]."""

MOST = 500
"""States that are kept."""


@dataclass
class EditHistory:
    """The states of a document before and after the present one.

    Parameters
    ----------
    present : PlanRequest
        The document.
    clock : callable
        Returns seconds.
    """

    present: PlanRequest
    clock: Callable[[], float] = monotonic
    past: list[PlanRequest] = field(default_factory=list)
    future: list[PlanRequest] = field(default_factory=list)
    _last: tuple[str, float] = ("", 0.0)

    def edit(self, document: PlanRequest, subject: str = "", held: bool = False) -> bool:
        """Replace the document; return whether that can be undone on its own.

        Parameters
        ----------
        document : PlanRequest
            The new one.
        subject : str
            What was edited, such as ``"waypoint 3"``: one drag of it, or one value typed, is one step. Empty: a step of
            its own.
        held : bool
            Whether it is held by a mouse: then only :meth:`pause` ends the step.
        """
        if document == self.present:
            return False
        now, (before, then) = self.clock(), self._last
        own = not subject or subject != before or (not held and now - then > PAUSE)
        if own:
            self.past = [*self.past[1 - MOST :], self.present]
        self.present, self.future, self._last = document, [], (subject, now)
        return own

    def pause(self) -> None:
        """End the present step: the next edit is one of its own."""
        self._last = ("", 0.0)

    def undo(self) -> bool:
        """Go one step back; return whether there was one."""
        return self._step(self.past, self.future)

    def redo(self) -> bool:
        """Go one step forward; return whether there was one."""
        return self._step(self.future, self.past)

    def _step(self, source: list[PlanRequest], target: list[PlanRequest]) -> bool:
        if not source:
            return False
        target.append(self.present)
        self.present = source.pop()
        self.pause()
        return True
