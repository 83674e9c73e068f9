"""The question of a fleet: as the joint search takes it, and checked.

Every refusal is one sentence that names the vehicle or the pair.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
from math import cos, inf, sin, sqrt
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, IntArray, numbers
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import DERIVATIVES, check_state, check_waypoints, point_text
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import EXACT
from minsnap.bounds.least_time import least_time
from minsnap.corridors.boxes import Boxes, Room, as_room
from minsnap.corridors.keep_out import Obstacle, as_simple, clearance_of
from minsnap.durations.connector import CONNECTOR
from minsnap.errors import FleetError, InfeasibleError, LimitError, SolverError, TimingError, WaypointError
from minsnap.fleet.common_clock import Fleet, Separation, as_separation
from minsnap.limits.limits import Limits, check_one_speed
from minsnap.limits.trapezoid import trapezoid_time
from minsnap.native.joint_fleet import KINDS, ORDERS
from minsnap.planning.planner import plan
from minsnap.trajectory.path import Path

INWARDS = 0.004
"""Share of the separation by which walls are moved inwards for the search: what lies between samples takes the rest."""

CROWDED = 0.85
"""How much shorter pieces at the ends are than those between: 0 for equal ones, below 1."""

ALONE = 3
"""Polynomials of a leg in the plan of a vehicle alone that says when it passes its waypoints."""

PLAIN = ("speed", "acceleration", "jerk", "snap")

BOUNDED = 8
"""Vehicles with more than one leg whose least time is proved as that of a course."""

MOST_VEHICLES = 10_000
"""Vehicles of one plan."""


@dataclass(frozen=True, eq=False)
class FleetTask:
    """The question of vehicles that fly at once.

    Parameters
    ----------
    waypoints : tuple of ndarray, shape (n_i, 3)
        Of each vehicle that is planned [m].
    states : tuple of mapping
        Of each: derivatives at the start, by order.
    limits : tuple of Limits or None
        Of each; None where only a total time is set.
    separation : Separation or None
    room : Room or None
    avoid : tuple of Obstacle
    fixed : tuple of Path
        Vehicles that fly as they do.
    corridors : tuple of Boxes or None
        Of each vehicle that is planned; empty for none.
    holds : tuple of ndarray, shape (n_i,), or None
        Of each vehicle: how long it rests at its waypoints at least [s]; empty for none.
    total_time : float or None
        Of all [s].
    instants : tuple of ndarray, shape (n_i, 2), or None
        Of each vehicle: when it arrives at each waypoint and leaves it [s]; empty for none.
    shares : ndarray or None
        Knots in units of the flight time, where instants are given: these are among them.
    later : tuple of (int, int)
        Vehicles and waypoints that are passed a knot later than alone, once for each time that they stand here.
    """

    waypoints: tuple[FloatArray, ...]
    states: tuple[Mapping[int, FloatArray], ...]
    limits: tuple[Limits, ...] | None
    separation: Separation | None
    room: Room | None
    avoid: tuple[Obstacle, ...]
    fixed: tuple[Path, ...]
    corridors: tuple[Boxes | None, ...] = ()
    holds: tuple[FloatArray | None, ...] = ()
    total_time: float | None = None
    instants: tuple[FloatArray | None, ...] = ()
    shares: FloatArray | None = None
    later: tuple[tuple[int, int], ...] = ()

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
        """Whether curves can be slowed down as a whole: all begin at rest, and nobody flies as he does, or is timed."""
        return not self.fixed and not self.instants and not any(map(self.moves, range(len(self))))

    def moves(self, vehicle: int) -> bool:
        """Return whether a vehicle has another state than rest at the start."""
        return any(each.any() for each in self.states[vehicle].values())

    def holds_of(self, vehicle: int) -> FloatArray:
        """Return how long a vehicle rests at its waypoints at least, shape (n_i,) [s]."""
        own = self.holds[vehicle] if self.holds else None
        return np.zeros(len(self.waypoints[vehicle])) if own is None else own

    def instants_of(self, vehicle: int) -> FloatArray | None:
        """Return when a vehicle arrives at its waypoints and leaves them, shape (n_i, 2) [s]; None where it is free."""
        return self.instants[vehicle] if self.instants else None

    def is_pinned(self, vehicle: int) -> bool:
        """Return whether a vehicle is at places of its own on its way: it passes some, rests, or is timed."""
        timed = self.instants_of(vehicle) is not None
        return timed or len(self.waypoints[vehicle]) > 2 or bool(self.holds_of(vehicle).any())

    def shares_of(self, pieces: int) -> FloatArray:
        """Return the instants of knots in units of the flight time, shape (pieces + 1,)."""
        return knot_shares(pieces) if self.shares is None else self.shares

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
        walls = np.full((len(self) + len(self.fixed), pieces, 2, 3), [[-inf], [inf]])
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
        knots = self.knots_of(vehicle, pieces)[:, 0]
        knots[-1] = pieces
        return np.asarray(np.repeat(np.arange(len(knots) - 1), np.diff(knots)))

    def knots_of(self, vehicle: int, pieces: int) -> IntArray:
        """Return the knots at which a vehicle arrives at each waypoint and leaves it, shape (n_i, 2).

        Arrivals are nearest to those of the vehicle alone, and each leg has at least one piece. Holds last their
        seconds in the least time that the fleet can take, and longer in longer ones.
        """
        shares, given = self.shares_of(pieces), self.instants_of(vehicle)
        if given is not None:
            return np.asarray(np.abs(shares[:, None, None] - given / (self.total_time or 1.0)).argmin(axis=0))
        points, holds = self.waypoints[vehicle], self.holds_of(vehicle)
        holds = holds / max(self.total_time or float(self.bounds.max()), 1e-12) if holds.any() else holds
        legs = self.legs_alone[vehicle]
        way = np.concatenate(([0.0], np.cumsum(legs))) / max(legs.sum(), 1e-12) * (1.0 - holds.sum())
        instants, knots = shares, [(0, int(np.searchsorted(shares, holds[0] - 1e-12)))]
        for index in range(1, len(points)):
            least, most = knots[-1][1] + 1, pieces - (len(points) - 1 - index)
            alone = int(np.argmin(np.abs(instants - way[index] - holds[:index].sum())))
            arrives = min(max(alone + self.later.count((vehicle, index)), least), most)
            leaves = int(np.searchsorted(instants, instants[arrives] + holds[index] - 1e-12))
            knots.append((arrives, leaves))
        last = int(np.searchsorted(instants, 1.0 - holds[-1] + 1e-12, side="right")) - 1
        knots[-1] = (last, pieces)
        indices = np.array(knots)
        if (indices[1:, 0] <= indices[:-1, 1]).any():
            raise FleetError(f"the holds of vehicle {vehicle} leave too few pieces to fly: give pieces={2 * pieces}")
        return indices

    @cached_property
    def legs_alone(self) -> tuple[FloatArray, ...]:
        """How long each leg of each vehicle lasts that flies alone [s]; where nothing says it, its length [m]."""
        return tuple(self._legs_alone(vehicle) for vehicle in range(len(self)))

    def _legs_alone(self, vehicle: int) -> FloatArray:
        points = self.waypoints[vehicle]
        if len(points) > 2 and self.limits is not None:
            with suppress(InfeasibleError, SolverError, TimingError):
                alone = plan(points, limits=self.limits[vehicle], pieces=ALONE)
                return np.asarray(alone.durations.reshape(len(points) - 1, -1).sum(axis=1))
        return np.asarray(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)))

    def stretch_of(self, pieces: int) -> float:
        """Return by how much the longest flight alone lasts longer if all pass their waypoints at knots, about."""
        longest, stretch = max(float(legs.sum()) for legs in self.legs_alone), 1.0
        for vehicle, legs in enumerate(self.legs_alone):
            if len(legs) > 1:
                arrives, leaves = self.shares_of(pieces)[self.knots_of(vehicle, pieces)].T
                stretch = max(stretch, float((legs / (arrives[1:] - leaves[:-1])).max()) / max(longest, 1e-12))
        return stretch

    @cached_property
    def limit_table(self) -> FloatArray:
        """Limits of velocity to snap: three axes, norm, norm of x and y, shape (m, 4, 5); infinite for none."""
        table = np.full((len(self) + len(self.fixed), ORDERS, KINDS), inf)
        for vehicle, own in enumerate(self.limits or ()):
            table[vehicle] = table_of(own)
        return table

    def bound_of(self, vehicle: int) -> float:
        """Return the least time within the speed and acceleration limits: a trapezoid along the way [s]."""
        steps = np.diff(self.waypoints[vehicle], axis=0)
        table, at_rest = self.limit_table[vehicle], not self.moves(vehicle)
        both = zip(ways_by_norm(steps), table[0], table[1], strict=True)
        flying = max(trapezoid(way, float(v), float(a) if at_rest else inf) for way, v, a in both)
        return flying + float(self.holds_of(vehicle).sum())

    @cached_property
    def bounds(self) -> FloatArray:
        """Least time of each vehicle that is planned, shape (m,) [s]."""
        return np.array([self.bound_of(vehicle) for vehicle in range(len(self))])

    @cached_property
    def least(self) -> FloatArray:
        """A time that each vehicle takes at least, shape (m,) [s].

        It knows the limit on the jerk where a way is one leg from rest to rest; of those with more legs, a few that are
        the slowest by their lengths have a bound that knows the bends.
        """
        least = self.bounds.copy()
        for vehicle, points in enumerate(self.waypoints):
            if len(points) == 2 and not self.moves(vehicle):
                table = np.minimum(self.limit_table[vehicle], self.limit_table[vehicle, :, 3:4])  # no axis is beyond
                each = zip(ways_by_norm(np.diff(points, axis=0)), *table[:3].tolist(), strict=True)
                flying = max(trapezoid(*limited) for limited in each)
                least[vehicle] = flying + float(self.holds_of(vehicle).sum())
        if self.limits is None:
            return least
        legs = [vehicle for vehicle in np.argsort(-self.bounds, kind="stable") if len(self.waypoints[vehicle]) > 2]
        for vehicle in legs[:BOUNDED]:
            start = {DERIVATIVES[order]: value for order, value in self.states[vehicle].items()}
            with suppress(WaypointError, LimitError):
                known = least_time(self.waypoints[vehicle], self.limits[vehicle], start=start or None).seconds or 0.0
                least[vehicle] = max(least[vehicle], known + float(self.holds_of(vehicle).sum()))
        return least


def ways_by_norm(steps: FloatArray) -> list[float]:
    """Return the lengths of steps (n, 3) along each axis, in space, and seen from above [m]."""
    norms = (steps, steps[:, :2])
    return [*np.abs(steps).sum(axis=0).tolist(), *(float(np.sqrt((each**2).sum(axis=1)).sum()) for each in norms)]


def way_of(points: FloatArray) -> float:
    """Return the straight length through waypoints [m]."""
    return float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum())


def knot_shares(pieces: int) -> FloatArray:
    """Return the instants of knots in units of the flight time: pieces are shorter at the ends, where speeds change."""
    x = np.arange(pieces + 1) / pieces
    return np.asarray((1.0 - CROWDED) * x + CROWDED * x * x * (3.0 - 2.0 * x))


def table_of(limits: Limits) -> FloatArray:
    """Return limits of one vehicle, shape (4, 5); those on thrust, tilt and body rate by what implies them."""
    table = np.full((ORDERS, KINDS), inf)
    for order, name in enumerate(PLAIN):
        value = getattr(limits, name)
        if value is not None:
            table[order, slice(3) if limits.norm == "axis" else 3] = value
    values = limits.given()
    for order, name in enumerate(PLAIN[:2]):
        table[order, 4] = values.get(f"horizontal_{name}", inf)
        table[order, 2] = min(table[order, 2], values.get(f"vertical_{name}", inf))
    table[0, 2] = min(table[0, 2], values.get("climb_speed", inf), values.get("descent_speed", inf))
    _add_thrust(table, values, limits.gravity)
    return table


def _add_thrust(table: FloatArray, values: Mapping[str, float], gravity: float) -> None:
    """Lower the acceleration so that thrust and tilt are kept, and the jerk so that body rates are."""
    room = [gravity * (values["max_thrust"] - 1.0)] if "max_thrust" in values else []
    room += [gravity * (1.0 - values["min_thrust"])] if "min_thrust" in values else []
    room += [gravity * sin(values["tilt"])] if "tilt" in values else []
    table[1, 3] = min([table[1, 3], *room])
    if "body_rate" in values:
        table[1, 3] = min(table[1, 3], gravity * cos(1.0))
        table[2, 3] = min(table[2, 3], values["body_rate"] * (gravity - table[1, 3]))


def trapezoid(way: float, speed: float, acceleration: float, jerk: float = inf) -> float:
    """Return the least time from rest to rest over a way [s], with the ends of its ramps rounded by a jerk.

    Raises
    ------
    FleetError
        If a number is none, or the speed, the acceleration or the jerk not positive.
    """
    real = all(isinstance(one, (int, float)) for one in (way, speed, acceleration, jerk))
    if not real or not min(speed, acceleration, jerk) > 0.0:
        raise FleetError(f"give a way [m], and a speed and an acceleration above 0, not {shown((speed, acceleration))}")
    if jerk < inf and way > 0.0:
        return _rounded(way, speed, acceleration, jerk)
    return trapezoid_time(way, speed, acceleration)


def _rounded(way: float, speed: float, acceleration: float, jerk: float) -> float:
    """Return the least time of seven pieces of constant jerk: four of one length, two of constant acceleration."""
    bend = min((0.5 * way / jerk) ** (1.0 / 3.0), sqrt(speed / jerk), acceleration / jerk)
    ramp = 0.0
    if bend >= acceleration / jerk:
        whole = 0.5 * (sqrt(bend * bend + 4.0 * way / (jerk * bend)) - 3.0 * bend)
        ramp = max(min(whole, speed / (jerk * bend) - bend), 0.0)
    top = jerk * bend * (bend + ramp)
    return float(way / top + 2.0 * bend + ramp)


def least_times(waypoints: ArrayLike, limits: Limits | Sequence[Limits]) -> FloatArray:
    """Return a time below which each vehicle cannot fly its way from rest to rest, shape (m,) [s].

    Parameters
    ----------
    waypoints : array_like, shape (m, n, 3), or sequence of array_like, shape (n_i, 3)
        [m].
    limits : Limits or sequence of Limits
        Speed, acceleration and jerk count along one leg, and what :func:`minsnap.least_time` knows through more.

    Raises
    ------
    FleetError
        If they are malformed.
    """
    return check_task(waypoints, limits, None, None, None, None, None, None, None).least


def limits_of(limits: Any, vehicles: int) -> list[Limits]:
    """Return the limits of each vehicle, from one for all or one each."""
    each = list(limits) if isinstance(limits, Sequence) else [limits] * vehicles
    if len(each) != vehicles:
        raise FleetError(f"{len(each)} limits for {vehicles} vehicles: give one for all, or one each")
    for one in {id(one): one for one in each}.values():
        check_one_speed(one, "a vehicle of a fleet")
    return each


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
        as_simple(avoid),
        flying,
        _checked_corridors(corridors, points),
        _checked_holds(holds, points),
    )
    _refuse_near(task, [each[0] for each in (*points, *(curve(0.0)[None] for curve in flying))], "starts")
    _refuse_near(task, [each[-1] for each in (*points, *(curve(curve.duration)[None] for curve in flying))], "goals")
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
    sentence = f"start must be a list of {count} states, each None or such as {{'velocity': (1, 0, 0)}}"
    each = one_each([None] * count if start is None else start, count, sentence)
    return tuple(check_state(state, f"the start of vehicle {i}", 4, 3) for i, state in enumerate(each))


def one_each(value: Any, count: int, sentence: str) -> tuple[Any, ...]:
    """Return the entries of a sequence, one for each vehicle, or raise FleetError with this sentence."""
    if not isinstance(value, Sequence) or len(value) != count:
        raise FleetError(sentence)
    return tuple(value)


def _checked_corridors(corridors: Any, points: tuple[FloatArray, ...]) -> tuple[Boxes | None, ...]:
    if corridors is None:
        return ()
    sentence = f"corridors must be a list of {len(points)} Boxes, with None for vehicles without one"
    entries = one_each(corridors, len(points), sentence)
    for vehicle, (boxes, own) in enumerate(zip(entries, points, strict=True)):
        if boxes is None:
            continue
        if not isinstance(boxes, Boxes) or boxes.lower.shape != (len(own) - 1, 3):
            text = f"the corridor of vehicle {vehicle} must be Boxes, one in space for each leg"
            raise FleetError(text, vehicle=vehicle)
        ends = np.stack((own[:-1], own[1:]))
        outside = ((ends < boxes.lower) | (ends > boxes.upper)).any(axis=(0, 2))
        if outside.any():
            text = f"leg {outside.argmax()} of vehicle {vehicle} begins or ends outside of its box"
            raise FleetError(f"{text}: move the waypoint or the box", vehicle=vehicle)
    return entries


def _checked_holds(holds: Any, points: tuple[FloatArray, ...]) -> tuple[FloatArray | None, ...]:
    if holds is None:
        return ()
    sentence = f"holds must be a list of {len(points)}, of each vehicle seconds at its waypoints, or None"
    entries = one_each(holds, len(points), sentence)
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


def meeting_at(task: FleetTask, pieces: int) -> tuple[tuple[int, int], tuple[int, int], float] | None:
    """Return the first two vehicles and waypoints passed at one knot nearer than the separation, and their gap [m]."""
    if task.separation is None:
        return None
    passed: dict[int, list[tuple[int, int]]] = {}
    for vehicle in range(len(task)):
        for index, (arrives, leaves) in enumerate(task.knots_of(vehicle, pieces)[1:-1].tolist(), 1):
            for knot in range(arrives, leaves + 1):
                passed.setdefault(knot, []).append((vehicle, index))
    for meeting in passed.values():
        for (one, i), (two, j) in combinations(meeting, 2):
            gap = task.separation.flat(task.waypoints[one][i] - task.waypoints[two][j])
            away = float(np.sqrt((gap**2).sum()))
            if away < (1.0 - EXACT) * (task.radii[one] + task.radii[two]):
                return (one, i), (two, j), away
    return None


def refuse_meetings(task: FleetTask, pieces: int) -> None:
    """Refuse the first two vehicles whose waypoints are passed at one instant, nearer than their separation."""
    meeting = meeting_at(task, pieces)
    if meeting is not None:
        (one, i), (two, j), away = meeting
        text = f"waypoint {i} of vehicle {one} and waypoint {j} of vehicle {two} are passed at one instant"
        advice = "give one other durations" if task.instants else "give one of the vehicles another waypoint before it"
        raise FleetError(f"{text}, {away:.4g} m apart: move one, or {advice}", pair=(one, two))


def apart_at_knots(task: FleetTask, pieces: int) -> FleetTask:
    """Return the task with waypoints passed a knot later, until no two vehicles are too near at one, if that helps."""
    tried = task
    for _ in range(pieces):
        meeting = meeting_at(tried, pieces)
        if meeting is None:
            return tried
        tried = replace(tried, later=(*tried.later, meeting[1]))
    return task


def _refuse_starts(task: FleetTask) -> None:
    """Refuse the first start that moves where it is to rest, or that is at a limit of its vehicle or beyond."""
    for vehicle, state in enumerate(task.states):
        rest = task.holds_of(vehicle)[0]
        if rest > 0.0 and task.moves(vehicle):
            text = f"vehicle {vehicle} starts moving and is to rest for {rest:g} s at its first waypoint"
            raise FleetError(f"{text}: leave out its start or that hold", vehicle=vehicle)
        for used in task.limits[vehicle].use_of_state(state, 3) if task.limits else ():
            if used.fraction > 1.0 - CONNECTOR.on_limit:
                text = f"the start of vehicle {vehicle} has {used.name} {used.value:.6g}"
                give = "a fleet starts within its limits; change it, or the start"
                raise FleetError(f"{text}, and its limit is {used.limit:g}: {give}", vehicle=vehicle)


def _refuse_outside(task: FleetTask) -> None:
    """Refuse the first waypoint outside of the room or inside an obstacle."""
    for vehicle, points in enumerate(task.waypoints):
        for index, point in enumerate(points):
            text = f"waypoint {index} of vehicle {vehicle}, {point_text(point)}, is"
            if task.room is not None and ((point < task.room.lower) | (point > task.room.upper)).any():
                raise FleetError(f"{text} outside of the room: move it or make the room larger", vehicle=vehicle)
            for which, obstacle in enumerate(task.avoid):
                depth = -clearance_of(obstacle, point)
                if depth > EXACT:
                    raise FleetError(f"{text} {depth:.3g} m inside obstacle {which}: move it", vehicle=vehicle)
