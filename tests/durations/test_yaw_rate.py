"""A limit on the rate of a yaw is a row of the search, which knows how a yaw through angles depends on all legs."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

import minsnap
from minsnap import Limits, LookAt, Search
from minsnap.errors import LimitError, UnprovedError
from minsnap.native.library import core

pytestmark = pytest.mark.skipif(core().name != "native", reason="needs the native core")

CORNER = [(0.0, 0.0, 1.0), (4.0, 0.0, 1.0), (4.0, 3.0, 1.0), (1.0, 5.0, 1.5)]
ANGLES = [0.0, 1.0, 3.0, 2.0]
LIMITS = Limits(speed=3.0, acceleration=6.0, jerk=40.0, yaw_rate=1.0)


def largest_rate(durations):
    """Return the largest rate of the clamped spline through the angles, at its knots and where it is stationary."""
    spline = CubicSpline(np.concatenate(([0.0], np.cumsum(durations))), ANGLES, bc_type="clamped")
    turning = spline.derivative(2).roots(extrapolate=False)
    return np.abs(spline(np.concatenate((spline.x, turning[np.isfinite(turning)])), 1)).max()


def least_total(limit):
    """Return the least total of durations within a limit on that rate, by the downhill simplex from many shares."""

    def total(logarithms):
        durations = np.exp(np.append(logarithms, 0.0))
        return durations.sum() * largest_rate(durations) / limit

    starts = [np.zeros(2), *np.random.default_rng(3).normal(size=(12, 2))]
    options = {"xatol": 1e-7, "fatol": 1e-9}
    return min(minimize(total, start, method="Nelder-Mead", options=options).fun for start in starts)


@pytest.mark.parametrize("limit", [0.4, 1.0])
@pytest.mark.parametrize("pieces", [1, 3, "auto"])
def test_turns_alone_take_the_least_time_of_their_spline(limit, pieces):
    plan = minsnap.plan(CORNER, limits=Limits(yaw_rate=limit), yaw=ANGLES, pieces=pieces)
    assert least_total(limit) * (1.0 - 1e-6) < plan.duration < least_total(limit) * 1.001


@pytest.mark.parametrize("pieces", [1, 2, 3, "auto"])
@pytest.mark.parametrize("start", [None, {"velocity": (1.0, 0.5, 0.0)}])
def test_a_search_ends_at_the_limit_with_any_number_of_pieces(pieces, start):
    plan = minsnap.plan(CORNER, limits=LIMITS, yaw=ANGLES, pieces=pieces, start=start)
    used = {used.name: used.fraction for used in plan.report.utilisation}
    assert used["yaw_rate"] == pytest.approx(1.0, abs=1e-3)
    assert plan.duration < 1.002 * minsnap.plan(CORNER, limits=LIMITS, yaw=ANGLES, pieces=1, start=start).duration


@pytest.mark.parametrize("closed", [False, True])
def test_a_lap_or_many_legs_fly_no_longer_than_with_the_rate_kept_by_slower_flight(closed):
    """64 legs took 175 s where 85 do."""
    random = np.random.default_rng(64)
    points = np.cumsum(random.normal(size=(13, 3)) * [4, 4, 1], axis=0)
    angles = np.cumsum(random.uniform(-1.0, 1.0, size=13))
    if closed:
        points[-1], angles[-1] = points[0], angles[0]
    limits = Limits(speed=5.0, acceleration=8.0, yaw_rate=0.7)
    plan = minsnap.plan(points, limits=limits, yaw=angles, pieces=1, closed=closed)
    slowed = minsnap.plan(points, limits=limits, yaw=angles, closed=closed, search=Search(split="distance"))
    assert plan.duration < 0.9 * slowed.duration


def test_a_price_of_time_is_cheaper_than_the_shortest_plan():
    """Its search had no end, and returned the shortest plan: 1e5 times the cost."""
    points = [(0.0, 0.0, 1.0), (4.0, 0.0, 1.5), (4.0, 5.0, 1.0), (-1.0, 6.0, 1.0)]
    limits = Limits(speed=3.2, max_thrust=1.8, body_rate=4.0, yaw_rate=1.3)
    asked = {"limits": limits, "yaw": [-1.8, -1.4, 1.5, 0.2], "pieces": 3}
    shortest = minsnap.plan(points, **asked)
    priced = minsnap.plan(points, **asked, search=Search(time_weight=400.0))
    assert priced.cost() + 400.0 * priced.duration < 0.5 * (shortest.cost() + 400.0 * shortest.duration)
    total = minsnap.plan(points, total_time=round(1.2 * shortest.duration, 2), **asked)
    assert total.cost() < 0.5 * shortest.cost()


@pytest.mark.parametrize(
    ("yaw", "error", "sentence"),
    [
        (0.5, LimitError, "nothing limits the time"),
        ([0.5] * 4, LimitError, "nothing limits the time"),
        ("tilt", LimitError, "nothing limits the time"),
        (lambda t: 0.5 * t, LimitError, "nothing limits the time"),
        (lambda t: 2.0 * t, LimitError, "the yaw turns at 2 rad/s"),
    ],
)
def test_a_rate_that_no_time_depends_on_is_refused_in_a_sentence(yaw, error, sentence):
    """A function of time ended in a sentence about durations of 2e-19 s."""
    with pytest.raises(error, match=sentence):
        minsnap.plan(CORNER, limits=Limits(yaw_rate=1.0), yaw=yaw)


def test_a_total_too_short_for_the_turns_names_the_shortest():
    with pytest.raises(UnprovedError) as refused:
        minsnap.plan(CORNER, total_time=3.0, limits=Limits(yaw_rate=1.0), yaw=ANGLES)
    assert refused.value.shortest == pytest.approx(least_total(1.0), rel=1e-3)


@pytest.mark.parametrize("yaw", ["velocity", ANGLES])
def test_a_start_in_motion_is_planned_within_a_rate_alone(yaw):
    plan = minsnap.plan(CORNER, limits=Limits(yaw_rate=1.0), yaw=yaw, start={"velocity": (1.0, 0.0, 0.0)})
    assert minsnap.certify(plan, CORNER, limits=Limits(yaw_rate=1.0)).ok


@pytest.mark.parametrize("dim", [1, 2])
def test_a_yaw_in_fewer_dimensions_is_searched_as_in_space(dim):
    """The native search did not take the rate of a yaw there: 39.7 s where 17.9 do."""
    points = np.array([[0.0, 0.0, 1.0], [2.5, 0.0, 1.0], [3.2, 0.0, 1.0], [2.4, 0.0, 1.0], [8.7, 0.0, 1.0]])
    asked = {"limits": Limits(speed=3.2, acceleration=3.3, yaw_rate=0.54), "yaw": [0.86, 2.46, 2.18, -0.57, 0.98]}
    flat, space = (minsnap.plan(points[:, :axes], **asked) for axes in (dim, 3))
    assert flat.duration == pytest.approx(space.duration, rel=1e-3)


@pytest.mark.parametrize(
    ("points", "limits", "at", "start", "most"),
    [
        (
            [(0.83, 4.61, 0.31), (3.26, 6.2, 0.27), (2.9, 10.18, 1.2), (3.25, 13.5, 0.51), (7.68, 15.18, -0.49)],
            {"speed": 3.51, "acceleration": 8.76, "yaw_rate": 1.82},
            (3.35, 6.45),
            (-0.08, 1.28, 1.58),
            6.6,
        ),
        (
            [(-1.13, 1.6, -0.74), (-0.04, -0.92, -1.94), (-8.57, 3.81, -1.34), (-7.01, 8.68, -2.98)],
            {"speed": 3.37, "acceleration": 7.72, "jerk": 40.0, "yaw_rate": 1.147},
            (-12.47, -8.27),
            (2.05, -1.53, -0.84),
            7.5,
        ),
    ],
)
def test_a_view_from_motion_turns_the_short_way_round_its_point(points, limits, at, start, most):
    """Without a softer first search one flew 14.6 s where 6.7 do; a curve through the point ended another."""
    asked = {"yaw": LookAt(at), "start": {"velocity": start}, "pieces": 1}
    assert minsnap.plan(points, limits=Limits(**limits), **asked).duration < most


def test_rest_at_every_waypoint_is_taken_where_a_search_ends_at_a_longer_flight():
    """The search along the velocity ended at 3.25 s, and rest takes 1.27."""
    points = [(-3.6377, -0.7406, -0.9806), (-5.8628, 0.771, -0.5442), (-5.8899, 0.1718, -0.9441)]
    asked = {"limits": Limits(speed=4.0778, yaw_rate=2.4036), "yaw": "velocity", "pieces": 1, "degree": 3}
    assert minsnap.plan(points, corridor=0.92, **asked).duration < 1.3
