"""certify_fleet: what holds of several vehicles at every instant, whoever planned them; and the last look at a plan.

Pieces of all vehicles of one degree and one set of limits are measured as if they were one curve: limits are asked of
each piece alone.

Distances are proved from the control points with running error bounds in the native core: one that is returned is never
more than the exact one of the stored numbers, and less by rounding alone.

It judges the trajectories that are returned, with their headings, by their control points alone. Of the knots and the
times that the search had in mind it takes nothing over.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, IntArray, numbers
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import check_threads
from minsnap.basics.messages import explains_names, shown
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.boxes import Boxes, Room, as_room
from minsnap.corridors.keep_out import Obstacle, as_simple
from minsnap.errors import FleetError
from minsnap.fleet.common_clock import Fleet, Separation, arrays_in_flight, as_separation
from minsnap.fleet.fleet_task import FleetTask, limits_of
from minsnap.last_look import fault_as_one_leg
from minsnap.limits.limits import Limits
from minsnap.native import proved_extrema as native
from minsnap.native.fleet_border import FleetArrays, NearPairs, clearances, near_pairs
from minsnap.trajectory.path import Path
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.trajectory import Trajectory, widest_step

if TYPE_CHECKING:
    from minsnap.fleet.fleet_tube import FleetTube
    from minsnap.vehicle.loop import Loop


@dataclass(frozen=True)
class FleetUse:
    """Largest use of a limit by a vehicle of a fleet.

    Parameters
    ----------
    vehicle : int
    use : Utilisation
        Its leg and its instant are those of the vehicle.
    """

    vehicle: int
    use: Utilisation

    @property
    def kept(self) -> bool:
        """Whether the limit is kept."""
        return self.use.kept


def fleet_use(fleet: Fleet, limits: Limits | Sequence[Limits]) -> tuple[FleetUse, ...]:
    """Return how far each limit is used, by the vehicle that uses it most."""
    groups: dict[tuple[int, int], tuple[Limits, list[int]]] = {}
    for vehicle, own in enumerate(limits_of(limits, len(fleet))):
        alone = vehicle if own.yaw_rate is not None else -fleet[vehicle].degree - 1
        groups.setdefault((id(own), alone), (own, []))[1].append(vehicle)
    most: dict[str, FleetUse] = {}
    for own, vehicles in groups.values():
        for used in _group_use(fleet, own, vehicles):
            if used.use.name not in most or used.use.fraction > most[used.use.name].use.fraction:
                most[used.use.name] = used
    return tuple(most.values())


def _group_use(fleet: Fleet, limits: Limits, vehicles: list[int]) -> list[FleetUse]:
    curves = [fleet[vehicle] for vehicle in vehicles]
    if len(curves) == 1:
        return [FleetUse(vehicles[0], used) for used in limits.utilisation(curves[0])]
    points, durations = zip(*((curve.control_points, curve.durations) for curve in curves), strict=True)
    joined, first = Trajectory(np.concatenate(points), np.concatenate(durations)), np.cumsum([0, *map(len, durations)])
    uses = []
    for used in limits.utilisation(joined):
        assert used.leg is not None  # of a trajectory
        which = int(np.searchsorted(first, used.leg, side="right")) - 1  # whose piece it is
        instant = min(max(0.0, used.instant - float(joined.breaks[first[which]])), curves[which].duration)
        leg = (used.leg - int(first[which])) // curves[which].pieces
        uses.append(FleetUse(vehicles[which], replace(used, leg=leg, instant=instant)))
    return uses


def room_margins(fleet: Fleet, room: Any) -> FloatArray:
    """Return the proved least distance of each vehicle to the walls of a room, shape (vehicles,) [m]."""
    if not isinstance(room, Room) or len(room.lower) != fleet.dim:
        raise FleetError(f"a fleet with {fleet.dim} coordinates needs a Room with as many, or two corners")
    low, high = (np.stack(ends) for ends in zip(*(extent_of(curve.control_points) for curve in fleet), strict=True))
    return np.asarray(np.minimum(low - room.lower, room.upper - high).min(axis=1))


def extent_of(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the proved least and greatest value of each coordinate over pieces (k, degree + 1, dim), shape (dim,).

    Raises
    ------
    FleetError
        If the control points are malformed.
    """
    held = numbers(points, copy=False)
    if held is None or held.ndim != 3:
        raise FleetError(f"the control points are {shown(points)}: give an array (k, degree + 1, dim) [m]")
    points = held
    return _least(points), -_least(-points)


