"""What the native core does for a fleet: least distances, clearances from obstacles, and bids for goals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.library import Entry, NativeCoreError, describe
from minsnap.native.records import AssignmentQuestion, ClearanceQuestion, FleetCurves, SeparationQuestion
from minsnap.native.status import Status

_SEPARATION = Entry("minsnap_fleet_separation", SeparationQuestion)
_CLEARANCE = Entry("minsnap_fleet_clearance", ClearanceQuestion)
_ASSIGNMENT = Entry("minsnap_fleet_assignment", AssignmentQuestion)


ROUNDED = 256.0
"""Roundings of the largest coordinate that distances along parts of curves are off by, at most about."""


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

    @property
    def rounding(self) -> float:
        """How far places may be off by rounding, where they are far from the origin [m]."""
        points = self._arrays["points"]
        return ROUNDED * float(np.finfo(np.float64).eps) * max(float(points.max()), -float(points.min()))

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
        How far proof and truth may lie apart [m]; where rounding is more, by that, as halving would never end.
    threads : int
    """
    obstacles, finest = np.ascontiguousarray(obstacles), max(finest, fleet.rounding)
    values, nearest = np.empty((fleet.vehicles, 3)), np.empty(fleet.vehicles, dtype=np.int64)
    asked = {"obstacles": len(obstacles), "obstacle": obstacles, "finest": finest}
    places = {"values": values, "nearest": nearest}
    require(_CLEARANCE, ClearanceQuestion(fleet=fleet.curves(), threads=threads, **asked, **places))
    return values[:, 0], values[:, 2], nearest


def bid_for_goals(
    starts: FloatArray, goals: FloatArray, step: float, bids: int, prices: FloatArray, goal_of: IntArray
) -> int:
    """Let vehicles bid for goals, and return how many have none yet.

    Parameters
    ----------
    starts, goals : ndarray, shape (3, m) and (3, k), k >= m
        [m].
    step : float
        By which a bid raises a price beyond the next best goal [m^2].
    bids : int
        The most of one call.
    prices : ndarray, shape (k,)
        Of the goals [m^2]; changed.
    goal_of : ndarray of int, shape (k,)
        Of each vehicle, those beyond m at no cost; -1 for none; changed.

    Raises
    ------
    NativeCoreError
        If the native core is not in use, or has no memory left.
    """
    waiting = np.zeros(1, dtype=np.int64)
    asked = {"vehicles": starts.shape[1], "goals": goals.shape[1], "step": step, "bids": bids}
    places = {"start": starts, "goal": goals, "price": prices, "goal_of": goal_of, "waiting": waiting}
    require(_ASSIGNMENT, AssignmentQuestion(**asked, **places))
    return int(waiting[0])


def require(entry: Entry, *arguments: Any) -> None:
    """Call an entry point, and raise NativeCoreError where the Python core is in use, or if it does not answer."""
    if entry.function() is None:
        raise NativeCoreError(f"fleets need the native core, and this is the {describe()}")
    status = Status(entry(*arguments))
    if status:
        raise NativeCoreError(f"the native core does not take this fleet: {status.reason}")


def _starts(sizes: Sequence[int]) -> IntArray:
    return np.concatenate(([0], np.cumsum(sizes)[:-1])).astype(np.int64)
