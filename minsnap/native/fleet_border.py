"""What the native core proves of a fleet: least distances of pairs, and clearances from obstacles, over all time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.library import Entry, NativeCoreError, describe
from minsnap.native.records import ClearanceQuestion, FleetCurves, SeparationQuestion
from minsnap.native.status import Status

_SEPARATION = Entry("minsnap_fleet_separation", SeparationQuestion)
_CLEARANCE = Entry("minsnap_fleet_clearance", ClearanceQuestion)


class NearPairs(NamedTuple):
    """Pairs in a part of the time, in an order that threads do not change.

    ``pairs`` (k, 2); ``least`` never more than the distance, ``attained`` never less, at ``instant``; each (k,).
    """

    pairs: IntArray
    least: FloatArray
    attained: FloatArray
    instant: FloatArray


class FleetArrays:
    """Curves of several vehicles in the arrays that the native core takes.

    Parameters
    ----------
    points : sequence of ndarray, shape (pieces, degree + 1, 3)
        Control points of each vehicle [m].
    breaks : sequence of ndarray, shape (pieces + 1,)
        From 0 to a common end [s].
    """

    def __init__(self, points: Sequence[FloatArray], breaks: Sequence[FloatArray]) -> None:
        sizes = [array.size for array in points]
        self.vehicles = len(points)
        self._arrays = {
            "points": np.concatenate([array.ravel() for array in points]),
            "breaks": np.concatenate(breaks),
            "point_start": _starts(sizes),
            "break_start": _starts([len(array) for array in breaks]),
            "pieces": np.array([len(array) for array in points], dtype=np.int64),
            "degree": np.array([array.shape[1] - 1 for array in points], dtype=np.int64),
        }

    def curves(self) -> FleetCurves:
        """Return them as entry points take them."""
        return FleetCurves(vehicles=self.vehicles, **self._arrays)


def near_pairs(
    fleet: FleetArrays, radii: FloatArray, downwash: float, reach: float, nearest_only: bool, threads: int
) -> NearPairs:
    """Return every pair that comes nearer than ``reach`` times the sum of its radii, per cell of time.

    With ``nearest_only`` the pair that comes nearest in units of its radii, among a few others.

    Raises
    ------
    NativeCoreError
        If the native core is not in use, or has no memory left.
    """
    capacity = 1024 + 16 * fleet.vehicles
    radii = np.ascontiguousarray(radii)
    while True:
        pairs, values = np.empty((capacity, 2), dtype=np.int64), np.empty((capacity, 3))
        total = np.zeros(1, dtype=np.int64)
        asked = {"radii": radii, "downwash": downwash, "reach": reach, "nearest_only": nearest_only}
        places = {"capacity": capacity, "pairs": pairs, "values": values, "found": total}
        require(_SEPARATION, SeparationQuestion(fleet=fleet.curves(), threads=threads, **asked, **places))
        count = int(total[0])
        if count <= capacity:
            return NearPairs(pairs[:count], *np.ascontiguousarray(values[:count].T))
        capacity = count


def clearances(
    fleet: FleetArrays, obstacles: FloatArray, finest: float, threads: int
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the least clearance of each vehicle, proved, its instant, and the obstacle; each (vehicles,).

    Parameters
    ----------
    fleet : FleetArrays
    obstacles : ndarray, shape (obstacles, 13)
        ``Obstacle.numbers`` of each.
    finest : float
        How far proof and truth may lie apart [m].
    threads : int
    """
    obstacles = np.ascontiguousarray(obstacles)
    values, nearest = np.empty((fleet.vehicles, 3)), np.empty(fleet.vehicles, dtype=np.int64)
    asked = {"obstacles": len(obstacles), "obstacle": obstacles, "finest": finest}
    places = {"values": values, "nearest": nearest}
    require(_CLEARANCE, ClearanceQuestion(fleet=fleet.curves(), threads=threads, **asked, **places))
    return values[:, 0], values[:, 2], nearest


def require(entry: Entry, *arguments: Any) -> None:
    """Call an entry point, and raise NativeCoreError where the Python core is in use, or if it does not answer."""
    if entry.function() is None:
        raise NativeCoreError(f"fleets need the native core, and this is the {describe()}")
    status = Status(entry(*arguments))
    if status:
        raise NativeCoreError(f"the native core does not take this fleet: {status.reason}")


def _starts(sizes: Sequence[int]) -> IntArray:
    return np.concatenate(([0], np.cumsum(sizes)[:-1])).astype(np.int64)
