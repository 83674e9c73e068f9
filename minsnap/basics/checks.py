"""Checks of what a caller passes: every refusal is one sentence that says where, what arrived and what to do."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from math import inf, perm
from typing import Any

import numpy as np

from minsnap.basics.arrays import LARGEST, SMALLEST, ArrayLike, BoolArray, FloatArray, IntArray, bounded, numbers
from minsnap.basics.messages import shown
from minsnap.errors import DegreeError, InputError, MinsnapError, TimingError, WaypointError

DERIVATIVES = ("position", "velocity", "acceleration", "jerk", "snap", "crackle")

FREE = "free"
"""What stands in the place of a derivative at an end, or of a yaw, that the plan chooses."""
DEGREES = (3, 5, 7, 9, 11)
SHORTEST, LONGEST = 1e-12, 1e9
"""Least and greatest duration of a leg, and total time [s]; the native core has the same.

The derivatives and the costs of any degree, with legs of both side by side, and the proofs of them are then well within
the range of a double.
"""
TIME = "it must be positive, from 1e-12 to 1e9 s"
"""What a message says of such a time."""
SIZE = "at most 1e40 in size"
"""What a message says of a number."""
MOST_PIECES, MOST_PER_PIECE = 1000, 100_000
"""Most polynomials per leg, and most instants per polynomial of a sampled corridor."""
NO_NUMBERS = (bool, np.timedelta64)
"""Kinds of integers that are no numbers here."""


def is_number(value: Any) -> bool:
    """Whether a value is a number up to ``LARGEST``: an integer or a float of Python or NumPy, not a bool."""
    if isinstance(value, NO_NUMBERS) or not isinstance(value, (int, float, np.integer, np.floating)):
        return False
    try:
        return abs(float(value)) <= LARGEST
    except OverflowError:
        return False


def has_method(value: Any, name: str) -> bool:
    """Whether a value, not a class, has a method or a property."""
    return hasattr(value, name) and not isinstance(value, type)


def is_whole(value: Any) -> bool:
    """Whether a value is a whole number: an integer of Python or NumPy, not a bool."""
    return isinstance(value, (int, np.integer)) and not isinstance(value, NO_NUMBERS)


def check_waypoints(waypoints: ArrayLike) -> FloatArray:
    """Return waypoints as a read-only array (n, dim), n >= 2, finite."""
    points = numbers(waypoints)
    if points is None:
        raise WaypointError("waypoints must be numbers of shape (n, dim), one row per waypoint, all rows equally long")
    if points.ndim != 2 or points.shape[1] < 1:
        raise WaypointError(f"waypoints have shape {points.shape}: give (n, 3) or (n, 2), one row per waypoint")
    if len(points) < 2:
        raise WaypointError(f"a trajectory needs at least 2 waypoints, not {len(points)}")
    if not bounded(points).all():
        index = int(np.flatnonzero(~bounded(points).all(axis=1))[0])
        raise WaypointError(
            f"waypoint {index} is {point_text(points[index])}: every coordinate must be a finite number, {SIZE}",
            waypoint=index,
        )
    return points


def check_tolerance(tolerance: ArrayLike | None, points: FloatArray) -> FloatArray:
    """Return half-widths of the box around every waypoint, (n, dim) [m], or raise WaypointError."""
    widths, count = np.zeros(points.shape), len(points)
    if tolerance is None:
        return widths
    give = f"one finite number of 0 or more [m], or one for each of {count} waypoints"
    shapes = (), (count,), points.shape
    half = check_array("waypoint_tolerance", tolerance, shapes, give, WaypointError, least=0.0)
    half = np.where(half < SMALLEST, 0.0, half)
    if half.ndim == 0:
        widths[1:-1] = half
    else:
        widths[:] = half[:, None] if half.ndim == 1 else half
    return widths


def check_durations(durations: ArrayLike, legs: int) -> FloatArray:
    """Return leg durations (legs,) as a read-only array, from ``SHORTEST`` to ``LONGEST`` [s]."""
    values = numbers(durations)
    if values is None:
        raise TimingError("durations must be numbers, one for each leg [s]")
    if values.shape != (legs,):
        count = len(values) if values.ndim == 1 else f"shape {values.shape}"
        raise TimingError(f"{legs} legs need {legs} durations, not {count}")
    good = (values >= SHORTEST) & (values <= LONGEST)
    if not good.all():
        leg = int(np.flatnonzero(~good)[0])
        raise TimingError(f"the duration of leg {leg} is {values[leg]} s: {TIME}", leg=leg)
    return values


def check_number(
    what: str,
    value: Any,
    least: float,
    most: float,
    give: str,
    error: type[MinsnapError] = InputError,
    *,
    unit: str = "",
    whole: bool = False,
) -> Any:
    """Return a number from ``least`` to ``most``, a whole one perhaps, or raise an error that says what to give."""
    number = value.item() if isinstance(value, np.generic) else value  # the bounds overflow in half precision
    if not (is_whole if whole else is_number)(value) or not least <= number <= most:
        raise error(f"{what} is {shown(value)}{unit and f' {unit}'}: {give}")
    return int(value) if whole else float(value)


def check_time(what: str, value: Any, error: type[MinsnapError]) -> float:
    """Return a time from ``SHORTEST`` to ``LONGEST`` as a float [s], or raise this error."""
    return float(check_number(what, value, SHORTEST, LONGEST, TIME, error))


def check_array(
    what: str,
    value: Any,
    shapes: Collection[tuple[int, ...]],
    give: str,
    error: type[MinsnapError],
    least: float = -LARGEST,
) -> FloatArray:
    """Return a read-only array of one of some shapes, finite and not below ``least``, or raise this error."""
    array = numbers(value)
    if array is None or array.shape not in shapes or not bounded(array).all() or (array < least).any():
        raise error(f"{what} is {shown(value)}: give {give}")
    return array


def check_distance(what: str, value: Any, error: type[MinsnapError]) -> float:
    """Return a finite number of 0 or more as a float, or raise this error."""
    return float(check_number(what, value, 0.0, inf, "give a distance of 0 or more [m]", error))


def check_positive(what: str, value: Any, unit: str, error: type[MinsnapError]) -> float:
    """Return a positive, finite number as a float, or raise this error."""
    if not is_number(value) or float(value) < SMALLEST:
        named = f" [{unit}]" if unit else ""
        raise error(f"{what} is {shown(value)}: it must be a positive number{named}{beyond(value)}")
    return float(value)


def check_threads(threads: Any, error: type[MinsnapError]) -> int:
    """Return how many threads to use, by default as many as processors, or raise this error."""
    if threads is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return int(check_number("threads", threads, 1, 256, "use 1 to 256", error, whole=True))


def beyond(value: Any) -> str:
    """Return the end of a message about a positive number that is outside the range of the library."""
    positive = isinstance(value, (int, float, np.floating)) and not isinstance(value, NO_NUMBERS) and 0 < value < inf
    return f", from {SMALLEST:g} to {LARGEST:g}" if positive else ""


def check_kind(what: str, value: Any, kinds: type | tuple[type, ...], give: str) -> None:
    """Raise InputError for a value of another kind."""
    if not isinstance(value, kinds):
        raise InputError(f"{what} must be {give}, not {type(value).__name__}")


def check_able(what: str, value: Any, method: str, give: str) -> None:
    """Raise InputError for a value without a method."""
    if not callable(getattr(value, method, None)):
        raise InputError(f"{what} must be {give}, not {type(value).__name__}")


def check_seed(value: Any) -> None:
    """Raise InputError for what repeats no random numbers."""
    check_number("the seed", value, 0, inf, "it must be a whole number, 0 or more", whole=True)


def check_words(**words: Any) -> None:
    """Refuse options that are not text, by name."""
    for name, word in words.items():
        if not isinstance(word, str):
            raise InputError(f"{name} is {shown(word)}: it is a word")


def check_flag(name: str, value: Any) -> bool:
    """Return a bool of Python or NumPy as Python's, or raise InputError."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} is {shown(value)}: it is True or False")
    return bool(value)


