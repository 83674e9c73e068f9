"""The native search for the shortest time: one interior point on the whole nonlinear programme."""

from __future__ import annotations

import ctypes
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import IntEnum
from itertools import islice
from math import prod
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.library import Entry
from minsnap.native.records import POLL, ConeGroup, MomentaryLimit, ShortestAnswer, ShortestRequest
from minsnap.native.status import Status

_SEARCH = Entry("minsnap_shortest_time", ShortestRequest, ShortestAnswer)


@dataclass(frozen=True, eq=False)
class ConeSets:
    """Sets that a derivative stays in: norm of A (x - a) <= radius + slope . (x - a), in the form of ``Walls``.

    Parameters
    ----------
    place : ndarray of int, shape (m,)
        Legs, or waypoints with ``at_knots``.
    matrix : ndarray, shape (m, q, dim)
    anchor, slope : ndarray, shape (m, dim)
    radius, width : ndarray, shape (m,)
    order : int
    outside : bool
        Whether the norm must be at least the radius instead; then without slope.
    at_knots : bool
    """

    place: IntArray
    matrix: FloatArray
    anchor: FloatArray
    slope: FloatArray
    radius: FloatArray
    width: FloatArray
    order: int
    outside: bool = False
    at_knots: bool = False


class InstantKind(IntEnum):
    """Limits on several derivatives: ``LimitKind`` of ``src/shortest_time/instant_limits.hpp``."""

    LEAST_THRUST = 0
    MOST_THRUST = 1
    TILT = 2
    BODY_RATE = 3
    UNSPUN_ROTORS = 4
    YAWED_ROTORS = 5
    HEADING_RATE = 6
    LOOK_RATE = 7


@dataclass(frozen=True)
class InstantLimit:
    """A limit on several derivatives at an instant, on every leg, and the numbers that its functions take."""

    kind: InstantKind
    parameters: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Guess:
    """A curve to begin from.

    Parameters
    ----------
    pieces : int
        Of each leg.
    durations : ndarray, shape (pieces in all,)
        [s].
    knots : ndarray, shape (pieces in all + 1, k, dim)
        Derivatives [m/s^order].
    slower : float
        Factor on time at which it is begun from.
    least : ndarray, shape (pieces in all,), or None
        Durations that none goes below [s].
    """

    pieces: int
    durations: FloatArray
    knots: FloatArray
    slower: float = 1.0
    least: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class ShortestQuestion:
    """What is searched for.

    Parameters
    ----------
    pinned : ndarray, shape (waypoints, k, dim)
        Derivatives [m/s^order]; positions are nominal where they are free, and along the axes of ``turned``.
    free : ndarray of bool, shape (waypoints, k, dim)
    lengths : ndarray, shape (legs,)
        Of the legs, none very short [m].
    norms : tuple of float
        Speed, acceleration, jerk and snap that a motion in any direction may reach; infinite where free.
    sets : sequence of ConeSets
    limits : sequence of InstantLimit
    parts : tuple of int
        Into how many each piece is divided, one time after another.
    closed, moving : bool
        Whether it is a lap, and whether time may not be scaled to keep the limits.
    worthwhile : float
        Relative gain of a division below which no further one is tried.
    inwards, tightened : float
        Shares of their widths by which walls are moved inwards, and limits.
    price : float
        Of a second, for the least sum of cost and price; 0 for the least time alone.
    rough : bool
        Whether the curve is only one to begin another search from, which may be outside of walls and limits.
    guess : Guess or None
        In place of rest at every waypoint; its pieces are divided then.
    turned : ndarray, shape (waypoints, dim, dim), or None
        Columns are the axes along which a waypoint's position is free or pinned; zeros for the world's.
    """

    pinned: FloatArray
    free: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    lengths: FloatArray
    norms: tuple[float, ...]
    sets: Sequence[ConeSets]
    limits: Sequence[InstantLimit]
    parts: tuple[int, ...]
    closed: bool
    moving: bool
    worthwhile: float
    inwards: float
    tightened: float = 0.0
    price: float = 0.0
    rough: bool = False
    guess: Guess | None = None
    turned: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class ShortestCurve:
    """A curve near the shortest one.

    Parameters
    ----------
    durations : ndarray, shape (pieces,)
        [s].
    points : ndarray, shape (pieces, 2k, dim)
        Control points [m].
    knots : ndarray, shape (pieces + 1, k, dim)
        Derivatives [m/s^order].
    iterations : int
    stopped : bool
        Whether the search was ended from outside.
    kept : bool
        Whether it converged to a curve inside all walls.
    slack : float
        How far inside its bound the most used limit of the search is, in widths.
    """

    durations: FloatArray
    points: FloatArray
    knots: FloatArray
    iterations: int
    stopped: bool
    kept: bool
    slack: float = 0.0


