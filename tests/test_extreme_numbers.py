"""Extreme numbers and kinds that are no numbers: a plan whose certificate is proved, or one sentence."""

import re
from itertools import product

import numpy as np
import pytest

import minsnap
from minsnap.errors import InfeasibleError, IntervalError, MinsnapError, TimingError, WaypointError
from minsnap.planning.request import plan_arguments

P = np.array([(0.0, 0.0, 1.0), (4.0, 0.0, 1.0), (4.0, 3.0, 1.5)])
T = [2.0, 2.0]
LIMITS = minsnap.Limits(speed=10.0, acceleration=30.0)
SIZES = (0.0, -0.0, 5e-324, 1e-300, 1e-39, 1e-12, 1e9, 1e20, 1e39, 1e100, 1e154, 1.7e308, np.nan, np.inf, -np.inf)
KINDS = (
    *(True, "x", None, 1j, 10**400, 10**5000, np.float16(1.5), np.float32(3e38), np.longdouble("1e4000")),
    *(np.int8(-128), np.uint8(255), np.complex128(1.0), np.array(2.0), np.array([2.0]), np.array([]), np.array(None)),
    np.timedelta64(1),
    *(np.ma.array(2.0, mask=True), np.array(2.0, ">f8"), object(), {}, [None], np.zeros((3, 3))),
)

QUESTIONS = {
    "coordinate": lambda v: {"waypoints": [(0, 0, 1), (v, 0, 1), (4, 3, 1.5)]},
    "coordinate in a tube": lambda v: {"waypoints": [(0, 0, 1), (v, 0, 1), (4, 3, 1.5)], "corridor": 0.3},
    "coordinate, split": lambda v: {
        "waypoints": [(0, 0, 1), (4, 0, 1), (4, v, 1)],
        "durations": None,
        "total_time": 4.0,
    },
    "duration": lambda v: {"durations": [v, 2.0]},
    "duration in a tube": lambda v: {"durations": [v, 2.0], "corridor": 0.3, "degree": 11},
    "duration within limits": lambda v: {"durations": [v, 2.0], "limits": LIMITS},
    "total": lambda v: {"durations": None, "total_time": v},
    "total in a tube": lambda v: {"durations": None, "total_time": v, "corridor": 0.3},
    "price of time": lambda v: {"durations": None, "time_weight": v},
    "half-width": lambda v: {"corridor": v},
    "half-width of a leg": lambda v: {"corridor": [v, 0.3]},
    "radius": lambda v: {"corridor": minsnap.RoundTube([v, 0.4])},
    "tolerance": lambda v: {"waypoint_tolerance": v, "corridor": 0.3},
    "ball": lambda v: {"waypoint_tolerance": minsnap.Ball(v)},
    "velocity": lambda v: {"start": {"velocity": (v, 0, 0)}, "corridor": 0.3},
    "acceleration": lambda v: {"end": {"acceleration": (0, v, 0)}, "degree": 11},
    "room": lambda v: {"room": ((-9, -9, -9), (9, 9, v))},
    "yaw": lambda v: {"yaw": v},
    "yaw function": lambda v: {"yaw": lambda t: v},
    "speed limit": lambda v: {"limits": minsnap.Limits(speed=v)},
    "vertical limit": lambda v: {"limits": minsnap.Limits(vertical_speed=v)},
}


def answer(asked):
    """Plan; a refusal is one sentence, and a plan has finite figures and a certificate that is proved."""
    question = {"waypoints": P, "durations": T} | asked
    try:
        curve = minsnap.plan(**plan_arguments(question))
    except MinsnapError as refused:
        text = str(refused)
        assert 10 < len(text) <= 1000 and "\n" not in text
        assert not re.search(r"0x[0-9a-f]{6}|np\.(float|int|longdouble)", text)
        return None
    tolerance = question.get("waypoint_tolerance")
    given = question["waypoints"], question.get("corridor"), question.get("limits")
    proved = minsnap.certify(curve, *given, tolerance=0.0 if tolerance is None else tolerance)
    assert proved.ok and proved.verify()
    assert np.isfinite([curve.cost(), curve.report.cost, proved.max_speed, proved.max_snap]).all()
    return curve


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::minsnap.errors.MagnitudeWarning", "ignore:.*converting a masked element")
@pytest.mark.parametrize("name", QUESTIONS)
def test_a_number_of_any_size_and_kind_ends_in_a_proved_plan_or_a_sentence(name):
    for value in (*SIZES, *KINDS):
        try:
            asked = QUESTIONS[name](value)
        except MinsnapError:
            continue
        answer(asked)


