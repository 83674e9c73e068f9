"""Starts and ends on their limits: taken with durations, a total time, and for the shortest time."""

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from tasks import task_of

import minsnap
from minsnap import Limits
from minsnap.durations.connector import pinned_state
from minsnap.durations.timing import Timing
from minsnap.durations.ways import connect_start, end_on_limit, shortest_from, start_on_limit
from minsnap.durations.within_limits import at_rest_everywhere, check_pinned_limits
from minsnap.errors import InfeasibleError, LimitError

POINTS = np.array([(0, 0, 1), (3, 0.5, 1), (6, 0, 1.2), (9, 1, 1)], dtype=float)
FIRST, LAST = (step / np.linalg.norm(step) for step in (POINTS[1] - POINTS[0], POINTS[3] - POINTS[2]))
TIMES = {"durations": [2.2, 1.8, 2.2], "total_time": 4.8, "shortest": None}
QUICK = settings(
    max_examples=8,
    deadline=None,
    phases=(Phase.explicit, Phase.generate),
    suppress_health_check=[HealthCheck.too_slow],
)


def planned(kind, limits, **options):
    times = {} if TIMES[kind] is None else {kind: TIMES[kind]}
    path = minsnap.plan(POINTS, limits=limits, **times, **options)
    assert minsnap.certify(path, POINTS, limits=limits, limits_from=path.report.limits_from).ok
    assert path.legs == 3
    assert path(path.leg_breaks) == pytest.approx(POINTS, abs=1e-9)
    for order in range(1, 4):
        jumps = path(path.breaks[1:-1], order) - path(np.nextafter(path.breaks[1:-1], 0.0), order)
        worst = np.abs(jumps).max() / path.max_norm(order)[0]
        assert worst <= 1e-6, (order, worst, path.durations)
    if kind == "durations":
        assert np.diff(path.leg_breaks) == pytest.approx(TIMES[kind], rel=1e-9)
    elif kind == "total_time":
        assert path.duration == pytest.approx(TIMES[kind], rel=1e-9)
    return path


@QUICK
@given(st.sampled_from(sorted(TIMES)), st.floats(2.6, 3.4), st.floats(5.0, 9.0), st.booleans(), st.booleans())
def test_a_start_and_an_end_on_a_limit_are_taken(kind, speed, acceleration, start, end):
    limits = Limits(speed=speed, acceleration=acceleration)
    options = {}
    if start:
        options["start"] = {"velocity": speed * FIRST}
    if end:
        options["end"] = {"velocity": speed * LAST}
    path = planned(kind, limits, **options)
    assert path.report.limits_from == 0.0
    for asked, at, waypoint in ((start, 0.0, FIRST), (end, path.duration, LAST)):
        assert path(at, 1) == pytest.approx(speed * waypoint if asked else np.zeros(3), abs=1e-9)


@pytest.mark.parametrize("kind", sorted(TIMES))
def test_accelerations_on_their_limit_are_taken(kind):
    start = {"velocity": FIRST, "acceleration": 6.0 * FIRST}
    end = {"velocity": LAST, "acceleration": -6.0 * LAST}
    path = planned(kind, Limits(speed=3.2, acceleration=6.0), start=start, end=end)
    assert path(0.0, 2) == pytest.approx(6.0 * FIRST, abs=1e-7)
    assert path(path.duration, 2) == pytest.approx(-6.0 * LAST, abs=1e-7)


def test_a_moving_start_is_met_exactly_where_the_time_is_lengthened_to_the_total():
    limits = Limits(speed=3.0, acceleration=6.0)
    path = minsnap.plan(POINTS, total_time=4.2, limits=limits, start={"velocity": (2.0, 0.0, 0.0)})
    assert path(0.0, 1) == pytest.approx([2.0, 0.0, 0.0], abs=1e-12)
    assert path.duration == pytest.approx(4.2, rel=1e-12)
    assert minsnap.certify(path, POINTS, limits=limits).ok


def test_a_start_outside_its_limits_is_brought_back_in_given_durations_too():
    path = planned("durations", Limits(speed=3.0, acceleration=6.0), start={"velocity": 3.3 * FIRST})
    assert 0.0 < path.report.limits_from < 0.5


def test_ways_stay_inside_the_corridor():
    options = {"start": {"velocity": 3.0 * FIRST}, "end": {"velocity": 3.0 * LAST}, "corridor": 0.3}
    path = planned("durations", Limits(speed=3.0, acceleration=9.0), **options)
    assert path.report.corridor_margin >= 0.0


def test_legs_too_short_for_their_way_and_ends_outside_their_limits_are_refused():
    limits = Limits(speed=3.0, acceleration=6.0)
    with pytest.raises(InfeasibleError, match="leg 0 has 0.01 s, and its length alone needs 1.01379 s") as refused:
        minsnap.plan(POINTS, durations=[0.01, 2, 2], limits=limits, start={"velocity": 3.0 * FIRST})
    assert refused.value.leg == 0
    with pytest.raises(LimitError, match="speed 3.3, beyond its limit 3"):
        minsnap.plan(POINTS, durations=[2, 2, 2], limits=limits, end={"velocity": 3.3 * LAST})


