"""The thread that plans: the latest request wins, older ones are dropped."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import MinsnapError
from minsnap.planning.request import PlanRequest
from minsnap.studio.plan_stages import PlannedScene, Superseded, planned_in_stages

SETTLED = 0.2
"""Seconds without a newer request after which a better plan is searched."""

OnPlan = Callable[[PlannedScene], None]
Refused = Callable[[PlanRequest, MinsnapError], None]


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
        self._waiting: PlanRequest | None = None
        self._durations: FloatArray | None = None
        self._busy = self._closed = False
        self._thread = threading.Thread(target=self._run, name="studio plans", daemon=True)
        self._thread.start()

    def ask(self, request: PlanRequest) -> None:
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
                self._plan(request)
            except Superseded:
                pass
            except MinsnapError as error:
                self._refused(request, error)
            except Exception:
                traceback.print_exc()
                self._refused(request, MinsnapError("planning failed in an unexpected way: the terminal says more"))

    def _next(self) -> PlanRequest | None:
        with self._changed:
            self._busy = False
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._waiting is not None or self._closed)
            request, self._waiting, self._busy = self._waiting, None, True
            return None if self._closed else request

    def _superseded(self) -> bool:
        return self._waiting is not None or self._closed

    def _plan(self, request: PlanRequest) -> None:
        for planned in planned_in_stages(request, self._durations, self._superseded):
            self._durations = np.diff(planned.trajectory.leg_breaks)
            self._on_plan(planned)
            if not planned.final:
                self._settle()

    def _settle(self) -> None:
        """Wait a little for a newer request before a search: during a drag only quick plans are made."""
        with self._changed:
            self._changed.wait_for(self._superseded, SETTLED)
