"""What is asked of a fleet, checked, as the joint search takes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import cos, inf, sin
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.checks import check_state, check_waypoints
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.boxes import Boxes
from minsnap.corridors.room import Room, as_room
from minsnap.errors import FleetError, WaypointError
from minsnap.fleet.common_clock import Fleet
from minsnap.fleet.fleet_limits import limits_of
from minsnap.fleet.keep_out import Obstacle, as_obstacles
from minsnap.fleet.separation import Separation, as_separation
from minsnap.limits.limits import Limits
from minsnap.native.joint_fleet import KINDS, ORDERS
from minsnap.trajectory.path import Path

MOST_VEHICLES = 10_000
"""Vehicles of one plan."""

INWARDS = 0.004
"""Share of the separation by which walls are moved inwards for the search: what lies between samples takes the rest."""

CROWDED = 0.85
"""How much shorter pieces at the ends are than those between: 0 for equal ones, below 1."""

PLAIN = ("speed", "acceleration", "jerk", "snap")


@dataclass(frozen=True, eq=False)
class FleetTask:
    """What is asked of vehicles that fly at once.

    Parameters
    ----------
    waypoints : tuple of ndarray, shape (n_i, 3)
        Of each vehicle that is planned [m].
    states : tuple of mapping
        Of each: derivatives at the start, by order.
    limits : tuple of Limits or None
        Of each; None where only a total time is given.
    separation : Separation or None
    room : Room or None
    avoid : tuple of Obstacle
    fixed : tuple of Path
        Vehicles that fly as they do.
    corridors : tuple of Boxes or None
        Of each vehicle that is planned; empty for none.
    """

    waypoints: tuple[FloatArray, ...]
    states: tuple[Mapping[int, FloatArray], ...]
    limits: tuple[Limits, ...] | None
    separation: Separation | None
    room: Room | None
    avoid: tuple[Obstacle, ...]
    fixed: tuple[Path, ...]
    corridors: tuple[Boxes | None, ...] = ()

    def __len__(self) -> int:
        return len(self.waypoints)

    @cached_property
    def starts(self) -> FloatArray:
        """First waypoints, shape (m, 3) [m]."""
        return np.stack([points[0] for points in self.waypoints])

    @cached_property
    def goals(self) -> FloatArray:
        """Last waypoints, shape (m, 3) [m]."""
        return np.stack([points[-1] for points in self.waypoints])

    @property
    def free_time(self) -> bool:
        """Whether curves can be slowed down as a whole: nobody moves at the start, and nobody flies as he does."""
        return not self.fixed and not any(any(each.any() for each in state.values()) for state in self.states)

    @property
    def through(self) -> bool:
        """Whether some vehicle has waypoints between its first and its last."""
        return any(len(points) > 2 for points in self.waypoints)

    @cached_property
    def radii(self) -> FloatArray:
        """Half the separation of each vehicle, the fixed ones last [m]."""
        count = len(self) + len(self.fixed)
        return np.full(count, 1e-9) if self.separation is None else self.separation.radii_of(count)

    @cached_property
    def length(self) -> float:
        """Unit of distances from walls: the least separation, or a share of the way [m]."""
        if self.separation is not None:
            return float(2.0 * self.radii.min())
        return float(0.05 * max(way_of(points) for points in self.waypoints) or 1.0)

    def walls(self, pieces: int) -> FloatArray:
        """Return the bounds of each piece, shape (m, pieces, 2, 3), the fixed vehicles' infinite [m]."""
        walls = np.empty((len(self) + len(self.fixed), pieces, 2, 3))
        walls[:, :, 0], walls[:, :, 1] = -inf, inf
        inwards = INWARDS * self.length
        if self.room is not None:
            walls[: len(self), :, 0], walls[: len(self), :, 1] = self.room.lower, self.room.upper
        for vehicle, boxes in enumerate(self.corridors):
            if boxes is not None:
                leg = self.legs_of(vehicle, pieces)
                walls[vehicle, :, 0] = np.maximum(walls[vehicle, :, 0], boxes.lower[leg])
                walls[vehicle, :, 1] = np.minimum(walls[vehicle, :, 1], boxes.upper[leg])
        for vehicle, points in enumerate(self.waypoints):  # a waypoint may lie on a wall
            walls[vehicle, :, 0] = np.minimum(walls[vehicle, :, 0] + inwards, points.min(axis=0))
            walls[vehicle, :, 1] = np.maximum(walls[vehicle, :, 1] - inwards, points.max(axis=0))
        return walls

    def legs_of(self, vehicle: int, pieces: int) -> IntArray:
        """Return the leg of each piece of a vehicle, shape (pieces,)."""
        knots = waypoint_knots(self.waypoints[vehicle], pieces)
        return np.asarray(np.repeat(np.arange(len(knots) - 1), np.diff(knots)))

    @cached_property
    def limit_table(self) -> FloatArray:
        """Limits of velocity to snap: three axes, norm, norm of x and y, shape (m, 4, 5); infinite for none."""
        table = np.full((len(self) + len(self.fixed), ORDERS, KINDS), inf)
        rows: dict[int, FloatArray] = {}
        for vehicle, own in enumerate(self.limits or ()):
            table[vehicle] = rows.setdefault(id(own), table_of(own))
        return table

    def bound_of(self, vehicle: int) -> float:
        """Return the least time within the speed and acceleration limits: a trapezoid along the way [s]."""
        steps = np.diff(self.waypoints[vehicle], axis=0)
        table, at_rest = self.limit_table[vehicle], not any(each.any() for each in self.states[vehicle].values())
        ways = [*np.abs(steps).sum(axis=0), np.sqrt((steps * steps).sum(axis=1)).sum()]
        ways.append(np.sqrt((steps[:, :2] ** 2).sum(axis=1)).sum())
        both = zip(ways, table[0], table[1], strict=True)
        return max(_trapezoid(float(way), float(v), float(a) if at_rest else inf) for way, v, a in both)

    @cached_property
    def bounds(self) -> FloatArray:
        """Least time of each vehicle that is planned, shape (m,) [s]."""
        return np.array([self.bound_of(vehicle) for vehicle in range(len(self))])


