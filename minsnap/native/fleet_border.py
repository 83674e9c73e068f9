"""What the native core proves of a fleet: least distances of pairs, and clearances from obstacles, over all time."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import Structure, byref, c_double, c_int64, c_void_p, sizeof
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.library import Entry, NativeCoreError, describe
from minsnap.native.records import fields
from minsnap.native.status import Status

_SEPARATION = Entry("minsnap_fleet_separation", c_void_p)
_CLEARANCE = Entry("minsnap_fleet_clearance", c_void_p)


class FleetCurves(Structure):
    """``FleetCurves`` of ``fleet/curves.hpp``."""

    _fields_ = (
        *fields(c_void_p, "points", "breaks", "point_start", "break_start", "pieces", "degree"),
        ("vehicles", c_int64),
    )


class _SeparationQuestion(Structure):
    _fields_ = (
        ("size", c_int64),
        ("fleet", FleetCurves),
        ("radii", c_void_p),
        *fields(c_double, "downwash", "reach"),
        *fields(c_int64, "nearest_only", "threads", "capacity"),
        *fields(c_void_p, "pairs", "values", "found"),
    )


class _ClearanceQuestion(Structure):
    _fields_ = (
        ("size", c_int64),
        ("fleet", FleetCurves),
        ("obstacles", c_int64),
        ("obstacle", c_void_p),
        ("finest", c_double),
        ("threads", c_int64),
        *fields(c_void_p, "values", "nearest"),
    )


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
        self._kept = (
            np.concatenate([array.ravel() for array in points]),
            np.concatenate(breaks),
            _starts(sizes),
            _starts([len(array) for array in breaks]),
            np.array([len(array) for array in points], dtype=np.int64),
            np.array([array.shape[1] - 1 for array in points], dtype=np.int64),
        )

    def curves(self) -> FleetCurves:
        """Return the border's view of them, valid as long as this object lives."""
        return FleetCurves(*(array.ctypes.data for array in self._kept), self.vehicles)


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
        question = _SeparationQuestion(
            sizeof(_SeparationQuestion),
            *(fleet.curves(), radii.ctypes.data, downwash, reach, int(nearest_only), threads, capacity),
            *(array.ctypes.data for array in (pairs, values, total)),
        )
        require(_SEPARATION, byref(question))
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
    question = _ClearanceQuestion(
        sizeof(_ClearanceQuestion),
        *(fleet.curves(), len(obstacles), obstacles.ctypes.data, finest, threads),
        *(values.ctypes.data, nearest.ctypes.data),
    )
    require(_CLEARANCE, byref(question))
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
