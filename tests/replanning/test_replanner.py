"""Changes in flight: continuity at the splice, nothing worse, nothing late, and a sentence for each refusal."""

import copy
import pickle
import threading
from itertools import count

import numpy as np
import pytest

import minsnap
from minsnap import Boxes, Limits, Replanner, Tube
from minsnap.basics.deadline import LateError
from minsnap.corridors import Walls
from minsnap.errors import (
    CorridorError,
    DegreeError,
    InputError,
    LimitError,
    SolverError,
    TimingError,
    WaypointError,
    YawError,
)
from minsnap.replanning import replanner as replanner_module
from minsnap.replanning.horizon import Better, search_ahead
from minsnap.replanning.splice import splice_of
from minsnap.vehicle import Quadrotor

POINTS = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2), (6, 1, 1), (8, 1, 1)], dtype=float)
LOWER, UPPER = np.minimum(POINTS[:-1], POINTS[1:]) - 0.5, np.maximum(POINTS[:-1], POINTS[1:]) + 0.5
BOXES = Boxes(LOWER, UPPER)
LIMITS = Limits(speed=3.0, acceleration=6.0)
START = {"velocity": (1.5, 0.2, 0), "acceleration": (0.5, 0, 0)}


def still():
    """Return a simulated clock that stands still while a plan is made."""
    return 100.0


AMPLE = {"began": 160.0}
"""The flight begins in a minute on that clock: a search has the time that it needs on a loaded machine."""


@pytest.fixture(scope="module")
def flown():
    return minsnap.plan(POINTS, limits=LIMITS, corridor=BOXES, start=START, pieces=1)


def ahead(flown, splice):
    passed = splice_of(flown, splice - 1e-3, 1e-3, 4).passed
    return passed, POINTS[passed + 1 :], Boxes(LOWER[passed:], UPPER[passed:])


def check_splice(change, flown):
    for curve in (change.trajectory, change.stop):
        for order in range(4):
            before = flown(min(change.splice, flown.duration), order)
            assert curve(0.0, order) == pytest.approx(before, abs=1e-8 * max(1.0, np.abs(before).max()))
        assert float(curve.yaw(0.0)) == pytest.approx(float(flown.yaw(min(change.splice, flown.duration))), abs=1e-9)


def check_certified(change, points, boxes):
    whole = np.concatenate((change.trajectory(0.0)[None], points))
    certificate = minsnap.certify(change.trajectory, whole, boxes, LIMITS, limits_from=change.limits_from)
    assert certificate.ok, certificate
    assert minsnap.certify(change.stop, limits=LIMITS).ok


def test_a_replanner_is_copied_and_sent_between_processes(flown):
    asked = Replanner(limits=LIMITS)
    asked.replan(flown, 0.1, POINTS[1:])
    for same in (copy.deepcopy(asked), pickle.loads(pickle.dumps(asked))):
        change = same.replan(flown, 0.1, POINTS[1:])
        assert change.trajectory(0.0) == pytest.approx(flown(change.splice)) and same.limits == asked.limits


@pytest.mark.parametrize("now", [0.0, 0.35, 0.9, 1.4, 2.0, 2.6, 3.2])
def test_with_nothing_changed_the_rest_of_the_plan_comes_back(flown, now):
    passed, points, boxes = ahead(flown, now + 0.05)
    change = minsnap.replan(flown, now, points, 0.05, limits=LIMITS, corridor=boxes, clock=still)
    assert change.kept and change.certified and change.reason == "nothing has changed"
    assert (change.splice, change.legs) == (pytest.approx(now + 0.05), passed)
    t = np.linspace(0.0, change.trajectory.duration, 200)
    assert change.trajectory(t) == pytest.approx(flown(np.minimum(change.splice + t, flown.duration)), abs=1e-6)
    check_splice(change, flown)
    check_certified(change, points, boxes)


@pytest.mark.parametrize("now", [0.0, 0.6, 1.3, 2.2])
def test_moved_waypoints_are_passed_from_the_state_at_the_splice(flown, now):
    passed, points, boxes = ahead(flown, now + 0.05)
    moved = points + np.where(np.arange(len(points)) == len(points) - 1, 0.2, 0.0)[:, None]
    change = Replanner(LIMITS, boxes, clock=still).replan(flown, now, moved, 0.05, **AMPLE)
    check_splice(change, flown)
    assert change.certified and not change.kept, change.reason
    check_certified(change, moved, boxes)
    assert change.trajectory(change.trajectory.duration) == pytest.approx(moved[-1], abs=1e-9)