def way_of(points: FloatArray) -> float:
    """Return the straight length through waypoints [m]."""
    return float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum())


def knot_shares(pieces: int) -> FloatArray:
    """Return the instants of knots in units of the flight time: pieces are shorter at the ends, where speeds change."""
    x = np.arange(pieces + 1) / pieces
    return np.asarray((1.0 - CROWDED) * x + CROWDED * x * x * (3.0 - 2.0 * x))


def waypoint_knots(points: FloatArray, pieces: int) -> list[int]:
    """Return the knot of each waypoint: by the length of the way, each leg at least one piece."""
    steps = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    share = np.concatenate(([0.0], np.cumsum(steps))) / max(way_of(points), 1e-12)
    instants, knots = knot_shares(pieces), [0]
    for index in range(1, len(points)):
        least, most = knots[-1] + 1, pieces - (len(points) - 1 - index)
        knots.append(min(max(int(np.argmin(np.abs(instants - share[index]))), least), most))
    knots[-1] = pieces
    return knots


def table_of(limits: Limits) -> FloatArray:
    """Return limits of one vehicle, shape (4, 5); those on thrust, tilt and body rate by what implies them."""
    table = np.full((ORDERS, KINDS), inf)
    for order, name in enumerate(PLAIN):
        value = getattr(limits, name)
        if value is not None:
            table[order, : 3 if limits.norm == "axis" else 0] = value
            table[order, 3] = inf if limits.norm == "axis" else value
    given = limits.given()
    for order, name in enumerate(PLAIN[:2]):
        table[order, 4] = given.get(f"horizontal_{name}", inf)
        table[order, 2] = min(table[order, 2], given.get(f"vertical_{name}", inf))
    table[0, 2] = min(table[0, 2], given.get("climb_speed", inf), given.get("descent_speed", inf))
    _add_thrust(table, given, limits.gravity)
    return table


def _add_thrust(table: FloatArray, given: Mapping[str, float], gravity: float) -> None:
    """Lower the acceleration so that thrust and tilt are kept, and the jerk so that body rates are."""
    room = [gravity * (given["max_thrust"] - 1.0)] if "max_thrust" in given else []
    room += [gravity * (1.0 - given["min_thrust"])] if "min_thrust" in given else []
    room += [gravity * sin(given["tilt"])] if "tilt" in given else []
    table[1, 3] = min([table[1, 3], *room])
    if "body_rate" in given:
        table[1, 3] = min(table[1, 3], gravity * cos(1.0))
        table[2, 3] = min(table[2, 3], given["body_rate"] * (gravity - table[1, 3]))


def _trapezoid(way: float, speed: float, acceleration: float) -> float:
    """Return the least time from rest to rest over a way [s]."""
    if way == 0.0:
        return 0.0
    if acceleration == inf:
        return way / speed
    if speed == inf or way * acceleration < speed * speed:
        return float(2.0 * np.sqrt(way / acceleration))
    return way / speed + speed / acceleration


