"""Totals too short for the limits: exact proofs, against formulas of single limits and against plans; tampered ones."""

from dataclasses import replace

import numpy as np
import pytest
from tasks import random_legs, task_of

import minsnap
from minsnap.limits.limits import Limits
from minsnap.refusals.short_total import short_leg, short_total

POINTS = np.array([(0.0, 0.0, 0.0), (3.0, 4.0, 0.0), (3.0, 0.0, 2.0), (1.0, 0.0, -2.0)])
STEPS = np.diff(POINTS, axis=0)
LEAST = {
    "speed": (Limits(speed=2.0), np.linalg.norm(STEPS, axis=1) / 2.0),
    "per axis": (Limits(speed=2.0, norm="axis"), np.abs(STEPS).max(axis=1) / 2.0),
    "horizontal": (Limits(horizontal_speed=2.0), np.hypot(STEPS[:, 0], STEPS[:, 1]) / 2.0),
    "climb": (Limits(climb_speed=0.5), np.maximum(STEPS[:, 2], 0.0) / 0.5),
    "descent": (Limits(descent_speed=0.5), np.maximum(-STEPS[:, 2], 0.0) / 0.5),
    "both": (
        Limits(speed=2.0, vertical_speed=0.5),
        np.maximum(np.linalg.norm(STEPS, axis=1) / 2.0, np.abs(STEPS[:, 2]) / 0.5),
    ),
}


def asked(limits, tolerance=0.0):
    task = task_of(POINTS, limits=limits)
    return replace(task, lower=task.lower - tolerance, upper=task.upper + tolerance)


@pytest.mark.parametrize("name", LEAST)
def test_totals_are_proved_too_short_below_the_least_and_not_above(name):
    limits, times = LEAST[name]
    proof = short_total(asked(limits), 0.999999 * times.sum())
    assert proof.verify() and float(proof.least) == pytest.approx(times.sum(), rel=1e-8)
    assert short_total(asked(limits), 1.000001 * times.sum()) is None


@pytest.mark.parametrize("leg", range(3))
def test_a_leg_alone_is_proved_too_short(leg):
    limits, times = LEAST["both"]
    durations = np.where(np.arange(3) == leg, 0.999999, 1.1) * times
    proof = short_leg(asked(limits), durations)
    assert proof.verify() and proof.moves[0].start == leg and proof.total == durations[leg]
    assert short_leg(asked(limits), 1.000001 * times) is None
    assert short_leg(asked(Limits(body_rate=2.0)), durations) is None


def test_a_leg_of_one_polynomial_is_smooth_whatever_joins_at_its_ends():
    """Its snap of 1 alone bounds the way from rest to a waypoint, T^4 / 24; not where there may be a knot between."""
    task = replace(task_of(POINTS[:3], limits=Limits(snap=1.0, norm="axis")), continuity=2)
    proof = short_leg(task, np.full(2, 0.99 * 96.0**0.25))
    assert proof.verify() and float(proof.least) == pytest.approx(96.0**0.25, rel=1e-3)
    assert short_leg(task, np.full(2, 1.001 * 96.0**0.25)) is None
    assert short_leg(replace(task, pieces=2), np.ones(2)) is None


def test_a_pinned_velocity_is_known_on_both_of_its_legs():
    """Within 1 m/s^2, 3.5 m from rest to 1 m/s take 3 s, up to 2 m/s and down again; without the pin 7 m take 5.3 s."""
    points, limits = np.outer((0.0, 3.5, 7.0), (1.0, 0.0)), Limits(acceleration=1.0)
    task = task_of(points, limits=limits, pins={1: {1: np.array((1.0, 0.0))}})
    proof = short_total(task, 5.999)
    assert proof.verify() and float(proof.least) == pytest.approx(6.0, rel=1e-3)
    assert short_total(task, 6.001) is None and short_total(task_of(points, limits=limits), 5.999) is None


def test_waypoints_that_are_free_may_be_nearer():
    tolerance = np.array([[0.0], [0.5], [0.0], [0.0]])
    proof = short_total(asked(Limits(speed=2.0, norm="axis"), tolerance), 1.0)
    assert float(proof.least) == pytest.approx((3.5 + 3.5 + 4.0) / 2.0, rel=1e-8)


