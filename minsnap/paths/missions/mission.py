"""plan_mission: one trajectory from the ground through a course, lap by lap, and back to the ground."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_kind, is_free, point_text
from minsnap.basics.tolerances import EXACT
from minsnap.certificate import continuity
from minsnap.corridors.constraint import Constraint, Walls, walls_of
from minsnap.corridors.gates import Gate, center_of
from minsnap.corridors.half_spaces import HalfSpaces
from minsnap.corridors.margins import nearest_wall
from minsnap.corridors.named_constraints import widths_of
from minsnap.corridors.obstacle_margins import nearest_obstacle
from minsnap.corridors.passages import GatePassage, gate_passages
from minsnap.durations.time_stretch import nearby_factor, touching_factor
from minsnap.errors import InfeasibleError, SolverError, WaypointError, YawError
from minsnap.files.plan_file import PassedStop
from minsnap.limits.compliance import keeps, largest_use, most_used
from minsnap.limits.heading_cost import fixed_yaw_notes
from minsnap.limits.limits import Limits
from minsnap.limits.ordinary import BUILT_UP, ORDINARY
from minsnap.limits.uses_over_time import legs_within
from minsnap.paths.missions.course import Course, Section, Stop, section_of
from minsnap.planning.free_heading import choose_heading, headings_for
from minsnap.planning.near_notes import near_notes
from minsnap.planning.planner import plan
from minsnap.replanning.horizon import grouped
from minsnap.trajectory.leg_uses import LegUse, Sensitivity
from minsnap.trajectory.plan_notes import plan_notes
from minsnap.trajectory.planned_heading import chosen_heading
from minsnap.trajectory.planned_path import PlannedPath
from minsnap.trajectory.trajectory import Plan, Trajectory, concatenate

if TYPE_CHECKING:
    from minsnap.vehicle.loop import Loop
    from minsnap.vehicle_tube import VehicleTube


@dataclass(frozen=True)
class MissionSettings:
    """What is flown before and after a course.

    Parameters
    ----------
    climb, landing, gentle : float
        Largest speeds of take-off and landing [m/s], and their acceleration [m/s^2].
    pieces : int
        Polynomials of take-off and landing, unless the course says how many a leg has.
    slowings : int
        How often parts are slowed down until they keep the limits together.
    shortest_run, longest_run : float
        Lengths of a run-up to a gate [m]; between them, that in which the top speed is reached.
    """

    climb: float = 1.0
    landing: float = 0.5
    gentle: float = 2.0
    pieces: int = 3
    slowings: int = 4
    shortest_run: float = 1.0
    longest_run: float = 5.0


AROUND = MissionSettings()


@dataclass(frozen=True)
class MissionPart:
    """A part of a mission.

    Parameters
    ----------
    name : str
        take-off, run-up, lap 1, course, hold, run-out or landing.
    start, duration : float
        When it begins, and how long it takes [s].
    """

    name: str
    start: float
    duration: float


class PlannedPart(NamedTuple):
    """A part that was planned, and which stop of the course each of its waypoints belongs to, -1 for none."""

    curve: Trajectory
    stops: tuple[int, ...] = ()

    def sensitivities(self) -> Iterator[Sensitivity]:
        """Yield how its time depends on limits, and on the room at stops by their numbers."""
        for one in self.curve.report.sensitivities if isinstance(self.curve, Plan) else ():
            known = one.waypoint is not None and bool(self.stops)
            yield replace(one, waypoint=self.stops[one.waypoint or 0]) if known else one


@dataclass(frozen=True, eq=False)
class Mission(PlannedPath):
    """A course as it is flown; a path like any other.

    Parameters
    ----------
    trajectory : Trajectory
        All parts, joined with continuous derivatives up to jerk.
    parts : tuple of MissionPart
        In order.
    course : Course
        The course as planned.
    limits : Limits
        What holds for all parts.
    corridor : tuple of HalfSpaces
        The walls that positions stay inside, on the legs of the trajectory: boxes, or tube and straight gates.
    interrupted : bool
        Whether the search for one of the parts was cut short, and its best plan until then taken.
    said : tuple of str
        Which heading was chosen, where it was free.
    planned : tuple of PlannedPart
        The parts of the course, once for each time that they are flown; take-off and landing have limits of their own.
    """

    trajectory: Trajectory
    parts: tuple[MissionPart, ...]
    course: Course
    limits: Limits
    corridor: tuple[HalfSpaces, ...] = ()
    interrupted: bool = False
    said: tuple[str, ...] = ()
    planned: tuple[PlannedPart, ...] = field(default=(), repr=False)

    @property
    def legs(self) -> tuple[LegUse, ...]:
        """What the flight does leg by leg: time, speed, limits that bind."""
        return legs_within(self.trajectory, self.limits)

    @property
    def sensitivities(self) -> tuple[Sensitivity, ...]:
        """How the flight time depends on limits, and on the room at the stops, over all parts; see ``Report``."""
        total: dict[tuple[str, int | None], Sensitivity] = {}
        for part in self.planned:
            for one in part.sensitivities():
                known = total.get((one.name, one.waypoint))
                seconds = one.seconds + (0.0 if known is None else known.seconds)
                total[one.name, one.waypoint] = replace(one, seconds=seconds)
        return tuple(sorted(total.values(), key=lambda one: -1 if one.waypoint is None else one.waypoint))

    @property
    def notes(self) -> tuple[str, ...]:
        """What is far from ordinary, as the report of a plan says it."""
        fixed = fixed_yaw_notes(self.limits, self.trajectory) if self.course.yaw is None else ()
        near = near_notes(self.trajectory, self.gates, self.course.obstacles, self.limits)
        return fixed + self.said + near + plan_notes(self.trajectory, self.limits.given(), widths_of(self.course.tube))

    @property
    def gates(self) -> dict[int, Gate]:
        """The gates, by their numbers among the stops."""
        return {number: stop.gate for number, stop in enumerate(self.course.stops) if stop.gate is not None}

    @property
    def pins(self) -> dict[int, Mapping[str, Any]]:
        """The states at the ends that the course gives, by the waypoints of the trajectory."""
        ends = {0: self.course.start or {}, self.trajectory.legs: self.course.end or {}}
        given = {knot: {name: each for name, each in end.items() if not is_free(each)} for knot, end in ends.items()}
        return {knot: state for knot, state in given.items() if state}

    @property
    def passed_stops(self) -> tuple[PassedStop, ...]:
        """The stops, as the file of a plan has them."""
        width, ends = self.course.tolerance, () if self.course.closed else (0, len(self.course.stops) - 1)
        stops = enumerate(self.course.stops)
        return tuple(PassedStop(stop.center, stop.ball, 0.0 if n in ends else width) for n, stop in stops)

    def in_loop(self, loop: Loop, wind: float) -> VehicleTube:
        """Return the tube of a vehicle in its control loop, which must keep what the course asks for.

        Parameters
        ----------
        loop : Loop
        wind : float
            Largest change of the wind [m/s].
        """
        from minsnap.vehicle_tube import vehicle_tube

        instants = self.trajectory.leg_breaks
        walls = walls_of(self.corridor, self.trajectory(instants))
        gates = {int(np.abs(instants - one.instant).argmin()): self.gates[one.gate] for one in self.gate_passages()}
        return vehicle_tube(loop, wind, self.trajectory, walls, gates, self.course.obstacles, self.limits)

    def gate_passages(self) -> tuple[GatePassage, ...]:
        """Return when, how fast and how far from its edges each gate is passed; by its number among the stops."""
        return gate_passages(self.trajectory, self.gates)


def plan_mission(course: Course, **planning: Any) -> Mission:
    """Plan a course, with take-off, holds, laps and landing.

    A closed course without holds, take-off and landing is one lap at speed, flown ``laps`` times. Everything else is
    flown from rest to rest between holds, all laps in one plan. With ``takeoff`` the vehicle climbs from the ground to
    the altitude of the first waypoint, and has a run-up where that is a gate, or where it takes off elsewhere; ``land``
    is the same at the end.

    Parameters
    ----------
    course : Course
    **planning
        Further arguments of :func:`minsnap.plan` for the course, such as ``pieces``. With ``tracking`` and ``wind`` the
        vehicle in its loop keeps tube, gates, obstacles and limits of the whole flight.

    Returns
    -------
    Mission

    Raises
    ------
    WaypointError
        If a course in the plane has a take-off, take-off or landing goes through an obstacle, or a waypoint is
        malformed.
    InfeasibleError, SolverError
        As :func:`minsnap.plan`.

    Examples
    --------
    >>> import minsnap
    >>> stops = tuple(minsnap.Stop(point) for point in ((0, 0, 1), (4, 0, 1), (2, 3, 1.5)))
    >>> mission = minsnap.plan_mission(minsnap.Course(stops, closed=True, laps=2, takeoff=True, land=True))
    >>> [part.name for part in mission.parts]
    ['take-off', 'lap 1', 'lap 2', 'landing']
    """
    check_kind("the course", course, Course, "a Course")
    own = ("degree", "pieces", "avoid", "tracking", "wind")
    course = course.changed(**{name: planning.pop(name) for name in own if name in planning})

    def planned(course: Course) -> Mission:
        return _above_ground(course, _headed_as_asked)

    def _headed_as_asked(course: Course) -> Mission:
        return _freely_headed(course, planning) if is_free(course.yaw) else _planned(course, planning)

    if course.tracking is None and not course.wind:
        return planned(course)
    return _kept_by_the_vehicle(course, planned)


def _above_ground(course: Course, planned: Callable[[Course], Mission]) -> Mission:
    """Plan a course; with a floor where it would go below the ground without one, if there is such a plan."""
    mission, ground = planned(course), course.ground
    if ground is None or mission.trajectory.extent(np.eye(3)[2])[0] >= ground - EXACT:
        return mission
    try:
        return planned(course.changed(floor=ground))
    except (InfeasibleError, SolverError):
        return mission


def _kept_by_the_vehicle(course: Course, planned: Callable[[Course], Mission]) -> Mission:
    """Plan a course so that the vehicle in its loop keeps it, in a wind that changes by at most the course's."""
    from minsnap.paths.missions.narrower_course import narrower_course, wider_walls
    from minsnap.planning.in_loop import describe_loop, plan_kept_in_loop
    from minsnap.vehicle_tube import check_dimensions, check_tracking

    loop, change = course.tracking, check_tracking(course.tracking, course.wind or 0.0)

    def less(distance: float, limits: Limits | None) -> tuple[Course, float]:
        return narrower_course(course, distance).changed(limits=limits), distance

    def followed(asked: tuple[Course, float]) -> tuple[Mission, VehicleTube]:
        mission = planned(asked[0])
        check_dimensions(mission.trajectory)
        walls = tuple(wider_walls(wall, asked[1]) for wall in mission.corridor)
        said = (*mission.said, describe_loop(change))
        kept = replace(mission, course=course, limits=course.bounds, corridor=walls, said=said)
        return kept, kept.in_loop(loop, change)

    return plan_kept_in_loop(loop, change, course.bounds, less, followed)


