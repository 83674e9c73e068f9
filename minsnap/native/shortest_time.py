"""The native search for the shortest time: one interior point on the whole nonlinear programme."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from enum import IntEnum
from math import inf, prod
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.interrupts import noted_interrupts
from minsnap.native.library import Entry
from minsnap.native.records import POLL, MomentaryLimit, ShortestAnswer, ShortestRequest, WallsRecord
from minsnap.native.status import Status

LOGGER = logging.getLogger(__name__)

_SEARCH = Entry("minsnap_shortest_time", ShortestRequest, ShortestAnswer)


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
    TURNING_ROTORS = 8
    TURN_RATE = 9
    TURNING_BODY_RATE = 10


@dataclass(frozen=True)
class InstantLimit:
    """A limit on several derivatives at an instant, on every leg, and the numbers that its functions take."""

    kind: InstantKind
    parameters: tuple[float, ...]


class YawRule(IntEnum):
    """Rules that make a yaw of a curve: ``Kind`` of ``src/shortest_time/ruled_heading.hpp``."""

    NONE = 0
    VELOCITY = 1
    POINT = 2


@dataclass(frozen=True, eq=False)
class HeldYaw:
    """A yaw as a search knows it: a function of time, a spline through angles, or what a rule makes of a curve.

    Parameters
    ----------
    points : ndarray, shape (turns, 4), or None
        Control points of cubics on equal shares of a time [rad].
    clock : float
        That time [s].
    angles : ndarray, shape (legs + 1,), or None
        Through which it goes by a spline of the legs' durations [rad].
    rate : float
        Of that at the start of an open course [rad/s].
    rule : YawRule
        By which it follows a curve.
    ruled : tuple of float
        What that takes: the largest rate where it is held [rad/s], the speed below which it is or 0 [m/s] and its angle
        at the start or infinity [rad]; or a point, east and north [m], and 0.
    """

    points: FloatArray | None = None
    clock: float = 0.0
    angles: FloatArray | None = None
    rate: float = 0.0
    rule: YawRule = YawRule.NONE
    ruled: tuple[float, float, float] = (0.0, 0.0, 0.0)


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
    """

    pieces: int
    durations: FloatArray
    knots: FloatArray
    slower: float = 1.0


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
    sets : sequence of WallsRecord
    limits : sequence of InstantLimit
    parts : tuple of int
        Into how many each piece is divided, one time after another.
    closed, moving : bool
        Whether it is a lap, and whether time may not be scaled to keep the limits.
    worthwhile : float
        Relative gain of a division below which no further one is tried.
    inwards, tightened : float
        Shares of their widths by which walls are moved inwards, and limits.
    timed : bool
        Whether all durations stay those of the guess, for the least cost at a price.
    price : float
        Of a second, for the least sum of cost and price; 0 for the least time alone.
    total : float
        Of all durations, for the least cost; 0 where it is free [s].
    rough : bool
        Whether the curve is only one to begin another search from, which may be outside of walls and limits.
    guess : Guess or None
        In place of rest at every waypoint; its pieces are divided then.
    planned : bool
        Whether that is a plan, on whose first and last piece nothing is held further inwards than it is there. The
        first may be a way back into the limits, which may exceed as much then, and takes no longer.
    turned : ndarray, shape (waypoints, dim, dim), or None
        Columns are the axes along which a waypoint's position is free or pinned; zeros for the world's.
    turning : HeldYaw or None
        The yaw, where limits depend on it.
    """

    pinned: FloatArray
    free: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    lengths: FloatArray
    norms: tuple[float, ...]
    sets: Sequence[WallsRecord]
    limits: Sequence[InstantLimit]
    parts: tuple[int, ...]
    closed: bool
    moving: bool
    worthwhile: float
    inwards: float
    tightened: float = 0.0
    timed: bool = False
    price: float = 0.0
    total: float = 0.0
    rough: bool = False
    guess: Guess | None = None
    planned: bool = False
    turned: FloatArray | None = None
    turning: HeldYaw | None = None

    @property
    def costs(self) -> bool:
        """Whether the cost counts, alone or beside the time."""
        return self.price > 0.0 or self.total > 0.0

    @property
    def held(self) -> bool:
        """Whether the time is given, so that a curve may not be flown more slowly."""
        return self.timed or self.total > 0.0

    def same(self, other: ShortestQuestion) -> bool:
        """Whether another question is the same, and so its answer."""
        return alike(self, other)


def alike(one: Any, other: Any) -> bool:
    """Whether two values are equal, whose fields may be arrays."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(alike, one, other))
    if isinstance(one, WallsRecord):
        return alike(one.kept, other.kept)
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(alike(value, other[name]) for name, value in one.items())
    if is_dataclass(one):
        return all(alike(getattr(one, name.name), getattr(other, name.name)) for name in reversed(fields(one)))
    return bool(one == other)


