"""Courses that leave room for a vehicle's control loop, as :mod:`minsnap.planning.in_loop` does for plans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from minsnap.corridors.half_spaces import HalfSpaces
from minsnap.corridors.tubes import Tube
from minsnap.paths.missions.course import Course, Stop
from minsnap.planning.in_loop import larger, narrower


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
    floor = None if course.floor is None else course.floor + distance
    return course.changed(boxes=boxes, tube=tube, avoid=avoid, stops=stops, floor=floor)


def _narrower_stop(stop: Stop, distance: float) -> Stop:
    return stop if stop.gate is None else replace(stop, place=stop.gate.within(distance))


def wider_walls(wall: HalfSpaces, distance: float) -> HalfSpaces:
    """Return half-spaces of positions, moved outwards by a distance [m]."""
    return HalfSpaces(wall.normal, wall.offset + distance * np.linalg.norm(wall.normal, axis=1), wall.legs)
