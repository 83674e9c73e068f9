"""Plans among obstacles that move: a way in space and time, polytopes along it, and curves in ever shorter times.

Each part of the way has its own seconds, and its polytope keeps away from what an obstacle passes in these. A curve for
fixed durations is then an ordinary plan within walls. Where the time is free, all durations are lowered by one factor,
and the polytopes laid anew around the last curve, as long as that succeeds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.keep_out import standing_at
from minsnap.corridors.moving import Moving, nearest_moving
from minsnap.corridors.tangent_polytopes import polytopes_along
from minsnap.corridors.way_around import Inside, Kept
from minsnap.corridors.way_in_time import WayInTime, way_in_time
from minsnap.durations.timing import Timed
from minsnap.errors import CorridorError, InfeasibleError, SolverError
from minsnap.native.half_space_sets import HalfSpaceRows
from minsnap.native.map_ways import tangent_planes
from minsnap.trajectory.trajectory import Trajectory

Place = Callable[[FloatArray], FloatArray]
"""Where something is at instants (m,), (m, dim) [m]."""

Planned = Callable[[list[WayInTime], list[HalfSpaceRows]], Timed]
"""Plans along ways, one a leg, each of as many parts, within a polytope for each part."""


@dataclass(frozen=True)
class AmongSettings:
    """How ways among moving obstacles become plans.

    Parameters
    ----------
    speed_shares : tuple of float
        Shares of the speed of the plan without them with which a way is looked for, one after the other.
    distance_share : float
        Share of the distance at each instant that a part keeps from all that an obstacle passes in its seconds, else it
        is halved.
    beside_radii : float
        How far beside an obstacle the last curve is taken to pass where it would be nearer in a shorter time, in radii.
    halvings : int
        Of a part, at most.
    instants : int
        Instants of a part at which an obstacle is kept away from, larger by half of what it moves between them.
    first_share, share_growth, last_share : float
        Share by which the time is lowered first, the factor after a success, and below which it is not tried.
    """

    speed_shares: tuple[float, ...] = (1.0, 0.75, 0.5, 0.3)
    distance_share: float = 0.5
    beside_radii: float = 0.05
    halvings: int = 5
    instants: int = 9
    first_share: float = 0.08
    share_growth: float = 1.4
    last_share: float = 0.004


AMONG = AmongSettings()


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What a plan keeps away from, and where it may be."""

    kept: Kept
    moving: tuple[Moving, ...]
    inside: tuple[Inside | None, ...]
    reach: float


def least_margin(curve: Trajectory, moving: Sequence[Moving]) -> float:
    """Return the proved least distance to moving obstacles [m]."""
    return min(nearest_moving(curve, each).value for each in moving)


def among_moving(
    around: Surroundings, first: Trajectory, passed: FloatArray, fixed: bool, plan: Planned, late: Callable[[], bool]
) -> Timed | None:
    """Return a plan among moving obstacles, or None where none was found.

    Parameters
    ----------
    around : Surroundings
    first : Trajectory
        The plan without them.
    passed : ndarray, shape (legs + 1, dim)
        Where it passes its waypoints [m].
    fixed : bool
        Whether its times stay.
    plan : callable
        See ``Planned``.
    late : callable
        Whether the time is over for better plans.
    """
    for share in AMONG.speed_shares:
        ways = _ways(around, first, passed, fixed, share)
        best = None if ways is None else _try_ways(around, ways, plan)
        if ways is not None and best is not None:
            return best if fixed else _shorten(around, ways, best, first.duration, plan, late)
    return None


def _ways(
    around: Surroundings, first: Trajectory, passed: FloatArray, fixed: bool, share: float
) -> list[WayInTime] | None:
    """Return a way in time for each leg, all of as many parts; None where one has none."""
    breaks, begin, ways = first.leg_breaks, 0.0, []
    for leg, inside in enumerate(around.inside):
        ends = passed[leg : leg + 2]
        line = first(np.linspace(breaks[leg], breaks[leg + 1], 65))
        mean = np.linalg.norm(np.diff(line, axis=0), axis=1).sum() / (breaks[leg + 1] - breaks[leg])
        speed = float(mean) * share if mean > 0.0 else max(each.radius for each in around.moving)
        arrive = float(breaks[leg + 1]) if fixed else None
        way = way_in_time(around.kept, around.moving, ends, speed / (share**2 if fixed else 1.0), begin, arrive, inside)
        if way is None:
            return None
        ways.append(way)
        begin = float(way.times[-1])
    return _alike(around, [_along(way) for way in ways], [way.times for way in ways])


def _divide(around: Surroundings, place: Place, times: FloatArray) -> WayInTime:
    """Halve parts of a way, until each keeps away from all that obstacles pass in its seconds."""
    parts = [(float(begin), float(end), AMONG.halvings) for begin, end in pairwise(times)][::-1]
    knots = [float(times[0])]
    while parts:
        begin, end, halvings = parts.pop()
        if halvings and _is_near(around, place, begin, end):
            middle = 0.5 * (begin + end)
            parts += [(middle, end, halvings - 1), (begin, middle, halvings - 1)]
        else:
            knots.append(end)
    instants = np.array(knots)
    return WayInTime(place(instants), instants)