def test_larger_limits_give_a_shorter_plan_and_never_a_longer_one(flown):
    faster = Limits(speed=4.0, acceleration=9.0)
    _, points, boxes = ahead(flown, 0.6)
    change = minsnap.replan(flown, 0.1, points, 0.5, limits=faster, corridor=boxes, clock=still, **AMPLE)
    assert not change.kept
    assert change.trajectory.duration < flown.duration - change.splice
    assert minsnap.certify(change.trajectory, np.vstack((change.trajectory(0.0), points)), boxes, faster).ok


def test_what_is_found_is_taken_only_if_it_is_better_than_the_rest(flown, monkeypatch):
    _, points, boxes = ahead(flown, 0.6)
    rest, faster = splice_of(flown, 0.1, 0.5, 4).rest, Limits(speed=4.0, acceleration=9.0)
    for factor, kept in ((1.01, True), (1.0, True), (0.99, False)):
        curve = minsnap.Trajectory(rest.control_points, factor * rest.durations, rest.yaw)
        monkeypatch.setattr(replanner_module.horizon, "search_ahead", lambda *_, found=curve: Better(found))
        change = Replanner(faster, boxes, clock=still).replan(flown, 0.1, points, 0.5, **AMPLE)
        assert change.kept is kept
        assert change.reason == ("nothing better was found" if kept else "")


def found_late(*_):
    raise LateError("time_limit has passed")


def test_a_search_that_is_out_of_time_says_so_by_the_budget(flown, monkeypatch):
    _, points, boxes = ahead(flown, 0.6)
    monkeypatch.setattr(replanner_module.horizon, "search_ahead", found_late)
    change = Replanner(Limits(speed=4.0, acceleration=9.0), boxes, clock=still).replan(flown, 0.1, points, 0.5, **AMPLE)
    assert change.kept
    assert change.reason == "the budget of 0.5 s was over before anything better was found"


def found_none(*_):
    raise SolverError("none")


def test_a_rest_that_leaves_the_walls_as_they_are_now_is_not_certified(flown, monkeypatch):
    monkeypatch.setattr(replanner_module.horizon, "search_ahead", found_none)
    passed, points, boxes = ahead(flown, 0.5)
    t = np.linspace(flown.leg_breaks[-2], flown.duration, 500)
    aside = np.abs(flown(t)[:, 1] - 1.0).max()
    for share, certified in ((1.01, True), (0.99, False)):
        lower, upper = boxes.lower.copy(), boxes.upper.copy()
        lower[-1, 1], upper[-1, 1] = 1.0 - share * aside, 1.0 + share * aside
        change = Replanner(LIMITS, Boxes(lower, upper), clock=still).replan(flown, 0.1, points, 0.4, **AMPLE)
        assert change.kept and change.certified is certified and change.stop is not None


def test_given_durations_and_totals_are_split_for_the_least_cost():
    flown = minsnap.plan(POINTS, durations=[1.0, 1.1, 1.0, 0.9], corridor=BOXES, start=START)
    passed, points, boxes = ahead(flown, 0.4)
    rest = splice_of(flown, 0.38, 0.02, 4).rest
    same = minsnap.replan(flown, 0.38, points, durations=rest.durations, corridor=boxes, clock=still)
    assert same.kept
    slower = minsnap.replan(flown, 0.38, points, durations=rest.durations * 1.3, corridor=boxes, clock=still)
    assert not slower.kept and slower.trajectory.durations == pytest.approx(rest.durations * 1.3)
    split = minsnap.replan(flown, 0.38, points, total_time=rest.duration, corridor=boxes, clock=still)
    assert not split.kept and split.trajectory.duration == pytest.approx(rest.duration)
    assert split.trajectory.cost() < rest.cost()
    for change in (same, slower, split):
        check_splice(change, flown)


def test_boxes_instead_of_waypoints():
    flown = minsnap.plan(
        None, limits=LIMITS, corridor=BOXES, start={"position": POINTS[0], **START}, end={"position": POINTS[-1]}
    )
    change = minsnap.replan(flown, 0.3, budget=0.1, boxes=BOXES, limits=LIMITS, clock=still)
    assert change.kept and change.certified
    goal = POINTS[-1] + [-0.5, 0.2, 0.1]
    change = minsnap.replan(flown, 0.0, budget=0.4, boxes=BOXES, goal=goal, limits=LIMITS, clock=still)
    check_splice(change, flown)
    if not change.kept:
        assert change.trajectory(change.trajectory.duration) == pytest.approx(goal)


