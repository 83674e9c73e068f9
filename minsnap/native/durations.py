"""Durations in the native core: the split of a time that costs least."""

from __future__ import annotations

from ctypes import c_double, c_int32, c_void_p
from math import inf
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import GAP
from minsnap.native.corridor import CorridorQuestion, corridor_record
from minsnap.native.free_optimum import Pins, chain_record
from minsnap.native.library import Entry, address
from minsnap.native.records import ChainRecord, CorridorRecord, SplitRecord
from minsnap.native.status import Status

_SPLIT = Entry("minsnap_best_split", ChainRecord, SplitRecord)
_CORRIDOR_SPLIT = Entry("minsnap_best_corridor_split", CorridorRecord, SplitRecord)
_TUBE_SPLIT = Entry("minsnap_best_tube_split", *[c_void_p] * 3, *[c_int32] * 3, c_double, SplitRecord)

EVALUATIONS = 2000
"""Evaluations after which a search is given up."""


class BestSplit(NamedTuple):
    """Durations (legs,) [s], of every evaluation total time [s] and value, (evaluations, 2), and the work of all."""

    durations: FloatArray
    history: FloatArray
    work: float


def best_split(
    points: FloatArray,
    first: FloatArray,
    half: int,
    price: float | None,
    pins: Pins,
    closed: bool = False,
    seconds: float = inf,
) -> BestSplit | Status:
    """Durations of least cost without walls, at the total of the first ones or at a price of a second.

    Parameters
    ----------
    points : ndarray, shape (legs + 1, dim)
        [m].
    half : int
        k, for degree 2k - 1.
    pins : mapping
        At rest at both ends where they say nothing else.
    closed : bool
        The state at the end is the state at the start, and free.
    first : ndarray, shape (legs,)
        Durations to begin with [s].
    price : float or None
        Cost of a second; None for a fixed total.
    seconds : float
        After which the best so far is returned, an evaluation earlier.
    """
    points, first = _floats(points), _floats(first)
    split = _split_record(len(first), 1, price, seconds)
    return _found(_SPLIT(chain_record(points, first, half, pins, closed), split), split)


def best_corridor_split(
    question: CorridorQuestion,
    first: FloatArray,
    pieces: int,
    price: float | None,
    gap: float,
    seconds: float = inf,
    effort: float = inf,
) -> BestSplit | Status:
    """Durations of least cost inside walls.

    Parameters
    ----------
    question : CorridorQuestion
        Its durations are not read.
    first : ndarray, shape (legs,)
        Durations of legs to begin with [s]; each is split equally over ``pieces``.
    price : float or None
        Cost of a second; None for a fixed total.
    gap : float
        Share of the cost that an evaluation may give away, and fall of the cost at which the search ends.
    seconds : float
        As for ``best_split``.
    effort : float
        Share of the work that a question is worth, after which the best so far is returned.
    """
    first = _floats(first)
    split = _split_record(len(first), pieces, price, seconds, effort)
    return _found(_CORRIDOR_SPLIT(corridor_record(question, first, gap), split), split)


def best_tube_split(
    points: FloatArray, first: FloatArray, widths: FloatArray, half: int, gap: float = GAP
) -> BestSplit | Status:
    """Durations of least cost from rest to rest in a tube, at the total of the first ones.

    Parameters
    ----------
    points, first, half
        As for ``best_split``.
    widths : ndarray, shape () or (legs,)
        Half-widths [m].
    gap : float
        As for ``best_corridor_split``.
    """
    points, first = _floats(points), _floats(first)
    split = _split_record(len(first), 1, None, inf)
    where = (address(array) for array in (points, first, widths))
    return _found(_TUBE_SPLIT(*where, points.shape[1], half, widths.ndim == 0, gap, split), split)


def _split_record(legs: int, pieces: int, price: float | None, seconds: float, effort: float = inf) -> SplitRecord:
    """Return a search for the durations of legs, with room for what it finds."""
    ends = {"capacity": EVALUATIONS, "seconds": seconds, "effort": effort}
    places = {"durations": np.empty(legs), "history": np.empty((EVALUATIONS, 2))}
    return SplitRecord(legs=legs, per_leg=pieces, price=price or 0.0, **ends, **places)


def _found(status: int, split: SplitRecord) -> BestSplit | Status:
    if status:
        return Status(status)
    return BestSplit(split.kept["durations"], split.kept["history"][: split.evaluations].copy(), split.work)


def _floats(array: FloatArray) -> FloatArray:
    return np.ascontiguousarray(array, dtype=np.float64)
