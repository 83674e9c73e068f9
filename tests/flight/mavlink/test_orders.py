"""Orders in flight: answered with a splice and a certificate, followed from what is flown, refused in a sentence."""

import json
from itertools import count

import numpy as np
import pytest
from changed_flights import Flown
from hypothesis import given
from hypothesis import strategies as st

import minsnap
from minsnap.errors import FlightError
from minsnap.flight.mavlink.offboard import Orders
from minsnap.replanning.replanner import Replanner

LIMITS = minsnap.Limits(speed=1.5, acceleration=2.0)
ROOM = minsnap.Room((-9, -9, 0), (9, 9, 5))
POINTS = np.array([(0, 0, 1.5), (3, 0, 1.5), (6, 2, 1.5)], dtype=float)
PLAN = minsnap.plan(POINTS, limits=LIMITS, corridor=ROOM)
GATE = {"center": [4.0, 1.0, 1.5], "heading_deg": 0, "width": 1.0}


@pytest.fixture
def flight():
    return Flown(PLAN)


@pytest.fixture
def order(flight):
    orders = Orders(flight, PLAN, LIMITS, replanner=Replanner(LIMITS, room=ROOM, clock=lambda: 0.0))

    def give(said, elapsed=None):
        flight.elapsed = flight.elapsed if elapsed is None else elapsed
        return json.loads(orders.answer(said if isinstance(said, str) else json.dumps(said)))

    return give


def test_a_goal_is_answered_with_its_splice_and_what_is_proved_of_the_way_there(flight, order):
    said = order({"goal": [4.0, 1.0, 1.5], "id": "a"}, 1.0)
    assert said["ok"] and said["id"] == "a" and said["certified"] and said["splice"] == pytest.approx(1.2)
    assert said["end"] == pytest.approx([4.0, 1.0, 1.5]) and said["max_speed"] <= 1.5 + 1e-6
    assert said["limits"]["acceleration"]["value"] <= 2.0 + 1e-6 and said["flown"]
    again = order({"waypoints": [[3.5, 0.6, 1.5], [4.0, 2.0, 2.0]]}, 1.6)
    assert again["splice"] == pytest.approx(1.8) and again["end"] == pytest.approx([4.0, 2.0, 2.0])
    assert flight.table[10**6].position == pytest.approx((2.0, 4.0, -2.0), abs=1e-6)


def test_a_stop_that_stands_in_for_a_goal_is_not_said_to_be_flown_there(flight):
    """It was answered by ok, and the vehicle stood metres from the goal."""
    ticks = count()
    orders = Orders(flight, PLAN, LIMITS, replanner=Replanner(LIMITS, room=ROOM, clock=lambda: 0.01 * next(ticks)))
    flight.elapsed = 1.0
    said = json.loads(orders.answer('{"goal": [4.0, 1.0, 1.5]}'))
    assert said["ok"] and not said["flown"] and "the stop is flown" in said["note"]
    assert np.linalg.norm(np.subtract(said["end"], [4.0, 1.0, 1.5])) > 1.0


def test_at_the_end_it_stays_for_another_goal_until_it_is_to_finish(flight, order):
    done = order({"goal": [3.0, 1.0, 1.5]}, 1.0)
    hovering = done["splice"] + done["duration"] + 20.0
    assert order("stop", hovering)["note"] == "it comes to rest here"
    said = order({"goal": [0.0, 1.0, 1.5], "yaw": 1.0}, hovering)
    assert said["ok"], said
    assert said["splice"] == pytest.approx(hovering + 0.2)
    assert flight.table[10**6].yaw == pytest.approx(np.pi / 2 - 1.0)
    assert order("finish") == {"ok": True, "finish": True} and not flight.table.stays


def test_a_stop_comes_to_rest_within_the_limits(flight, order):
    said = order("stop", 1.2)
    assert said["ok"] and said["certified"] and said["duration"] < 3.0 and flight.stops == 0
    assert flight.table[10**6].velocity == (0.0, 0.0, 0.0)
    assert order({"goal": [6.0, 2.0, 1.5]}, 1.5)["ok"]


def test_a_gate_that_is_passed_straight_has_one_heading(flight, order):
    """Three were asked for, one for each of the points that it was made of."""
    said = order({"waypoints": [GATE | {"straight": 0.4}, [5.0, 2.0, 1.5]], "yaw": [0.3, 0.6]}, 1.0)
    assert said["ok"], said
    assert flight.table[10**6].yaw == pytest.approx(np.pi / 2 - 0.6)


