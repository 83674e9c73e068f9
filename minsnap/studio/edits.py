"""Edits of a request: pure functions that keep as many widths, boxes, durations and headings as there are legs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors import Gate
from minsnap.errors import InputError, WaypointError
from minsnap.files import Box, FileRequest, Opening, Point

_Made = Callable[[Any], Sequence[Any]]

SPEED = 1.0
"""Average speed that gives a new leg its duration [m/s]."""

WIDTH = 0.3
"""Half-width of a new tube [m]."""

ROOM_AROUND = 1.0
"""How far new boxes and rooms reach beyond their waypoints [m]."""

GATE = 1.0
"""Sides of a new gate [m]."""

THINNEST = 0.02
"""Least distance of two opposite faces while one is moved [m]."""

ROOM = "room"
"""What the page calls the room, besides ``box 0`` and so on."""


def move_waypoint(request: FileRequest, index: int, position: Sequence[float]) -> FileRequest:
    """Return the request with a waypoint at another position [m]; both ends of a closed lap move together."""
    points = list(request.waypoints)
    point = tuple(float(value) for value in position)
    ends = (0, len(points) - 1)
    joined = request.closed and index in ends
    step = np.subtract(point, points[index])
    for i in ends if joined else (index,):
        points[i] = point
    moved = replace(request, waypoints=tuple(points))
    return _with_corners(moved, ends if joined else (index,), lambda corners: corners + step)


def insert_waypoint(request: FileRequest, index: int) -> FileRequest:
    """Return the request with a waypoint in the middle of the leg from waypoint ``index``, or beyond the last one.

    Both halves of the leg keep its width and its box, and share its duration.
    """
    points = [np.array(point) for point in request.waypoints]
    last = len(points) - 1
    leg = min(index, last - 1)
    start, end = points[leg : leg + 2]
    new = end + (end - start) / 2.0 if index >= last else (start + end) / 2
    points.insert(index + 1, new)
    yaw = request.yaw_in([*range(index + 1), index, *range(index + 1, last + 1)])
    shares = (1.0, 0.5) if index >= last else (0.5, 0.5)
    openings = _renumbered(request, [*range(index + 1), *range(index + 2, last + 2)])
    changed = replace(request, waypoints=tuple(_plain(point) for point in points), yaw=yaw, openings=openings)
    twice: _Made = lambda values: values * 2  # noqa: E731
    return _grown(_with_legs(changed, slice(leg, leg + 1), lambda d: [share * d[0] for share in shares], twice, twice))


def delete_waypoint(request: FileRequest, index: int) -> FileRequest:
    """Return the request without a waypoint; its two legs become one, with the smaller width and a box around both.

    Raises
    ------
    WaypointError
        If only two are left.
    """
    if len(request.waypoints) <= 2:
        raise WaypointError("a path has two waypoints at least: add one before you delete this")
    points = request.waypoints[:index] + request.waypoints[index + 1 :]
    yaw = request.yaw_in([*range(index), *range(index + 1, len(request.waypoints))])
    first, last = max(index - 1, 0), min(index, request.legs - 1)
    openings = _renumbered(request, [*range(index), None, *range(index, len(points))])
    changed = replace(request, waypoints=points, yaw=yaw, openings=openings)
    if first == last:  # an end, whose leg goes with it
        return _with_legs(changed, slice(first, last + 1), *(lambda values: (),) * 3)
    hull = lambda boxes: (_hull((*boxes[0], *boxes[1])),)  # noqa: E731
    return _with_legs(changed, slice(first, last + 1), lambda d: (sum(d),), lambda w: (min(w),), hull)


def move_in_order(request: FileRequest, index: int, step: int) -> FileRequest:
    """Return the request with a waypoint exchanged with its neighbour ``step`` away, -1 or 1; legs keep their place."""
    other = index + step
    if not 0 <= other < len(request.waypoints):
        return request
    order = list(range(len(request.waypoints)))
    order[index], order[other] = order[other], order[index]
    yaw = request.yaw_in(order)
    points = tuple(request.waypoints[i] for i in order)
    return _grown(replace(request, waypoints=points, yaw=yaw, openings=_renumbered(request, order)))


def with_gate(request: FileRequest, index: int, wanted: bool, margin: float = 0.0) -> FileRequest:
    """Return the request with a gate of 1 m by 1 m at a waypoint, across the way to it and from it, or without it.

    ``margin`` is how far from its edges the gate is passed [m].
    """
    others = tuple(gate for gate in request.openings if gate.waypoint != index)
    if not wanted:
        return replace(request, openings=others)
    points = np.array(request.waypoints)
    along = points[min(index + 1, request.legs)] - points[max(index - 1, 0)]
    along[2] = 0.0
    heading = along / np.linalg.norm(along) if along.any() else np.array([1.0, 0.0, 0.0])
    corners = Gate(points[index], heading, GATE).corners
    return replace(request, openings=tuple(sorted((*others, Opening(index, _points(corners), 1, margin)))))


def reshape_gate(request: FileRequest, index: int, matrix: FloatArray) -> FileRequest:
    """Return the request with the corners of a gate turned or scaled about its center, by a matrix (3, 3)."""
    center = np.array(request.waypoints[index])
    return _with_corners(request, (index,), lambda corners: center + (corners - center) @ matrix.T)


def resize_gate(request: FileRequest, index: int, size: Sequence[float]) -> FileRequest:
    """Return the request with another width and height of a gate [m], if it is there."""
    corners = next((np.array(gate.corners) for gate in request.openings if gate.waypoint == index), None)
    if corners is None:
        return request
    scale = np.maximum(size, THINNEST) / size_of(corners) - 1.0
    axes = np.stack(axes_of(corners))
    return reshape_gate(request, index, np.eye(3) + axes.T * scale @ axes)


def size_of(corners: FloatArray) -> FloatArray:
    """Return the width and the height of an opening with these corners, (m, 3), shape (2,) [m]."""
    return np.asarray(np.ptp(corners @ np.stack(axes_of(corners)).T, axis=0))


def set_margin(request: FileRequest, index: int, margin: float) -> FileRequest:
    """Return the request with another margin of a gate [m]."""
    return _with_gates(request, (index,), lambda gate: gate._replace(margin=float(margin)))


def axes_of(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return unit vectors along the width and the height of an opening with these corners, (m, 3)."""
    normal = Gate.polygon(corners).normal
    across = np.cross((0.0, 0.0, 1.0) if abs(normal[2]) < 0.99 else (0.0, 1.0, 0.0), normal)
    if len(corners) == 4:  # of a gate that is rolled, the side that is nearest to level
        across = max(np.diff(corners[:3], axis=0), key=lambda side: abs(side @ across) / np.linalg.norm(side))
    across /= np.linalg.norm(across)
    return across, np.cross(normal, across)


