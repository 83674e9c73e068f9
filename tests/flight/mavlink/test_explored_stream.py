"""Flights by what a sensor sees: answered line by line, around what is seen, and stopped where nothing more comes."""

import json

import numpy as np
import pytest
from changed_flights import Flown

import minsnap
from minsnap.errors import InputError
from minsnap.flight.mavlink.explored_stream import Exploration, Exploring, exploring_course
from minsnap.paths.missions.course import Course, Stop

LIMITS = minsnap.Limits(speed=2.0, acceleration=3.0, jerk=15.0)
START, GOAL = np.array([0.0, 0.0, 1.5]), np.array([9.0, 0.0, 1.5])
TRUNK, RADIUS, RANGE = np.array([4.0, 0.1]), 0.4, 5.0
RAYS = np.stack([part(np.linspace(0.0, 2.0 * np.pi, 240, endpoint=False)) for part in (np.cos, np.sin)], axis=1)


def seen(place, **other):
    """Return the line of a scan of one trunk from a place."""
    to = TRUNK - place[:2]
    along = RAYS @ to
    inside = RADIUS**2 - to @ to + along**2
    far = np.where((inside >= 0.0) & (along > 0.0), along - np.sqrt(np.maximum(inside, 0.0)), np.inf)
    ends = place[:2] + np.minimum(far, RANGE)[:, None] * RAYS
    points, rays = ends[far <= RANGE], ends[far > RANGE]
    return json.dumps({"position": list(place), "points": points.tolist(), "rays": rays.tolist(), **other})


class Explored(Flown):
    def stop(self):
        raise AssertionError("an exploration ends by its own stop")

    def place(self, elapsed):
        north, east, down = self.table[round(20.0 * elapsed)].position
        return np.array([east, north, -down])


class Clock:
    """A clock that a test sets, on which plans take no time."""

    def __init__(self):
        self.time = 0.0

    def __call__(self):
        return self.time


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def flight():
    return Explored(exploring().flown)


def exploring(**other):
    how = {"plane": True, "explorer": {"clearance": 0.3, "sensing": RANGE}} | other
    return Exploring(START, GOAL, LIMITS, **how)


def answer(exploration, *lines):
    return [json.loads(said) for said in exploration.answers(list(lines))]


def fly(exploration, flight, clock, until):
    """Tell what is seen ten times a second, and return the answers, and the places at each setpoint."""
    said, places = [], []
    while flight.elapsed < until and flight.table.stays:
        said += answer(exploration, seen(flight.place(flight.elapsed)))
        places += [flight.place(flight.elapsed + step) for step in (0.0, 0.05)]
        flight.elapsed += 0.1
        clock.time += 0.1
    return said, np.array(places)


@pytest.mark.slow
def test_a_trunk_that_is_seen_is_flown_around_and_the_goal_ends_the_flight(flight, clock):
    exploration = Exploration(flight, exploring(), clock)
    (before,) = answer(exploration, seen(START, id="a"))
    assert before["ok"] and before["flying"] is False and before["id"] == "a" and before["end"][0] > 2.0
    flight.elapsed = 0.2
    said, places = fly(exploration, flight, clock, 20.0)
    assert said[-1]["arrived"] and said[-1]["goal"] and not flight.table.stays
    np.testing.assert_allclose(places[-1], GOAL, atol=1e-5)
    assert (np.linalg.norm(places[:, :2] - TRUNK, axis=1) - RADIUS).min() > 0.2
    assert np.ptp(places[:, 2]) < 1e-9
    plans = [each for each in said if "splice" in each]
    assert plans and all(each["certified"] and each["max_speed"] <= 2.0 + 1e-6 for each in plans)
    assert any("waiting" in each for each in said), "a plan that waits for its splice is not replaced"
    assert all(each["ok"] for each in said)


