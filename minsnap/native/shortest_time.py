"""The native search for the shortest time: one interior point on the whole nonlinear programme."""

from __future__ import annotations

import ctypes
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from ctypes import POINTER, Structure, byref, c_double, c_int64, c_void_p
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.library import Entry, NativeCoreError
from minsnap.native.status import Status

_Poll = ctypes.CFUNCTYPE(c_int64, c_double, c_int64)


class _Group(Structure):
    """``ConeGroup`` of ``src/shortest_time/border.hpp``."""

    _fields_ = [(name, c_int64) for name in ("count", "rows", "order", "outside", "at_knots")] + [
        (name, c_void_p) for name in ("leg", "matrix", "anchor", "slope", "radius", "width")
    ]


class _Limit(Structure):
    """``MomentaryLimit``."""

    _fields_ = [("kind", c_int64), ("parameters", c_void_p)]


class _Request(Structure):
    """``ShortestRequest``."""

    _fields_ = [
        *((name, c_int64) for name in ("half", "dim", "legs", "closed", "groups", "limits")),
        *((name, c_int64) for name in ("divisions", "moving", "rough")),
        ("parts", c_void_p),
        *((name, c_double) for name in ("worthwhile", "inwards", "tightened")),
        *((name, c_void_p) for name in ("pinned", "free", "lengths", "norms")),
        *((name, c_double) for name in ("price", "slower")),
        ("guessed", c_int64),
        *((name, c_void_p) for name in ("guess_durations", "guess_knots", "least", "turned")),
        ("cones", POINTER(_Group)),
        ("momentary", POINTER(_Limit)),
        ("poll", _Poll),
    ]


class _Answer(Structure):
    """``ShortestAnswer``."""

    _fields_ = [
        *((name, c_int64) for name in ("pieces", "iterations")),
        *((name, c_double) for name in ("total", "wall", "limit")),
        *((name, c_void_p) for name in ("durations", "points", "knots")),
    ]


