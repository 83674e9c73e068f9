"""What a report knows of the legs of a flight: measured, and how its time depends on limits and rooms."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap import Ball, Gate, Limits, Search
from minsnap.basics.limit_kinds import KIND
from minsnap.planning.leg_table import of_rotors
from minsnap.trajectory.leg_uses import BINDING
from minsnap.vehicle import Quadrotor

POINTS = np.array([(0, 0, 1), (4, 0, 1), (4, 4, 1.5), (1, 5, 1)], dtype=float)
LIMITS = Limits(speed=3, acceleration=6, jerk=40)


def test_legs_add_up_to_the_flight():
    path = minsnap.plan(POINTS, limits=LIMITS)
    legs = path.report.legs
    assert [use.leg for use in legs] == [0, 1, 2]
    assert [use.start for use in legs] == pytest.approx(path.leg_breaks[:-1])
    assert sum(use.duration for use in legs) == pytest.approx(path.duration)
    assert sum(use.mean_speed * use.duration for use in legs) == pytest.approx(path.arc_length(), rel=1e-4)
    assert max(use.max_speed for use in legs) == pytest.approx(path.max_norm(1)[0], rel=1e-12)
    for use in legs:
        seconds = [time for _, time in use.binding]
        assert seconds == sorted(seconds, reverse=True)
        assert all(0.0 < time <= use.duration * (1 + 1e-9) for time in seconds)
        assert use.limit == (use.binding[0][0] if use.binding else None)


def test_a_limit_binds_as_long_as_it_is_used_up():
    """Against the roots of the speed's polynomial: |v|^2 = (0.99 L)^2, exactly."""
    path = minsnap.plan(POINTS[:2], limits=Limits(speed=1.0, acceleration=6), pieces=1)
    (use,) = path.report.legs
    t = np.linspace(0, path.duration, 7)
    roots = (np.polynomial.Polynomial.fit(t, path(t, 1)[:, 0], 6) - BINDING).roots()
    roots = [root.real for root in roots if abs(root.imag) < 1e-9 and 0 < root.real < path.duration]
    assert dict(use.binding)["speed"] == pytest.approx(max(roots) - min(roots), abs=2 * path.duration / 64)


def test_plans_of_every_kind_know_their_legs():
    plans = [
        minsnap.plan(POINTS, [2.0, 2.0, 2.0]),
        minsnap.plan(POINTS, [2.0, 2.0, 2.0], corridor=0.3),
        minsnap.plan(POINTS, total_time=6.0, limits=Limits(speed=8)),
        minsnap.plan_many([POINTS], [[2.0, 2.0, 2.0]])[0],
        minsnap.plan_many([POINTS], [[2.0, 2.0, 2.0]], corridor=0.3)[0],
    ]
    for path in plans:
        assert len(path.report.legs) == 3 and path.report.sensitivities == ()
        assert path.report.legs[1].max_speed >= path.report.legs[1].mean_speed > 1.0


@pytest.mark.parametrize("pieces", [1, "auto"])
def test_sensitivities_add_up_as_dimensions_say(pieces):
    """T(c^q L_q) = T / c for limits of order q, so that the sum of q L dT/dL is -T."""
    errors = []
    for seed in range(4):
        random = np.random.default_rng(seed)
        points = np.cumsum(random.normal(0.0, [3.0, 3.0, 1.0], (5, 3)), axis=0)
        limits = Limits(speed=random.uniform(2, 5), acceleration=random.uniform(3, 8), jerk=random.uniform(20, 60))
        path = minsnap.plan(points, limits=limits, pieces=pieces)
        known = path.report.sensitivities
        assert [one.name for one in known] == ["speed", "acceleration", "jerk"]
        assert all(one.seconds < 1e-3 for one in known)
        errors.append(sum(KIND[one.name].order * one.value * one.seconds for one in known) / path.duration + 1.0)
    assert np.abs(errors).max() < 0.06 and np.median(np.abs(errors)) < 0.02


def test_sensitivities_are_those_of_the_proved_least_time():
    """The envelope of the bound, which shares no code with the search: its own costate with other limits."""
    path = minsnap.plan(POINTS, limits=Limits(speed=3, acceleration=6))
    proof = path.report.least.bound.proof
    for one in path.report.sensitivities:
        kind = "velocities" if one.name == "speed" else "accelerations"
        wider, narrower = (
            replace(proof, **{kind: tuple(each.scaled(factor) for each in getattr(proof, kind))}).seconds()[0]
            for factor in (1.0001, 0.9999)
        )
        assert one.seconds * one.value == pytest.approx((wider - narrower) / 2e-4, rel=0.1, abs=0.01 * path.duration)


