"""Bad input: the exact class, and one sentence that says where, what arrived and what to do."""

import re

import numpy as np
import pytest

import minsnap
from minsnap.cli.app import exit_status
from minsnap.errors import (
    CorridorError,
    DegreeError,
    InfeasibleError,
    IntervalError,
    LimitError,
    MinsnapError,
    ShapeError,
    TimingError,
    UnknownSolverError,
    WaypointError,
    YawError,
)
from minsnap.planning.request import plan_arguments

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
DURATIONS = [4.0, 2.0, 4.0, 2.0]
NAN, INF = float("nan"), float("inf")


def replaced(index, point):
    points = list(CORNERS)
    points[index] = point
    return points


WAYPOINTS = (
    ({"waypoints": []}, WaypointError, "shape"),
    ({"waypoints": [(0, 0, 1)], "durations": []}, WaypointError, "at least 2 waypoints, not 1"),
    ({"waypoints": [0, 1, 2, 3]}, WaypointError, r"shape \(4,\).*\(n, 3\)"),
    ({"waypoints": 3.0}, WaypointError, r"shape \(\)"),
    ({"waypoints": np.zeros((5, 0))}, WaypointError, "shape"),
    ({"waypoints": np.zeros((2, 5, 3))}, WaypointError, r"shape \(2, 5, 3\)"),
    ({"waypoints": [(0, 0, 1), (8, 0), (8, 4, 1)]}, WaypointError, "all rows equally long"),
    ({"waypoints": [("a", "b", "c"), (1, 2, 3)]}, WaypointError, "must be numbers"),
    ({"waypoints": replaced(2, (8, NAN, 1))}, WaypointError, r"waypoint 2 is \(8, nan, 1\).*finite"),
    ({"waypoints": replaced(3, (0, 4, INF))}, WaypointError, r"waypoint 3 is \(0, 4, inf\).*finite"),
    ({"waypoints": replaced(3, (0, 4, -INF))}, WaypointError, r"waypoint 3 is \(0, 4, -inf\).*finite"),
    ({"waypoints": replaced(2, (8, 0, 1)), "durations": None, "total_time": 9}, WaypointError, r"1 and 2 are both"),
    (
        {"waypoints": CORNERS[:4], "durations": [1, 1, 1], "closed": True},
        WaypointError,
        "last waypoint to be the first",
    ),
)

TIMES = (
    ({"durations": None}, TimingError, "give one of durations, total_time"),
    ({"total_time": 12}, TimingError, "durations and total_time"),
    ({"durations": None, "total_time": 0}, TimingError, "total_time is 0"),
    ({"durations": None, "total_time": -3.0}, TimingError, "total_time is -3"),
    ({"durations": None, "total_time": NAN}, TimingError, "total_time is nan"),
    ({"durations": None, "total_time": INF}, TimingError, "total_time is inf"),
    ({"durations": None, "total_time": "12"}, TimingError, "total_time is '12'"),
    ({"durations": None, "total_time": True}, TimingError, "total_time is True"),
    ({"durations": None, "total_time": [12]}, TimingError, r"total_time is \[12\]"),
    ({"durations": [4, 2, 4]}, TimingError, "4 legs need 4 durations, not 3"),
    ({"durations": 4.0}, TimingError, "4 legs need 4 durations"),
    ({"durations": [4, 2, "x", 2]}, TimingError, "durations must be numbers"),
    ({"durations": [4, 2, 0, 2]}, TimingError, "duration of leg 2 is 0.0 s.*positive"),
    ({"durations": [4, -2, 4, 2]}, TimingError, "duration of leg 1 is -2.0 s.*positive"),
    ({"durations": [NAN, 2, 4, 2]}, TimingError, "duration of leg 0 is nan s"),
    ({"durations": [4, 2, 4, INF]}, TimingError, "duration of leg 3 is inf s"),
    ({"durations": None, "total_time": 12, "split": "fair"}, TimingError, "split is 'fair'.*optimal.*distance"),
)

CORRIDORS = (
    ({"corridor": 0.0}, CorridorError, "positive and finite"),
    ({"corridor": -0.3}, CorridorError, "positive and finite.*-0.3"),
    ({"corridor": NAN}, CorridorError, "positive and finite"),
    ({"corridor": INF}, CorridorError, "positive and finite"),
    ({"corridor": [0.3, 0.3, 0.0, 0.3]}, CorridorError, "entry 2"),
    ({"corridor": [0.3, 0.3]}, CorridorError, r"shape \(2,\) for 4 legs"),
    ({"corridor": "wide"}, CorridorError, "numbers"),
    ({"corridor": []}, CorridorError, "positive and finite"),
    ({"waypoint_tolerance": -0.1}, WaypointError, "is -0.1: give one finite number of 0 or more"),
    ({"waypoint_tolerance": NAN}, WaypointError, "finite"),
    ({"waypoint_tolerance": [0.1, 0.2]}, WaypointError, r"is \[0.1, 0.2\]: give one .*5 waypoints"),
    ({"waypoint_tolerance": "loose"}, WaypointError, "is 'loose': give one finite number"),
)