def _least(points: FloatArray) -> FloatArray:
    """Return the proved least value of each coordinate over all pieces, shape (dim,)."""
    rows = -np.moveaxis(points, 2, 0)
    largest = native.maxima(rows.reshape(-1, points.shape[1]), None, points.shape[2])
    return np.array([-native.maximum(each)[0] for each in rows]) if largest is None else -largest[1]


REACH = 1.5
"""Pairs nearer than this many times their separation are listed, unless the caller says otherwise."""

FINEST = 1e-10
"""Greatest difference between a proved clearance and the true one [m]."""


@dataclass(frozen=True)
class NearPair:
    """Two vehicles that come near each other.

    Parameters
    ----------
    pair : tuple of int
        Ascending.
    distance : float
        Least distance over all time, heights divided by the downwash [m]; the exact one is not less.
    required : float
        What it is to be [m].
    instant : float
        When [s].
    """

    pair: tuple[int, int]
    distance: float
    required: float
    instant: float

    @property
    def share(self) -> float:
        """Distance in units of what it is to be."""
        return self.distance / self.required


@dataclass(frozen=True, eq=False)
class FleetCertificate:
    """Bounds of a fleet over all time, proved, and exact to rounding.

    Parameters
    ----------
    closest : NearPair or None
        The pair that comes nearest to its separation; None for one vehicle.
    nearest : tuple of NearPair
        All pairs that come nearer than ``reach`` times their separation, those nearest to it first.
    utilisation : tuple of FleetUse
        How far each limit is used by the vehicle that uses it most; empty without limits.
    room_margins : ndarray, shape (vehicles,), or None
        Least distance of each vehicle to the walls of the room [m], negative outside.
    clearances : ndarray, shape (vehicles,), or None
        Least distance of each vehicle to an obstacle [m], negative inside; near ellipsoids and corners a lower bound.
    nearest_obstacles : ndarray of int, shape (vehicles,), or None
        Which obstacle that is.
    fleet : Fleet
        What it is about.
    separation : Separation or None
    vehicles : FleetTube or None
        Where the vehicles can be in their control loops; None without ``tracking``.
    """

    closest: NearPair | None
    nearest: tuple[NearPair, ...] = field(repr=False)
    utilisation: tuple[FleetUse, ...]
    room_margins: FloatArray | None = field(repr=False)
    clearances: FloatArray | None = field(repr=False)
    nearest_obstacles: IntArray | None = field(repr=False)
    fleet: Fleet = field(repr=False)
    separation: Separation | None = field(repr=False)
    vehicles: FleetTube | None = field(default=None, repr=False)

    @property
    def tube(self) -> float | None:
        """Largest tracking error that a vehicle's loop can have [m]; None without ``tracking``."""
        return None if self.vehicles is None else self.vehicles.error

    @property
    def wind(self) -> float | None:
        """Largest change of the wind at which all vehicles keep all that is asked [m/s]; None without ``tracking``."""
        return None if self.vehicles is None else self.vehicles.strongest

    @property
    def ok(self) -> bool:
        """Whether all conditions hold, separations and limits to ``EXACT`` of themselves, others to ``EXACT`` [m]."""
        return self.fault is None

    @cached_property
    def fault(self) -> str | None:
        """The first condition that does not hold, in words; None where all do."""
        for used in self.utilisation:
            if not used.kept:
                reached = f"{used.use.name} reaches {used.use.value:.9g} at {used.use.instant:.4g} s"
                return f"vehicle {used.vehicle}: {reached} where {used.use.limit:.9g} is allowed"
        if self.room_margins is not None and not self.room_margins.min() >= -EXACT:
            return f"vehicle {self.room_margins.argmin()} leaves the room by {-self.room_margins.min():.3g} m"
        if self.clearances is not None and not self.clearances.min() >= -EXACT:
            return f"vehicle {self.clearances.argmin()} is {-self.clearances.min():.3g} m inside an obstacle"
        if self.jump is not None:
            return f"vehicle {self.jump[0]} jumps by {self.jump[2]:.3g} m at {self.jump[1]:.4g} s"
        if self.closest is not None and not self.closest.share >= 1.0 - EXACT:
            near = self.closest
            return f"vehicles {near.pair} come as near as {near.distance:.9g} m at {near.instant:.4g} s"
        return None if self.vehicles is None else self.vehicles.fault

    @property
    def least_distance(self) -> float | None:
        """Distance of the closest pair, heights divided by the downwash [m]; None for one vehicle."""
        return None if self.closest is None else self.closest.distance

    @property
    def pair(self) -> tuple[int, int] | None:
        """Which two vehicles that are."""
        return None if self.closest is None else self.closest.pair

    @property
    def instant(self) -> float | None:
        """When [s]."""
        return None if self.closest is None else self.closest.instant

    @cached_property
    def jump(self) -> tuple[int, float, float] | None:
        """The greatest step in position over 1 cm: vehicle, instant [s] and distance [m]; None without one."""
        steps = [widest_step(curve) for curve in self.fleet]
        vehicle = int(np.argmax([step for step, _, _ in steps]))
        step, instant, _ = steps[vehicle]
        return (vehicle, instant, step) if step > 0.01 else None  # numbers of few digits make small ones

    @cached_property
    def room_margin(self) -> float | None:
        """Least distance of any vehicle to the walls of the room [m]; None without a room."""
        return None if self.room_margins is None else float(self.room_margins.min())

    @cached_property
    def clearance(self) -> float | None:
        """Least distance of any vehicle to an obstacle [m]; None without obstacles."""
        return None if self.clearances is None else float(self.clearances.min())

    def middle_of(self, near: NearPair) -> FloatArray:
        """Return the point halfway between two vehicles when they are nearest, shape (dim,) [m]."""
        curves = [self.fleet[vehicle] for vehicle in near.pair]
        return np.asarray(np.mean([curve(min(near.instant, curve.duration)) for curve in curves], axis=0))