def check_switch(name: str, value: Any) -> bool:
    """Return a bool, also of a whole number, which is False for 0; or raise InputError."""
    return check_flag(name, bool(value) if is_whole(value) else value)


def check_degree(degree: Any) -> int:
    """Return k for degree 2k - 1, or raise DegreeError."""
    if not is_whole(degree) or int(degree) not in DEGREES:
        number = "" if is_whole(degree) else "give a whole number; "
        raise DegreeError(f"degree is {shown(degree)}: {number}it must be odd, from 3 to 11 (7 minimises snap)")
    return (int(degree) + 1) // 2


def check_continuity(continuity: Any, half: int) -> int:
    """Return the continuity, k - 1 by default; at most degree - 1."""
    if continuity is None:
        return half - 1
    most = 2 * half - 2
    give = f"pieces of degree {2 * half - 1} can share derivatives 0 to {most} at their knots"
    check_number("continuity", continuity, 0, most, give, DegreeError, whole=True)
    if continuity < half - 2:
        raise DegreeError(
            f"continuity {continuity} leaves the curve undetermined at degree {2 * half - 1}: use at least {half - 2}"
        )
    return int(continuity)


def check_jumps(continuity: int, half: int, between_waypoints: bool) -> None:
    """Raise DegreeError for continuity k - 2 unless every leg is one polynomial between fixed waypoints.

    Where polynomials of degree k - 1 may meet at a free position with a jump of derivative k - 1, curves that differ
    cost the same.
    """
    if continuity < half - 1 and not between_waypoints:
        raise DegreeError(
            f"continuity {continuity} at degree {2 * half - 1} leaves the curve undetermined unless every leg is one "
            f"polynomial between fixed waypoints: use continuity {half - 1}, or pieces=1 and no waypoint_tolerance"
        )