@pytest.mark.slow
@pytest.mark.parametrize("degree", [7, 11])
@pytest.mark.parametrize("asked", [{}, {"corridor": 0.3}, {"pieces": 2, "corridor": 0.3}])
def test_durations_at_both_ends_of_the_range_side_by_side(degree, asked):
    for durations in ([1e-12, 1e9], [1e9, 1e-12], [1e-12, 1e-12], [1e9, 1e9]):
        assert answer({"durations": durations, "degree": degree, **asked}) is not None


@pytest.mark.parametrize("duration", [9e-13, 1e-320, 1.1e9, 1e60, 1e300])
def test_a_time_beyond_the_range_is_named(duration):
    for asked in ({}, {"corridor": 0.3}, {"limits": LIMITS}):
        with pytest.raises(TimingError, match="the duration of leg 1 is .* s: it must be .*from 1e-12 to 1e9 s"):
            minsnap.plan(P, durations=[2.0, duration], **asked)
        with pytest.raises(TimingError, match="total_time is .*: it must be positive, from 1e-12 to 1e9 s"):
            minsnap.plan(P, total_time=duration, **asked)
    many = minsnap.plan_many([P, P], [T, [2.0, duration]])
    assert many.errors[0] is None and "the duration of leg 1 is" in str(many.errors[1])
    flown = minsnap.plan(P, T)
    with pytest.raises(TimingError, match="from 1e-12 to 1e9 s"):
        minsnap.replan(flown, 0.5, P[1:], 0.1, durations=[1.0, duration])
    with pytest.raises(TimingError, match="from 1e-12 to 1e9 s"):
        minsnap.replan(flown, 0.5, P[1:], 0.1, total_time=duration)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("duration", "asked"),
    [*product([1e-12, 1e-9, 1e-7, 1e-5], [{}, {"corridor": 0.3}]), (1e-9, {"degree": 11, "pieces": 2})],
)
def test_a_leg_too_short_for_its_speed_is_proved_to_be_and_nothing_is_printed(duration, asked, capfd):
    for limits in (minsnap.Limits(speed=10.0), minsnap.Limits(speed=10.0, vertical_speed=2.0, snap=1e3)):
        with pytest.raises(InfeasibleError) as refused:
            minsnap.plan(P, durations=[duration, 2.0], limits=limits, **asked)
        assert refused.type is InfeasibleError and refused.value.verify()
    with pytest.raises(MinsnapError):
        minsnap.plan(P, durations=[duration, 2.0], limits=minsnap.Limits(snap=1e3), **asked)
    assert capfd.readouterr() == ("", "")


def test_what_masked_arrays_hide_is_not_taken():
    hidden = np.ma.array(P, mask=[[False] * 3, [True, False, False], [False] * 3])
    with pytest.raises(WaypointError, match="waypoint 1 is "):
        minsnap.plan(hidden, T)


@pytest.mark.parametrize("change", [np.asfortranarray, lambda a: a.astype(">f8"), lambda a: a.astype(object)])
def test_other_layouts_of_the_same_numbers_give_the_same_plan(change):
    usual = minsnap.plan(P, T, corridor=0.3)
    other = minsnap.plan(change(P), change(np.array(T)), corridor=change(np.array([0.3, 0.3])))
    assert (usual.control_points == other.control_points).all()


def test_a_trajectory_refuses_durations_that_no_figure_bears():
    for duration in (1e-320, 1e-19, 1e19, np.nan):
        with pytest.raises(TimingError, match="durations must be positive and finite, from 1e-18 to 1e\\+18 s"):
            minsnap.Trajectory(np.zeros((1, 8, 3)), [duration])


def test_a_cut_within_rounding_of_a_knot_leaves_out_the_rest_of_that_piece():
    curve = minsnap.plan(P, T)
    assert curve.between(np.nextafter(2.0, 0.0), 3.0).durations.tolist() == [1.0]
    assert len(curve.between(1.0, np.nextafter(2.0, 3.0)).durations) == 1


@pytest.mark.parametrize("yaw", [0.3, "velocity", "tilt", minsnap.LookAt((9.0, 9.0))])
def test_instants_that_are_no_numbers(yaw):
    curve = minsnap.plan(P, T, yaw=yaw)
    for instant in ("soon", 1j, 10**400, {}, [[1.0], [1.0, 2.0]], object()):
        for ask in (curve, curve.yaw):
            with pytest.raises(IntervalError, match="give numbers of seconds"):
                ask(instant)
    for order in (10**400, 2**70):
        assert not curve(1.0, order).any() and not curve.derivative(order)(1.0).any()
        assert curve.max_norm(order)[0] == 0.0