@explains_names({"obstacles": "avoid=", "distance": "separation="})
def certify_fleet(
    fleet: Fleet | Sequence[Path],
    separation: Separation | float | None = None,
    limits: Limits | Sequence[Limits] | None = None,
    room: Room | Sequence[ArrayLike] | None = None,
    avoid: Obstacle | Sequence[Obstacle] | None = None,
    reach: float = REACH,
    threads: int | None = None,
    tracking: Loop | Sequence[Loop] | None = None,
    wind: float = 0.0,
) -> FleetCertificate:
    """Check several vehicles at every instant, and return exact bounds.

    Parameters
    ----------
    fleet : Fleet or sequence of Trajectory
        On one clock; a vehicle that ends before the others stays at its end.
    separation : Separation or float, optional
        Least distance of any two [m]; by default that of the fleet.
    limits : Limits or sequence of Limits, optional
        Limits of all vehicles, or of each.
    room : Room or pair of corners, optional
        Room of all vehicles.
    avoid : obstacle or sequence of obstacles, optional
        Cylinders, ellipsoids and cuboids to keep out of.
    reach : float
        Pairs are listed that come nearer than this multiple of their separation.
    threads : int, optional
        By default as many as processors; they change nothing in the result.
    tracking : Loop or sequence of Loop, optional
        Control loop of all vehicles, or of each, which must then keep separation, room, obstacles and thrust, too.
    wind : float
        With ``tracking``: largest change of the wind at any vehicle from what it is at the start [m/s].

    Returns
    -------
    FleetCertificate

    Raises
    ------
    VehicleError
        If ``tracking`` is no loop, or the wind is given without one.
    FleetError
        If the trajectories, the limits, the room or the obstacles do not fit together.
    """
    vehicles = fleet if isinstance(fleet, Fleet) else Fleet(_listed(fleet))
    apart = vehicles.separation if separation is None else as_separation(separation)
    workers = check_threads(threads, FleetError)
    pairs = () if apart is None or len(vehicles) < 2 else _nearest(vehicles, apart, reach, workers)
    use = () if limits is None else fleet_use(vehicles, limits)
    rooms = as_room(room)
    margins = room_margins(vehicles, rooms[0]) if rooms else None
    obstacles = as_simple(avoid)
    clear, which = _clearances(vehicles, obstacles, workers) if obstacles else (None, None)
    near = tuple(pair for pair in pairs if pair.share < reach)
    tube = None
    if tracking is not None or wind:
        from minsnap.fleet.fleet_tube import fleet_tube

        kept = apart, rooms[0] if rooms else None, obstacles, limits_of(limits, len(vehicles)) if limits else None
        tube = fleet_tube(vehicles, tracking, wind, *kept, workers)
    return FleetCertificate(pairs[0] if pairs else None, near, use, margins, clear, which, vehicles, apart, tube)


