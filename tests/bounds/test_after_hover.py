"""What a flight keeps soon after it hovers: known optima, sets that hold in truth, and proofs that are taken apart."""

from dataclasses import replace
from fractions import Fraction
from math import sqrt, tan

import numpy as np
import pytest

import minsnap
from minsnap import Ball, Limits, least_time
from minsnap.bounds.derivative_sets import bounding_sets
from minsnap.bounds.exact_numbers import tangent_above
from minsnap.bounds.exact_proof import least_time_proved
from minsnap.vehicle import BodyDrag, Quadrotor

AGILE = replace(Quadrotor.dji_f330(), drag=BodyDrag())
LINE = [(0.0, 0.0, 0.0), (8.0, 0.0, 0.0)]
COURSE = [(0, 0, 0), (2, 1, 0), (3, 4, 1)]
LIMITS = {
    "jerk": Limits(acceleration=6.0, jerk=30.0),
    "jerk and speed": Limits(speed=3.0, acceleration=6.0, jerk=30.0),
    "snap along axes": Limits(acceleration=6.0, snap=200.0, norm="axis"),
    "body rate": Limits(max_thrust=2.0, body_rate=5.0),
    "rotors": Limits.of(AGILE),
    "rotors with drag": Limits.of(replace(AGILE, drag=BodyDrag((0.2, 0.3, 0.1))), speed=8.0),
}


@pytest.fixture(scope="module", params=[*LIMITS])
def limits(request):
    return LIMITS[request.param]


def without_hover(course, limits, **more):
    """The bound of flights that begin and end at rest with any acceleration."""
    bound = least_time(course, limits, **more)
    proof = bound.proof
    none = replace(proof, latest=np.zeros((2, 0)), hovering=proof.hovering[:, :0])
    return float(least_time_proved(none))


def test_jerk_at_the_ends_is_most_of_what_it_costs():
    """From rest to rest with bang-bang jerk the half of the time T solves A x^2 - (A^2 / J) x = L."""
    limits = LIMITS["jerk"]
    ramp = 6.0**2 / 30.0
    optimum = 2.0 * (ramp + sqrt(ramp**2 + 4.0 * 6.0 * 8.0)) / 12.0
    bound = least_time(LINE, limits)
    assert bound.verify() and bound.left_out == ("jerk away from hover",)
    assert 0.975 * optimum < bound.seconds < optimum
    assert bound.seconds > 1.05 * least_time(LINE, Limits(acceleration=6.0)).seconds


def test_a_total_that_jerk_makes_too_short_is_refused_with_a_proof():
    known, unknown = least_time(COURSE, LIMITS["jerk"]).seconds, least_time(COURSE, Limits(acceleration=6.0)).seconds
    with pytest.raises(minsnap.InfeasibleError, match="every flight takes") as refused:
        minsnap.plan(COURSE, total_time=0.1 * unknown + 0.9 * known, limits=LIMITS["jerk"], pieces=3)
    assert refused.value.verify()


def test_ends_that_hover_take_longer_and_flights_longer_still(limits):
    bound, flown = least_time(COURSE, limits), minsnap.plan(COURSE, limits=limits, pieces=3, yaw="tilt")
    assert bound.verify()
    assert 1.002 * without_hover(COURSE, limits) < bound.seconds < flown.duration
    assert flown.report.lower_bound == bound.seconds


def test_the_sum_in_floating_point_is_the_exact_one(limits):
    proof = least_time(COURSE, limits, waypoint_tolerance=Ball(0.1)).proof
    assert float(least_time_proved(proof)) == pytest.approx(proof.seconds()[0], rel=1e-12)


@pytest.mark.parametrize("name", ["latest", "hovering", "costate"])
def test_numbers_that_were_changed_prove_no_more(name):
    bound = least_time(COURSE, LIMITS["rotors"], waypoint_tolerance=Ball(0.1))
    changed = replace(bound.proof, **{name: 1.03 * getattr(bound.proof, name)})
    assert not replace(bound, proof=changed).verify()
    for latest in (bound.proof.latest[:, ::-1], bound.proof.latest[:, :2], bound.proof.latest * np.inf):
        assert least_time_proved(replace(bound.proof, latest=latest)) is None


def test_a_quicker_body_or_ends_that_do_not_hover_are_another_question():
    bound = least_time(COURSE, LIMITS["rotors"])
    quicker = tuple(replace(one, rate=1.2 * one.rate) for one in bound.proof.growing)
    assert not replace(bound, proof=replace(bound.proof, growing=quicker)).verify()
    moving = replace(bound.proof.course, calm=(2, 2))
    assert not replace(bound, proof=replace(bound.proof, course=moving)).verify()


@pytest.mark.parametrize(
    ("start", "used"),
    [
        ({}, True),
        ({"acceleration": (0, 0, 0.5)}, False),
        ({"jerk": (1, 0, 0)}, False),
        ({"velocity": (1, 0, 0)}, False),
    ],
)
def test_a_start_hovers_where_velocity_acceleration_and_jerk_are_zero(start, used):
    proof = least_time(COURSE, LIMITS["rotors"], start=start).proof
    assert proof.hovering[0].any() == used and proof.hovering[1].any()