@dataclass(frozen=True, eq=False)
class ShortestCurve:
    """A curve near the shortest one.

    Parameters
    ----------
    durations : ndarray, shape (pieces,)
        [s].
    points : ndarray, shape (pieces, 2k, dim)
        Control points [m].
    iterations : int
    stopped : bool
        Whether the search was ended from outside.
    kept : bool
        Whether it converged to a curve inside all walls.
    slack : float
        How far inside its bound the most used limit of the search is, in widths.
    restored : bool
        Whether the search had no end of its own, so that it may be far from the best.
    knots : ndarray, shape (pieces + 1, k, dim)
        Derivatives, of a curve that was searched [m/s^order].
    inside : ShortestCurve or None
        The shortest curve inside all that the search knows that it came by, which need not be its end.
    """

    durations: FloatArray
    points: FloatArray
    iterations: int
    stopped: bool
    kept: bool
    slack: float = 0.0
    restored: bool = False
    knots: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 0)))
    inside: ShortestCurve | None = None


@dataclass(frozen=True, eq=False)
class Watch:
    """When a search ends, and who is told of its iterations.

    Parameters
    ----------
    tell : callable
        Called every few milliseconds and at the end with the total times of the iterations since it was called last
        [s], the work so far, and whether Ctrl-C was pressed; True ends the search. What it raises is raised on.
    live : bool
        Whether it is called before every iteration instead.
    room : int
        Iterations after which it is called in any case.
    row_work, iteration_work : float
        Work of an iteration: for each row, and besides.
    work, worth : float
        Work on the question before the search, and beyond which it ends.
    longest, vanishing : float
        Longest total time of searches before [s], and the share of the longest of all below which it ends.
    """

    tell: Callable[[list[float], float, bool], bool]
    live: bool = False
    room: int = 256
    row_work: float = 0.0
    iteration_work: float = 0.0
    work: float = 0.0
    worth: float = inf
    longest: float = 0.0
    vanishing: float = 0.0


def search_shortest(question: ShortestQuestion, watch: Watch) -> ShortestCurve | None:
    """Search for the shortest time; None where the native core is not in use, or does not take the question."""
    raised: list[BaseException] = []
    pressed: list[int] = []
    totals = np.empty(watch.room)

    def tell() -> bool:
        new, answer.told = totals[: answer.told].tolist(), 0
        return watch.tell(new, answer.work, bool(pressed))

    def polled(_context: int | None) -> int:
        try:
            return bool(tell())
        except BaseException as error:  # noqa: BLE001 - carried through the native core
            raised.append(error)
            return 1

    waypoints, half, dim = question.pinned.shape
    # coordinates that are always zero, up to three or five, for which a degree has searches
    more = 0 if half == 4 else max(3 - dim, 0) + (dim == 4)
    most = (waypoints - 1) * prod(question.parts)
    most *= 1 if question.guess is None else question.guess.pieces
    shapes = (most,), (most, 2 * half, dim + more), (most + 1, half, dim + more)
    last, inside = (tuple(map(np.empty, shapes)) for _ in range(2))
    rooms = dict(zip(_CURVE, last, strict=True))
    if question.moving:  # what scales to its limits needs no other curve
        rooms |= {f"inside_{name}": room for name, room in zip(_CURVE, inside, strict=True)}
    answer = ShortestAnswer(work=watch.work, longest=watch.longest, totals=totals, **rooms)
    request = _request(question, more)
    request.put(**{name: getattr(watch, name) for name in _WATCHED}, poll=POLL(polled))
    with noted_interrupts(pressed):
        status = Status(_SEARCH(request, answer))
    if raised:
        raise raised[0]
    tell()
    if LOGGER.isEnabledFor(logging.DEBUG):
        _log(question, status, answer.iterations, float(last[0][: max(answer.pieces, 0) * (waypoints - 1)].sum()))
    if status not in (Status.DONE, Status.SPENT, Status.NO_PROGRESS):
        return None

    def curve(rooms: tuple[FloatArray, ...], pieces: int, stopped: bool, kept: bool, **others: Any) -> ShortestCurve:
        durations, points, knots = rooms
        count = pieces * (waypoints - 1)
        if count < most or more:
            durations, points, knots = durations[:count], points[:count, :, :dim], knots[: count + 1, :, :dim]
        return ShortestCurve(durations, points, answer.iterations, stopped, kept, knots=knots, **others)

    others = {"slack": -answer.limit, "restored": bool(answer.restored)}
    ended = curve(last, answer.pieces, status is Status.SPENT, status is not Status.NO_PROGRESS, **others)
    return replace(ended, inside=curve(inside, answer.inside, True, True)) if answer.inside else ended