def set_width(request: FileRequest, leg: int, width: float) -> FileRequest:
    """Return the request with another half-width of one leg [m]."""
    widths = request.corridor or (WIDTH,) * request.legs
    return replace(request, corridor=(*widths[:leg], float(width), *widths[leg + 1 :]))


def with_tube(request: FileRequest, wanted: bool) -> FileRequest:
    """Return the request with a tube of 0.3 m around every leg, or without any."""
    return replace(request, corridor=(WIDTH,) * request.legs if wanted else None)


def with_boxes(request: FileRequest, wanted: bool) -> FileRequest:
    """Return the request with a box around every leg, 1 m larger than the leg, or without any."""
    boxes = tuple(_around(request.waypoints[leg : leg + 2]) for leg in range(request.legs))
    return replace(request, boxes=boxes if wanted else None)


def with_room(request: FileRequest, wanted: bool) -> FileRequest:
    """Return the request with a room around all waypoints, or without any."""
    return replace(request, room=_around(request.waypoints) if wanted else None)


def move_face(box: Box, axis: int, side: int, value: float) -> Box:
    """Return a box with one of its faces elsewhere.

    Parameters
    ----------
    box : Box
        [m].
    axis, side : int
        Which face: axis 0 to 2; side 0 is the lower one.
    value : float
        Its new coordinate [m]; it stops 2 cm before the opposite face.
    """
    corners = [list(corner) for corner in box]
    opposite = corners[1 - side][axis]
    corners[side][axis] = min(value, opposite - THINNEST) if side == 0 else max(value, opposite + THINNEST)
    return _plain(corners[0]), _plain(corners[1])


def named_boxes(request: FileRequest) -> dict[str, Box]:
    """Return the room and the boxes of the legs by what the page calls them."""
    room = {} if request.room is None else {ROOM: request.room}
    return room | {f"box {leg}": box for leg, box in enumerate(request.boxes or ())}


def change_box(request: FileRequest, name: str, change: Callable[[Box], Box]) -> FileRequest:
    """Return the request with the room or a box changed, if it is there."""
    boxes = named_boxes(request)
    if name not in boxes:
        return request
    boxes[name] = change(boxes[name])
    room = boxes.pop(ROOM, None)
    return replace(request, room=room, boxes=None if request.boxes is None else tuple(boxes.values()))


