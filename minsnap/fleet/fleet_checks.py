"""Checks of the question of a fleet: every refusal is one sentence that names the vehicle or the pair."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, numbers
from minsnap.basics.checks import check_state, check_waypoints, point_text
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.boxes import Boxes, Room, as_room
from minsnap.corridors.keep_out import as_obstacles, clearance_of
from minsnap.errors import FleetError, WaypointError
from minsnap.fleet.common_clock import Fleet, as_separation
from minsnap.fleet.fleet_certificate import limits_of
from minsnap.fleet.fleet_task import FleetTask
from minsnap.trajectory.path import Path

MOST_VEHICLES = 10_000
"""Vehicles of one plan."""


def check_task(
    waypoints: Any,
    limits: Any,
    separation: Any,
    room: Any,
    avoid: Any,
    start: Any,
    fixed: Any,
    corridors: Any,
    holds: Any,
) -> FleetTask:
    """Return the question, or raise FleetError in one sentence."""
    points = _checked_waypoints(waypoints)
    flying = tuple(fixed) if isinstance(fixed, Sequence | Fleet) else ()
    for curve in flying:
        if not isinstance(curve, Path):
            raise FleetError(f"a fixed vehicle is a {type(curve).__name__}: give its Trajectory")
    rooms = as_room(room)
    if rooms and not (isinstance(rooms[0], Room) and len(rooms[0].lower) == 3):
        raise FleetError("the room of a fleet must be a Room, or two corners of three coordinates")
    task = FleetTask(
        points,
        _checked_states(start, len(points)),
        None if limits is None else tuple(limits_of(limits, len(points))),
        None if separation is None else as_separation(separation),
        rooms[0] if rooms else None,  # type: ignore[arg-type]
        as_obstacles(avoid),
        flying,
        _checked_corridors(corridors, points),
        _checked_holds(holds, points),
    )
    _refuse_near(task, [each[0] for each in (*points, *(curve(0.0)[None] for curve in flying))], "starts")
    _refuse_near(task, [each[-1] for each in points], "goals")
    _refuse_outside(task)
    _refuse_starts(task)
    return task


def _checked_waypoints(waypoints: Any) -> tuple[FloatArray, ...]:
    if isinstance(waypoints, str) or not hasattr(waypoints, "__len__") or not len(waypoints):
        raise FleetError(f"the waypoints are {shown(waypoints)}: give an array (n, 3) for each vehicle [m]")
    if len(waypoints) > MOST_VEHICLES:
        raise FleetError(f"there are {len(waypoints)} vehicles: at most {MOST_VEHICLES} are planned at once")
    points = []
    for vehicle, rows in enumerate(waypoints):
        try:
            own = check_waypoints(rows)
        except WaypointError as error:
            raise FleetError(f"vehicle {vehicle}: {error}", vehicle=vehicle) from None
        if own.shape[1] != 3:
            raise FleetError(f"vehicle {vehicle} has {own.shape[1]} coordinates: give x, y and z", vehicle=vehicle)
        points.append(own)
    return tuple(points)


def _checked_states(start: Any, count: int) -> tuple[Mapping[int, FloatArray], ...]:
    each = [None] * count if start is None else start
    each = _one_each(
        each, count, f"start must be a list of {count} states, each None or such as {{'velocity': (1, 0, 0)}}"
    )
    return tuple(check_state(state, f"the start of vehicle {i}", 4, 3) for i, state in enumerate(each))


def _one_each(value: Any, count: int, sentence: str) -> tuple[Any, ...]:
    """Return the entries of a sequence, one for each vehicle, or raise FleetError with this sentence."""
    if not isinstance(value, Sequence) or len(value) != count:
        raise FleetError(sentence)
    return tuple(value)


def _checked_corridors(corridors: Any, points: tuple[FloatArray, ...]) -> tuple[Boxes | None, ...]:
    if corridors is None:
        return ()
    sentence = f"corridors must be a list of {len(points)} Boxes, with None for vehicles without one"
    entries = _one_each(corridors, len(points), sentence)
    for vehicle, (boxes, own) in enumerate(zip(entries, points, strict=True)):
        if boxes is None:
            continue
        if not isinstance(boxes, Boxes) or boxes.lower.shape != (len(own) - 1, 3):
            raise FleetError(
                f"the corridor of vehicle {vehicle} must be Boxes, one in space for each leg", vehicle=vehicle
            )
        ends = np.stack((own[:-1], own[1:]))
        if ((ends < boxes.lower) | (ends > boxes.upper)).any():
            leg = int(np.argmax(((ends < boxes.lower) | (ends > boxes.upper)).any(axis=(0, 2))))
            text = f"leg {leg} of vehicle {vehicle} begins or ends outside of its box: move the waypoint or the box"
            raise FleetError(text, vehicle=vehicle)
    return entries


def _checked_holds(holds: Any, points: tuple[FloatArray, ...]) -> tuple[FloatArray | None, ...]:
    if holds is None:
        return ()
    sentence = f"holds must be a list of {len(points)}, of each vehicle seconds at its waypoints, or None"
    entries = _one_each(holds, len(points), sentence)
    checked = [None if each is None else numbers(each) for each in entries]
    for vehicle, (own, way) in enumerate(zip(checked, points, strict=True)):
        if entries[vehicle] is not None and (own is None or own.shape != way.shape[:1] or not (own >= 0.0).all()):
            text = f"the holds of vehicle {vehicle} are {shown(entries[vehicle])}"
            raise FleetError(f"{text}: give {len(way)} numbers of 0 or more [s], one a waypoint", vehicle=vehicle)
    return tuple(checked)


def _refuse_near(task: FleetTask, points: list[FloatArray], what: str) -> None:
    """Refuse the first pair of starts or goals that are nearer than their separation."""
    if task.separation is None:
        return
    places = task.separation.flat(np.stack(points))
    for i in range(len(places) - 1):
        away = np.sqrt(((places[i + 1 :] - places[i]) ** 2).sum(axis=1))
        least = task.radii[i] + task.radii[i + 1 : len(places)]
        if (away < (1.0 - EXACT) * least).any():
            k = int(np.argmin(away - least))
            raise FleetError(
                f"the {what} of vehicles {i} and {i + 1 + k} are {away[k]:.4g} m apart, {least[k] - away[k]:.3g} m "
                f"less than their separation of {least[k]:g} m (heights divided by the downwash): move one",
                pair=(i, i + 1 + k),
            )


def refuse_meetings(task: FleetTask, pieces: int) -> None:
    """Refuse the first two vehicles whose waypoints are passed at one instant, nearer than their separation."""
    passed: dict[int, list[tuple[int, int]]] = {}
    for vehicle in range(len(task)):
        for index, (arrives, leaves) in enumerate(task.knots_of(vehicle, pieces)[1:-1].tolist(), 1):
            for knot in range(arrives, leaves + 1):
                passed.setdefault(knot, []).append((vehicle, index))
    if task.separation is None:
        return
    for meeting in passed.values():
        for (one, i), (two, j) in combinations(meeting, 2):
            gap = task.separation.flat(task.waypoints[one][i] - task.waypoints[two][j])
            away = float(np.sqrt((gap**2).sum()))
            if away < (1.0 - EXACT) * (task.radii[one] + task.radii[two]):
                raise FleetError(
                    f"waypoint {i} of vehicle {one} and waypoint {j} of vehicle {two} are passed at one instant, "
                    f"{away:.4g} m apart: move one, or give one of the vehicles another waypoint before it",
                    pair=(one, two),
                )


def _refuse_starts(task: FleetTask) -> None:
    """Refuse the first start that moves where it is to rest, or that exceeds a limit of its vehicle."""
    for vehicle, state in enumerate(task.states):
        rest = task.holds_of(vehicle)[0]
        if rest > 0.0 and task.moves(vehicle):
            text = f"vehicle {vehicle} starts moving and is to rest for {rest:g} s at its first waypoint"
            raise FleetError(f"{text}: leave out its start or that hold", vehicle=vehicle)
        for used in task.limits[vehicle].use_of_state(state, 3) if task.limits else ():
            if used.fraction > 1.0 + EXACT:
                text = f"the start of vehicle {vehicle} has {used.name} {used.value:.6g}, and {used.limit:g} is allowed"
                raise FleetError(f"{text}: change the limit, or the start", vehicle=vehicle)


def _refuse_outside(task: FleetTask) -> None:
    """Refuse the first waypoint outside of the room or inside an obstacle."""
    for vehicle, points in enumerate(task.waypoints):
        for index, point in enumerate(points):
            if task.room is not None and ((point < task.room.lower) | (point > task.room.upper)).any():
                text = f"waypoint {index} of vehicle {vehicle}, {point_text(point)}, is outside of the room"
                raise FleetError(f"{text}: move it or make the room larger", vehicle=vehicle)
            for which, obstacle in enumerate(task.avoid):
                depth = -clearance_of(obstacle, point)
                if depth > EXACT:
                    text = f"{depth:.3g} m inside obstacle {which}: move it"
                    raise FleetError(
                        f"waypoint {index} of vehicle {vehicle}, {point_text(point)}, is {text}", vehicle=vehicle
                    )