FORWARD, BACK = [(0.0, 0.0), (2.0, 0.0)], [(0.0, 0.0), (2.0, 0.0), (-3.0, 0.0)]
TURNING = {
    "from rest to rest within an acceleration": (FORWARD, Limits(acceleration=0.5), 4.0),
    "jerk": (FORWARD, Limits(jerk=4.0), 16.0 ** (1 / 3)),
    "snap": (FORWARD, Limits(snap=3.0), 256.0**0.25),
    "speed and acceleration": (FORWARD, Limits(speed=1.0, acceleration=2.0), 2.5),
    "there and back": (BACK, Limits(acceleration=0.5), 4.0 + 40.0**0.5),
    "there and back within a speed": (BACK, Limits(speed=1.0, acceleration=2.0), 2.5 + 5.5),
    "by the axis": (BACK, Limits(acceleration=0.5, norm="axis"), 4.0 + 40.0**0.5),
}


@pytest.mark.parametrize("name", TURNING)
def test_rest_and_turns_take_the_time_that_formulas_of_time_optimal_moves_say(name):
    points, limits, least = TURNING[name]
    near = 1e-2 if len(limits.given()) > 1 else 1e-6  # where the acceleration ends within a cell
    proof = short_total(task_of(np.array(points), limits=limits), (1.0 - near) * least)
    assert proof.verify() and float(proof.least) == pytest.approx(least, rel=near)
    assert short_total(task_of(np.array(points), limits=limits), 1.000001 * least) is None


def test_a_lap_turns_where_it_begins():
    points, limits = np.array([(0.0, 0.0), (2.0, 0.0), (0.0, 0.0)]), Limits(acceleration=0.5)
    proof = short_total(task_of(points, limits=limits, closed=True), 7.999)
    assert float(proof.least) == pytest.approx(8.0, rel=1e-8)
    assert short_total(replace(task_of(points, limits=limits, closed=True), continuity=0), 1e-3) is None


@pytest.mark.parametrize("speed", [2.0, -2.0])
def test_what_moves_at_an_end_gets_there_sooner_or_later(speed):
    """4 m within 2 m/s²: against the speed it first falls back by 1 m in 1 s."""
    rest = {order: np.zeros(2) for order in (1, 2, 3)}
    pins = {0: rest | {1: np.array([speed, 0.0])}, 1: rest}
    task = task_of(np.array([(0.0, 0.0), (4.0, 0.0)]), limits=Limits(acceleration=2.0), pins=pins)
    least = 10.0**0.5 - 1.0 if speed > 0.0 else 1.0 + 10.0**0.5
    proof = short_total(task, 0.99 * least)
    assert proof.verify() and float(proof.least) == pytest.approx(least, rel=0.01)
    assert short_total(task, 1.000001 * least) is None


def test_what_is_reached_in_a_moment_is_not_out_of_reach_since_more_time_leads_back():
    """From 5 m/s with -20 m/s² it is 0.625 m to the summit, 0.25 s from the start."""
    pins = {0: {1: np.array([5.0]), 2: np.array([-20.0]), 3: np.zeros(1)}}
    pins[1] = pins[0] | {1: np.zeros(1)}
    assert short_total(task_of(np.array([[0.0], [0.625]]), limits=Limits(jerk=1.0), pins=pins), 0.251) is None


def test_an_acceleration_that_only_falls_brings_no_rest_back_to_rest_in_any_time():
    wall = minsnap.HalfSpaces((1.0, 0.0), -0.5, order=2)
    for times in ({"total_time": 5.0}, {"search": minsnap.Search(time_weight=1.0)}):
        with pytest.raises(minsnap.InfeasibleError, match="no curve pass the waypoints in any time") as refused:
            minsnap.plan([(0.0, 0.0), (2.0, 1.0), (1.0, 3.0)], corridor=wall, degree=3, **times)
        assert refused.value.verify()