@pytest.mark.parametrize(("below", "on"), ((0.9e-5, True), (1.1e-5, False)))
def test_an_end_is_on_a_limit_to_a_hundred_thousandth(below, on):
    fast = {1: 2.0 * (1.0 - below) * FIRST, 2: np.zeros(3), 3: np.zeros(3)}
    for waypoint, on_limit in ((0, start_on_limit), (3, end_on_limit)):
        assert on_limit(task_of(POINTS, pins={waypoint: fast}), Limits(speed=2.0)) is on


@pytest.mark.parametrize(("below", "refused"), ((0.9e-6, True), (1.1e-6, False)))
def test_a_state_pinned_on_the_way_is_at_a_limit_to_a_millionth(below, refused):
    task = task_of(POINTS, pins={1: {1: 2.0 * (1.0 - below) * FIRST}})
    if refused:
        with pytest.raises(LimitError, match="waypoint 1 has speed 2, at its limit 2: raise .* at least 2.02"):
            check_pinned_limits(task, Limits(speed=2.0))
    else:
        check_pinned_limits(task, Limits(speed=2.0))


GUSTS = [
    ((3.9, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ((2.34, 3.12, 0.0), (0.0, 0.0, 0.0)),
    ((0.0, 3.9, 0.0), (0.0, 0.0, 0.0)),
    ((0.5, 2.5, 0.5), (0.0, 9.5, 0.0)),
]


@pytest.mark.parametrize(("velocity", "acceleration"), GUSTS)
def test_a_whole_is_shorter_than_the_way_and_the_rest_and_exceeds_no_more(velocity, acceleration):
    limits = Limits(speed=3.0, acceleration=8.0)
    task = task_of(POINTS, pins={0: {1: np.array(velocity), 2: np.array(acceleration), 3: np.zeros(3)}})
    parts, whole = (shortest_from(task, Timing(limits=limits), again=again).plan() for again in (False, True))
    assert whole.trajectory.duration < 0.995 * parts.trajectory.duration
    assert whole.limits_from <= 1.02 * parts.limits_from
    way = connect_start(pinned_state(task), (), limits)
    first = whole.trajectory.durations[0]
    assert first <= way.duration * (1.0 + 1e-6)
    shares = np.linspace(0.0, 1.0, 301)
    for order, most in ((1, 3.0), (2, 8.0)):
        own, known = (
            np.linalg.norm(curve(shares * end, order), axis=1)
            for curve, end in ((whole.trajectory, first), (way, way.duration))
        )
        assert (own <= np.maximum(known, most) * 1.003).all(), order


REFUSED_BETWEEN = {
    "no limits kept from the end of the way": (
        [(-3.24, 9.34, 5.56), (-2.67, 4.45, 3.72)],
        {"speed": 4.579, "max_thrust": 1.8, "body_rate": 4.0},
        {"velocity": (0.022, -3.962, -2.295), "acceleration": (-14.677, -0.12, 0.0)},
        {"pieces": 3, "corridor": 0.85},
    ),
    "the same of one piece a leg": (
        [(0.09, -0.99, 5.54), (-6.4, -0.34, 4.63), (-6.18, -3.5, 4.8), (1.62, -5.39, 4.96)],
        {"speed": 2.887, "max_thrust": 1.8, "body_rate": 4.0},
        {"velocity": (-1.803, 0.5, -0.426), "acceleration": (-8.907, 11.665, 0.0)},
        {"pieces": 1, "corridor": 0.64},
    ),
    "a number of pieces that is searched": (
        [(-0.37, 5.53, 5.51), (-1.18, 3.78, 4.35), (-8.41, 3.6, 5.57), (-10.55, -0.04, 5.19)],
        {"speed": 4.497, "acceleration": 7.897, "jerk": 25.0, "snap": 400.0},
        {"velocity": (-0.867, -2.472, -0.909), "acceleration": (-0.627, -3.358, 7.295)},
        {"pieces": "auto", "corridor": 1.05},
    ),
}


@pytest.mark.parametrize("name", sorted(REFUSED_BETWEEN))
def test_a_start_whose_rest_alone_has_no_plan_is_planned_as_a_whole(name):
    points, bounds, start, options = REFUSED_BETWEEN[name]
    limits = Limits(**bounds)
    path = minsnap.plan(points, limits=limits, start=start, **options)
    assert path.report.corridor_margin >= 0.0
    assert 0.0 < path.report.limits_from < 0.1 * path.duration
    kept = minsnap.certify(path, points, limits=limits, limits_from=path.report.limits_from)
    assert kept.ok
    for order, value in ((1, "velocity"), (2, "acceleration")):
        assert path(0.0, order) == pytest.approx(np.array(start[value]), abs=1e-6)


def test_the_search_from_rest_at_every_waypoint_finds_the_flight_of_the_one_from_ways():
    limits, fast = Limits(speed=3.0, acceleration=8.0), {1: 3.3 * FIRST, 2: np.zeros(3), 3: np.zeros(3)}
    task, timing = task_of(POINTS, pins={0: fast}), Timing(limits=limits)
    quick, best = at_rest_everywhere(task, timing, again=True), shortest_from(task, timing).plan()
    assert quick.trajectory.duration == pytest.approx(best.trajectory.duration, rel=0.1)
    assert minsnap.certify(quick.trajectory, POINTS, limits=limits, limits_from=quick.limits_from).ok
