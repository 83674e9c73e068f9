"""Ways to come to rest from a moving state, inside walls, found and proved by the native core."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from sys import maxsize
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.library import Entry
from minsnap.native.records import StopRecord, WallsRecord

_STOP = Entry("minsnap_stop", StopRecord)


class ProvedStop(NamedTuple):
    """A polynomial that is proved to stop inside the walls: as one piece, or two where it enters the second leg.

    Parameters
    ----------
    points : ndarray, shape (pieces, 2k, dim)
        Control points [m].
    durations : ndarray, shape (pieces,)
        [s].
    limited : bool
        Whether it is proved to be in the sets of the limits, too.
    """

    points: FloatArray
    durations: FloatArray
    limited: bool


class StopFamily:
    """Stops from a state; none where the native core is not in use.

    Parameters
    ----------
    state : ndarray, shape (k, dim)
        Derivatives 0 ... k - 1 at the start [m/s^order].
    waypoints : ndarray, shape (legs + 1, dim)
        [m].
    walls, limits : sequence of WallsRecord
        Of legs, and of limits for one leg.
    unit : float
        Time that stopping takes at a large acceleration [s].
    """

    def __init__(
        self,
        state: FloatArray,
        waypoints: FloatArray,
        walls: Sequence[WallsRecord],
        limits: Sequence[WallsRecord],
        unit: float,
    ) -> None:
        (half, dim), legs = state.shape, len(waypoints) - 1
        sizes = {"half": half, "dim": dim, "walls": len(walls), "limits": len(limits), "legs": legs}
        self._points, self._caps = np.empty((2, 2 * half, dim)), np.full(legs, np.inf)
        self._record = StopRecord(
            **sizes,
            unit=unit,
            state=np.ascontiguousarray(state),
            waypoints=np.ascontiguousarray(waypoints),
            cones=[*walls, *limits],
            caps=self._caps,
            points=self._points,
        )

    def members(self) -> Iterator[ProvedStop]:
        """Yield the stops of the family in closed form, shortest first."""
        self._record.member = 0
        while (stop := self._found()) is not None:
            yield stop
            self._record.member += 1

    def proved(self, duration: float, points: FloatArray) -> ProvedStop | None:
        """Return control points (2k, dim), counted from the start, as a stop in the first leg, or None."""
        self._record.member, self._record.duration = -1, duration
        self._points[0] = points
        return self._found()

    @property
    def caps(self) -> FloatArray:
        """How far each of the first legs goes on beyond its end, (legs,) [m]; infinite where that is not bounded."""
        self._record.member = maxsize  # beyond the family
        self._found()
        return self._caps

    def _found(self) -> ProvedStop | None:
        if _STOP(self._record):
            return None
        duration, change = self._record.duration, self._record.change
        durations = np.array([change * duration, (1.0 - change) * duration] if change else [duration])
        return ProvedStop(self._points[: len(durations)].copy(), durations, bool(self._record.limited))