def test_a_tube_runs_along_the_legs_of_the_course_also_after_a_replan(flown):
    tubed = minsnap.plan(POINTS, limits=LIMITS, corridor=0.3, pieces=1)
    replanner = Replanner(LIMITS, 0.3, clock=still)
    now, current = 0.1, tubed
    for _ in range(5):
        change = replanner.replan(current, now, POINTS[1:], 0.05)
        assert change.kept and change.certified
        current, now = change.trajectory, 0.05
    assert current(0.2) == pytest.approx(tubed(0.15 + 4 * 0.1 + 0.2), abs=1e-6)


def test_a_horizon_plans_the_first_legs_and_keeps_the_others(flown):
    _, points, boxes = ahead(flown, 0.5)
    wider = Boxes(boxes.lower - 0.1, boxes.upper + 0.1)
    replanner = Replanner(LIMITS, boxes, horizon=2, clock=still)
    replanner.replan(flown, 0.0, points, 0.05)
    change = Replanner(Limits(speed=4.0, acceleration=9.0), wider, horizon=2, clock=still).replan(
        flown, 0.1, points, 0.4
    )
    check_splice(change, flown)
    if not change.kept:
        t = np.linspace(0.0, flown.duration - flown.leg_breaks[2], 50)
        begin = change.trajectory.leg_breaks[2]
        assert change.trajectory(np.minimum(begin + t, change.trajectory.duration)) == pytest.approx(
            flown(np.minimum(flown.leg_breaks[2] + t, flown.duration)), abs=1e-6
        )


def test_where_the_flown_plan_exceeds_the_limits_beyond_the_horizon_the_plan_rests_there(flown):
    _, points, boxes = ahead(flown, 0.3)
    slower = Limits(speed=2.4, acceleration=6.0)
    change = Replanner(slower, boxes, horizon=2, clock=still).replan(flown, 0.1, points, 0.2, **AMPLE)
    assert not change.kept and change.trajectory.legs == 2, change.reason
    assert minsnap.certify(change.trajectory, limits=slower, limits_from=change.limits_from).ok


def test_where_the_course_beyond_the_horizon_changes_the_plan_rests_there(flown):
    _, points, boxes = ahead(flown, 0.5)
    points = points.copy()
    points[-1] += [0.3, 0.0, 0.0]
    change = Replanner(LIMITS, boxes, horizon=2, clock=still).replan(flown, 0.1, points, 0.4, **AMPLE)
    assert not change.kept
    assert change.trajectory.legs == 2
    assert change.trajectory(change.trajectory.duration) == pytest.approx(points[1])
    check_splice(change, flown)


def test_what_is_late_is_not_flown(flown):
    _, points, boxes = ahead(flown, 0.5)
    ticks = count()
    change = Replanner(LIMITS, boxes, clock=lambda: 10.0 * next(ticks)).replan(flown, 0.1, points + 0.01, 0.4)
    assert change.kept and change.certified
    assert "no time to search" in change.reason
    assert change.stop is change.trajectory
    assert change.took > 0.4 and change.late == pytest.approx(change.took + 10.0 - 0.4)  # one tick later
    slower = Limits(speed=2.0, acceleration=6.0)
    with pytest.raises(TimingError, match=r"the budget of 0.4 s was over before a stop plan was found: replan again"):
        Replanner(slower, boxes, clock=lambda: 10.0 * next(ticks)).replan(flown, 0.1, points, 0.4)
    with pytest.raises(TimingError, match=r"the splice at 0.5 s of the flown plan passed 0.25 s ago: replan earlier"):
        Replanner(LIMITS, boxes, clock=lambda: 50.75).replan(flown, 0.1, points, 0.4, began=50.0)


def test_after_its_stop_it_goes_on_from_hover(flown):
    passed, points, boxes = ahead(flown, 0.9)
    replanner = Replanner(LIMITS, boxes, clock=still)
    stop = replanner.replan(flown, 0.5, points, 0.4, **AMPLE).stop
    goes_on = replanner.replan(stop, stop.duration + 7.0, points, 0.4, **AMPLE)
    assert goes_on.late == 0.0 and not goes_on.kept
    assert goes_on.trajectory(0.0) == pytest.approx(stop(stop.duration), abs=1e-9)
    check_splice(goes_on, stop)
    check_certified(goes_on, points, boxes)