def _log(question: ShortestQuestion, status: Status, iterations: int, total: float) -> None:
    """Log how a search ended; what it found is certified after it, and may be refused then."""
    begun = "from rest" if question.guess is None else f"from a curve of {question.guess.durations.sum():.6g} s"
    aim = f"price {question.price:g}" if question.price else "least time"
    aim = "durations as given" if question.timed else f"a total of {question.total:g} s" if question.total else aim
    pieces = " then ".join(map(str, question.parts)) or "its"
    found = f", {total:.6g} s" if status in (Status.DONE, Status.SPENT, Status.NO_PROGRESS) else ""
    text = "search (%s) of %d legs, pieces: %s, %s: %s after %d iterations%s"
    LOGGER.debug(text, aim, len(question.pinned) - 1, pieces, begun, status.name.lower(), iterations, found)


_CURVE = ("durations", "points", "knots")
"""What an answer says of a curve."""


_TAKEN = ("closed", "moving", "timed", "rough", "worthwhile", "inwards", "tightened", "price", "total", "lengths")
"""What a request takes over from a question as it is."""


_WATCHED = ("live", "room", "row_work", "iteration_work", "worth", "vanishing")
"""The same of a watch."""


def _request(question: ShortestQuestion, more: int) -> ShortestRequest:
    """Return the request, with some more coordinates that are zero."""

    def wide(values: Any) -> Any:
        return np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, more)]) if more else values

    sets, guess = list(question.sets), question.guess
    if more:
        sets = [one.changed(**{name: wide(one.kept[name]) for name in ("matrix", "anchor", "slope")}) for one in sets]
    limits = [
        MomentaryLimit(kind=one.kind, parameters=np.array(one.parameters, dtype=np.float64)) for one in question.limits
    ]
    waypoints, half, dim = question.pinned.shape
    sizes = {"half": half, "dim": dim + more, "legs": waypoints - 1, "groups": len(sets), "limits": len(limits)}
    request = ShortestRequest(
        **sizes,
        **{name: getattr(question, name) for name in _TAKEN},
        divisions=len(question.parts),
        parts=np.array(question.parts, dtype=np.int64),
        pinned=wide(question.pinned),
        free=wide(question.free).astype(np.int64),
        norms=np.array(question.norms, dtype=np.float64),
        turned=_turned(question.turned, more),
        cones=sets,
        momentary=limits,
    )
    turning = question.turning
    if turning is not None:
        turns = 0 if turning.points is None else len(turning.points)
        request.put(turns=turns, turning=turning.points, clock=turning.clock, angles=turning.angles, rate=turning.rate)
        request.put(rule=turning.rule, ruled=np.array(turning.ruled))
    if guess is not None:
        request.put(guessed=guess.pieces, slower=guess.slower, guess_knots=wide(guess.knots))
        request.put(guess_durations=guess.durations, planned=question.planned)
    return request


def _turned(axes: FloatArray | None, more: int) -> FloatArray | None:
    """Return axes of waypoints with further coordinates along themselves."""
    if axes is None or not more:
        return axes
    wider = np.pad(axes, ((0, 0), (0, more), (0, more)))
    for axis in range(axes.shape[1], axes.shape[1] + more):
        wider[axes.any(axis=(1, 2)), axis, axis] = 1.0
    return wider