def test_gates_are_passed_in_their_direction(order):
    said = order({"waypoints": [GATE | {"straight": 0.4}, [5.0, 2.0, 1.5]]}, 1.0)
    assert said["gates"] == [pytest.approx(said["gates"][0] | {"gate": 0, "clearance": 0.5})]
    back = order({"waypoints": [GATE | {"heading_deg": 180}, [5.0, 2.0, 1.5]]}, 1.4)
    assert not back["ok"] and "gate 0 would be passed backwards" in back["error"]


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ("nonsense", "the order is"),
        ({"goto": [1, 2, 3]}, "give one of goal, waypoints, stop and finish"),
        ({"goal": [1, 2, "x"]}, "give a finite number"),
        ('{"goal": [NaN, 0, 1]}', "give a finite number"),
        ({"waypoints": []}, "one at least"),
        ({"waypoints": 7}, "one at least"),
        ({"goal": [3.0, 9.0]}, "coordinates"),
        ({"goal": [1, 0, 1], "yaw": "north"}, "yaw is 'north': give one angle [rad] for each of the 1 waypoints"),
        ({"goal": [1, 0, 1], "yaw": [[1], [1, 2]]}, "yaw is [[1], [1, 2]]: give one angle"),
        ({"goal": [1, 0, 1], "yaw": [1, 2]}, "yaw is [1, 2]: give one angle [rad] for each of the 1 waypoints"),
        ({"goal": [1, 0, -1]}, "room"),
        ({"goal": [1, 0, 1], "waypoints": [[2, 0, 1]]}, "give one of goal, waypoints, stop and finish"),
        ({"finish": True, "goal": [1, 0, 1]}, "give one of goal, waypoints, stop and finish"),
        ({"stop": True, "finish": True}, "give one of goal, waypoints, stop and finish"),
        ({"finish": True, "yaw": 1}, "yaw beside goal or waypoints"),
        ({"stop": False}, "stop is False: give true, or the word alone"),
        ({"finish": 1}, "finish is 1: give true"),
        ('{"goal": [1, 0, 1], "id": NaN}', "the id is no value that JSON can write"),
        ('{"stop": true, "id": 1e999}', "the id is no value that JSON can write"),
    ],
)
def test_mistakes_are_answered_and_change_nothing(flight, order, said, why):
    """Some of them used to be followed in part, or to end the reading of orders: ``stop`` was obeyed no more."""
    before = flight.table[40]
    answer = order(said, 1.0)
    assert flight.table.stays and flight.stops == 0
    assert not answer["ok"] and why in answer["error"]
    assert flight.table[40] == before and flight.began == 0.0


VALUES = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=3) | st.lists(st.floats(-9, 9), min_size=3, max_size=3),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["center", "width", "x"]), inner),
    max_leaves=6,
)


@given(st.dictionaries(st.sampled_from(["goal", "waypoints", "yaw", "id", "stop", "finish"]), VALUES) | VALUES)
def test_any_order_is_answered_by_a_line_of_json(said):
    flight = Flown(PLAN)
    line = Orders(flight, PLAN, LIMITS, ROOM).answer(json.dumps(said))
    answer = json.loads(line, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert answer["ok"] is not flight.table.stays, "before the flight, finish is all that can be followed"
    assert answer["ok"] or answer["error"]


def test_an_error_of_our_own_is_an_answer_too(flight, order):
    """It used to end the process that reads orders; only the end of the flight does."""
    flight.change = lambda change: {}["missing"]
    assert "missing" in order({"goal": [4.0, 1.0, 1.5], "id": 3}, 1.0)["error"]
    flight.change = gone
    with pytest.raises(EOFError):
        order({"goal": [4.0, 1.0, 1.5]}, 1.0)


def gone(change):
    raise EOFError


def test_before_the_flight_nothing_is_changed_and_a_stop_that_nothing_allows_holds(flight, order):
    assert "not flying" in order({"goal": [1, 0, 1]})["error"]
    flight.change = refuse
    assert order("stop", 1.2)["note"].startswith("held, for there is no certified stop: walls") and flight.stops == 1


def refuse(change):
    raise FlightError("walls")
