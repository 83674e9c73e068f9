"""The state of a studio: document, undo, the last good plan, and what cannot be done; without any page."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from time import monotonic

from minsnap.errors import MinsnapError
from minsnap.planning.request import PlanRequest
from minsnap.studio.plan_worker import PlannedScene, PlanWorker
from minsnap.trajectory.trajectory import Trajectory

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


@dataclass(frozen=True, eq=False)
class BenchState:
    """What a studio shows.

    Parameters
    ----------
    request : PlanRequest
        The document as it is edited.
    planned : PlannedScene or None
        The last good plan; of an earlier document while ``searching`` or where there is a ``refusal``.
    searching : bool
        Whether a plan, or a better one, is searched.
    refusal : str
        Why the document cannot be planned; empty where it can.
    leg : int or None
        The leg that it is about.
    smallest_width : float or None
        The smallest half-width of that leg that would do [m].
    ghost : Trajectory or None
        The plan before the last edit.
    """

    request: PlanRequest
    planned: PlannedScene | None = None
    searching: bool = False
    refusal: str = ""
    leg: int | None = None
    smallest_width: float | None = None
    ghost: Trajectory | None = None

    @property
    def is_plan_of_document(self) -> bool:
        """Whether the plan is the final one of the document as it is."""
        return self.planned is not None and self.planned.final and self.planned.request == self.request


Observer = Callable[[BenchState], None]


class Workbench:
    """A document that is planned again after every edit.

    Parameters
    ----------
    request : PlanRequest
        The first document.
    observer : callable
        Called with the state after every change of it, one call at a time, from any thread.
    planned : PlannedScene, optional
        A plan of the document that is there already.
    clock : callable
        Returns seconds; for the history.
    """

    def __init__(
        self,
        request: PlanRequest,
        observer: Observer,
        planned: PlannedScene | None = None,
        clock: Callable[[], float] = monotonic,
    ) -> None:
        self.lock = threading.RLock()
        self._history = EditHistory(request, clock)
        self._observer = observer
        self._state = BenchState(request, planned)
        self._worker = PlanWorker(self._take_plan, self._refused)
        self._show(self._state) if planned is not None else self.plan()

    @property
    def state(self) -> BenchState:
        """What is shown."""
        with self.lock:
            return self._state

    @property
    def can_undo(self) -> bool:
        """Whether there is an edit to undo."""
        return bool(self._history.past)

    def edit(self, change: Callable[[PlanRequest], PlanRequest], subject: str = "", held: bool = False) -> None:
        """Change the document and plan it.

        Parameters
        ----------
        change : callable
            Returns the new document.
        subject : str
            What is edited: edits of one subject in a row are undone together.
        held : bool
            Whether it is dragged: then they are until :meth:`pause`.

        Raises
        ------
        MinsnapError
            What ``change`` raises; the document then stays as it is.
        """
        with self.lock:
            before = self._state.request
            own = self._history.edit(change(before), subject, held)
            if self._history.present != before:
                self._take_up(own)

    def pause(self) -> None:
        """End a drag: what follows is undone on its own."""
        with self.lock:
            self._history.pause()

    def undo(self) -> None:
        """Take the last edit back."""
        with self.lock:
            if self._history.undo():
                self._take_up(True)

    def redo(self) -> None:
        """Do the edit again that was taken back last."""
        with self.lock:
            if self._history.redo():
                self._take_up(True)

    def plan(self) -> None:
        """Plan the document as it is."""
        with self.lock:
            self._take_up(False)

    def wait(self, timeout: float = 30.0) -> bool:
        """Wait until the plan is final or refused; return whether that is so within this time [s]."""
        return self._worker.wait(timeout)

    def close(self) -> None:
        """End the planning thread."""
        self._worker.close()

    def _take_up(self, keep_ghost: bool) -> None:
        """Show the new document with the last good plan, and ask for its own."""
        planned = self._state.planned
        ghost = planned.trajectory if keep_ghost and planned is not None else self._state.ghost
        self._worker.ask(self._history.present)
        self._show(BenchState(self._history.present, planned, True, ghost=ghost))

    def _take_plan(self, planned: PlannedScene) -> None:
        with self.lock:
            now = self._state
            searching = not planned.final or planned.request != now.request
            self._show(BenchState(now.request, planned, searching, ghost=now.ghost))

    def _refused(self, request: PlanRequest, error: MinsnapError) -> None:
        with self.lock:
            now = self._state
            if request == now.request:
                leg, width = getattr(error, "leg", None), getattr(error, "smallest_width", None)
                self._show(BenchState(request, now.planned, False, f"{error}", leg, width, now.ghost))

    def _show(self, state: BenchState) -> None:
        self._state = state
        self._observer(state)