def test_the_clock_of_the_flight_says_when_the_answer_is_due(flown):
    _, points, boxes = ahead(flown, 0.5)
    change = Replanner(LIMITS, boxes, clock=lambda: 50.2).replan(flown, 0.1, points, 0.4, began=50.0)
    assert change.kept and change.splice == 0.5


def test_the_time_at_which_the_flight_began_is_a_number(flown):
    _, points, boxes = ahead(flown, 0.5)
    for began in ("now", np.nan):
        with pytest.raises(InputError, match="began is .*: give a number of seconds"):
            Replanner(LIMITS, boxes).replan(flown, 0.1, points, 0.4, began=began)


def test_budgets_below_what_a_stop_takes_are_refused(flown):
    _, points, boxes = ahead(flown, 0.5)
    with pytest.raises(TimingError, match=r"the budget is 1e-06 s and a stop plan takes \S+ s here: give at least"):
        Replanner(LIMITS, boxes).replan(flown, 0.1, points, 1e-6)


def test_a_start_outside_its_box_says_by_how_much_and_flies_back_where_that_is_allowed(flown):
    lower = LOWER.copy()
    lower[0, 2] = flown(0.2)[2] + 0.05
    shifted, points = Boxes(lower, UPPER), POINTS[1:] + np.array([0.0, 0.0, 0.2])
    options = {"limits": LIMITS, "corridor": shifted, "clock": still}
    with pytest.raises(CorridorError, match="the start is 0.05 m outside the box of leg 0: .* recover=0.05") as refused:
        minsnap.replan(flown, 0.1, points, 0.1, **options)
    assert (refused.value.leg, refused.value.waypoint) == (0, 0)
    change = Replanner(**options, recover=0.1).replan(flown, 0.0, points, 0.2, **AMPLE)
    assert not change.kept, change.reason
    assert 0.0 < change.inside_from < 0.6
    t = np.linspace(change.inside_from, change.trajectory.leg_breaks[1], 500)
    assert change.trajectory(t)[:, 2].min() >= lower[0, 2] - 1e-9
    assert change.trajectory(0.0, 1) == pytest.approx(flown(0.2, 1), abs=1e-8)


@pytest.mark.parametrize("outside", [0.0444, 0.0526])
def test_the_way_back_that_a_refusal_names_is_long_enough(flown, outside):
    lower = LOWER.copy()
    lower[0, 2] = flown(0.2)[2] + outside
    options = {"limits": LIMITS, "corridor": Boxes(lower, UPPER), "clock": still}
    points = POINTS[1:] + np.array([0.0, 0.0, 0.2])
    with pytest.raises(CorridorError) as refused:
        minsnap.replan(flown, 0.1, points, 0.1, **options)
    named = float(str(refused.value).split("recover=")[1].split()[0])
    assert outside < named < 1.02 * outside
    assert not Replanner(**options, recover=named).replan(flown, 0.0, points, 0.2, **AMPLE).kept


def test_a_goal_outside_its_box_and_boxes_that_do_not_meet_are_refused(flown):
    _, points, boxes = ahead(flown, 0.5)
    behind = points.copy()
    behind[-1] = (8.0, 5.0, 1.0)
    with pytest.raises(CorridorError, match="3.5 m outside the box of leg 3") as refused:
        minsnap.replan(flown, 0.1, behind, 0.4, limits=LIMITS, corridor=boxes)
    assert refused.value.waypoint == 4
    with pytest.raises(CorridorError, match="do not overlap"):
        Boxes([(0, 0, 0), (2, 0, 0)], [(1, 1, 1), (3, 1, 1)])


def test_two_threads_are_refused(flown):
    _, points, boxes = ahead(flown, 0.5)
    inside, leave = threading.Event(), threading.Event()

    def clock():
        inside.set()
        leave.wait(120.0)
        return 0.0

    replanner = Replanner(LIMITS, boxes, clock=clock)
    other = threading.Thread(target=replanner.replan, args=(flown, 0.1, points, 0.4))
    other.start()
    try:
        assert inside.wait(120.0)
        with pytest.raises(InputError, match="at work for another thread"):
            replanner.replan(flown, 0.1, points, 0.4)
    finally:
        leave.set()
        other.join()


def test_a_vehicle_at_its_goal_flies_on(flown):
    change = minsnap.replan(
        flown, flown.duration, [(8.0, 2.0, 1.0)], 0.5, limits=LIMITS, corridor=0.5, clock=still, **AMPLE
    )
    assert not change.kept
    assert change.trajectory(0.0) == pytest.approx(POINTS[-1], abs=1e-9)
    assert change.stop.duration < 0.5