@pytest.mark.parametrize("size", [5e-324, 1e-310, 1e-200, 1e-120])
@pytest.mark.parametrize("duration", [1e-12, 1.0, 1e9])
def test_norms_that_underflow_are_bounded_still(size, duration):
    assert minsnap.certify(minsnap.plan(P * size, [duration, duration])).verify()


HELD = minsnap.plan(P, T, corridor=0.3)
REFUSED = {
    "pieces of none": (lambda: minsnap.Trajectory(np.zeros((3, 8, 3)), [1, 1, 1], pieces=0), "no whole number of legs"),
    "half a piece": (lambda: minsnap.Trajectory(np.zeros((3, 8, 3)), [1, 1, 1], pieces=1.5), "no whole number of legs"),
    "far points": (lambda: minsnap.Trajectory(np.full((1, 8, 3), 1e151), [1]), "at most 1e\\+150 in size"),
    "degree": (lambda: HELD.elevated(9.5), "the degree is 9.5"),
    "tolerance of a length": (lambda: HELD.arc_length(0.0), "the tolerance of a length is 0.0"),
    "interval": (lambda: HELD.between("now", 1.0), "is not an interval"),
    "stretch": (lambda: HELD.stretched(1e300), "positive factor"),
    "limits of a certificate": (lambda: minsnap.certify(HELD, limits=3.0), "limits must be a Limits, not float"),
    "limits of a shape": (lambda: minsnap.circle(limits=3.0), "limits must be a Limits, not float"),
    "limits of no vehicle": (lambda: minsnap.Limits.of(3.0), "takes a Quadrotor, not float"),
    "direction": (lambda: minsnap.circle(clockwise=np.zeros(2)), "clockwise is .*: it is True or False"),
    "yaw of a shape": (lambda: minsnap.circle(yaw=np.zeros(2)), "the yaw is .*: it must be an angle"),
    "laps": (lambda: minsnap.rectangle(laps=10**20), "the number of laps is 1000.*: it must be a whole number from 1"),
    "legs": (lambda: minsnap.HalfSpaces([(1, 0, 0)], [9], legs=0.5), "the legs of half-spaces are 0.5"),
    "order": (lambda: minsnap.HalfSpaces([(1, 0, 0)], [9], order=1.0), "the order of half-spaces is 1.0"),
    "faint normal": (lambda: minsnap.HalfSpaces([(1e-200, 0, 0)], [9]), "has a normal of zeros"),
    "small gate": (lambda: minsnap.Gate((4, 4, 1), (1, 0, 0), 1e-30, 1.0), "it is too small"),
    "gradients": (lambda: minsnap.plan_many([P], [T], gradients=np.zeros(2)), "gradients is .*: it is True or False"),
    "states": (
        lambda: minsnap.plan_many([P], [T], start={"velocity": 10**400}),
        "the velocity of start must be numbers",
    ),
    "pieces": (lambda: minsnap.plan(P, T, pieces=10**6), "at most 1000"),
    "samples": (lambda: minsnap.plan(P, T, corridor=minsnap.Sampled(1, 10**9)), "at most 100000"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_other_entry_points_refuse_in_a_sentence(name):
    ask, says = REFUSED[name]
    with pytest.raises(MinsnapError, match=says) as refused:
        ask()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("apart", [5e-324, 1e-300, 1e-160])
def test_a_waypoint_error_that_underflows_is_bounded_still(apart):
    found = minsnap.certify(HELD, P + [(0.0, 0.0, 0.0), (0.0, apart, 0.0), (0.0, 0.0, 0.0)])
    assert found.waypoint_error >= apart and found.verify()


@pytest.mark.parametrize("goal", [1e9, 1e20, 1e39])
def test_a_goal_at_any_distance_is_replanned_or_refused(goal):
    replanner = minsnap.Replanner(minsnap.Limits(speed=6.0, acceleration=20.0), clock=lambda: 0.0)
    try:
        change = replanner.replan(HELD, 0.5, [(goal, 0.0, 1.0), (4.0, 3.0, 1.5)], 0.5)
    except MinsnapError:
        return
    assert np.isfinite(change.trajectory.control_points).all()


@pytest.mark.parametrize("speed", [1e6, 1e12, 1e39])
def test_a_start_far_beyond_its_limits_is_refused(speed):
    with pytest.raises(MinsnapError):
        minsnap.plan(P, limits=minsnap.Limits(speed=3.0, acceleration=5.0), start={"velocity": (speed, 0.0, 0.0)})