def check_task(
    waypoints: Any, limits: Any, separation: Any, room: Any, avoid: Any, start: Any, fixed: Any, corridors: Any = None
) -> FleetTask:
    """Return what is asked, or raise FleetError in one sentence."""
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
    )
    _refuse_near(task, [each[0] for each in (*points, *(curve(0.0)[None] for curve in flying))], "starts")
    _refuse_near(task, [each[-1] for each in points], "goals")
    _refuse_outside(task)
    return task


def _checked_waypoints(waypoints: Any) -> tuple[FloatArray, ...]:
    if isinstance(waypoints, str) or not hasattr(waypoints, "__len__") or not len(waypoints):
        raise FleetError(f"the waypoints are {shown(waypoints)}: give an array (n, 3) for each vehicle [m]")
    if len(waypoints) > MOST_VEHICLES:
        raise FleetError(f"there are {len(waypoints)} vehicles: at most {MOST_VEHICLES} are planned at once")
    points = []
    for vehicle, given in enumerate(waypoints):
        try:
            own = check_waypoints(given)
        except WaypointError as error:
            raise FleetError(f"vehicle {vehicle}: {error}", vehicle=vehicle) from None
        if own.shape[1] != 3:
            raise FleetError(f"vehicle {vehicle} has {own.shape[1]} coordinates: give x, y and z", vehicle=vehicle)
        points.append(own)
    return tuple(points)


def _checked_states(start: Any, count: int) -> tuple[Mapping[int, FloatArray], ...]:
    each = [None] * count if start is None else start
    if isinstance(each, Mapping) or not isinstance(each, Sequence) or len(each) != count:
        raise FleetError(f"start must be a list of {count} states, each None or such as {{'velocity': (1, 0, 0)}}")
    return tuple(check_state(state, f"the start of vehicle {i}", 4, 3) for i, state in enumerate(each))


def _checked_corridors(corridors: Any, points: tuple[FloatArray, ...]) -> tuple[Boxes | None, ...]:
    if corridors is None:
        return ()
    given = tuple(corridors) if isinstance(corridors, Sequence) else ()
    if len(given) != len(points):
        raise FleetError(f"corridors must be a list of {len(points)} Boxes, with None for vehicles without one")
    for vehicle, (boxes, own) in enumerate(zip(given, points, strict=True)):
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
    return given


def _refuse_near(task: FleetTask, points: list[FloatArray], what: str) -> None:
    """Refuse the first pair of starts or goals that are nearer than their separation."""
    if task.separation is None:
        return
    places = np.stack(points) * [1.0, 1.0, 1.0 / task.separation.downwash]
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
    for vehicle, points in enumerate(task.waypoints):
        for index, knot in enumerate(waypoint_knots(points, pieces)[1:-1], 1):
            passed.setdefault(knot, []).append((vehicle, index))
    if task.separation is None:
        return
    scale = np.array([1.0, 1.0, 1.0 / task.separation.downwash])
    for meeting in passed.values():
        for place, (one, i) in enumerate(meeting):
            for two, j in meeting[place + 1 :]:
                away = float(np.sqrt((((task.waypoints[one][i] - task.waypoints[two][j]) * scale) ** 2).sum()))
                if away < (1.0 - EXACT) * (task.radii[one] + task.radii[two]):
                    raise FleetError(
                        f"waypoint {i} of vehicle {one} and waypoint {j} of vehicle {two} are passed at one instant, "
                        f"{away:.4g} m apart: move one, or give one of the vehicles another waypoint before it",
                        pair=(one, two),
                    )


def _refuse_outside(task: FleetTask) -> None:
    """Refuse the first waypoint outside of the room or inside an obstacle."""
    obstacles = [each.numbers() for each in task.avoid]
    for vehicle, points in enumerate(task.waypoints):
        for index, point in enumerate(points):
            if task.room is not None and ((point < task.room.lower) | (point > task.room.upper)).any():
                text = f"waypoint {index} of vehicle {vehicle}, {point}, is outside of the room"
                raise FleetError(f"{text}: move it or make the room larger", vehicle=vehicle)
            for which, numbers in enumerate(obstacles):
                depth = -_clearance(numbers, point)
                if depth > EXACT:
                    text = f"waypoint {index} of vehicle {vehicle}, {point}, is {depth:.3g} m inside obstacle {which}"
                    raise FleetError(f"{text}: move it", vehicle=vehicle)


def _clearance(numbers: FloatArray, point: FloatArray) -> float:
    centre, scale, radius, low, high = numbers[:3], numbers[3:6], numbers[6], numbers[7:10], numbers[10:]
    flat = float(np.maximum(point - high, low - point).max())
    return flat if radius < 0.0 else max(flat, float(np.sqrt(((scale * (point - centre)) ** 2).sum())) - radius)
