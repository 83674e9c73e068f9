"""What the native search for the shortest time is asked: waypoints, walls and limits of a task in its form.

The functions of limits on several derivatives at an instant stand in ``src/shortest_time/instant_limits.hpp``.  Where
the yaw is known, constant or held as it turns (``HeldYaw``), the thrust of each rotor is computed.  Else a bound on the
largest one is used, which holds for any heading of a body that does not spin about its thrust: the mean thrust, the
most that a rotor adds for the torque about horizontal axes, and the most for the torque about the thrust axis that
unequal inertias ask for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, hypot, tan
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray, significant
from minsnap.basics.checks import SHORTEST
from minsnap.corridors.constraint import Walls
from minsnap.durations.initial_guess import guessed_lengths, norm_limits, stop_and_go_times
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.limits.vehicle_use import VEHICLE_USE, lateral_alike, medium_of
from minsnap.native.records import WallsRecord
from minsnap.native.shortest_time import Guess, HeldYaw, InstantKind, InstantLimit, ShortestQuestion
from minsnap.optimisation.solve import solve
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.optimisation.task import Task
from minsnap.trajectory.heading import Heading, RuledHeading
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle.quadrotor import Quadrotor


@dataclass(frozen=True)
class QuestionSettings:
    """What the search is asked beside the task.

    Parameters
    ----------
    divisions : tuple of int
        Into how many times as many pieces legs are divided, time after time, where their number is left to the search.
    alone : tuple of int
        The same for a single leg, whatever it gains: its pieces cost little.
    worthwhile : float
        Relative gain of the first division from which several legs are divided again: where three pieces gained 8 %,
        six then gain about 0.5 % more.
    inward : float
        Share of their widths by which walls are moved inwards.
    room : float
        Share by which limits that slower flight cannot repair are tightened, which saves repairs at the end.
    directed : float
        Share of the weight below which thrust has no direction: there a small change turns it by any angle.
    aside : float
        Least share of the thrust that is not along a constant yaw: there a small change spins the body by any angle.
    turn : float
        Duration of the cubics of a yaw that is a function of time [s].
    angle_digits : int
        Decimals of the angles of a yaw [rad].
    """

    divisions: tuple[int, ...] = (3, 2)
    alone: tuple[int, ...] = (3, 3)
    worthwhile: float = 0.08
    inward: float = 2e-4
    room: float = 1e-4
    directed: float = 0.1
    aside: float = 0.1
    turn: float = 0.05
    angle_digits: int = 12


QUESTION = QuestionSettings()


def question_of(task: Task, limits: Limits, refine: bool, flown: Trajectory | None = None) -> ShortestQuestion:
    """Return the question for a task within limits.

    Parameters
    ----------
    task : Task
        Without walls of limits.
    limits : Limits
    refine : bool
        Whether the search chooses the number of pieces.
    flown : Trajectory, optional
        Any curve of the task with its heading, where limits depend on that.
    """
    pinned, free, turned = _waypoints(task)
    sets = [*(wall.record for wall in _walls(task, limits)), *_least_thrust(task, limits), *_region_sets(task)]
    lengths = guessed_lengths(task)
    turning = None if flown is None else turning_of(limits, flown)
    divisions = QUESTION.divisions if task.legs > 1 else QUESTION.alone
    return ShortestQuestion(
        pinned=pinned,
        free=free,
        lengths=lengths,
        norms=norm_limits(limits),
        sets=[one for one in sets if one.count],
        limits=instant_limits(limits, None if flown is None else flown.yaw, lengths, turning is not None),
        parts=divisions if refine else () if task.pieces == 1 else (task.pieces,),
        closed=task.closed,
        moving=not scales(task, limits) or any(wall.order for wall in task.walls),  # which slower flight need not keep
        worthwhile=QUESTION.worthwhile if task.legs > 1 else 0.0,
        inwards=0.0 if task.touches.any() else QUESTION.inward,
        tightened=QUESTION.room if task.still and not scales(task, limits) else 0.0,
        turned=turned,
        turning=turning,
    )


def with_rates(question: ShortestQuestion, limits: Limits, heading: Heading | None, **others: Any) -> ShortestQuestion:
    """Return a question with other limits on the rates of body and yaw; ``others`` are further fields to replace."""
    asked = replace(question, norms=norm_limits(limits), **others)
    return replace(asked, limits=instant_limits(limits, heading, question.lengths, asked.turning is not None))


def begun_from(question: ShortestQuestion, guess: Guess | None) -> ShortestQuestion:
    """Return a question that begins from a curve, whose legs are not divided again if they are divided already."""
    if guess is None:
        return question
    return replace(question, guess=guess, parts=question.parts if guess.pieces == 1 else ())


def coasting(task: Task, times: FloatArray) -> SolvedTask:
    """Return the curve of least cost through all waypoints that keeps the speed of a moving start.

    It arrives with the speed of a moving end.

    From rest at every waypoint a search that begins in motion finds a loop back to a waypoint that is close ahead.

    Parameters
    ----------
    times : ndarray, shape (legs,)
        Of legs from rest to rest [s].
    """
    durations = times.copy()
    for leg, waypoint in ((0, 0), (task.legs - 1, task.legs)):
        speed = hypot(*task.pins.get(waypoint, {}).get(1, ()))
        if speed > 0.0:
            durations[leg] = min(durations[leg], max(float(task.lengths[leg]) / speed, SHORTEST))
    pinned = np.zeros(task.waypoints.shape)
    free = replace(task, pieces=1, walls=(), regions={}, lower=pinned, upper=pinned, continuity=task.half - 1)
    return solve(free, durations)


def scales(task: Task, limits: Limits) -> bool:
    """Whether slowing any curve down brings it within the limits.

    Not those on rates of the body and on rotors: near free fall a slower flight may turn its thrust faster.
    """
    return task.still and limits.body_rate is None and not isinstance(limits, VehicleLimits)


def guess_of(curve: Trajectory, task: Task, slower: float = 1.0) -> Guess | None:
    """Return a curve through the same legs as a guess; None where its pieces are others than those asked for."""
    if curve.legs != task.legs or task.pieces not in (1, curve.pieces):
        return None
    instants = curve.leg_breaks if task.pieces == 1 else curve.breaks
    return Guess(task.pieces, np.diff(instants), curve.states(instants, task.half), slower)


def _waypoints(task: Task) -> tuple[FloatArray, BoolArray, FloatArray | None]:
    """Return derivatives that are pinned, which ones are free, and the axes of positions in slanted planes."""
    pinned = np.zeros((task.legs + 1, task.half, task.dim))
    pinned[:, 0] = task.waypoints
    for waypoint, state in task.pins.items():
        for order, value in state.items():
            pinned[waypoint, order] = value
    free = task.free[:: task.pieces, : task.half].copy()
    planes = {k: r.plane for k, r in task.regions.items() if r.plane is not None}
    if not planes:
        return pinned, free, None
    turned = np.zeros((task.legs + 1, task.dim, task.dim))
    for waypoint, normal in planes.items():
        turned[waypoint] = _axes(normal)
        pinned[waypoint, 0] = (turned[waypoint] * task.waypoints[waypoint][:, None]).sum(axis=0)
        free[waypoint, 0] = np.arange(task.dim) > 0
    return pinned, free, turned


def _axes(normal: FloatArray) -> FloatArray:
    """Orthogonal axes of which the first is along a unit normal: a reflection (A. S. Householder, 1958)."""
    mirror = normal.copy()
    mirror[0] += 1.0 if normal[0] >= 0.0 else -1.0
    return np.asarray(np.eye(len(normal)) - 2.0 / (mirror * mirror).sum() * mirror[:, None] * mirror)


def _walls(task: Task, limits: Limits) -> list[Walls]:
    """Walls of the corridor and of the limits, without those that are stricter than their limit or ignore drag."""
    other = ("min_thrust", "max_thrust", "tilt") if limits.medium.drags else ("min_thrust",) if _bounded(limits) else ()
    return [*task.walls, *(wall for wall in limits.walls(task.waypoints) if wall.name not in other)]


def _bounded(limits: Limits) -> bool:
    """Whether accelerations are bounded, so that no curve leaps through free fall between instants."""
    return limits.max_thrust is not None or limits.acceleration is not None


def _least_thrust(task: Task, limits: Limits) -> list[WallsRecord]:
    """Accelerations no nearer to free fall than the least thrust."""
    turned = limits.body_rate is not None or isinstance(limits, VehicleLimits)
    directed = turned and (limits.min_thrust is None or limits.min_thrust < QUESTION.directed)
    least = QUESTION.directed if directed else limits.min_thrust if _bounded(limits) else None
    if least is None or limits.medium.drags:
        return []
    legs, radius = task.legs, np.full(task.legs, least * limits.gravity)
    width = np.full(task.legs, limits.gravity) if directed else radius
    fall = np.tile((0.0, 0.0, -limits.gravity), (legs, 1))
    matrix, slope = np.tile(np.eye(3), (legs, 1, 1)), np.zeros((legs, 3))
    return [Walls(np.arange(legs), matrix, fall, slope, radius, width, order=2).record.changed(outside=True)]


def _region_sets(task: Task) -> list[WallsRecord]:
    """Return flat sides of all regions, boxes among them, then balls, then the directions in which they are crossed.

    Of a lap only those of its first waypoint.
    """
    boxed, regions = task.upper > task.lower, task.own_regions
    if not boxed.any():
        return []
    width = (task.upper - task.lower).max(axis=1) / 2.0
    balls = [waypoint for waypoint, region in regions.items() if np.isfinite(region.radius)]
    boxed[balls] = False
    boxed[-1] &= not task.closed
    place, axis = np.nonzero(boxed)
    axes = np.eye(task.dim)[axis]
    sides = [(place, -axes, task.upper[boxed]), (place, axes, -task.lower[boxed])]
    sides += [(np.full(len(one.bounds), waypoint), -one.normals, one.bounds) for waypoint, one in regions.items()]
    place, slope, bound = (np.concatenate(part) for part in zip(*sides, strict=True))
    order = place.argsort(kind="stable")
    place = place[order]
    sets = [_at_knots(task, place, slope[order], bound[order], width[place])]
    if balls:
        radius = np.array([regions[waypoint].radius for waypoint in balls])
        sets.append(_at_knots(task, balls, np.zeros((len(balls), task.dim)), radius, radius, size=task.dim))
    crossed = {waypoint: one.crossing for waypoint, one in regions.items() if one.crossing is not None}
    if crossed:
        bounds = np.zeros(len(crossed)), np.ones(len(crossed))
        sets.append(_at_knots(task, list(crossed), np.array(list(crossed.values())), *bounds, order=1))
    return sets


def _at_knots(
    task: Task,
    waypoints: Sequence[int] | IntArray,
    slope: FloatArray,
    radius: FloatArray,
    width: FloatArray,
    size: int = 0,
    order: int = 0,
) -> WallsRecord:
    """Return sets from slopes, radii and widths, with so many rows of the identity."""
    place = np.array(waypoints)
    anchor = task.waypoints[place] if order == 0 else np.zeros((len(place), task.dim))
    matrix = np.tile(np.eye(size, task.dim), (len(place), 1, 1))
    return Walls(place, matrix, anchor, slope, radius, width, order).record.changed(at_knots=True)


def instant_limits(limits: Limits, heading: Heading | None, lengths: FloatArray, held: bool) -> list[InstantLimit]:
    """Return the limits that are no sets of one derivative, with parameters rounded to 13 digits.

    So all machines ask the same question, whatever the last digits of their mathematical libraries.

    Parameters
    ----------
    limits : Limits
    heading : Heading or None
        Of any curve of the task.
    lengths : ndarray, shape (legs,)
        Of the legs, none very short [m].
    held : bool
        Whether the search holds a yaw that turns.
    """
    medium = limits.medium
    share = 1.0 - VEHICLE_USE.margin if medium.drags else 1.0
    entries = []
    if medium.drags and limits.min_thrust is not None:
        entries.append(InstantLimit(InstantKind.LEAST_THRUST, (*medium.values, limits.min_thrust / share)))
    if medium.drags and limits.max_thrust is not None:
        entries.append(InstantLimit(InstantKind.MOST_THRUST, (*medium.values, limits.max_thrust * share)))
    if medium.drags and limits.tilt is not None:
        entries.append(InstantLimit(InstantKind.TILT, (*medium.values, tan(limits.tilt * share))))
    rotors = []
    if isinstance(limits, VehicleLimits):
        rotors = [_rotors(limits.vehicle, limits.reserve, heading, held)]
    if limits.body_rate is not None:
        kind, body = InstantKind.BODY_RATE, medium.values
        if isinstance(limits, VehicleLimits) and held and not lateral_alike(limits.vehicle):
            kind, body = InstantKind.TURNING_BODY_RATE, rotors[0].parameters
        entries.append(InstantLimit(kind, (*body, limits.body_rate * share)))
    entries += rotors
    if limits.yaw_rate is not None and heading is not None:
        speed = float((lengths / stop_and_go_times(lengths, limits)).mean())
        held_rate = (
            [InstantLimit(InstantKind.TURN_RATE, (limits.yaw_rate,))] if held and heading.polynomial is not None else []
        )
        entries += held_rate or heading.rate_limits(limits.yaw_rate, float(lengths.mean()), speed)
    return [replace(one, parameters=tuple(significant(value, 13) for value in one.parameters)) for one in entries]


def _rotors(vehicle: Quadrotor, reserve: float, heading: Heading | None, held: bool) -> InstantLimit:
    """Limit the rotors' thrusts to a share of their room around hover, less the margin that the proof needs."""
    hover, (least, most) = vehicle.hover_thrust, vehicle.rotor_thrust_limits
    below, above = ((1.0 - reserve) * room - VEHICLE_USE.margin * hover for room in (hover - least, most - hover))
    room = vehicle.mass, hover - below, hover + above
    common = (*medium_of(vehicle).values, *room)
    if heading is None or not held:
        turning = _rotor_thrust_per_acceleration(vehicle), _rotor_thrust_per_squared_rate(vehicle)
        return InstantLimit(InstantKind.UNSPUN_ROTORS, (*common, *turning))
    body = (*map(float, (*vehicle.inertia.reshape(-1), *vehicle.inverse_mixer.reshape(-1))), QUESTION.aside)
    if heading.constant is None or not lateral_alike(vehicle):
        drag = (*(vehicle.flat_drag.linear / vehicle.mass), *(vehicle.flat_drag.quadratic / vehicle.mass))
        return InstantLimit(InstantKind.TURNING_ROTORS, (vehicle.gravity, *map(float, drag), *room, *body))
    along = float(np.cos(heading.constant)), float(np.sin(heading.constant))
    return InstantLimit(InstantKind.YAWED_ROTORS, (*common, *along, *body))