def with_time(request: FileRequest, mode: str, durations: Sequence[float], limits: dict[str, float]) -> FileRequest:
    """Return the request timed in another way.

    Parameters
    ----------
    request : FileRequest
    mode : {"durations", "total time", "limits"}
        What is given.
    durations : sequence of float
        Of the legs, for the first two [s].
    limits : dict
        For the third.
    """
    times = tuple(float(value) for value in durations)
    if mode == "limits":
        kept = request.limits or tuple(limits.items())
        return replace(request, durations=None, total_time=None, limits=kept)
    search = request.search and replace(request.search, time_weight=None)
    request = replace(request, limits=(), rotors=None)
    if mode == "total time":
        search = search and replace(search, time_limit=None)
        return replace(request, durations=None, total_time=sum(times), search=search)
    return replace(request, durations=times, total_time=None, search=search and replace(search, split="optimal"))


def set_limit(request: FileRequest, name: str, value: float | None) -> FileRequest:
    """Return the request with another value of a limit, or without it where that is None.

    Raises
    ------
    InputError
        If that would leave a plan within limits without any.
    """
    limits = {known: bound for known, bound in request.limits if known != name}
    if value is not None:
        limits[name] = float(value)
    if not limits and request.rotors is None:
        raise InputError("the time comes from the limits: keep one of them, or give the time instead")
    return replace(request, limits=tuple(limits.items()))


def set_reserve(request: FileRequest, share: float) -> FileRequest:
    """Return the request with another share of the rotors' room left to feedback, if their limits are kept."""
    return request if request.rotors is None else replace(request, rotors=float(share))


def set_duration(request: FileRequest, leg: int, seconds: float) -> FileRequest:
    """Return the request with another duration of one leg [s]."""
    times = request.durations or straight_durations(request)
    return replace(request, durations=(*times[:leg], float(seconds), *times[leg + 1 :]), total_time=None)


def straight_durations(request: FileRequest) -> tuple[float, ...]:
    """Return durations of the legs at 1 m/s [s]."""
    steps = np.diff(np.array(request.waypoints), axis=0)
    return tuple((np.maximum(np.linalg.norm(steps, axis=1), 0.1) / SPEED).tolist())


def _renumbered(request: FileRequest, order: Sequence[int | None]) -> tuple[Opening, ...]:
    """Return the gates at the new numbers of their waypoints; those of waypoints that are gone are left out."""
    numbers = [(order[gate.waypoint], gate) for gate in request.openings]
    return tuple(sorted(gate._replace(waypoint=number) for number, gate in numbers if number is not None))


def _with_corners(
    request: FileRequest, moved: Sequence[int], change: Callable[[FloatArray], FloatArray]
) -> FileRequest:
    """Return the request with other corners of the gates at some waypoints."""
    return _with_gates(request, moved, lambda gate: gate._replace(corners=_points(change(np.array(gate.corners)))))


def _with_gates(request: FileRequest, changed: Sequence[int], change: Callable[[Opening], Opening]) -> FileRequest:
    """Return the request with other gates at some waypoints."""
    gates = (change(gate) if gate.waypoint in changed else gate for gate in request.openings)
    return replace(request, openings=tuple(gates))


def _points(corners: FloatArray) -> tuple[Point, ...]:
    return tuple(_plain(corner) for corner in corners)


def _with_legs(request: FileRequest, legs: slice, durations: _Made, widths: _Made, boxes: _Made) -> FileRequest:
    """Return the request with other legs in the place of some: their values are made of those of these."""

    def spliced(values: Any, made: _Made) -> Any:
        return None if values is None else (*values[: legs.start], *made(values[legs]), *values[legs.stop :])

    times = spliced(request.durations, durations)
    return replace(
        request, durations=times, corridor=spliced(request.corridor, widths), boxes=spliced(request.boxes, boxes)
    )


def _grown(request: FileRequest) -> FileRequest:
    """Return the request with boxes that contain the ends of their legs."""
    if request.boxes is None:
        return request
    boxes = []
    for leg, (lower, upper) in enumerate(request.boxes):
        ends = request.waypoints[leg : leg + 2]
        holds = (np.array(ends) >= lower).all() and (np.array(ends) <= upper).all()
        boxes.append((lower, upper) if holds else _hull((lower, upper, *_around(ends))))
    return replace(request, boxes=tuple(boxes))


def _around(points: Sequence[Point]) -> Box:
    lower, upper = _hull(points)
    return _plain(np.array(lower) - ROOM_AROUND), _plain(np.array(upper) + ROOM_AROUND)


def _hull(points: Sequence[Point]) -> Box:
    values = np.array(points)
    return _plain(values.min(axis=0)), _plain(values.max(axis=0))


def _plain(values: Sequence[float] | FloatArray) -> Point:
    return tuple(float(value) for value in values)