def _freely_headed(course: Course, planning: dict[str, Any]) -> Mission:
    """Plan the whole flight at the constant heading that serves best, which its notes say."""
    headed = choose_heading(
        headings_for(course.bounds, course.centers),
        lambda angle: _planned(course.changed(yaw=angle), planning),
        lambda mission: (mission.trajectory.duration, largest_use(mission.limits, mission.trajectory)),
        "flight time",
        lambda mission: mission.interrupted,
    )
    return replace(headed.plan, said=(headed.note,))


def _planned(course: Course, planning: dict[str, Any]) -> Mission:
    flown = _flown(course, planning)
    planned = tuple(PlannedPart(part.curve, part.stops) for part in flown)
    interrupted = any(part.curve.report is not None and part.curve.report.interrupted for part in flown)
    if course.takeoff is not False:
        first = flown[0].curve
        ground = _ground(first, 0.0, course.takeoff)
        flown = [_vertical("take-off", ground, first(0.0), course, course.takeoff_speed or AROUND.climb), *flown]
    if course.land is not False:
        last = flown[-1].curve
        ground, end = _ground(last, last.duration, course.land), last(last.duration)
        flown.append(_vertical("landing", end, ground, course, course.land_speed or AROUND.landing))
    flown, curve = _within_limits(course, flown, _headed(course, flown))
    walls = _corridor(curve, flown)
    _look_at(curve, walls, planning.get("continuity"), len(flown) > 1)
    return Mission(curve, _parts(flown), course, course.bounds, walls, interrupted, planned=planned)