DEGREES = (
    ({"degree": 6}, DegreeError, "degree is 6.*odd, from 3 to 11"),
    ({"degree": "7"}, DegreeError, "degree is '7': give a whole number"),
    ({"degree": 1}, DegreeError, "degree is 1"),
    ({"degree": 13}, DegreeError, "degree is 13"),
    ({"degree": 7.0}, DegreeError, "degree is 7.0"),
    ({"degree": "7"}, DegreeError, "degree is '7'"),
    ({"degree": True}, DegreeError, "degree is True"),
    ({"continuity": 7}, DegreeError, "continuity is 7.*0 to 6"),
    ({"continuity": -1}, DegreeError, "continuity is -1"),
    ({"continuity": 2.5}, DegreeError, "continuity is 2.5"),
    ({"durations": None, "total_time": 9.0, "continuity": 4}, DegreeError, "take degree=9, or give durations"),
    ({"limits": minsnap.Limits(speed=1), "durations": None, "continuity": 6}, DegreeError, "=6 was asked for: give"),
    ({"degree": 5, "continuity": 5}, DegreeError, "continuity is 5.*0 to 4"),
    ({"pieces": 0}, DegreeError, "pieces is 0"),
    ({"pieces": -2}, DegreeError, "pieces is -2"),
    ({"pieces": 1.5}, DegreeError, "pieces is 1.5"),
    ({"corridor": 0.3, "continuity": 5}, InfeasibleError, "continuity=5.*freedom.*continuity=3"),
    ({"corridor": 0.3, "continuity": 6}, InfeasibleError, "continuity=6.*freedom.*continuity=3"),
)

STATES = (
    ({"start": {"position": (1, 1, 1)}}, WaypointError, "start is at"),
    ({"start": {"snap": (0, 0, 0)}}, WaypointError, "start pins 'snap'.*velocity, acceleration, jerk"),
    ({"end": {"speed": (0, 0, 0)}}, WaypointError, "end pins 'speed'"),
    ({"end": {"velocity": (0, 0)}}, WaypointError, "velocity of end is .*3 finite numbers"),
    ({"start": {"velocity": (0, NAN, 0)}}, WaypointError, "velocity of start"),
    ({"start": {"velocity": "fast"}}, WaypointError, "velocity of start"),
    ({"start": (1, 0, 0)}, WaypointError, "start must be a mapping"),
    ({"closed": True, "start": {"velocity": (1, 0, 0)}}, WaypointError, "closed=True"),
    ({"closed": True, "end": {}}, WaypointError, "closed=True"),
    ({"pins": {5: {"velocity": (1, 0, 0)}}}, WaypointError, "pins name waypoint 5.*0 to 4"),
    ({"pins": {-1: {"velocity": (1, 0, 0)}}}, WaypointError, "pins name waypoint -1"),
    ({"pins": {1.5: {"velocity": (1, 0, 0)}}}, WaypointError, "pins name waypoint 1.5"),
    ({"pins": {0: {"velocity": (1, 0, 0)}}}, WaypointError, "start= or end="),
    ({"pins": {4: {"velocity": (1, 0, 0)}}}, WaypointError, "start= or end="),
    ({"pins": {2: {"velocity": (1, 0)}}}, WaypointError, r"velocity of pins\[2\]"),
    ({"pins": {2: (1, 0, 0)}}, WaypointError, r"pins\[2\] must be a mapping"),
)

LIMITS = {"limits": minsnap.Limits(speed=3.0, acceleration=6.0)}
ALONE = {"durations": None} | LIMITS

IGNORED = (
    ({"split": "distance"}, TimingError, "split='distance' does not go with durations"),
    ({"split": "trapezoid"} | ALONE, TimingError, "split is 'trapezoid': use 'optimal' or 'distance'"),
    ({"durations": None, "time_weight": 1.0, "split": "distance"}, TimingError, "does not go with time_weight"),
    ({"search": {"split": "distance"}}, minsnap.InputError, "search must be a Search.*not dict"),
    ({"corridor": minsnap.Sampled(0.3)} | ALONE, CorridorError, "does not go with limits"),
    ({"corridor": minsnap.Sampled(0.3)} | LIMITS, CorridorError, "does not go with limits"),
    ({"search": "distance"}, minsnap.InputError, "search must be a Search.*not str"),
)

REST = (
    ({"solver": "gurobi"}, UnknownSolverError, "'gurobi' is not installed.*clarabel.*daqp"),
    ({"solver": ""}, UnknownSolverError, "is not installed"),
    ({"yaw": "north"}, YawError, "yaw is 'north'"),
    ({"yaw": [0, 1]}, YawError, "one for each of 5 waypoints"),
    ({"yaw": NAN}, YawError, "finite"),
    ({"yaw": "velocity", "waypoints": [[0], [1]], "durations": [1]}, YawError, "two coordinates"),
    ({"yaw": [0, 1, 2, 3, 4], "closed": True}, YawError, "begins at a yaw of 0 rad and ends at 4 rad"),
    ({"yaw": 0.3, "yaw_rate": 1.0}, YawError, "yaw_rate=1.0 is for a heading along the velocity: give yaw='velocity'"),
    ({"hold_below": 0.1}, YawError, "hold_below=0.1 is for a heading along the velocity: give yaw='velocity'"),
    ({"yaw": minsnap.LookAt((8, 4))}, YawError, "passes within 0 m of the point to look at"),
    ({"limits": minsnap.Limits(yaw_rate=1.0), "durations": None}, LimitError, "nothing limits the time"),
    ({"limits": minsnap.Limits(speed=1e-40), "durations": None}, LimitError, "so low that a leg takes over 1e\\+18 s"),
)

