"""Durations in the native core: the optimal cost with its exact gradient, and the split of a time that costs least."""

from __future__ import annotations

from collections.abc import Mapping
from ctypes import c_double, c_int32, c_int64, c_void_p
from math import inf
from typing import Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import GAP
from minsnap.native.corridor import CorridorQuestion, corridor_record
from minsnap.native.library import Entry, address, optional_address
from minsnap.native.records import CorridorRecord, SplitRecord
from minsnap.native.status import Status

_CHAIN = (*[c_void_p] * 2, c_int64, *[c_void_p] * 3)
"""States at the ends; pins: how many, knots, masks, values."""

_GRADIENT = Entry("minsnap_cost_gradient", *[c_int64] * 4, *[c_void_p] * 2, *_CHAIN, *[c_void_p] * 3)
_SPLIT = Entry(
    "minsnap_best_split", *[c_int64] * 4, *[c_void_p] * 2, c_double, *_CHAIN, c_double, c_int64, *[c_void_p] * 3
)
_CORRIDOR_SPLIT = Entry("minsnap_best_corridor_split", CorridorRecord, SplitRecord)
_TUBE_SPLIT = Entry(
    "minsnap_best_tube_split", *[c_void_p] * 3, c_int64, *[c_int32] * 3, c_double, c_int64, *[c_void_p] * 3
)

EVALUATIONS = 2000
"""Evaluations after which a search is given up."""

Pins = Mapping[int, Mapping[int, FloatArray]]
"""Derivatives of order 1 … k - 1 by waypoint and order; what is not given at an open end is zero."""


class CostGradient(NamedTuple):
    """Optimal cost, its derivatives in the durations (legs,) and in the waypoints (legs + 1, dim)."""

    cost: float
    durations: FloatArray
    waypoints: FloatArray


class SplitFound(NamedTuple):
    """Durations (legs,) [s], and of every evaluation total time [s] and value, (evaluations, 2)."""

    durations: FloatArray
    history: FloatArray


def cost_gradient(
    points: FloatArray, durations: FloatArray, half: int, pins: Pins | None = None, closed: bool = False
) -> CostGradient | Status | None:
    """Least integral of the squared k-th derivative through points, and how it changes with durations and points.

    Derivatives by the envelope theorem, from the same elimination as the curve: exact but for rounding, which grows
    with the ratio of the durations (six digits are left at 50, 15 and 6 for degrees 7, 9 and 11).

    Parameters
    ----------
    points : ndarray, shape (legs + 1, dim)
        [m].
    durations : ndarray, shape (legs,)
        [s].
    half : int
        k, for degree 2k - 1.
    pins : mapping, optional
        By default at rest at both ends.
    closed : bool
        The state at the end is the state at the start, and free.

    Returns
    -------
    CostGradient, Status or None
        A status says why the native core does not answer; None, that the Python core is in use.
    """
    call = _GRADIENT.function()
    if call is None:
        return None
    points, durations = _floats(points), _floats(durations)
    cost, slopes, forces = np.zeros(1), np.empty(len(durations)), np.empty(points.shape)
    kept, chain = _chain(len(durations), points.shape[1], half, pins or {})
    status = call(
        *(half, len(durations), points.shape[1], closed, address(points), address(durations)),
        *(*chain, address(cost), address(slopes), address(forces)),
    )
    del kept
    return Status(status) if status else CostGradient(float(cost[0]), slopes, forces)


def best_split(
    points: FloatArray,
    first: FloatArray,
    half: int,
    price: float | None,
    pins: Pins,
    closed: bool = False,
    seconds: float = inf,
) -> SplitFound | Status | None:
    """Durations of least cost without walls, at the total of the first ones or at a price of a second.

    Parameters
    ----------
    points, half, pins, closed
        As for ``cost_gradient``.
    first : ndarray, shape (legs,)
        Durations to begin with [s].
    price : float or None
        Cost of a second; None for a fixed total.
    seconds : float
        After which the best so far is returned, an evaluation earlier.
    """
    call = _SPLIT.function()
    if call is None:
        return None
    points, first = _floats(points), _floats(first)
    kept, chain = _chain(len(first), points.shape[1], half, pins)
    found = _Found(len(first))
    status = call(
        *(half, len(first), points.shape[1], closed, address(points), address(first), price or 0.0),
        *(*chain, seconds, EVALUATIONS, *found.addresses()),
    )
    del kept
    return Status(status) if status else found.split()


def best_corridor_split(
    question: CorridorQuestion, first: FloatArray, pieces: int, price: float | None, gap: float, seconds: float = inf
) -> SplitFound | Status | None:
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
    """
    call = _CORRIDOR_SPLIT.function()
    if call is None:
        return None
    first, found = _floats(first), _Found(len(first))
    split = SplitRecord(
        **{"legs": len(first), "per_leg": pieces, "capacity": EVALUATIONS, "price": price or 0.0, "seconds": seconds},
        **{"durations": found.durations, "history": found.history},
    )
    status = call(corridor_record(question, first, gap), split)
    found.figures[0] = split.evaluations
    return Status(status) if status else found.split()


def best_tube_split(
    points: FloatArray, first: FloatArray, widths: FloatArray, half: int, gap: float = GAP
) -> SplitFound | Status | None:
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
    call = _TUBE_SPLIT.function()
    if call is None:
        return None
    points, first, found = _floats(points), _floats(first), _Found(len(first))
    status = call(
        *(address(points), address(first), address(widths), len(first), points.shape[1], half, widths.ndim == 0, gap),
        *(EVALUATIONS, *found.addresses()),
    )
    return Status(status) if status else found.split()


class _Found:
    """Where a search writes what it finds."""

    def __init__(self, legs: int) -> None:
        self.durations, self.history, self.figures = np.empty(legs), np.empty((EVALUATIONS, 2)), np.zeros(1)

    def addresses(self) -> list[Any]:
        return [address(array) for array in (self.durations, self.history, self.figures)]

    def split(self) -> SplitFound:
        return SplitFound(self.durations, self.history[: int(self.figures[0])].copy())


def _chain(legs: int, dim: int, half: int, pins: Pins) -> tuple[list[Any], tuple[Any, ...]]:
    """Arrays of states at the ends and of pins at inner knots, to be kept alive, and their arguments."""
    ends = [_state(pins[knot], half, dim) if knot in pins else None for knot in (0, legs)]
    inner = sorted(knot for knot in pins if 0 < knot < legs and pins[knot])
    knots = np.array(inner, dtype=np.int64)
    masks = np.array([sum(1 << order for order in pins[knot]) for knot in inner], dtype=np.uint32)
    values = np.array([_state(pins[knot], half, dim) for knot in inner]).reshape(len(inner), half - 1, dim)
    kept = [*ends, knots, masks, values]
    where = [optional_address(array) for array in kept]
    return kept, (*where[:2], len(inner), *where[2:])


def _state(state: Mapping[int, FloatArray], half: int, dim: int) -> FloatArray:
    """Return derivatives 1 … k - 1, shape (k - 1, dim); those not given are zero."""
    values = np.zeros((half - 1, dim))
    for order, value in state.items():
        values[order - 1] = value
    return values


def _floats(array: FloatArray) -> FloatArray:
    return np.ascontiguousarray(array, dtype=np.float64)
