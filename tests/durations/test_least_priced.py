"""The least cost within limits, for a price of time or a total: the curve and its durations searched together."""

import pytest
from random_combinations import question
from tasks import REFERENCE

import minsnap
from minsnap.basics.deadline import LateError
from minsnap.errors import LimitError
from minsnap.limits.limits import Limits
from minsnap.planning.request import plan_arguments
from minsnap.vehicle import Quadrotor

LIMITS = Limits(speed=3.0, acceleration=6.0)
TURNING = Limits(speed=3.0, acceleration=6.0, body_rate=0.45)


def check(path, limits):
    assert minsnap.certify(path, REFERENCE, corridor=0.3, limits=limits).ok


def test_a_price_is_paid_as_by_searches_over_durations_alone():
    """Nested searches over durations, with the limits as walls of the QP, ended at 12839.55 and 1518.18."""
    for weight, least in ((100.0, 1518.18), (1000.0, 12839.55)):
        path = minsnap.plan(REFERENCE, limits=LIMITS, corridor=0.3, search=minsnap.Search(time_weight=weight))
        check(path, LIMITS)
        assert path.cost() + weight * path.duration <= 1.001 * least


def test_several_pieces_are_priced_within_the_limits():
    """A search that began from the shortest plan ended at 5,014,569 here, since that plan is so rough."""
    path = minsnap.plan(REFERENCE, limits=LIMITS, corridor=0.3, pieces=3, search=minsnap.Search(time_weight=1e4))
    check(path, LIMITS)
    assert path.cost() + 1e4 * path.duration <= 106_700


def test_a_total_is_split_as_by_searches_over_durations_alone():
    """Nested searches ended at 839.62 and 6384.58."""
    for total, least in ((12.0, 839.62), (11.0, 6384.58)):
        path = minsnap.plan(REFERENCE, total_time=total, limits=LIMITS, corridor=0.3)
        check(path, LIMITS)
        assert path.duration == pytest.approx(total, rel=1e-12) and path.cost() <= 1.003 * least


def test_limits_that_are_not_convex_are_kept_without_slowing_down():
    """The shortest plan slowed down to 13 s cost 2672; with a price of 1000 it ended at 14340."""
    path = minsnap.plan(REFERENCE, total_time=13.0, limits=TURNING, corridor=0.3)
    check(path, TURNING)
    assert path.duration == pytest.approx(13.0) and path.cost() <= 290.0
    priced = minsnap.plan(REFERENCE, limits=TURNING, corridor=0.3, search=minsnap.Search(time_weight=1e3))
    check(priced, TURNING)
    assert priced.cost() + 1e3 * priced.duration <= 13_060.0


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"pieces": 3},
        {"closed": True},
        {"start": {"velocity": (1.0, 0.3, 0.0)}, "corridor": 0.5},
        {"limits": TURNING},
        {"waypoint_tolerance": 0.2},
        {"degree": 9},
    ],
    ids=str,
)
def test_a_total_costs_what_its_price_does(more):
    """The plan of a price costs the least of all plans of its duration."""
    asked = {"limits": LIMITS, "corridor": 0.3} | more
    priced = minsnap.plan(REFERENCE, search=minsnap.Search(time_weight=1e3), **asked)
    order = (asked.get("degree", 7) + 1) // 2
    path = minsnap.plan(REFERENCE, total_time=priced.duration, **asked)
    assert path.duration == pytest.approx(priced.duration, rel=1e-12)
    assert 0.99 * priced.cost(order) <= path.cost(order) <= 1.005 * priced.cost(order)