_SEARCH = Entry("minsnap_shortest_time", POINTER(_Request), POINTER(_Answer))
_LAYOUT = Entry("minsnap_shortest_layout", c_void_p, c_int64)


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
    """

    durations: FloatArray
    points: FloatArray
    knots: FloatArray
    iterations: int
    stopped: bool
    kept: bool


def search_shortest(question: ShortestQuestion, poll: Callable[[float, bool], bool]) -> ShortestCurve | None:
    """Search for the shortest time; None where the native core is not in use, or does not take the question.

    Parameters
    ----------
    question : ShortestQuestion
    poll : callable
        Called before every iteration with the total time [s], and whether Ctrl-C was pressed since the search began;
        True ends the search. What it raises is raised here.
    """
    search = _SEARCH.function()
    if search is None:
        return None
    _check_layout()
    dim, more = question.pinned.shape[2], _missing(question)
    if more:
        padded = search_shortest(_padded(question, more), poll)
        return padded and replace(padded, points=padded.points[..., :dim], knots=padded.knots[..., :dim])
    raised: list[BaseException] = []
    pressed: list[int] = []
    told: list[bool] = []

    def polled(total: float, _: int) -> int:
        try:
            told.extend([True] * bool(pressed))
            return int(poll(total, bool(pressed)))
        except BaseException as error:  # noqa: BLE001 - carried through the native core
            raised.append(error)
            return 1

    waypoints, half, dim = question.pinned.shape
    most = (waypoints - 1) * int(np.prod(question.parts, dtype=np.int64))
    most *= 1 if question.guess is None else question.guess.pieces
    arrays = np.empty(most), np.empty((most, 2 * half, dim)), np.empty((most + 1, half, dim))
    answer = _Answer(0, 0, 0.0, 0.0, 0.0, *(array.ctypes.data for array in arrays))
    request, _held = _request(question, _Poll(polled))
    with _noting(pressed):
        status = Status(search(byref(request), byref(answer)))
    if raised:
        raise raised[0]
    if pressed and not told:
        raise KeyboardInterrupt
    if status not in (Status.DONE, Status.SPENT, Status.NO_PROGRESS):
        return None
    count = answer.pieces * (waypoints - 1)
    ended = status is Status.SPENT, status is not Status.NO_PROGRESS
    return ShortestCurve(arrays[0][:count], arrays[1][:count], arrays[2][: count + 1], answer.iterations, *ended)


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


def _missing(question: ShortestQuestion) -> int:
    """How many coordinates are missing to those that the native core knows for a degree."""
    _, half, dim = question.pinned.shape
    return max(0, (2 if half == 4 else 3) - int(dim))


def _padded(question: ShortestQuestion, more: int) -> ShortestQuestion:
    """Return the same question with coordinates that are always zero."""

    def wider(values: FloatArray) -> FloatArray:
        return np.concatenate((values, np.zeros((*values.shape[:-1], more), dtype=values.dtype)), axis=-1)

    sets = [
        replace(one, matrix=wider(one.matrix), anchor=wider(one.anchor), slope=wider(one.slope))
        for one in question.sets
    ]
    guess = question.guess and replace(question.guess, knots=wider(question.guess.knots))
    turned = question.turned
    if turned is not None:
        turned = np.pad(turned, ((0, 0), (0, more), (0, more)))
        turned_knots = turned.any(axis=(1, 2))
        for axis in range(turned.shape[1] - more, turned.shape[1]):
            turned[turned_knots, axis, axis] = 1.0
    pinned, free = (
        wider(question.pinned),
        np.concatenate((question.free, np.zeros((*question.free.shape[:-1], more), dtype=bool)), axis=-1),
    )
    return replace(question, pinned=pinned, free=free, sets=sets, guess=guess, turned=turned)


def _request(question: ShortestQuestion, poll: object) -> tuple[_Request, list[object]]:
    """Return the request, and the arrays that it points to."""
    held: list[object] = []

    def at(values: object, kind: type) -> int:
        array: np.ndarray[tuple[int, ...], np.dtype[Any]] = np.ascontiguousarray(values, dtype=kind)
        held.append(array)
        return int(array.ctypes.data)

    numbers = (np.float64,) * 5
    groups = [
        _Group(
            *(len(one.place), one.matrix.shape[1], one.order, one.outside, one.at_knots, at(one.place, np.int64)),
            *(at(getattr(one, name), kind) for name, kind in zip(_NUMBERS, numbers, strict=True)),
        )
        for one in question.sets
    ]
    table = (_Group * len(groups))(*groups)
    limits = (_Limit * len(question.limits))(
        *(_Limit(one.kind, at(one.parameters, np.float64)) for one in question.limits)
    )
    held += [table, limits]
    waypoints, half, dim = question.pinned.shape
    request = _Request(
        *(half, dim, waypoints - 1, question.closed, len(groups), len(limits)),
        *(len(question.parts), question.moving, question.rough),
        at(question.parts, np.int64),
        *(question.worthwhile, question.inwards, question.tightened),
        *(at(question.pinned, np.float64), at(question.free, np.int64)),
        *(at(question.lengths, np.float64), at(question.norms, np.float64)),
        question.price,
        *_guessed(question.guess, at),
        None if question.turned is None else at(question.turned, np.float64),
        table,
        limits,
        poll,
    )
    return request, held


def _guessed(guess: Guess | None, at: Callable[[object, type], int]) -> tuple[float | int | None, ...]:
    if guess is None:
        return 1.0, 0, None, None, None
    least = None if guess.least is None else at(guess.least, np.float64)
    return guess.slower, guess.pieces, at(guess.durations, np.float64), at(guess.knots, np.float64), least


_NUMBERS = ("matrix", "anchor", "slope", "radius", "width")


def _check_layout() -> None:
    """Raise NativeCoreError unless both sides mean the same fields at the same places."""
    layout = _LAYOUT.function()
    if layout is None or _Checked.done:
        return
    own = [
        number
        for struct in (_Group, _Limit, _Request, _Answer)
        for number in (ctypes.sizeof(struct), *(getattr(struct, field[0]).offset for field in struct._fields_))
    ]
    declared = np.zeros(len(own) + 1, dtype=np.int64)
    count = layout(declared.ctypes.data, len(declared))
    if declared[:count].tolist() != own:
        raise NativeCoreError("the native core lays the request of a search out otherwise: compile it anew")
    _Checked.done = True


class _Checked:
    """Whether the layouts were compared."""

    done = False
