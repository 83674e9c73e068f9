"""The state of a studio without any page: document, undo, the last good plan, and the thread that plans.

The latest request wins; a quick plan comes first where the search takes long.
"""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from time import monotonic, perf_counter
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_waypoints
from minsnap.basics.limit_kinds import KIND
from minsnap.certificate import Certificate, certify
from minsnap.errors import MinsnapError
from minsnap.files import FileRequest
from minsnap.limits import Limits
from minsnap.planning import plan
from minsnap.studio.edits import straight_durations
from minsnap.trajectory import Step, Trajectory

STRETCHES = 6
"""Attempts at slowing a quick plan down until its limits hold."""

SLACK = 1e-6
"""By how much more it is slowed down, relative."""


SETTLED = 0.2
"""Seconds without a newer request after which a better plan is searched."""

Refused = Callable[[FileRequest, MinsnapError], None]


class Superseded(Exception):  # noqa: N818
    """A newer request has arrived: raised inside a search to end it; never leaves the studio."""


@dataclass(frozen=True, eq=False)
class PlannedScene:
    """A plan with its request.

    Parameters
    ----------
    request : FileRequest
        The request that was planned.
    trajectory : Trajectory
        Its plan.
    certificate : Certificate
        What holds of it.
    final : bool
        Whether it is what ``plan`` returns for the request; False while a better one is searched.
    milliseconds : float
        From the request to this plan.
    """

    request: FileRequest
    trajectory: Trajectory
    certificate: Certificate
    final: bool
    milliseconds: float


def planned_in_stages(
    request: FileRequest, durations: FloatArray | None, superseded: Callable[[], bool]
) -> Iterator[PlannedScene]:
    """Plan a request.

    Where durations are searched within limits, the first plan has the durations of the last one, as often stretched as
    the limits need, so that it is there in milliseconds; it is left out where it does not keep everything. Every plan
    is certified.

    Parameters
    ----------
    request : FileRequest
    durations : ndarray, shape (legs,), or None
        Of the last plan [s].
    superseded : callable
        Whether a newer request is there; called during the search.

    Yields
    ------
    PlannedScene
        The last one is what :func:`minsnap.plan` returns.

    Raises
    ------
    MinsnapError
        What ``plan`` raises.
    Superseded
        If a newer request has arrived.
    """
    began = perf_counter()
    arguments = request.request().arguments()
    if "limits" in arguments and request.durations is None and request.total_time is None:
        quick = _quick_plan(request, arguments, durations)
        shown = None if quick is None else _certified(request, quick, False, began)
        if shown is not None and shown.certificate.ok:
            yield shown

    def check(step: Step | None = None) -> None:
        if superseded():
            raise Superseded

    check()
    searches = arguments.get("durations") is None
    curve = plan(**arguments, progress=check) if searches else plan(**arguments)
    yield _certified(request, curve, True, began)


def _certified(request: FileRequest, curve: Trajectory, final: bool, began: float) -> PlannedScene:
    tolerance = 0.0 if request.waypoint_tolerance is None else request.waypoint_tolerance
    certificate = certify(curve, request.places, request.walls, request.bounds, tolerance, avoid=request.obstacles)
    return PlannedScene(request, curve, certificate, final, 1e3 * (perf_counter() - began))


def _quick_plan(request: FileRequest, arguments: dict[str, Any], durations: FloatArray | None) -> Trajectory | None:
    """Plan with fixed durations, stretched as often as the limits need; None if that does not end."""
    known = durations is not None and len(durations) == request.legs
    times = np.array(durations if known else straight_durations(request))
    limits: Limits = arguments["limits"]
    try:
        for attempt in range(STRETCHES):
            curve = plan(**arguments | {"limits": None, "pieces": 1, "durations": times})
            factor = max(_stretch(used.name, used.fraction) for used in limits.utilisation(curve))
            if factor <= 1.0 and (attempt or factor > 1.0 - SLACK):
                return curve
            times = times * (factor * (1.0 + SLACK))
    except MinsnapError:
        return None
    return None


def _stretch(name: str, fraction: float) -> float:
    """Return the factor on time that uses a limit fully: exact for norms of derivatives, a guess for the others."""
    kind = KIND[name]
    if kind.order:
        return float(fraction ** (1.0 / kind.order))
    return float(min(max(fraction, 0.9), 4.0) ** 0.5)


OnPlan = Callable[[PlannedScene], None]


