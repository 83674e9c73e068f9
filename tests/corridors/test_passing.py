import numpy as np
import pytest

import minsnap
from minsnap import Ball, Gate
from minsnap.corridors.given_waypoints import as_knots
from minsnap.corridors.knot_regions import passing, place
from minsnap.trajectory.trajectory import Trajectory

POINTS = np.array([(0, 0, 1), (3, 1, 1), (6, 0, 2)], dtype=float)
TIMES = [1.5, 1.6]


def moved(traj, shift):
    """A curve whose middle waypoint is elsewhere, on both sides of the knot."""
    points = traj.control_points.copy()
    points[0, -1] += shift
    points[1, 0] += shift
    return Trajectory(points, traj.durations)


@pytest.mark.parametrize("tolerance", [0.2, Ball(0.2)])
def test_a_waypoint_that_is_outside_by_more_than_rounding_is_not_passed(tolerance):
    placement = place(as_knots(POINTS, tolerance), ())
    through = minsnap.plan(POINTS, durations=TIMES)
    for aside, passed in ((0.199, True), (0.2 + 0.5e-9 * 6.0, True), (0.2 + 2e-9 * 6.0, False)):
        curve = moved(through, (0.0, aside, 0.0))
        excess, passes = passing(curve, placement)
        assert passes is passed
        assert excess == pytest.approx(max(aside - 0.2, 0.0), abs=1e-15)


def test_a_gate_is_passed_in_its_direction_only():
    curve = minsnap.plan(POINTS, durations=TIMES)
    for normal, passed in (((1, 0, 0), True), ((-1, 0, 0), False)):
        gate = Gate(POINTS[1], normal, 1.0, 1.0, crossing=1)
        assert passing(curve, place(as_knots([POINTS[0], gate, POINTS[2]]), ()))[1] is passed


def test_a_plan_whose_solvers_stop_short_passes_its_waypoints():
    """The curve swings out by 1e5 m along its tubes; one 1e-7 m outside of a waypoint's box was taken for inside."""
    points = [
        (4.7795870745636675, -2.7682833593614875),
        (3.9533941767896654, -3.3235594418212995),
        (8.52867579903948, -7.124198317615542),
        (9.3115363067554, -13.998962803795663),
        (12.17981820799907, -16.253567012335306),
        (13.52323571833216, -19.8062090104662),
        (12.81332146721278, -18.748904572069147),
        (11.7870691144811, -19.57294880810107),
    ]
    times = [
        0.26107660704179003,
        3.2043447133762686,
        19.341369032057827,
        1.0819967696116273,
        14.126151276971537,
        4.043688636611062,
        0.5491642762551657,
    ]
    width, aside = 1.5546344719852614, 0.05329461925487551
    traj = minsnap.plan(points, durations=times, degree=11, continuity=6, waypoint_tolerance=aside, corridor=width)
    assert minsnap.certify(traj, points, width, tolerance=aside).ok