def refuse_smoother(continuity: int, half: int) -> None:
    """Raise DegreeError for a continuity above k - 1, with the degree that has it."""
    if continuity <= half - 1:
        return
    degree = 2 * continuity + 1
    higher = f"take degree={degree}, or give durations" if degree in DEGREES else "give durations"
    raise DegreeError(
        f"where a plan chooses its times, degree {2 * half - 1} joins derivatives up to {half - 1}, and "
        f"continuity={continuity} was asked for: {higher}"
    )


def check_pieces(pieces: Any) -> tuple[int, bool]:
    """Return the number of polynomials per leg, a whole number of at least 1, and whether a search may choose it."""
    if isinstance(pieces, str) and pieces == "auto":
        return 1, True
    give = f"a leg has a whole number of polynomials, at least 1 and at most {MOST_PIECES}, or 'auto'"
    return int(check_number("pieces", pieces, 1, MOST_PIECES, give, DegreeError, whole=True)), False


def refuse_repeated(points: FloatArray, reason: str) -> None:
    """Raise WaypointError if two waypoints in a row are equal."""
    same = (points[1:] == points[:-1]).all(axis=1)
    if same.any():
        leg = int(np.argmax(same))
        raise WaypointError(
            f"waypoints {leg} and {leg + 1} are both {point_text(points[leg])}: remove one, or {reason}", leg=leg
        )


def check_closing(closed: bool, points: FloatArray) -> bool:
    """Return whether a lap is closed, or raise WaypointError if it does not end where it began."""
    if closed and (points[0] != points[-1]).any():
        raise WaypointError("closed=True needs the last waypoint to be the first one: append it")
    return bool(closed)


def check_pins(
    pins: Mapping[int, Mapping[str, ArrayLike]] | None,
    start: Mapping[str, ArrayLike] | None,
    end: Mapping[str, ArrayLike] | None,
    closed: bool,
    half: int,
    points: FloatArray,
) -> dict[int, dict[int, FloatArray]]:
    """Return pinned derivatives by waypoint and order; at open ends those up to order k - 1 not named are zero.

    What is ``"free"`` at an end is left out.
    """
    last, dim = len(points) - 1, points.shape[1]
    if closed and (start is not None or end is not None):
        raise WaypointError("closed=True leaves the state at start and end free: give neither start= nor end=")
    collected: dict[int, dict[int, FloatArray]] = {}
    if pins is not None and not isinstance(pins, Mapping):
        raise WaypointError(f"pins must be a mapping such as {{1: {{'velocity': (1, 0, 0)}}}}, not {shown(pins)}")
    for index, state in (pins or {}).items():
        if not is_whole(index) or not 0 <= index <= last:
            raise WaypointError(f"pins name waypoint {shown(index)}: there are waypoints 0 to {last}")
        if index in (0, last):
            raise WaypointError(f"pins name waypoint {index}, an end of the trajectory: use start= or end=")
        collected[int(index)] = check_state(state, f"pins[{index}]", half, dim)
    if not closed:
        rest = {order: np.zeros(dim) for order in range(1, half)}
        for knot, given, where in ((0, start, "start"), (last, end, "end")):
            known = rest | check_state(given, where, half, dim, may_be_free=True)
            collected[knot] = {order: known[order] for order in rest if order not in free_orders(given, half)}
    return collected


def is_free(value: Any) -> bool:
    """Whether a derivative of an end, or a yaw, is left to the plan."""
    return isinstance(value, str) and value == FREE


def free_orders(state: Any, half: int) -> set[int]:
    """Return the orders up to k - 1 of the derivatives that a state leaves free."""
    named = state.items() if isinstance(state, Mapping) else ()
    return {DERIVATIVES.index(name) for name, value in named if is_free(value) and name in DERIVATIVES[1:half]}