class PlanWorker:
    """A thread that plans the last request.

    Parameters
    ----------
    on_plan : callable
        Called with every plan, in the thread.
    refused : callable
        Called with a request that cannot be met, and why.
    """

    def __init__(self, on_plan: OnPlan, refused: Refused) -> None:
        self._on_plan, self._refused = on_plan, refused
        self._changed = threading.Condition()
        self._waiting: FileRequest | None = None
        self._durations: FloatArray | None = None
        self._busy = self._closed = False
        self._thread = threading.Thread(target=self._run, name="studio plans", daemon=True)
        self._thread.start()

    def ask(self, request: FileRequest) -> None:
        """Plan this request next, instead of any other that waits; a search that runs is ended."""
        with self._changed:
            self._waiting = request
            self._changed.notify_all()

    def wait(self, timeout: float) -> bool:
        """Wait until nothing is left to plan; return whether that is so within this time [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: self._waiting is None and not self._busy, timeout)

    def close(self, timeout: float = 2.0) -> None:
        """End the thread; it is left behind if a plan without a search takes longer than this [s]."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join(timeout)

    def _run(self) -> None:
        while (request := self._next()) is not None:
            try:
                self._answer(request)
            except Exception:  # of the one that is told of a refusal: the next request is planned all the same
                traceback.print_exc()

    def _answer(self, request: FileRequest) -> None:
        try:
            self._plan(request)
        except Superseded:
            pass
        except MinsnapError as error:
            self._refused(request, error)
        except Exception:
            traceback.print_exc()
            self._refused(request, MinsnapError("planning failed in an unexpected way: the terminal says more"))

    def _next(self) -> FileRequest | None:
        with self._changed:
            self._busy = False
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._waiting is not None or self._closed)
            request, self._waiting, self._busy = self._waiting, None, True
            return None if self._closed else request

    def _superseded(self) -> bool:
        return self._waiting is not None or self._closed

    def _plan(self, request: FileRequest) -> None:
        for planned in planned_in_stages(request, self._durations, self._superseded):
            self._durations = np.diff(planned.trajectory.leg_breaks)
            self._on_plan(planned)
            if not planned.final:
                self._settle()

    def _settle(self) -> None:
        """Wait a little for a newer request before a search: during a drag only quick plans are made."""
        with self._changed:
            self._changed.wait_for(self._superseded, SETTLED)


PAUSE = 1.0
"""Edits of one thing that follow each other within this time are undone together [s]."""

MOST = 500
"""States that are kept."""


@dataclass
class EditHistory:
    """The states of a document before and after the present one.

    Parameters
    ----------
    present : FileRequest
        The document.
    clock : callable
        Returns seconds.
    """

    present: FileRequest
    clock: Callable[[], float] = monotonic
    past: list[FileRequest] = field(default_factory=list)
    future: list[FileRequest] = field(default_factory=list)
    _last: tuple[str, float] = ("", 0.0)

    def edit(self, document: FileRequest, subject: str = "", held: bool = False) -> bool:
        """Replace the document; return whether that can be undone on its own.

        Parameters
        ----------
        document : FileRequest
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

    def _step(self, source: list[FileRequest], target: list[FileRequest]) -> bool:
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
    request : FileRequest
        The document as it is edited.
    planned : PlannedScene or None
        The last good plan; of an earlier document while ``searching`` or where there is a ``refusal``.
    searching : bool
        Whether a plan, or a better one, is searched.
    refusal : str
        Why the document cannot be planned; empty where it can.
    leg : int or None
        The leg that it is about.
    ghost : Trajectory or None
        The plan before the last edit.
    """

    request: FileRequest
    planned: PlannedScene | None = None
    searching: bool = False
    refusal: str = ""
    leg: int | None = None
    ghost: Trajectory | None = None

    @property
    def is_plan_of_document(self) -> bool:
        """Whether the plan is the final one of the document as it is."""
        return self.planned is not None and self.planned.final and self.planned.request == self.request


Observer = Callable[[BenchState], None]
Present = Callable[[], BenchState]


class Workbench:
    """A document that is planned again after every edit.

    Parameters
    ----------
    request : FileRequest
        The first document.
    observer : callable
        Called with the state after every change of it, one call at a time, from any thread.
    planned : PlannedScene, optional
        A plan of the document that is there already.
    """

    def __init__(self, request: FileRequest, observer: Observer, planned: PlannedScene | None = None) -> None:
        self.lock = threading.RLock()
        self._history = EditHistory(request)
        self._observer = observer
        self._state = BenchState(request, planned)
        self._worker = PlanWorker(self._take_plan, self._refused)
        if planned is not None:
            self._show(self._state)
        else:
            with self.lock:
                self._take_up(False)

    @property
    def state(self) -> BenchState:
        """What is shown."""
        with self.lock:
            return self._state

    def edit(self, change: Callable[[FileRequest], FileRequest], subject: str = "", held: bool = False) -> None:
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
            What ``change`` raises, or where waypoints are no places; the document then stays as it is.
        """
        with self.lock:
            before = self._state.request
            after = change(before)
            check_waypoints(after.waypoints)
            own = self._history.edit(after, subject, held)
            if self._history.present != before:
                self._take_up(own)

    def pause(self) -> None:
        """End a drag: what follows is undone on its own; waits for no plan that is being shown."""
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

    def _refused(self, request: FileRequest, error: MinsnapError) -> None:
        with self.lock:
            now = self._state
            if request == now.request:
                leg = getattr(error, "leg", None)
                self._show(BenchState(request, now.planned, False, f"{error}", leg, now.ghost))

    def _show(self, state: BenchState) -> None:
        self._state = state
        self._observer(state)