THROUGH = minsnap.Gate((4, 0, 1), (1, 0, 0), 0.5)
BEHIND = (
    ({"corridor": minsnap.HalfSpaces([(1, 0, 0)], [3])}, "outside the half-space of leg 1: move it or widen"),
    ({"room": ((-1, -1, 0), (3, 1, 2))}, "outside the room of leg 1: move it or widen the room"),
)


@pytest.mark.parametrize(("walls", "words"), BEHIND, ids=str)
def test_a_gate_behind_a_wall_is_named(walls, words):
    with pytest.raises(CorridorError, match=rf"the gate of waypoint 1 at \(4, 0, 1\) is 1 m {words}"):
        minsnap.plan([(0, 0, 1), THROUGH, (6, 0, 1)], total_time=6.0, **plan_arguments(walls))


@pytest.mark.parametrize(
    ("change", "error", "words"), (*WAYPOINTS, *TIMES, *CORRIDORS, *DEGREES, *STATES, *IGNORED, *REST), ids=str
)
def test_a_question_that_cannot_be_used(change, error, words):
    with pytest.raises(error, match=words) as caught:
        minsnap.plan(**plan_arguments({"waypoints": CORNERS, "durations": DURATIONS} | change))
    is_one_sentence(caught.value)


def is_one_sentence(found):
    assert isinstance(found, MinsnapError)
    assert isinstance(found, ValueError)
    text = str(found)
    assert 10 < len(text) < 300
    assert "\n" not in text
    assert not text.endswith(".")
    assert not re.search(r"Traceback|array\(|np\.|0x[0-9a-f]+", text), text


@pytest.mark.parametrize(
    ("ask", "error", "words"),
    (
        (lambda traj: traj(12.1), IntervalError, "outside the path's interval"),
        (lambda traj: traj(-0.1), IntervalError, "outside the path's interval"),
        (lambda traj: traj(NAN), IntervalError, "outside the path's interval"),
        (lambda traj: traj(1.0, -1), IntervalError, "order is -1"),
        (lambda traj: traj.sample(0), TimingError, "the rate is 0"),
        (lambda traj: traj.sample(-20), TimingError, "the rate is -20"),
        (lambda traj: traj.between(3, 2), IntervalError, "is not an interval"),
        (lambda traj: traj.stretched(-1), TimingError, "positive factor"),
        (lambda traj: minsnap.circle(-1.0), ShapeError, "radius"),
        (lambda traj: minsnap.circle(0.0), ShapeError, "radius"),
        (lambda traj: minsnap.circle(3.0, period=0.0), ShapeError, "period"),
        (lambda traj: minsnap.certify(traj, CORNERS[:2]), WaypointError, "shape"),
    ),
)
def test_what_is_asked_of_a_path_that_it_cannot_answer(ask, error, words):
    with pytest.raises(error, match=words) as caught:
        ask(minsnap.plan(CORNERS, DURATIONS))
    is_one_sentence(caught.value)


def test_evidence_is_attached():
    def evidence(**change):
        with pytest.raises(MinsnapError) as caught:
            minsnap.plan(**plan_arguments({"waypoints": CORNERS, "durations": DURATIONS} | change))
        return caught.value

    assert evidence(waypoints=replaced(2, (8, NAN, 1))).waypoint == 2
    assert evidence(durations=[4, 2, 0, 2]).leg == 2
    assert evidence(waypoints=replaced(2, (8, 0, 1)), durations=None, total_time=9.0).leg == 1
    narrow = evidence(corridor=0.02, continuity=4)
    assert narrow.leg in range(4)
    assert narrow.smallest_width > 0.02
    assert 0.0 <= narrow.instant <= 12.0


def test_bad_input_ends_with_2_and_what_cannot_be_met_with_1():
    for change, status in (({"degree": 4}, 2), ({"corridor": -1}, 2), ({"corridor": 0.02, "continuity": 4}, 1)):
        with pytest.raises(MinsnapError) as caught:
            minsnap.plan(**plan_arguments({"waypoints": CORNERS, "durations": DURATIONS} | change))
        assert exit_status(caught.value) == status


def test_the_smallest_width_is_enough_and_little_less_is_not():
    asked = {"waypoints": CORNERS, "durations": DURATIONS, "continuity": 4}
    with pytest.raises(InfeasibleError) as caught:
        minsnap.plan(**asked, corridor=0.02)
    width = caught.value.smallest_width
    assert minsnap.certify(minsnap.plan(**asked, corridor=width * 1.01), CORNERS, width * 1.01).ok
    with pytest.raises(InfeasibleError):
        minsnap.plan(**asked, corridor=width * 0.97)