def search_shortest(question: ShortestQuestion, poll: Callable[[float, bool, int], bool]) -> ShortestCurve | None:
    """Search for the shortest time; None where the native core is not in use, or does not take the question.

    Parameters
    ----------
    question : ShortestQuestion
    poll : callable
        Called before every iteration with the total time [s], whether Ctrl-C was pressed since the search began, and
        the number of rows; True ends the search. What it raises is raised here.
    """
    search = _SEARCH.function()
    if search is None:
        return None
    raised: list[BaseException] = []
    pressed: list[int] = []
    told: list[bool] = []

    def polled(total: float, rows: int) -> int:
        try:
            if pressed:
                told.append(True)
            return int(poll(total, bool(pressed), rows))
        except BaseException as error:  # noqa: BLE001 - carried through the native core
            raised.append(error)
            return 1

    waypoints, half, dim = question.pinned.shape
    more = max(0, (2 if half == 4 else 3) - dim)  # to the coordinates that are known for a degree: they are always zero
    most = (waypoints - 1) * prod(question.parts)
    most *= 1 if question.guess is None else question.guess.pieces
    durations, points, knots = (
        np.empty(most),
        np.empty((most, 2 * half, dim + more)),
        np.empty((most + 1, half, dim + more)),
    )
    arrays = {"durations": durations, "points": points, "knots": knots}
    answer = ShortestAnswer(**{name: array.ctypes.data for name, array in arrays.items()})
    request, _held = _request(question, more, POLL(polled))
    with _noting(pressed):
        status = Status(search(request, answer))
    if raised:
        raise raised[0]
    if pressed and not told:
        raise KeyboardInterrupt
    if status not in (Status.DONE, Status.SPENT, Status.NO_PROGRESS):
        return None
    count = answer.pieces * (waypoints - 1)
    found = durations, points, knots
    if count < most or more:
        found = durations[:count], points[:count, :, :dim], knots[: count + 1, :, :dim]
    ended = status is Status.SPENT, status is not Status.NO_PROGRESS
    return ShortestCurve(*found, answer.iterations, *ended, slack=-answer.limit)


@contextmanager
def _noting(pressed: list[int]) -> Iterator[None]:
    """Note Ctrl-C while compiled code runs: the interpreter drops an exception that it raises as a callback begins."""
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, lambda number, frame: pressed.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


class _Block:
    """Arrays of one kind one after the other, and the addresses at which the native core reads them."""

    def __init__(self, kind: type, arrays: Sequence[np.ndarray[Any, Any] | None]) -> None:
        given = [array.ravel() for array in arrays if array is not None]
        self.values: np.ndarray[Any, Any] = np.concatenate(given, dtype=kind, casting="unsafe")
        places: list[int | None] = []
        place = self.values.ctypes.data
        for array in arrays:
            places.append(None if array is None else place)
            place += 0 if array is None else 8 * array.size
        self.places = iter(places)

    def take(self, count: int) -> list[int | None]:
        """Return the next addresses."""
        return list(islice(self.places, count))


def _request(question: ShortestQuestion, more: int, poll: object) -> tuple[ShortestRequest, object]:
    """Return the request, with some more coordinates that are zero, and what it points to."""

    def wide(values: Any) -> Any:
        return values if values is None or not more else np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, more)])

    guess, sets, limits = question.guess, question.sets, question.limits
    values: list[FloatArray | None] = [
        wide(question.pinned),
        question.lengths,
        np.array(question.norms),
        _turned(question.turned, more),
    ]
    values += [None] * 3 if guess is None else [guess.durations, wide(guess.knots), guess.least]
    for one in sets:
        values += [wide(one.matrix), wide(one.anchor), wide(one.slope), one.radius, one.width]
    numbers = _Block(np.float64, [*values, *(np.array(one.parameters) for one in limits)])
    whole = _Block(np.int64, [np.array(question.parts), wide(question.free), *(one.place for one in sets)])
    (pinned, lengths, norms, turned), (times, knots, least) = numbers.take(4), numbers.take(3)
    parts, free = whole.take(2)
    cones = (ConeGroup * len(sets))(*(_group(one, whole, numbers) for one in sets))
    known = (MomentaryLimit(kind=limit.kind, parameters=numbers.take(1)[0]) for limit in limits)
    momentary = (MomentaryLimit * len(limits))(*known)
    waypoints, half, dim = question.pinned.shape
    sizes = {"half": half, "dim": dim + more, "legs": waypoints - 1, "groups": len(sets), "limits": len(limits)}
    at = {"pinned": pinned, "lengths": lengths, "norms": norms, "turned": turned, "parts": parts, "free": free}
    if guess is not None:
        sizes |= {"guessed": guess.pieces}
        at |= {"guess_durations": times, "guess_knots": knots, "least": least}
    request = ShortestRequest(
        **sizes,
        **at,
        **{name: getattr(question, name) for name in _PASSED},
        divisions=len(question.parts),
        slower=1.0 if guess is None else guess.slower,
        cones=ctypes.addressof(cones),
        momentary=ctypes.addressof(momentary),
        poll=poll,
    )
    return request, (numbers, whole, cones, momentary)


_PASSED = ("closed", "moving", "rough", "worthwhile", "inwards", "tightened", "price")
"""What a request takes over from a question as it is."""


def _group(sets: ConeSets, whole: _Block, numbers: _Block) -> ConeGroup:
    kind = {"rows": sets.matrix.shape[1], "order": sets.order, "outside": sets.outside, "at_knots": sets.at_knots}
    arrays = dict(zip(("matrix", "anchor", "slope", "radius", "width"), numbers.take(5), strict=True))
    return ConeGroup(count=len(sets.place), leg=whole.take(1)[0], **kind, **arrays)


def _turned(axes: FloatArray | None, more: int) -> FloatArray | None:
    """Return axes of waypoints with further coordinates along themselves."""
    if axes is None or not more:
        return axes
    wider = np.pad(axes, ((0, 0), (0, more), (0, more)))
    for axis in range(axes.shape[1], axes.shape[1] + more):
        wider[axes.any(axis=(1, 2)), axis, axis] = 1.0
    return wider