def test_room_at_gates_balls_and_boxes_is_worth_what_other_plans_say():
    gate = Gate((4, 0, 1), (1, 0.5, 0), 0.8)
    for places, tolerance in (([POINTS[0], gate, *POINTS[2:]], None), (POINTS, Ball(0.3)), (POINTS, 0.3)):
        path = minsnap.plan(places, limits=LIMITS, waypoint_tolerance=tolerance, pieces=1)
        known = [one for one in path.report.sensitivities if one.waypoint is not None]
        assert [one.waypoint for one in known] == ([1] if tolerance is None else [1, 2])
        assert {one.unit for one in known} == {"m"} and all(one.seconds < 0.0 for one in known)
        if isinstance(tolerance, Ball):
            others = (minsnap.plan(places, limits=LIMITS, waypoint_tolerance=Ball(r), pieces=1) for r in (0.25, 0.35))
            less, more = (other.duration for other in others)
            assert sum(one.seconds for one in known) == pytest.approx((more - less) / 0.1, rel=0.15)


def test_the_thrust_of_rotors_counts_in_newtons():
    vehicle = Quadrotor.crazyflie()
    limits = Limits.of(vehicle, reserve=0.1, speed=5.0)
    assert of_rotors(limits) == {"max_thrust"} and of_rotors(LIMITS) == frozenset()
    known = {one.name: one for one in minsnap.plan(POINTS, limits=limits, pieces=1, yaw="free").report.sensitivities}
    assert set(known) == {"speed", "rotor_thrust"} and known["rotor_thrust"].unit == "N"
    assert known["rotor_thrust"].value == pytest.approx(vehicle.rotor_thrust_limits[1])
    assert known["rotor_thrust"].seconds < 0.0 and known["speed"].seconds < 0.0


@pytest.mark.parametrize(
    "asked",
    [
        {"start": {"velocity": (3.2, 0, 0)}},
        {"end": {"velocity": (0, 3.0, 0)}},
        {"end": {"velocity": "free"}},
        {"closed": True},
        {"corridor": 0.3},
    ],
)
def test_sensitivities_are_known_of_every_search_for_the_shortest_time(asked):
    points = np.vstack((POINTS, POINTS[:1])) if "closed" in asked else POINTS
    known = minsnap.plan(points, limits=Limits(speed=3, acceleration=6), pieces=1, **asked).report.sensitivities
    assert {one.name for one in known} == {"speed", "acceleration"}


@pytest.mark.parametrize(
    "asked",
    [
        {"search": Search(time_weight=100.0)},
        {"total_time": 9.0},
        {"avoid": [minsnap.Cylinder((2, 0.1), 0.3)]},
    ],
)
def test_other_plans_have_none(asked):
    assert minsnap.plan(POINTS, limits=LIMITS, **asked).report.sensitivities == ()


def test_a_report_that_is_copied_keeps_its_legs():
    path = minsnap.plan(POINTS, limits=LIMITS, pieces=1)
    before, after = pickle.loads(pickle.dumps(path)), None
    assert path.report.sensitivities
    after = pickle.loads(pickle.dumps(path))
    assert before.report.legs == path.report.legs and before.report.sensitivities == ()
    assert after.report.sensitivities == path.report.sensitivities


def test_a_mission_adds_up_its_parts_by_stops():
    gate = minsnap.Stop(Gate((4, 0, 1), (1, 0.5, 0), 0.8))
    stops = (minsnap.Stop((0, 0, 1)), gate, minsnap.Stop((4, 4, 1)))
    once, twice = (
        minsnap.plan_mission(minsnap.Course(stops, closed=True, laps=laps, limits=LIMITS, pieces=1)) for laps in (1, 2)
    )
    known = {(one.name, one.waypoint): one.seconds for one in once.sensitivities}
    assert set(known) == {("speed", None), ("acceleration", None), ("jerk", None), ("gate", 1)}
    assert {(one.name, one.waypoint): one.seconds for one in twice.sensitivities} == pytest.approx(
        {name: 2.0 * seconds for name, seconds in known.items()}
    )
    assert len(once.legs) == once.trajectory.legs