def test_a_vehicle_brings_the_limits_of_its_rotors(flown):
    slow = minsnap.plan(POINTS, durations=[3.0, 3.0, 3.0, 3.0])
    change = minsnap.replan(
        slow,
        0.5,
        POINTS[1:],
        1.0,
        limits=LIMITS,
        vehicle=Quadrotor.dji_f330(),
        room=((-9, -9, 0), (9, 9, 3)),
        clock=still,
    )
    own = Replanner(Limits.of(Quadrotor.dji_f330(), reserve=0.5), vehicle=Quadrotor.dji_f330()).limits
    assert own == Limits.of(Quadrotor.dji_f330(), reserve=0.5), "rotors were used to 90 % again"
    by_axis = Replanner(Limits(speed=2.0, norm="axis"), vehicle=Quadrotor.dji_f330())
    assert by_axis.limits.norm == "axis" and "max_thrust" in by_axis.limits.given()
    assert {used.name for used in Limits.of(Quadrotor.dji_f330()).utilisation(change.stop)} >= {"rotor_thrust"}
    check_splice(change, slow)


@pytest.mark.parametrize(
    ("options", "error", "sentence"),
    [
        ({"degree": 5}, DegreeError, "degree 5 cannot take over the jerk at a splice: use 7, 9 or 11"),
        ({"recover": -1.0}, InputError, "recover is -1.0: give a distance of 0 or more"),
        ({"horizon": 0}, InputError, "horizon is 0: give a number of legs, 1 or more"),
        ({"yaw": [0.0, 1.0]}, YawError, "give an angle"),
        ({"limits": 3.0}, LimitError, "limits must be a Limits, not float"),
    ],
)
def test_malformed_options_are_refused(options, error, sentence):
    with pytest.raises(error, match=sentence):
        Replanner(**options)


def test_malformed_calls_are_refused(flown):
    with pytest.raises(TimingError, match="nothing says how fast to fly: give limits"):
        minsnap.replan(flown, 0.1, POINTS[1:])
    with pytest.raises(WaypointError, match=r"the waypoints ahead have shape \(1, 2\)"):
        minsnap.replan(flown, 0.1, [(1.0, 2.0)], limits=LIMITS)
    with pytest.raises(WaypointError, match="leave out waypoints that have been passed"):
        minsnap.replan(flown, 0.1, [flown(0.1 + 0.02), POINTS[1]], limits=LIMITS)
    with pytest.raises(InputError, match="now is None"):
        minsnap.replan(flown, None, POINTS[1:], limits=LIMITS)


def test_tubes_of_several_widths_go_with_the_legs_ahead():
    tubed = minsnap.plan(POINTS, limits=LIMITS, corridor=[0.3, 0.4, 0.5, 0.6], pieces=1)
    change = minsnap.replan(
        tubed, 0.2, POINTS[1:], 0.1, limits=LIMITS, corridor=Tube([0.3, 0.4, 0.5, 0.6]), clock=still
    )
    assert change.kept and change.certified


def test_many_replans_of_the_same_plan_neither_drift_nor_grow():
    """80 cuts of 40 ms: the rest is still the plan, to the rounding of one cut, with a heading of one step."""
    flown = minsnap.plan(POINTS, limits=LIMITS, corridor=BOXES, start=START, yaw=[0.0, 0.3, 0.1, -0.4, 0.2], pieces=1)
    replanner = Replanner(LIMITS, clock=still)
    current, now = flown, 0.0
    for _ in range(80):
        passed = splice_of(flown, now, 0.04, 4).passed
        boxes = Boxes(LOWER[passed:], UPPER[passed:])
        change = replanner.replan(current, 0.0, POINTS[passed + 1 :], 0.04, boxes=boxes)
        assert change.kept and change.certified
        current, now = change.trajectory, now + 0.04
    t = np.linspace(0.0, current.duration, 50)
    inside = np.minimum(now + t, flown.duration)
    assert current(t) == pytest.approx(flown(inside), abs=1e-11)
    assert current.yaw(t) == pytest.approx(flown.yaw(inside), abs=1e-11)


