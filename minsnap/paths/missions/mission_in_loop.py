"""Missions that leave room for a vehicle's control loop, as :mod:`minsnap.planning.in_loop` does for plans."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.corridors.half_spaces import HalfSpaces
from minsnap.corridors.tubes import Tube
from minsnap.limits.limits import Limits
from minsnap.paths.missions.course import Course, Stop
from minsnap.paths.missions.mission import Mission
from minsnap.planning.in_loop import kept_in_loop, larger, narrower, told_in_loop
from minsnap.vehicle_tube import VehicleTube, check_followed, check_tracking


def mission_in_loop(course: Course, tracking: Any, wind: Any, planned: Callable[[Course], Mission]) -> Mission:
    """Plan a course so that the vehicle in its loop keeps it, in a wind that changes by at most ``wind`` [m/s].

    Parameters
    ----------
    course : Course
    tracking : Loop
    wind : float or None
    planned : callable
        Plans a course.

    Raises
    ------
    VehicleError
        If ``tracking`` is no loop, or thrust and tilt leave nothing to the plan.
    UnprovedError
        If no mission was found with which the vehicle stays inside.
    """
    change = check_tracking(tracking, wind)

    def less(distance: float, limits: Limits | None) -> tuple[Course, float]:
        return narrower_course(course, distance).changed(limits=limits), distance

    def followed(asked: tuple[Course, float]) -> tuple[Mission, VehicleTube]:
        mission = planned(asked[0])
        check_followed(mission.trajectory)
        walls = tuple(_wider(wall, asked[1]) for wall in mission.corridor)
        said = (*mission.said, told_in_loop(change))
        kept = replace(mission, course=course, limits=course.bounds, corridor=walls, said=said)
        return kept, kept.in_loop(tracking, change)

    return kept_in_loop(tracking, change, course.bounds, less, followed)


def narrower_course(course: Course, distance: float) -> Course:
    """Return a course whose tube, boxes and gates are narrower by a distance [m], and its obstacles larger.

    Raises
    ------
    CorridorError, WaypointError
        If nothing is left of one of them.
    """
    boxes = None if course.boxes is None else narrower(course.boxes, distance)
    tube = None if course.tube is None else float(np.max(Tube(course.tube - distance).half_width))
    avoid = tuple(part for each in course.obstacles for part in larger(each, distance))
    stops = tuple(_narrower_stop(stop, distance) for stop in course.stops)
    return course.changed(boxes=boxes, tube=tube, avoid=avoid, stops=stops)


def _narrower_stop(stop: Stop, distance: float) -> Stop:
    return stop if stop.gate is None else replace(stop, place=stop.gate.within(distance))


def _wider(wall: HalfSpaces, distance: float) -> HalfSpaces:
    """Return half-spaces of positions, moved outwards by a distance [m]."""
    return HalfSpaces(wall.normal, wall.offset + distance * np.linalg.norm(wall.normal, axis=1), wall.legs)
