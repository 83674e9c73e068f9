"""Times within limits where waypoints lie on the floor, and refusals of prices of time."""

import numpy as np
import pytest

import minsnap

FLOOR = minsnap.Room((-20.0, -20.0, 0.0), (20.0, 20.0, 6.0))
LIMITS = minsnap.Limits(speed=3.0, acceleration=6.0)


def course(seed):
    random = np.random.default_rng(seed)
    points = random.uniform(-5.0, 5.0, (int(random.integers(3, 8)), 3))
    points[:, 2] = random.choice([0.0, 0.0, 1.0], len(points))
    return points


@pytest.mark.parametrize("seed", [0, 8, 44])
def test_the_shortest_time_of_a_course_on_the_floor_is_certified(seed):
    traj = minsnap.plan(course(seed), limits=LIMITS, corridor=FLOOR)
    assert minsnap.certify(traj, course(seed), FLOOR, limits=LIMITS).ok
    assert max(used.fraction for used in traj.report.utilisation) > 0.98


def test_a_total_within_limits_on_the_floor_is_certified():
    points = course(11)
    points[0, 2] = points[-1, 2] = 0.0
    traj = minsnap.plan(points, limits=LIMITS, total_time=30.0, corridor=FLOOR)
    assert traj.duration == pytest.approx(30.0) and minsnap.certify(traj, points, FLOOR, limits=LIMITS).ok


def test_a_start_across_a_tube_is_stopped_in_times_as_short_as_that_takes():
    state = {"velocity": (0.0, 30.0)}
    traj = minsnap.plan([(0, 0), (5, 0)], corridor=0.1, start=state, search=minsnap.Search(time_weight=100.0))
    assert minsnap.certify(traj, [(0, 0), (5, 0)], 0.1).ok and traj.duration < 0.1