def test_walls_that_a_plan_does_not_touch_may_shift_for_a_while_without_a_search(monkeypatch):
    """Once a search has found nothing better, until a wall comes near or a share of the flight has passed."""
    points, limits = np.array([(0.0, 0, 1), (4, 0, 1), (8, 1, 1), (12, 0, 1)]), Limits(speed=3.0, acceleration=6.0)
    searches, shifts = [], count()
    monkeypatch.setattr(replanner_module.horizon, "search_ahead", lambda *a: (searches.append(1), search_ahead(*a))[1])
    replanner, flown = Replanner(limits, clearance=0.1, clock=still), minsnap.plan(points, limits=limits, pieces=1)
    lower, upper = np.minimum(points[:-1], points[1:]), np.maximum(points[:-1], points[1:])

    def next_replan(flown, wide=2.0):
        searches.clear()
        wide += 1e-3 * (next(shifts) % 7)
        change = replanner.replan(flown, 0.0, points[1:], 0.01, boxes=Boxes(lower - wide, upper + wide), began=160.0)
        assert change.certified
        return change

    change = next_replan(next_replan(flown).trajectory)
    while not change.kept:
        change = next_replan(change.trajectory)
    instants = []
    for instant in range(int(0.2 * flown.duration / 0.01)):
        change = next_replan(change.trajectory)
        instants += [instant] * len(searches)
        assert searches or change.reason == "no wall that it touches has changed"
    assert instants[0] * 0.01 > 0.07 * flown.duration, "a search without need"
    while searches:
        change = next_replan(change.trajectory)
    next_replan(change.trajectory, 0.1)
    assert searches, "a wall has come near"


def test_a_rest_that_was_planned_for_another_aim_is_not_kept():
    points = np.array([(0.0, 0, 1), (4, 0, 1), (8, 1, 1), (12, 0, 1)])
    slow, replanner = minsnap.plan(points, total_time=16.0), Replanner(LIMITS, corridor=1.0, clock=still)
    timed = replanner.replan(slow, 0.0, points[1:], 0.01, total_time=15.0, **AMPLE)
    assert timed.trajectory.duration == pytest.approx(15.0)
    shortest = replanner.replan(timed.trajectory, 0.0, points[1:], 0.01, **AMPLE)
    assert not shortest.kept and shortest.trajectory.duration < 6.0
    total = shortest.trajectory.duration - 0.01
    cheaper = replanner.replan(shortest.trajectory, 0.0, points[1:], 0.01, total_time=total, **AMPLE)
    assert not cheaper.kept and cheaper.trajectory.cost() < 0.7 * shortest.trajectory.cost()


def test_a_plan_that_was_never_searched_is_searched_once_walls_change():
    points = np.array([(0.0, 0, 1), (4, 0, 1), (8, 3, 1), (12, 0, 1)])
    lower, upper = np.minimum(points[:-1], points[1:]), np.maximum(points[:-1], points[1:])
    flown, replanner = minsnap.plan(points, limits=LIMITS, corridor=0.1, pieces=1), Replanner(LIMITS, clock=still)
    first = replanner.replan(flown, 0.0, points[1:], 0.01, boxes=Boxes(lower - 2.0, upper + 2.0), **AMPLE)
    wider = replanner.replan(first.trajectory, 0.0, points[1:], 0.01, boxes=Boxes(lower - 2.1, upper + 2.1), **AMPLE)
    assert first.kept and not wider.kept and wider.trajectory.duration < first.trajectory.duration - 0.2


@pytest.mark.parametrize("slope", (1.0, 10.0))
def test_whether_a_plan_touches_a_wall_does_not_depend_on_how_its_normal_is_written(slope):
    class Slab:
        def __init__(self, beyond):
            self.beyond = beyond

        def walls(self, waypoints):
            legs, normal = len(waypoints) - 1, np.array([0.0, slope, 0.0])
            below, above = -slope * self.beyond, slope * (4.0 + self.beyond)
            planes = np.tile(normal, (legs, 1)), np.zeros((legs, 3)), np.full(legs, below), np.full(legs, above)
            return [Walls.planes(np.arange(legs), *planes, np.full(legs, 2.0 * slope))]

    points = np.array([(0.0, 0, 1), (4, 0, 1), (8, 4, 1), (12, 0, 1), (16, 4, 1)])
    limits = Limits(speed=3.0, acceleration=4.0)
    replanner, change = Replanner(limits, clearance=0.1, clock=still), None
    flown = minsnap.plan(points, total_time=20.0)
    for _ in range(2):
        change = replanner.replan(flown, 0.0, points[1:], 0.01, corridor=Slab(0.15), **AMPLE)
        flown = change.trajectory
    opened = replanner.replan(flown, 0.0, points[1:], 0.01, corridor=Slab(2.0), **AMPLE)
    assert not opened.kept and opened.trajectory.duration < flown.duration - 0.01
