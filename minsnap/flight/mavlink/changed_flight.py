"""What plans changes of a flight from what is flown, and hands them over in time: for orders, and for what is seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

from minsnap.certificate import certify
from minsnap.errors import FlightError, TimingError
from minsnap.limits import Limits
from minsnap.replanning import Change
from minsnap.trajectory import Trajectory

BUDGETS = (0.2, 0.5, 1.0)
"""Times from a question to its splice that are tried in turn [s]."""


class ChangeableFlight(Protocol):
    """What takes changes: a :class:`~minsnap.flight.mavlink.streaming.Streamer`."""

    @property
    def now(self) -> float | None:
        """Instant on the clock of the trajectory that is flown [s]; None unless it is flying."""

    @property
    def began(self) -> float:
        """Instant of the flight at which that trajectory has its time 0 [s]."""

    def change(self, change: Change) -> Trajectory:
        """Fly a change from its splice on; return what is flown from then on."""

    def stop(self) -> None:
        """Stop and hold."""

    def finish(self) -> None:
        """End the flight at the end of what is flown."""


class ChangedFlight:
    """A flight, and what it flies.

    Parameters
    ----------
    flight : ChangeableFlight
        That flies ``flown``.
    flown : Trajectory
        What is flown at first.
    limits : Limits
        Which all changes keep.
    """

    def __init__(self, flight: ChangeableFlight, flown: Trajectory, limits: Limits) -> None:
        self._flight, self._flown, self._limits = flight, flown, limits

    def _handed_over(self, change: Change) -> Trajectory:
        """Let the flight take a change; return what is flown from its splice on."""
        return self._flight.change(change)

    def _planned(self, plan: Callable[[float, float], Change]) -> Change:
        """Plan with more and more time, hand the change over, and return it with its splice on the flight's clock."""
        refused: TimingError | None = None
        for budget in BUDGETS:
            now = self._now()
            try:
                change, before = plan(now, budget), self._flight.began
                self._flown = self._handed_over(change)
                return replace(change, splice=before + change.splice)
            except TimingError as error:
                refused = error
        assert refused is not None
        raise refused

    def _now(self) -> float:
        now = self._flight.now
        if now is None:
            raise FlightError("the vehicle is not flying this plan: nothing was changed")
        return max(now, 0.0)

    def _told(self, change: Change) -> dict[str, Any]:
        """Return the splice, and the figures of the certificate of what is flown from then on."""
        proved = certify(self._flown, limits=self._limits, limits_from=change.limits_from)
        return {
            "splice": change.splice,
            "duration": self._flown.duration,
            "certified": proved.ok and change.certified,
            "flown": change.certified,
            "max_speed": proved.max_speed,
            "max_acceleration": proved.max_acceleration,
            "limits": {used.name: {"value": used.value, "limit": used.limit} for used in proved.utilisation},
            "end": self._flown(self._flown.duration).tolist(),
            **({} if change.certified else {"note": f"the stop is flown: {change.reason}"}),
        }