def turning_of(limits: Limits, flown: Trajectory) -> HeldYaw | None:
    """Return the yaw along a curve as a search holds it; None where its limits do not depend on that."""
    yaw, rotors = flown.yaw, isinstance(limits, VehicleLimits)
    if yaw.medium is not None or not (rotors or limits.yaw_rate is not None):
        return None
    if isinstance(yaw, RuledHeading):
        rule, numbers = yaw.asked
        return HeldYaw(rule=rule, ruled=numbers) if rotors else None
    knots = np.zeros(0) if yaw.polynomial is None else yaw.polynomial.breaks
    if yaw.constant is not None or (len(knots) == flown.legs + 1 and np.allclose(knots, flown.leg_breaks)):
        angles = yaw(flown.leg_breaks).round(QUESTION.angle_digits)
        return HeldYaw(angles=angles, rate=float(yaw(0.0, 1)))
    if not rotors:
        return None
    turns = max(len(knots) - 1, ceil(flown.duration / QUESTION.turn))
    return HeldYaw(_cubics(yaw, flown.duration, turns), clock=flown.duration)


def _cubics(yaw: Heading, duration: float, turns: int) -> FloatArray:
    """Return control points, shape (turns, 4), of cubics with the angles and rates of a yaw [rad]."""
    instants = np.minimum(duration * np.linspace(0.0, 1.0, turns + 1), duration)
    angles, bends = yaw(instants), yaw(instants, 1) * duration / (3.0 * turns)
    points = angles[:-1], angles[:-1] + bends[:-1], angles[1:] - bends[1:], angles[1:]
    return np.ascontiguousarray(np.stack(points, axis=-1).round(QUESTION.angle_digits))


def _rotor_thrust_per_acceleration(vehicle: Quadrotor) -> float:
    """Most thrust of a rotor for an angular acceleration of one about any horizontal body axis [N s^2/rad]."""
    return float(np.linalg.norm(vehicle.inverse_mixer[:, 1:3] @ vehicle.inertia[:2, :2], axis=1).max())


def _rotor_thrust_per_squared_rate(vehicle: Quadrotor) -> float:
    """Most thrust of a rotor for a turn at a rate of one, whose torque comes from unequal inertias [N s^2]."""
    (first, mixed), (_, second) = vehicle.inertia[:2, :2]
    return float(np.abs(vehicle.inverse_mixer[:, 3]).max() * np.hypot((second - first) / 2.0, mixed))