def _listed(fleet: Any) -> tuple[Any, ...]:
    if not isinstance(fleet, Sequence):
        raise FleetError(f"certify_fleet takes a Fleet or a list of trajectories, not {type(fleet).__name__}")
    return tuple(fleet)


def _nearest(fleet: Fleet, separation: Separation, reach: float, threads: int) -> tuple[NearPair, ...]:
    """Return pairs nearer than ``reach``, or the single nearest one, nearest to their separation first."""
    if not reach >= 1.0:
        raise FleetError(f"reach is {reach!r}: give at least 1, in units of the separation")
    radii = separation.radii_of(len(fleet))
    if separation.ground is None:
        return _near_or_nearest(fleet.arrays, radii, separation.downwash, reach, threads)
    away = 4.0 * reach * float(radii.max()) * separation.downwash
    flying = _near_or_nearest(arrays_in_flight(fleet, away), radii, separation.downwash, reach, threads)
    standing = np.full(len(fleet), 0.5 * separation.ground)
    pairs = {near.pair: near for near in _near_or_nearest(fleet.arrays, standing, separation.downwash, reach, threads)}
    for near in flying:
        if near.pair not in pairs or near.share < pairs[near.pair].share:
            pairs[near.pair] = near
    return tuple(sorted(pairs.values(), key=lambda near: (near.share, near.pair)))


def _near_or_nearest(
    arrays: FleetArrays, radii: FloatArray, downwash: float, reach: float, threads: int
) -> tuple[NearPair, ...]:
    pairs = near_pairs(arrays, radii, downwash, reach, False, threads)
    if len(pairs.pairs):
        return _merged(pairs, radii)
    return _merged(near_pairs(arrays, radii, downwash, reach, True, threads), radii)[:1]


def _merged(pairs: NearPairs, radii: FloatArray) -> tuple[NearPair, ...]:
    """Return the least of each pair over the cells of time."""
    one, two = pairs.pairs.T
    order = np.lexsort((pairs.instant, pairs.attained, two, one))
    first = np.ones(len(order), dtype=bool)
    first[1:] = (np.diff(one[order]) != 0) | (np.diff(two[order]) != 0)
    starts = np.flatnonzero(first)
    least, kept = np.minimum.reduceat(pairs.least[order], starts), order[starts]
    required = radii[one[kept]] + radii[two[kept]]
    ranked = np.lexsort((two[kept], one[kept], least / required))
    columns = (one[kept], two[kept], least, required, pairs.instant[kept])
    rows = zip(*(column[ranked].tolist() for column in columns), strict=True)
    return tuple(NearPair((i, j), distance, limit, instant) for i, j, distance, limit, instant in rows)


