"""Limits of a vehicle: thrust from its rotors, and every rotor's thrust proved over all time."""

import dataclasses

import numpy as np
import pytest
from tasks import REFERENCE, random_legs

import minsnap
from minsnap.errors import LimitError
from minsnap.limits.limits import Limits
from minsnap.time_allocation.time_stretch import most_used
from minsnap.vehicle import BodyDrag, Quadrotor, flatness_of

VEHICLES = {"f330": Quadrotor.dji_f330(), "crazyflie": Quadrotor.crazyflie()}


def thrusts(vehicle, path, count=40001):
    t = np.linspace(0.0, path.duration, count)
    speed = flatness_of(vehicle, path, t, drag=BodyDrag()).rotor_speed
    return vehicle.thrust_coefficient * speed * np.abs(speed)


def rotors(limits, path):
    used = {used.name: used for used in limits.utilisation(path)}
    return used["rotor_thrust"], used["min_rotor_thrust"]


def test_thrust_is_what_the_rotors_give_less_the_reserve():
    vehicle = VEHICLES["f330"]
    full, half = Limits.of(vehicle, 0.0), Limits.of(vehicle, 0.5)
    assert full.max_thrust == pytest.approx(vehicle.max_thrust_to_weight)
    assert half.max_thrust - 1.0 == pytest.approx(0.5 * (full.max_thrust - 1.0))
    assert full.min_thrust == pytest.approx(4.0 * vehicle.rotor_thrust_limits[0] / vehicle.weight)
    assert 1.0 - half.min_thrust == pytest.approx(0.5 * (1.0 - full.min_thrust))
    assert Limits.of(VEHICLES["crazyflie"]).min_thrust is None, "its rotors may stop"
    assert Limits.of(vehicle, speed=3.0, body_rate=4.0).given()["body_rate"] == 4.0


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("yaw", [None, 0.7, "turning"])
@pytest.mark.parametrize("seed", range(4))
def test_no_sampled_thrust_is_beyond_the_bound_and_the_bound_is_close(seed, yaw, vehicle):
    points, durations = random_legs(seed, 3)
    heading = np.arange(4.0) if yaw == "turning" else yaw
    path = minsnap.plan(points, durations, yaw=heading)
    body = VEHICLES[vehicle]
    most, least = rotors(Limits.of(body, 0.0), path)
    found = thrusts(body, path)
    assert most.method == least.method == "interval"
    assert found.max() <= most.value <= found.max() + 2e-3 * body.hover_thrust
    assert found.min() >= least.value >= found.min() - 2e-3 * body.hover_thrust
    assert most.limit == pytest.approx(body.rotor_thrust_limits[1])
    assert least.limit == pytest.approx(body.rotor_thrust_limits[0], abs=1e-15)


def test_a_yaw_along_the_velocity_is_sampled_and_says_so():
    path = minsnap.plan(REFERENCE, total_time=12.0, corridor=0.5, yaw="velocity")
    most, least = rotors(Limits.of(VEHICLES["f330"]), path)
    found = thrusts(VEHICLES["f330"], path)
    assert most.method == least.method == "sampled"
    assert found.max() <= most.value <= 1.01 * found.max()


def test_hover_uses_neither_side():
    path = minsnap.plan([(0, 0, 0), (0.01, 0, 0)], [20.0])
    most, least = rotors(Limits.of(VEHICLES["f330"]), path)
    assert most.fraction < 1e-3 and least.fraction < 1e-3


def test_the_bound_follows_time_as_it_is_stretched():
    path = minsnap.plan(REFERENCE, total_time=8.0, yaw=[0.0, 1.0, 2.0, 3.0, 4.0])
    limits = Limits.of(VEHICLES["f330"])
    for factor in (0.8, 1.0, 2.0):
        stretched = path.stretched(factor)
        assert thrusts(VEHICLES["f330"], stretched).max() <= rotors(limits, stretched)[0].value


@pytest.mark.slow
def test_a_plan_for_a_vehicle_asks_no_rotor_for_more_than_it_gives():
    """Little yaw authority: the rotors bind long before the total thrust."""
    vehicle = dataclasses.replace(VEHICLES["f330"], rotor_speed_max=650.0)
    limits = Limits.of(vehicle, 0.2, speed=8.0)
    path = minsnap.plan(REFERENCE[:3] + [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]], limits=limits)
    found, (least, most) = thrusts(vehicle, path), vehicle.rotor_thrust_limits
    room = 0.8 * (most - vehicle.hover_thrust)
    assert found.max() <= vehicle.hover_thrust + room and found.min() >= least
    assert 0.999 <= most_used(limits, path).fraction <= 1.0 + 1e-9
    assert minsnap.certify(path, limits=limits).ok


@pytest.mark.parametrize("reserve", [-0.1, 1.0, float("nan")])
def test_a_reserve_out_of_range_is_refused(reserve):
    with pytest.raises(LimitError, match="reserve"):
        Limits.of(VEHICLES["f330"], reserve)


def test_a_vehicle_that_cannot_hover_is_refused():
    with pytest.raises(LimitError, match="cannot hover") as refused:
        Limits.of(dataclasses.replace(VEHICLES["f330"], mass=3.0))
    assert refused.value.smallest == 1.0


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("seed", range(4))
def test_rotors_without_spin_are_proved_too(seed, vehicle):
    points, durations = random_legs(seed, 3)
    body = VEHICLES[vehicle]
    path = minsnap.plan(points, durations, yaw="tilt")
    most, least = rotors(Limits.of(body, 0.0), path)
    found = thrusts(body, path)
    assert most.method == least.method == "interval"
    assert found.max() <= most.value <= found.max() + 2e-3 * body.hover_thrust
    assert found.min() >= least.value >= found.min() - 2e-3 * body.hover_thrust


def test_without_spin_rotors_are_used_less_and_the_yaw_rate_not_at_all():
    body = VEHICLES["f330"]
    points = [(0, 0, 1), (3, 2, 2), (5, -2, 3), (1, -3, 1), (-2, 0, 2)]
    limits = Limits.of(body, 0.0, yaw_rate=3.0)
    fixed, free = (minsnap.plan(points, [0.9, 0.9, 1.0, 0.9], yaw=yaw) for yaw in (None, "tilt"))
    assert rotors(limits, free)[0].fraction < 0.9 * rotors(limits, fixed)[0].fraction
    turn = next(used for used in limits.utilisation(free) if used.name == "yaw_rate")
    assert (turn.value, turn.method) == (0.0, "exact")