def _is_near(around: Surroundings, place: Place, begin: float, end: float) -> bool:
    """Whether the line of a part is much nearer to what obstacles pass in its seconds than it is at each instant."""
    instants = np.linspace(begin, end, AMONG.instants)
    along, line = place(instants), place(np.array([begin, end]))
    for each in around.moving:
        gap = float(each.clearances(along, instants).min())
        if gap >= around.reach:
            continue
        nowhere = np.zeros((0, along.shape[1]))
        between = tangent_planes(line, _sweep(each, begin, end), nowhere, 0.0, around.reach).distance[0]
        if between < AMONG.distance_share * gap:
            return True
    return False


def _in_so_many(way: WayInTime, place: Place, parts: int) -> WayInTime:
    """Return a way with so many parts: the longest in time are halved."""
    times = way.times
    while len(times) - 1 < parts:
        longest = int(np.argmax(np.diff(times)))
        times = np.insert(times, longest + 1, 0.5 * (times[longest] + times[longest + 1]))
    return WayInTime(place(times), times)


def _alike(around: Surroundings, places: list[Place], times: list[FloatArray]) -> list[WayInTime]:
    """Return ways through places, with as many parts each."""
    ways = [_divide(around, *each) for each in zip(places, times, strict=True)]
    parts = max(len(way.times) - 1 for way in ways)
    return [_in_so_many(way, place, parts) for way, place in zip(ways, places, strict=True)]


def _along(way: WayInTime) -> Place:
    """Return where a way is at instants."""
    return lambda times: np.stack([np.interp(times, way.times, axis) for axis in way.points.T], axis=1)


def _on_curve(curve: Trajectory, factor: float, way: WayInTime, moving: Sequence[Moving]) -> Place:
    """Return where a curve is at instants in units of a factor, beside obstacles; at both ends of a way as this is."""

    def place(times: FloatArray) -> FloatArray:
        points = np.array(curve(np.clip(times / factor, 0.0, curve.duration)))
        for each in moving:
            shared = points[:, : each.dim]
            apart = shared - each.center(times)[:, : shared.shape[1]]
            far = np.linalg.norm(apart, axis=1)
            short = (1.0 + AMONG.beside_radii) * each.radius_at(times) - far
            shared += (np.maximum(short, 0.0) / np.maximum(far, 1e-9))[:, None] * apart
        points[times == factor * way.times[0]] = way.points[0]
        points[times == factor * way.times[-1]] = way.points[-1]
        return points

    return place


def _try_ways(around: Surroundings, ways: list[WayInTime], plan: Planned) -> Timed | None:
    """Return the plan along ways, if it has one that is proved among all moving obstacles."""
    try:
        sets = [each for way in ways for each in _sets(around, way)]
        timed = plan(ways, sets)
    except (CorridorError, InfeasibleError, SolverError):  # LateError too: each plan has its own work
        return None
    return timed if least_margin(timed.trajectory, around.moving) >= 0.0 else None


def _sets(around: Surroundings, way: WayInTime) -> list[HalfSpaceRows]:
    """Return a polytope around each part of a way, away from what obstacles pass in its seconds."""
    sets, still = [], around.kept
    for part in range(len(way.times) - 1):
        swept = [_sweep(each, way.times[part], way.times[part + 1]) for each in around.moving]
        numbers = np.concatenate((still.obstacles, *swept))
        line = way.points[part : part + 2]
        sets += polytopes_along(line, numbers, still.points, still.clearance, around.reach, prisms=still.prisms)
    return sets


def _sweep(obstacle: Moving, begin: float, end: float) -> FloatArray:
    """Return what holds an obstacle from one instant to another, (looked, 13)."""
    instants = np.linspace(begin, end, AMONG.instants)
    half = 0.5 * (obstacle.speed + obstacle.growth) * (end - begin) / (AMONG.instants - 1)
    numbers = np.stack([each.numbers() for each in standing_at(obstacle, instants)])
    return _larger(numbers, half)


def _larger(numbers: FloatArray, more: float) -> FloatArray:
    """Return balls or upright cylinders of a larger radius."""
    numbers[:, 6] += more
    return numbers


def _shorten(
    around: Surroundings,
    ways: list[WayInTime],
    best: Timed,
    least: float,
    plan: Planned,
    late: Callable[[], bool],
) -> Timed:
    """Lower the time as far as it goes."""
    share, corners = AMONG.first_share, [way.times for way in ways]
    while share > AMONG.last_share and not late():
        factor = max(1.0 - share, least / best.trajectory.duration)
        if factor > 1.0 - AMONG.last_share:
            break
        places = [_on_curve(best.trajectory, factor, way, around.moving) for way in ways]
        quicker = _alike(around, places, [factor * times for times in corners])
        found = _try_ways(around, quicker, plan)
        if found is None:
            share *= 0.5
        else:
            corners = [factor * times for times in corners]
            ways, best, share = quicker, found, min(AMONG.first_share, AMONG.share_growth * share)
    return best
