"""What a budget ends: searches, ways back and certified ends stop at their deadline, and nothing is explained."""

from dataclasses import replace
from time import monotonic

import numpy as np
import pytest

import minsnap
from minsnap import Boxes, Limits
from minsnap.errors import InfeasibleError
from minsnap.replanning.course_ahead import course_ahead
from minsnap.replanning.search import Aim, search_ahead
from minsnap.replanning.splice import splice_of
from minsnap.time_allocation.least_time import LateError
from minsnap.time_allocation.recovery import start_state, way_back

POINTS = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2), (6, 1, 1)], dtype=float)
LIMITS = Limits(speed=3.0, acceleration=6.0)


@pytest.fixture(scope="module")
def flown():
    return minsnap.plan(POINTS, limits=LIMITS, corridor=0.5)


def task_of(flown, walls, points, **changes):
    splice = splice_of(flown, 0.3, 0.1, 4)
    course = course_ahead(splice, points, None, splice.leg_start, [walls], 1)
    return replace(course.task, explained=False, **changes)


def through(width):
    return Boxes(np.minimum(POINTS[:-1], POINTS[1:]) - width, np.maximum(POINTS[:-1], POINTS[1:]) + width)


def test_a_search_past_its_deadline_ends_without_a_way_back(flown):
    task = task_of(flown, through(0.5), POINTS[1:], deadline=monotonic() - 1.0)
    with pytest.raises(LateError):
        search_ahead(task, Aim(LIMITS), lambda curve: curve, None, 10.0)
    assert way_back(start_state(task), task.walls, Limits(speed=0.5), deadline=monotonic() - 1.0) is None


def test_what_cannot_be_flown_is_refused_without_an_explanation(flown):
    task = task_of(flown, through(0.5), POINTS[1:])
    limited = task.with_walls(LIMITS.walls(task.waypoints))
    with pytest.raises(InfeasibleError, match="no curve keeps the walls and the limits in these durations"):
        search_ahead(limited, Aim(durations=[0.1, 0.1, 0.1]), lambda curve: curve, None, 10.0)