def _clearances(fleet: Fleet, obstacles: Sequence[Obstacle], threads: int) -> tuple[FloatArray, IntArray]:
    if fleet.dim != 3:
        raise FleetError("obstacles are in space, and the vehicles have two coordinates: give three")
    least, _, which = clearances(fleet.arrays, np.stack([each.numbers() for each in obstacles]), FINEST, threads)
    return least, which


HALF = 4
"""Derivatives 0 ... k - 1 are continuous, and prescribed at both ends."""


def fleet_fault(task: FleetTask, fleet: Fleet, threads: int) -> str | None:
    """Return which condition a fleet does not keep, or None.

    Parameters
    ----------
    task : FleetTask
    fleet : Fleet
        With the headings; its first vehicles are those that were planned.
    threads : int
    """
    planned = [fleet[vehicle] for vehicle in range(len(task))]
    duration = planned[0].duration if task.total_time is None else task.total_time
    for vehicle, curve in enumerate(planned):
        wrong = next(_faults_alone(task, vehicle, curve, duration), None)
        if wrong is not None:
            return f"vehicle {vehicle}: {wrong}"
    limited = None if task.limits is None else certify_fleet(planned, limits=task.limits).fault
    return limited or certify_fleet(fleet, task.separation, None, task.room, task.avoid, threads=threads).fault


def _faults_alone(task: FleetTask, vehicle: int, curve: Trajectory, duration: float) -> Iterator[str]:
    """Yield what one vehicle does not keep, but for limits."""
    points, holds = task.waypoints[vehicle], task.holds_of(vehicle)
    fault = fault_as_one_leg(curve, points[[0, -1]], task.states[vehicle], HALF, duration)
    boxes = task.corridors[vehicle] if task.corridors else None
    if fault is not None:
        yield fault
    if len(points) == 2 and boxes is None and not holds.any():
        return
    knots = passed_knots(curve, points)
    if knots is None:
        yield "it does not pass all of its waypoints in their order"
        return
    short = curve.breaks[knots[:, 1]] - curve.breaks[knots[:, 0]] < holds - EXACT * curve.duration
    if short.any():
        yield f"it does not rest at waypoint {int(short.argmax())} for {holds[short.argmax()]:.9g} s"
    legs = np.repeat(np.arange(len(knots) - 1), np.diff(knots[:, 0]))
    for leg in () if boxes is None else legs_left(boxes, curve, legs, EXACT):
        yield f"it leaves the box of leg {leg}"


def passed_knots(curve: Trajectory, points: FloatArray) -> IntArray | None:
    """Return the knots at which a curve arrives at each waypoint and leaves it, (n, 2); None where it misses one."""
    resting = (curve.control_points == curve.control_points[:, :1]).all(axis=(1, 2))
    places = np.concatenate((curve.control_points[:, 0], curve.control_points[-1:, -1]))
    moves = np.append(np.flatnonzero(~resting), len(resting))
    knots, next_one = [], 0
    for point in points[:-1]:
        here = next_one + np.flatnonzero((places[next_one:] == point).all(axis=1))
        if not len(here):
            return None
        leaves = int(moves[np.searchsorted(moves, here[0])])
        knots.append((int(here[0]), leaves))
        next_one = leaves + 1
    arrives = int(moves[-2]) + 1 if len(moves) > 1 else 0
    return np.array([*knots, (arrives, len(resting))]) if (places[-1] == points[-1]).all() else None


def legs_left(boxes: Boxes, curve: Trajectory, leg: IntArray, slack: float = 0.0) -> list[int]:
    """Return the legs of pieces that are not proved to be inside of their boxes; ``leg`` of each piece, (pieces,)."""
    ends = [extent_of(points[None]) for points in curve.control_points[: len(leg)]]
    low, high = (np.stack(end) for end in zip(*ends, strict=True))
    outside = (low < boxes.lower[leg] - slack) | (high > boxes.upper[leg] + slack)
    return [int(number) for number in leg[outside.any(axis=1)]]