def refuse_undetermined(pinned: Mapping[int, Mapping[int, FloatArray]], fixed: BoolArray, half: int) -> None:
    """Raise WaypointError where so much is free that many curves cost nothing: polynomials below degree k.

    Parameters
    ----------
    pinned : mapping
        Derivatives by waypoint and order; values do not matter.
    fixed : ndarray of bool, shape (n,)
        Whether a waypoint is passed exactly.
    half : int
        k.
    """
    known = [(knot, 0) for knot in np.flatnonzero(fixed).tolist()]
    known += [(knot, order) for knot, state in pinned.items() for order in state]
    places = np.linspace(-1.0, 1.0, len(fixed))
    rows = np.zeros((len(known), half))
    for row, (knot, order) in zip(rows, known, strict=True):
        row[order:] = [perm(power, order) * places[knot] ** (power - order) for power in range(order, half)]
    if np.linalg.matrix_rank(rows) < half:
        raise WaypointError(
            "the ends leave so much free that many curves cost nothing: pin one more derivative of an end, pass one "
            "more waypoint, or give limits alone for the shortest time"
        )


def at_rest_in_holds(
    pinned: dict[int, dict[int, FloatArray]], points: FloatArray, fixed: BoolArray, half: int
) -> tuple[dict[int, dict[int, FloatArray]], list[int]]:
    """Return pinned derivatives, those up to order k - 1 zero at both ends of legs between equal waypoints; these legs.

    Parameters
    ----------
    pinned : dict
        As ``check_pins`` returns it; a leg with a derivative at its ends that is not zero is no hold. A single leg that
        begins and ends at rest is one without pins.
    points : ndarray, shape (n, dim)
        Waypoints [m].
    fixed : ndarray of bool, shape (n,)
        Whether a waypoint is passed exactly.
    half : int
        k.
    """
    still = (points[1:] == points[:-1]).all(axis=1) & fixed[1:] & fixed[:-1]
    rest = {order: np.zeros(points.shape[1]) for order in range(1, half)}
    resting, legs = dict(pinned), list[int]()
    for leg in np.flatnonzero(still).tolist():
        ends = [pinned.get(knot, {}) for knot in (leg, leg + 1)]
        if any(value.any() for end in ends for value in end.values()) or len(still) == 1:
            continue
        resting |= {knot: rest for knot in (leg, leg + 1)}
        legs.append(leg)
    return resting, legs


def check_position(state: Any, where: str) -> tuple[FloatArray | None, Any]:
    """Return the position (dim,) of the state at an end [m], None without one, and the rest of the state."""
    if not isinstance(state, Mapping) or "position" not in state:
        return None, state
    rest = {name: value for name, value in state.items() if name != "position"}
    position = numbers(state["position"])
    if position is None or position.ndim != 1 or not position.size or not bounded(position).all():
        raise WaypointError(f"the position of {where} is {shown(state['position'])}: give one finite number per axis")
    return position, rest


HEADINGS = ("yaw", "heading", "psi", "attitude", "yaw_rate")
"""What others have in a state, and a plan as its yaw."""


def check_state(
    state: Mapping[str, ArrayLike] | None, where: str, half: int, dim: int, may_be_free: bool = False
) -> dict[int, FloatArray]:
    """Return pinned derivatives by order (1 … k - 1) from a mapping such as ``{"velocity": (1, 0, 0)}``."""
    if state is None:
        return {}
    if not isinstance(state, Mapping):
        raise WaypointError(f"{where} must be a mapping such as {{'velocity': (1, 0, 0)}}, not {shown(state)}")
    allowed, give, found = DERIVATIVES[1:half], f"{dim} finite numbers", dict[int, FloatArray]()
    give += f" or {FREE!r}" if may_be_free else ""
    for name, value in state.items():
        if name not in allowed:
            instead = "; a heading is yaw=, such as Velocity(yaw_at_start=1.57)" if name in HEADINGS else ""
            near = [word for word in allowed if isinstance(name, str) and len(name) > 2 and word.startswith(name)]
            can = f"did you mean {near[0]}?" if near else f"degree {2 * half - 1} can pin {', '.join(allowed)}{instead}"
            raise WaypointError(f"{where} pins {shown(name)}: {can}")
        if may_be_free and is_free(value):
            continue
        order = DERIVATIVES.index(name)
        found[order] = check_array(f"the {name} of {where}", value, ((dim,),), give, WaypointError)
    return found


def check_finite(what: str, points: FloatArray, error: type[MinsnapError]) -> None:
    """Raise this error if a point of some (n, dim) is not finite or beyond all sizes, and say which."""
    finite = bounded(points).all(axis=1)
    if not finite.all():
        index, count = int(np.argmin(finite)), int(np.sum(~finite))
        more = f", and {count - 1} more are like it" if count > 1 else ""
        raise error(f"point {index} of {what} is {point_text(points[index])}{more}: give finite numbers, {SIZE} [m]")


def point_text(point: FloatArray | IntArray) -> str:
    """Return a point as a message shows it."""
    return "(" + ", ".join(f"{value:g}" for value in point) + ")"