@pytest.mark.slow
@pytest.mark.parametrize(
    "limits", [Limits(speed=2.0, acceleration=3.0), Limits(jerk=5.0, vertical_speed=1.0), Limits(snap=9.0)]
)
@pytest.mark.parametrize("seed", range(6))
def test_no_plan_is_shorter_than_what_is_proved(seed, limits):
    points, _ = random_legs(seed)
    start = {"velocity": np.array([0.3, -0.2, 0.1])} if seed % 2 else {}
    path = minsnap.plan(points, limits=limits, pieces=4, start=start, closed=False)
    pins = {0: {1: np.array([0.3, -0.2, 0.1]) * (seed % 2), 2: np.zeros(3), 3: np.zeros(3)}}
    task = task_of(points, limits=limits, pins=pins)
    assert short_total(task, path.duration * (1.0 + 1e-9)) is None
    assert short_total(task, 0.4 * path.duration).verify()


def test_directions_are_turned_where_those_of_legs_nearly_do():
    """Those of legs and of sums of them prove no more than 2.15 s."""
    points = np.array([(0.6, 0.3, -0.4), (0.8, 0.2, -0.3), (0.8, 0.0, -0.4), (0.8, -0.3, -0.5), (0.7, -0.1, -0.7)])
    limits, rest, velocity = Limits(snap=14.0), {order: np.zeros(3) for order in (1, 2, 3)}, np.array([-0.5, 0.0, -0.6])
    task = task_of(points, limits=limits, pins={0: rest, 4: rest | {1: velocity}})
    proof = short_total(task, 2.3)
    assert proof.verify() and 2.3 < float(proof.least) < 2.4
    path = minsnap.plan(points, limits=limits, pieces=4, end={"velocity": velocity})
    assert path.duration > float(proof.least) and short_total(task, path.duration * (1.0 + 1e-9)) is None


def test_no_proof_without_limits_on_derivatives():
    assert short_total(asked(None), 1e-3) is None


def test_tampered_proofs_do_not_verify():
    proof = short_total(asked(Limits(speed=2.0)), 4.0)
    assert proof.verify()
    first, *others = proof.moves
    assert not replace(proof, moves=(replace(first, least=1.01 * first.least), *others)).verify()
    assert not replace(proof, moves=(replace(first, direction=-first.direction), *others)).verify()
    assert not replace(proof, moves=(*proof.moves, first)).verify()
    assert not replace(proof, moves=(first, *proof.moves)).verify()
    assert not replace(proof, total=7.0).verify()
    assert not replace(proof, moves=proof.moves[1:], total=5.0).verify()
    back = short_total(task_of(np.array(BACK), limits=Limits(acceleration=0.5)), 8.0)
    assert not replace(back, task=task_of(np.array(BACK)[[0, 2, 1]], limits=Limits(acceleration=0.5))).verify()
    assert not replace(back, task=replace(back.task, continuity=0)).verify()


def test_a_start_beyond_its_limits_proves_no_time_too_short():
    """What may be faster than the limits at first is over in less time than they allow: here 4.5 s have a plan."""
    asked = {"limits": Limits(speed=1.0, acceleration=2.0), "start": {"velocity": (3.0, 0.0, 0.0)}}
    points = [(0.0, 0.0, 0.0), (5.0, 0.0, 0.0)]
    assert minsnap.plan(points, total_time=4.5, **asked).duration == pytest.approx(4.5)
    for times in ({"total_time": 3.5}, {"durations": [0.1]}):
        with pytest.raises(minsnap.MinsnapError) as refused:
            minsnap.plan(points, **times, **asked)
        assert not isinstance(refused.value, minsnap.InfeasibleError) or not refused.value.verify()


def test_a_refusal_in_gates_is_right():
    """The gate may be crossed anywhere, so that the least total counts from its edge."""
    gate = minsnap.Gate((2.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0)
    with pytest.raises(minsnap.InfeasibleError, match=r"the lengths of the legs alone need 2\.\d* s") as refused:
        minsnap.plan([(0, 0, 0), gate, (2, 3, 0)], total_time=1.9, limits=Limits(speed=2.0, norm="axis"))
    assert refused.value.verify()