@pytest.mark.slow
def test_a_price_with_a_heading_along_the_velocity_is_paid_in_several_pieces():
    """The search ended at 20,000 times this: differences of the cost were lost in rounding."""
    asked, _ = question(2371)
    path = minsnap.plan(**asked)
    assert path.cost((asked["degree"] + 1) // 2) + asked["search"].time_weight * path.duration <= 1e3


def test_limits_that_do_not_bind_change_nothing():
    for asked in ({"total_time": 30.0}, {"time_weight": 1.0}):
        free, path = (
            minsnap.plan(REFERENCE, corridor=0.3, **plan_arguments(asked | more)) for more in ({}, {"limits": LIMITS})
        )
        assert path.cost() == pytest.approx(free.cost(), rel=1e-6)


def test_a_moving_start_is_priced_too():
    start = {"velocity": (1.0, 0.3, 0.0)}
    path = minsnap.plan(REFERENCE, limits=LIMITS, corridor=0.5, start=start, search=minsnap.Search(time_weight=1e3))
    assert minsnap.certify(path, REFERENCE, corridor=0.5, limits=LIMITS).ok
    assert path(0.0, 1) == pytest.approx(start["velocity"])


@pytest.mark.parametrize("asked", ({}, {"degree": 5, "continuity": 1}))
def test_a_split_within_limits_ends_at_the_time_limit_with_the_plan_that_it_begins_with(asked):
    path = minsnap.plan(
        REFERENCE, corridor=0.3, limits=LIMITS, total_time=20.0, search=minsnap.Search(time_limit=1e-9), **asked
    )
    assert not path.report.steps
    check(path, LIMITS)


@pytest.mark.parametrize(("degree", "limits"), [(3, Limits(jerk=1.0)), (5, Limits(snap=1.0))])
def test_a_limit_on_a_derivative_that_jumps_limits_no_time(degree, limits):
    with pytest.raises(LimitError, match="nothing limits the time"):
        minsnap.plan(REFERENCE, degree=degree, pieces=3, limits=limits)


@pytest.mark.parametrize("total", [6.0, 10.0, 20.0])
def test_a_total_has_a_plan_where_nothing_limits_the_shortest_time(total):
    limits = Limits(snap=1.0)
    path = minsnap.plan(REFERENCE, degree=5, pieces=3, limits=limits, total_time=total)
    assert path.duration == pytest.approx(total, rel=1e-12) and minsnap.certify(path, REFERENCE, limits=limits).ok


@pytest.mark.slow
def test_a_total_along_the_velocity_is_searched_from_the_shortest_plan_first():
    """A search from about its price left that no work: its shortest plan was 68 % longer."""
    points = [(0.0, 0.0, 0.0), (0.1665, -1.2885, 0.2792), (1.3063, -0.8939, 0.6461), (4.3131, -1.3602, -0.023)]
    limits = Limits.of(Quadrotor.px4_sih(), speed=6.6, yaw_rate=0.95)
    asked = {"limits": limits, "corridor": 0.3, "yaw": "velocity", "pieces": 1}
    assert minsnap.plan(points, total_time=3.25, **asked).duration == pytest.approx(3.25, rel=1e-9)


def interrupted_at(step, points, **asked):
    """What Ctrl-C at a step of the search leaves."""
    steps = []

    def press(_):
        steps.append(1)
        if len(steps) == step:
            raise KeyboardInterrupt

    return minsnap.plan(points, progress=press, **asked), len(steps)


CORNER = [(0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (4.0, 4.0, 1.0)]


def test_an_interrupted_price_is_flown_within_the_limits():
    """Its plan without limits was refused by the last look, and searched anew."""
    search = minsnap.Search(time_weight=1e6, on_interrupt="return")
    path, steps = interrupted_at(1, CORNER, limits=Limits(speed=1.0, acceleration=2.0), search=search)
    assert path.report.interrupted and steps < 10
    assert minsnap.certify(path, CORNER, limits=Limits(speed=1.0, acceleration=2.0)).ok


@pytest.mark.parametrize("pieces", [1, "auto"])
def test_an_interrupted_total_says_so(pieces):
    """It said that the shortest found was longer, and began again with other pieces."""
    limits, search = Limits(speed=3.0, acceleration=6.0, tilt=0.5), minsnap.Search(on_interrupt="return")
    with pytest.raises(LateError, match="interrupted"):
        interrupted_at(12, CORNER, limits=limits, total_time=3.4245, pieces=pieces, search=search)
    with pytest.raises(LateError, match="time_limit"):
        minsnap.plan(CORNER, limits=limits, total_time=3.4245, pieces=pieces, search=minsnap.Search(time_limit=1e-3))
