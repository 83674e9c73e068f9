"""Any planner's flight against a course: where it passes the stops, which limits it keeps, how near the best it is.

The instants at which the stops are passed in their order are those with the least sum of squared distances outside of
where each may be passed, by dynamic programming over many instants; each is then refined on the curve.  What a flight
misses by is given to the bound as room, so that it holds for all flights that pass as near.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import ceil
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.bounds.least_time import TimeBound, TimeQuestion, names_of
from minsnap.corridors.constraint import walls_of
from minsnap.corridors.gates import Gate
from minsnap.corridors.given_waypoints import as_knots
from minsnap.corridors.knot_regions import KnotRegion, Placement, ball_region, place
from minsnap.corridors.obstacle_margins import nearest_obstacle
from minsnap.corridors.passages import clearances
from minsnap.errors import InputError, WaypointError
from minsnap.files.consistency import check_membership
from minsnap.files.formats.pieces import through
from minsnap.limits.compliance import KEPT
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.limits.uses_over_time import utilisation_curves
from minsnap.limits.utilisation import used_at
from minsnap.paths.missions.course import Course, Stop, section_of
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.samples import Samples
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class CourseCheckSettings:
    """How passages are looked for, and what counts as kept.

    Parameters
    ----------
    fewest, per_piece : int
        Instants of a curve, at least, and of each of its polynomials.
    refined : int
        Steps of a golden section search beside each instant.
    sampled : float
        Share by which a limit may be exceeded at the samples of a file of setpoints, for their rounding.
    """

    fewest: int = 4000
    per_piece: int = 16
    refined: int = 60
    sampled: float = 1e-3


SETTINGS = CourseCheckSettings()


@dataclass(frozen=True)
class StopPassage:
    """One passage of a stop.

    Parameters
    ----------
    stop : int
        Which of the course, counted from 0.
    instant : float
        [s].
    speed : float
        [m/s].
    outside : float
        How far outside of where it may be passed [m]; 0 inside.
    clearance : float or None
        Of a gate: distance to the nearest edge of its opening, negative outside of it [m].
    """

    stop: int
    instant: float
    speed: float
    outside: float
    clearance: float | None = None


@dataclass(frozen=True, eq=False)
class CourseCheck:
    """A flight against a course.

    Parameters
    ----------
    passages : tuple of StopPassage
        In the order of the flight.
    utilisation : tuple of Utilisation
        Of the limits of the course, over all of the flight.
    unknown : tuple of str
        Limits that the file says too little to measure.
    seconds : float
        From the first stop to the last [s].
    bound : TimeBound
        Of the time of all flights that pass as near, with the same velocities at both ends.
    problems : tuple of str
        What is not as the course asks for.
    """

    passages: tuple[StopPassage, ...]
    utilisation: tuple[Utilisation, ...]
    unknown: tuple[str, ...]
    seconds: float
    bound: TimeBound
    problems: tuple[str, ...] = field(default=())

    @property
    def gap(self) -> float | None:
        """How much longer it is at most than any flight within the limits; negative where it exceeds them."""
        return None if self.bound.seconds is None else self.seconds / self.bound.seconds - 1.0

    @property
    def sentence(self) -> str:
        """What the bound says of the flight."""
        gap, left = self.gap, ", ".join(self.bound.left_out)
        if gap is None:
            return f"no bound: {self.bound.reason}"
        least = f"every flight within these limits takes {self.bound.seconds:.6g} s at least"
        without = f" ({left} left out)" if left else ""
        return f"{least}{without}: {100.0 * abs(gap):.2f} % {'longer at most' if gap >= 0.0 else 'shorter'}"


def check_course(content: Trajectory | Samples, course: Course, resolution: float = 1e-6) -> CourseCheck:
    """Return how a flight keeps a course, and how much longer it is than the least time of the course.

    Parameters
    ----------
    content : Trajectory or Samples
        Samples count as the curve through them; limits are measured at them.
    course : Course
        With stops.
    resolution : float
        Rounding of its positions: a stop that is missed by less counts as passed [m].

    Raises
    ------
    InputError
        If the course has boxes in the place of stops, holds, or other coordinates than the flight.
    """
    if course.boxes is not None:
        raise InputError("the course has boxes and no stops: a flight is checked against waypoints and gates")
    if any(stop.hold for stop in course.stops):
        raise InputError("the course has holds, which are no part of this check: leave them out")
    curve = content if isinstance(content, Trajectory) else through(content)
    stops = course.sequence()
    if curve.dim != len(stops[0].center):
        raise InputError(f"the flight has {curve.dim} coordinates, and the course {len(stops[0].center)}")
    section = section_of(stops, course, closed=course.periodic)
    placement = place(as_knots(section.places, section.request.waypoint_tolerance), [])
    instants = _passed_in_order(curve, placement)
    for knot, whole in ((0, 0.0), (-1, curve.duration)) if course.periodic else ():
        if _outside(placement, knot % len(instants), curve(whole)) <= placement.rounding:
            instants[knot] = whole  # a lap is all of it
    gates = {knot: each for knot, each in enumerate(section.places) if isinstance(each, Gate)}
    outside = np.array([_outside(placement, knot, curve(t)) for knot, t in enumerate(instants)])
    outside[outside <= placement.rounding] = 0.0
    passages = tuple(_passages(curve, course, stops, instants, outside, section.knots, gates))
    used, unknown = _used(content, curve, course.bounds)
    problems = [*_missed(passages, resolution), *_exceeded(used, isinstance(content, Trajectory))]
    problems += [*_wrong_way(curve, placement, instants), *_beside(content, curve, course, stops)]
    bound = _bound(curve, course, placement, gates, instants, outside, section.walls or None)
    seconds = float(instants[-1] - instants[0])
    return CourseCheck(passages, used, unknown, seconds, bound, tuple(problems))


def _outside(placement: Placement, knot: int, position: FloatArray) -> float:
    """Return how far a place is outside of where a waypoint may be passed [m]; 0 inside."""
    return float(_distances(placement, knot, position[None])[0])


def _distances(placement: Placement, knot: int, places: FloatArray) -> FloatArray:
    """Return the same of places (m, dim): (m,)."""
    offset = places - placement.points[knot]
    region = placement.regions.get(knot)
    beyond = np.maximum(np.maximum(offset - placement.upper[knot], placement.lower[knot] - offset), 0.0)
    parts = [np.sqrt((beyond**2).sum(axis=1))]
    if region is not None:
        parts.append(np.sqrt((offset**2).sum(axis=1)) - region.radius)
        parts += list((offset @ region.normals.T - region.bounds).T)
        parts += [] if region.plane is None else [np.abs(offset @ region.plane)]
    return np.asarray(np.maximum(np.max(parts, axis=0), 0.0))


def _passed_in_order(curve: Trajectory, placement: Placement) -> FloatArray:
    """Return when the waypoints are passed, one after the other, (n,) [s]."""
    per = max(SETTINGS.per_piece, ceil(SETTINGS.fewest / len(curve.durations)))
    inner = np.arange(per) / per
    t = np.append((curve.breaks[:-1, None] + curve.durations[:, None] * inner).reshape(-1), curve.duration)
    places = curve(t)
    count = len(placement.points)
    costs, came = np.zeros(len(t)), np.zeros((count, len(t)), dtype=np.intp)
    for knot in range(count):
        least = np.minimum.accumulate(costs)
        came[knot] = np.maximum.accumulate(np.where(costs <= least, np.arange(len(t)), 0))
        costs = least + _distances(placement, knot, places) ** 2
    chosen = [int(costs.argmin())]
    for knot in range(count - 1, 0, -1):
        chosen.append(int(came[knot][chosen[-1]]))
    first, last, instants = 0.0, curve.duration, []
    for knot, at in enumerate(reversed(chosen)):
        first = max(first, float(t[max(at - 1, 0)]))
        found = _nearest(curve, placement, knot, first, max(float(t[min(at + 1, len(t) - 1)]), first), float(t[at]))
        first = min(max(found, first), last)
        instants.append(first)
    return np.array(instants)


def _nearest(curve: Trajectory, placement: Placement, knot: int, low: float, high: float, middle: float) -> float:
    """Return where on an interval a waypoint is least missed, by golden section; the middle where that is no worse."""
    share = 0.5 * (5.0**0.5 - 1.0)
    best, start, end = max(middle, low), low, high

    def missed(t: float) -> float:
        return _outside(placement, knot, curve(t))

    for _ in range(SETTINGS.refined if missed(best) > 0.0 else 0):
        one, other = end - share * (end - start), start + share * (end - start)
        start, end = (start, other) if missed(one) <= missed(other) else (one, end)
    tried = [best, 0.5 * (start + end), low, high]
    return min(tried, key=missed)


def _passages(
    curve: Trajectory,
    course: Course,
    stops: Sequence[Stop],
    instants: FloatArray,
    outside: FloatArray,
    knots: Sequence[int],
    gates: dict[int, Gate],
) -> Iterator[StopPassage]:
    """Yield the passages of the stops, of which a straight gate is missed by the most of its three places."""
    numbers = {id(stop): number for number, stop in enumerate(course.stops)}
    for stop, knot in zip(stops, knots, strict=True):
        at, gate = float(instants[knot]), gates.get(knot)
        beside = outside[knot - 1 : knot + 2] if stop.straight and knot - 1 in gates and knot + 1 in gates else ()
        clear = None if gate is None else float(clearances(gate, curve(at)[None], np.inf)[0])
        speed = float(np.sqrt((curve(at, 1) ** 2).sum()))
        yield StopPassage(numbers[id(stop)], at, speed, max(float(outside[knot]), *map(float, beside), 0.0), clear)


def _used(
    content: Trajectory | Samples, curve: Trajectory, limits: Limits
) -> tuple[tuple[Utilisation, ...], tuple[str, ...]]:
    """Return the use of limits: exact of polynomials, at the samples of setpoints; and what is not known of these."""
    if isinstance(content, Trajectory):
        return limits.utilisation(content), ()
    used, unknown = [], ["rotor_thrust"] if isinstance(limits, VehicleLimits) else []
    for name, limit in limits.given().items():
        alone: dict[str, Any] = {name: limit}
        try:
            (share,) = utilisation_curves(content, Limits(**alone, norm=limits.norm, gravity=limits.gravity)).values()
        except InputError:
            unknown.append(name)
            continue
        at = int(share.argmax())
        instant = float(content.t[at] - content.t[0])
        value = limit * float(share[at]) if name != "min_thrust" else limit / float(share[at])
        used.append(used_at(curve, name, limit, value, instant, "sampled"))
    return tuple(replace(one, leg=None) for one in used), tuple(unknown)


def _missed(passages: Sequence[StopPassage], resolution: float) -> Iterator[str]:
    for passed in passages:
        if passed.outside > resolution:
            yield f"stop {passed.stop} is missed by {passed.outside:.3g} m, at {passed.instant:.6g} s"


def _exceeded(used: Sequence[Utilisation], exact: bool) -> Iterator[str]:
    for one in used:
        if one.fraction > 1.0 + (KEPT if exact else SETTINGS.sampled):
            yield f"the flight exceeds the course's {one.name}: {one.fact[1]}"


def _wrong_way(curve: Trajectory, placement: Placement, instants: FloatArray) -> Iterator[str]:
    for knot, region in placement.regions.items():
        t = float(instants[knot])
        if region.crossing is not None and float(curve(t, 1) @ region.crossing) < 0.0:
            yield f"the gate at {placement.points[knot].tolist()} is passed the wrong way, at {t:.6g} s"


def _beside(content: Trajectory | Samples, curve: Trajectory, course: Course, stops: Sequence[Stop]) -> Iterator[str]:
    """Yield where the flight meets an obstacle, or leaves the tube at its samples."""
    if course.obstacles:
        near = nearest_obstacle(curve, course.obstacles)
        if near.value < 0.0:
            yield f"the flight is {near.beyond}, at {near.instant:.6g} s"
    if course.tube is not None:
        samples = content.sample(100.0) if isinstance(content, Trajectory) else content
        try:
            inside = check_membership(samples, np.array([stop.center for stop in stops]), course.tube)
        except WaypointError:
            return
        if not inside.ok:
            yield f"the flight leaves the tube of leg {inside.leg} by {-inside.margin:.3g} m, at {inside.instant:.6g} s"


def _bound(
    curve: Trajectory,
    course: Course,
    placement: Placement,
    gates: dict[int, Gate],
    instants: FloatArray,
    outside: FloatArray,
    corridor: Any,
) -> TimeBound:
    """Return the bound of all flights that pass the stops as near, with the same velocities at both ends."""
    lower, upper, regions = placement.lower.copy(), placement.upper.copy(), dict(placement.regions)
    kept = dict(gates)
    for knot in np.flatnonzero(outside > 0.0).tolist():
        wider = _wider(regions.pop(knot, None), float(outside[knot]), lower[knot], upper[knot])
        kept.pop(knot, None)  # its opening is that of the box around it
        lower[knot], upper[knot] = wider.lower, wider.upper
        regions[knot] = wider
    (start, end), points = (curve.states(t, 2) for t in (instants[0], instants[-1])), placement.points
    named = names_of(walls_of(corridor or (), points)) + (("the obstacles",) if course.obstacles else ())
    widened = Placement(points, lower, upper, regions=regions)
    bound = TimeQuestion(widened, kept, np.stack((start[1], end[1])), course.bounds, named).bound
    if not (course.periodic and np.allclose(start, end, rtol=EXACT, atol=EXACT)):
        return bound
    lap = TimeQuestion(widened, kept, None, course.bounds, named).bound  # which ends in the very place of its start
    return max(bound, lap, key=lambda one: one.seconds or 0.0)


def _wider(region: KnotRegion | None, miss: float, lower: FloatArray, upper: FloatArray) -> KnotRegion:
    """Return a ball of the room that a point was passed in, or the box around a gate or a box with that room."""
    radius = 0.0 if region is None else region.radius
    exact = bool((lower == upper).all())
    if exact or (region is not None and region.radius < np.inf):
        return ball_region(radius + miss, len(lower))
    none = np.zeros((0, len(lower)))
    return KnotRegion(lower - miss, upper + miss, np.inf, none, np.zeros(0), what="box")