def test_an_acceleration_that_is_zero_bounds_what_jerk_makes_of_it():
    proof = least_time(COURSE, LIMITS["jerk"], start={"jerk": (1, 0, 0)}).proof
    assert proof.hovering[0].any()


def test_curves_that_jump_do_not_keep_what_grows():
    """Thrust that turns at once at a knot is no flight, but a curve of degree 5 may ask for it."""
    asked = {"limits": LIMITS["rotors"], "pieces": 3, "yaw": "tilt"}
    report = minsnap.plan(COURSE, **asked, degree=5).report
    assert report.lower_bound == pytest.approx(without_hover(COURSE, LIMITS["rotors"]), rel=1e-2)
    assert "single rotors" in report.least.bound.left_out
    assert minsnap.plan(COURSE, **asked).report.lower_bound > 1.02 * report.lower_bound


@pytest.mark.parametrize(("degree", "limits"), [(3, LIMITS["jerk"]), (5, LIMITS["snap along axes"])])
def test_curves_of_a_lower_degree_have_a_bound_of_their_own(degree, limits):
    """Their acceleration, or jerk, jumps: they are quicker than smooth flights."""
    points = [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0)]
    flown = minsnap.plan(points, limits=limits, degree=degree, pieces=4)
    bound = least_time(points, limits, degree=degree)
    assert bound.verify() and flown.report.lower_bound == bound.seconds <= flown.duration
    assert bound.seconds < least_time(points, limits).seconds


def test_what_jerk_alone_makes_long_is_proved_long():
    """With intervals up to one and a half times the duration without jerk at most a twelfth was gained."""
    points = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)]
    bound, free = least_time(points, Limits(acceleration=6.0, jerk=10.0)), least_time(points, Limits(acceleration=6.0))
    assert bound.verify() and bound.seconds > 1.5 * free.seconds


@pytest.mark.parametrize("inertia", [(0.0054, 0.0054, 0.0096), (0.004, 0.0055, 0.0085), (0.0053, 0.0055, 0.0056)])
def test_no_torque_turns_the_thrust_sooner(inertia):
    """The body is integrated with thrusts at their limits, in what direction and at what yaw rate it likes."""
    vehicle = replace(AGILE, inertia=np.array(inertia))
    limits = Limits.of(vehicle)
    (cone,) = [one for one in bounding_sets(limits, 3).growing if one.power == 2]
    low, high = (vehicle.hover_thrust + 0.9 * (end - vehicle.hover_thrust) for end in vehicle.rotor_thrust_limits)
    random, moments, fastest = np.random.default_rng(3), np.array(inertia), 0.0
    for _ in range(60):
        rate, time, step = np.array((0.0, 0.0, random.uniform(-20.0, 20.0))), 0.0, 1e-4
        thrusts = random.choice((low, high), 4)
        for k in range(1500):
            if k % 100 == 0 and random.random() < 0.5:
                thrusts = random.choice((low, high), 4)
            torque = vehicle.mixer[1:] @ thrusts
            middle = rate + 0.5 * step * (torque - np.cross(rate, moments * rate)) / moments
            rate = rate + step * (torque - np.cross(middle, moments * middle)) / moments
            time += step
            fastest = max(fastest, np.hypot(*rate[:2]) / (cone.rate * time))
    assert 0.5 < fastest <= 1.0 + 1e-4


def test_bodies_whose_axis_may_turn_otherwise_bound_nothing():
    """A body that is not flat, or whose axes are slanted, swaps turns between its axes."""
    for inertia in (np.array((0.009, 0.0054, 0.006)), np.array(((0.005, 0, 2e-4), (0, 0.005, 0), (2e-4, 0, 0.009)))):
        sets = bounding_sets(Limits.of(replace(AGILE, inertia=inertia)), 3)
        assert not sets.growing and "single rotors" in sets.left_out


def test_thrusts_lie_in_the_cone_of_their_time_with_the_drag_of_every_speed():
    limits = LIMITS["rotors with drag"]
    vehicle, random = limits.vehicle, np.random.default_rng(2)
    (cone,) = bounding_sets(limits, 3).growing
    for time in (0.01, 0.05, 0.08):
        for _ in range(200):
            angle, turn = random.uniform(0.0, cone.size(np.array(time))), random.uniform(-np.pi, np.pi)
            axis = np.array((np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)))
            axes = np.linalg.svd(axis[None])[2]
            axes[0] = axis
            velocity = random.normal(size=3)
            velocity *= 8.0 / np.linalg.norm(velocity)
            drag = axes.T @ (np.array(vehicle.drag.linear)[[2, 0, 1]] * (axes @ velocity))
            pushed = random.uniform(0.0, limits.max_thrust) * limits.gravity * axis - drag / vehicle.mass
            along = random.normal(size=3)
            fall = np.array((0.0, 0.0, limits.gravity))
            assert along @ (pushed - fall) <= cone.support(along, np.array(time))


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.1, 0.7, 1.2, 1.3])
def test_tangents_are_bounded_from_above(angle):
    found = tangent_above(Fraction(angle))
    assert tan(angle) * (1.0 - 1e-15) <= found <= tan(angle) * (1.0 + 1e-13) + 1e-20