@dataclass(frozen=True, eq=False)
class _Flown:
    """A curve, the names of its parts with the instants at which they begin [s], and its walls on the planned legs."""

    curve: Trajectory
    names: tuple[tuple[str, float], ...]
    walls: Sequence[Walls] = ()
    legs: int = 1
    stops: tuple[int, ...] = ()

    def slower(self, factor: float) -> _Flown:
        """Return the same flown more slowly; a hold is kept as long as it is."""
        if self.names[0][0] == "hold":
            return self
        names = tuple((name, factor * t) for name, t in self.names)
        return replace(self, curve=self.curve.stretched(factor), names=names)

    @property
    def passed(self) -> FloatArray:
        """When the planned legs begin and end [s]; a way around obstacles has several legs for each."""
        return self.curve.leg_breaks[:: self.curve.legs // self.legs]


def _within_limits(course: Course, flown: list[_Flown], curve: Trajectory) -> tuple[list[_Flown], Trajectory]:
    """Return the parts and the whole, slowed down where the whole does not keep what its parts keep alone.

    After a closed lap a body that never spins about its thrust axis has turned, so that other rotors give the most.

    Raises
    ------
    SolverError
        If the whole does not keep the limits so.
    """
    report = flown[0].curve.report
    start = report.limits_from if course.start and report is not None else 0.0
    for _ in range(AROUND.slowings):
        if keeps(course.bounds, curve, start):
            return flown, curve
        if course.start or course.end:
            break
        factor = nearby_factor(course.bounds, curve.stretched) or touching_factor(course.bounds, curve)
        flown = [part.slower(factor) for part in flown]
        curve = _headed(course, flown)
    used = most_used(course.bounds, curve)
    raise SolverError(
        f"the parts together do not keep {used.name}: it reaches {used.value:.6g} at {used.instant:.4g} s where "
        f"{used.limit:.6g} is allowed; lower that limit a little"
    )


def _look_at(curve: Trajectory, corridor: Sequence[HalfSpaces], wanted: int | None, joined_parts: bool) -> None:
    """Raise SolverError where parts that are right by themselves do not join, or leave a wall together.

    Parts begin and end with k - 1 prescribed derivatives: more of them are continuous inside of parts alone.
    """
    default = (curve.degree - 1) // 2
    least = default if wanted is None else min(wanted, default) if joined_parts else wanted
    joined, nearest = continuity(curve), nearest_wall(curve, walls_of(corridor, curve(curve.leg_breaks)))
    if joined < least:
        wrong = f"its parts join with {joined} continuous derivatives, and the plan needs {least}"
    elif nearest is not None and not nearest.value >= 0.0:
        wrong = f"it leaves the walls of leg {nearest.leg} by {-nearest.value:.3g} m at {nearest.instant:.4g} s"
    else:
        return
    raise SolverError(f"the mission is refused at the last look: {wrong}; please report this course")


def _flown(course: Course, planning: dict[str, Any]) -> list[_Flown]:
    """Plan the course itself."""
    on_ground = course.takeoff is not False or course.land is not False
    if course.boxes is not None:
        request = replace(course.request, start=course.start, end=course.end)
        curve, legs = plan(**request.arguments() | planning), len(course.boxes.lower)
        places = curve(curve.leg_breaks[:: curve.legs // legs])
        return [_Flown(curve, (("course", 0.0),), _walls([course.boxes], places), legs)]
    if course.periodic and not on_ground:
        around = [*course.stops, course.stops[0]]
        section = section_of(around, course, closed=True)
        lap, kept = plan(**section.request.arguments() | planning), _walls(section.walls, section.places)
        numbers = _stops_of(section, around, course)
        return [_Flown(lap, ((f"lap {n}", 0.0),), kept, section.legs, numbers) for n in range(1, course.laps + 1)]
    return _sections(course, planning)


def _sections(course: Course, planning: dict[str, Any]) -> list[_Flown]:
    """Plan from hold to hold, each from rest to rest, and the holds between."""
    sections: list[_Flown] = []
    section: list[tuple[str, Stop]] = []
    order = _order(course)
    for index, entry in enumerate(order):
        section.append(entry)
        last = index == len(order) - 1
        if len(section) > 1 and (entry[1].hold or last):
            ends = {"start": course.start if index == len(section) - 1 else None, "end": course.end if last else None}
            sections.append(_section(section, course, ends | planning))
            section = [entry]
        if entry[1].hold:
            still = Trajectory(np.tile(entry[1].center, (1, course.degree + 1, 1)), np.array([entry[1].hold]))
            sections.append(_Flown(still, (("hold", 0.0),)))
    return sections


def _order(course: Course) -> list[tuple[str, Stop]]:
    """Return the stops of the flight in order, each with the name of the part that begins there."""
    stops = course.sequence()
    lap = len(stops) // course.laps if course.closed else max((len(stops) - 1) // course.laps, 1)
    numbers = [min(index // lap, course.laps - 1) + 1 for index in range(len(stops))]
    named = [f"lap {number}" if course.laps > 1 or course.closed else "course" for number in numbers]
    order = list(zip(named, stops, strict=True))
    if course.takeoff is not False:
        order = [*_run(course, stops[0], course.takeoff, -1.0, "run-up"), *order]
    if course.land is not False:
        beyond = _run(course, stops[-1], course.land, 1.0, "run-out")
        order = [*order[:-1], ("run-out" if beyond else order[-1][0], stops[-1]), *beyond]
    return order


def _run(course: Course, stop: Stop, where: Any, side: float, name: str) -> list[tuple[str, Stop]]:
    """Return the stop at which a run-up begins, or a run-out ends: elsewhere than at the waypoint itself, or none."""
    place = stop.center.copy()
    if where is not True:
        place[: len(place) - 1] = where[: len(place) - 1]
    elif stop.gate is not None:
        most = course.bounds.speed or ORDINARY["speed"]
        braking = course.bounds.acceleration or ORDINARY["acceleration"]
        length = min(max(AROUND.shortest_run, most**2 / (2.0 * braking)), AROUND.longest_run)
        place = place + side * (stop.gate.crossing or 1) * length * stop.gate.normal
    return [] if np.array_equal(place, stop.center) else [(name, Stop(place))]


def _section(section: list[tuple[str, Stop]], course: Course, planning: dict[str, Any]) -> _Flown:
    """Plan a section, and name its parts."""
    stops = [stop for _, stop in section]
    part = section_of(stops, course, closed=False)
    curve = plan(**part.request.arguments() | planning)
    flown = _Flown(curve, (), _walls(part.walls, part.places), part.legs, _stops_of(part, stops, course))
    names = [(name, float(t)) for (name, _), t in zip(section[:-1], flown.passed[part.knots], strict=False)]
    kept = [entry for i, entry in enumerate(names) if i == 0 or entry[0] != names[i - 1][0]]
    return replace(flown, names=tuple(kept))


def _stops_of(section: Section, stops: Sequence[Stop], course: Course) -> tuple[int, ...]:
    """Return the numbers of the stops to which waypoints belong, those beside a straight gate too; -1 for none."""
    numbers = {id(stop): number for number, stop in enumerate(course.stops)}
    found = dict(zip(section.knots, (numbers.get(id(stop), -1) for stop in stops), strict=True))
    beside = ((knot, knot - 1, knot + 1) for knot in range(section.legs + 1))
    return tuple(next((found[near] for near in around if near in found), -1) for around in beside)


def _walls(corridor: Sequence[Constraint], places: Any) -> list[Walls]:
    """Return the walls that positions stay inside, for waypoints and gates."""
    points = np.array(list(map(center_of, places)))
    return [wall for wall in walls_of(corridor, points) if wall.order == 0]


def _corridor(joined: Trajectory, flown: Sequence[_Flown]) -> tuple[HalfSpaces, ...]:
    """Return the walls of all parts, which are planes, on the legs of the whole."""
    walls, start = [], 0.0
    middles = (joined.leg_breaks[:-1] + joined.leg_breaks[1:]) / 2.0
    for part in flown:
        own = np.searchsorted(start + part.passed, middles, side="right") - 1
        for wall in part.walls:
            normal, offset = wall.half_spaces
            for leg in np.unique(wall.leg):
                rows, legs = wall.leg == leg, np.flatnonzero(own == leg).tolist()
                walls.append(HalfSpaces(normal[rows], offset[rows], tuple(legs)))
        start += part.curve.duration
    return tuple(walls)


def _ground(curve: Trajectory, t: float, where: Any) -> FloatArray:
    """Return the point on the ground below an end of the course."""
    if curve.dim != 3:
        raise WaypointError("take-off and landing need waypoints of three coordinates, and these have two")
    above = curve(t)
    ground = np.array([above[0], above[1], 0.0 if where is True else where[2]])
    if not above[2] > ground[2]:
        raise WaypointError(f"the ground at {ground[2]:g} m is not below the course at {above[2]:g} m: say where it is")
    return ground


def _vertical(name: str, start: FloatArray, goal: FloatArray, course: Course, speed: float) -> _Flown:
    """Plan a climb or a descent from rest to rest, slower than the limits and than a speed."""
    limits = course.bounds
    slow = min(speed, limits.speed or speed)
    gentle = min(AROUND.gentle, limits.acceleration or AROUND.gentle)
    jerk = min(gentle / BUILT_UP, limits.jerk or inf)
    slower = replace(limits, speed=slow, acceleration=gentle, jerk=jerk)
    pieces = course.pieces if isinstance(course.pieces, int) else AROUND.pieces
    curve = plan([start, goal], limits=slower, degree=course.degree, pieces=pieces)
    near = nearest_obstacle(curve, course.obstacles) if course.obstacles else None
    if near is not None and near.value < -EXACT:
        raise WaypointError(
            f"the {name} is straight, and it is {near.beyond} at "
            f"{point_text(curve(near.instant))} m: begin or end the course beside it, or say where the ground is"
        )
    return _Flown(curve, ((name, 0.0),))


def _headed(course: Course, flown: Sequence[_Flown]) -> Trajectory:
    """Join the parts, and give the whole its heading."""
    most = max(part.curve.pieces for part in flown)
    joined = concatenate([grouped(part.curve, most) for part in flown])
    if isinstance(course.yaw, tuple) and len(course.yaw) != joined.legs + 1:
        raise YawError(
            f"yaw has {len(course.yaw)} angles: give one, or {joined.legs + 1}, one for each waypoint of the whole "
            "flight with its take-off, its landing, all laps and the points beside straight gates"
        )
    heading = chosen_heading(course.yaw, joined.legs, False, course.bounds)
    return joined.with_yaw(heading(joined))


def _parts(flown: Sequence[_Flown]) -> tuple[MissionPart, ...]:
    starts = np.concatenate(([0.0], np.cumsum([part.curve.duration for part in flown])))
    begins = [(name, float(start + t)) for part, start in zip(flown, starts, strict=False) for name, t in part.names]
    ends = [t for _, t in begins[1:]] + [float(starts[-1])]
    return tuple(MissionPart(name, t, end - t) for (name, t), end in zip(begins, ends, strict=True))