@pytest.mark.slow
def test_a_lost_sensor_ends_in_the_certified_stop_and_one_that_comes_back_is_heard(flight, clock):
    exploration = Exploration(flight, exploring(), clock)
    flight.elapsed = 0.2
    _, flown = fly(exploration, flight, clock, 2.0)
    assert exploration.quiet() is None
    end = exploration._flown(exploration._flown.duration)
    known = exploration._explorer.known.states.copy()
    clock.time += 1.1
    flight.elapsed += 0.5
    told = json.loads(exploration.quiet())
    assert not told["ok"] and "nothing was observed for 1 s" in told["error"] and told["certified"]
    stop = exploration._flown
    assert np.linalg.norm(stop(stop.duration, 1)) < 1e-9
    assert np.linalg.norm(stop(stop.duration) - flown[-1, :2]) < np.linalg.norm(end - flown[-1, :2])
    assert (exploration._explorer.known.states == known).all()
    cells = np.floor(stop(np.linspace(0.0, stop.duration, 200)) / 0.25).astype(int)
    assert (known[tuple((cells - exploration._explorer.known.first).T)] == 1).all()
    assert exploration.quiet() is None, "it is said once"
    flight.elapsed += stop.duration + 1.0
    said, places = fly(exploration, flight, clock, flight.elapsed + 20.0)
    assert said[-1]["arrived"]
    np.testing.assert_allclose(places[-1], GOAL, atol=1e-5)


def test_of_lines_that_wait_each_is_taken_and_answered_and_one_plan_is_made(flight, clock):
    exploration = Exploration(flight, exploring(), clock)
    first, wrong, last = answer(exploration, seen(START, id=1), "{", seen(START + (0.1, 0.0, 0.0), id=3))
    assert first == {"ok": True, "id": 1} and not wrong["ok"] and last["ok"] and last["id"] == 3
    assert "duration" in last


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("{", "give an observation in JSON"),
        ("[1, 2]", "give the position of the sensor"),
        ('{"points": []}', "give the position of the sensor"),
        ('{"position": [0, 0], "pints": []}', "has 'pints'"),
        ('{"position": [0], "points": []}', "position of the sensor"),
        ('{"position": [0, NaN], "points": []}', "position of the sensor"),
        ('{"position": [0, 0], "points": [[1, 2, 3]]}', "points are"),
        ('{"position": [0, 0], "points": [[1, Infinity]]}', "point 0 of the points is (1, inf)"),
        ('{"position": [0, 0], "rays": "all"}', "ends of rays are"),
        ('{"position": [0, 0], "id": []}', "id is"),
        ('{"position": {"x": 0}, "points": []}', "position of the sensor"),
    ],
)
def test_a_line_that_is_no_observation_is_answered_in_a_sentence_and_changes_nothing(flight, clock, line, words):
    exploration = Exploration(flight, exploring(), clock)
    (said,) = answer(exploration, line)
    assert not said["ok"] and words in said["error"] and "\n" not in said["error"]
    assert not exploration._explorer.known.states.size


@pytest.mark.parametrize(
    "wrong",
    [
        {"stops": (Stop(START), Stop(GOAL), Stop(START))},
        {"stops": (Stop(START), Stop(GOAL, hold=1.0))},
        {"stops": (Stop(START[:2]), Stop(GOAL[:2]))},
        {"tube": 0.5},
        {"yaw": "velocity"},
        {"closed": True},
    ],
)
def test_a_course_that_says_more_than_two_ends_and_limits_is_refused(wrong):
    ends = {"stops": (Stop(START), Stop(GOAL)), "limits": LIMITS}
    with pytest.raises(InputError, match="the course: a flight that explores has"):
        exploring_course(Course(**ends | wrong), "the course")
    how = exploring_course(Course(**ends, yaw=0.5), "the course", plane=True, sensing=4.0)
    assert how.heading == 0.5 and how.explorer == {"clearance": 0.3, "sensing": 4.0} and how.dim == 2


def test_malformed_arguments_of_an_exploration_are_refused_before_the_flight():
    for wrong, words in [({"lost": 0.0}, "sensor is lost"), ({"explorer": {"sensing": -1.0}}, "range of the sensor")]:
        with pytest.raises(InputError, match=words):
            exploring(**wrong)
    with pytest.raises(InputError, match="one height"):
        Exploring(START, GOAL + (0.0, 0.0, 1.0), LIMITS, plane=True)
