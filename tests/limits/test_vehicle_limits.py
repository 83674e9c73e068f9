"""Limits of a vehicle: thrust from its rotors, and every rotor's thrust proved over all time."""

import dataclasses

import numpy as np
import pytest
from tasks import REFERENCE, random_legs, spinless

import minsnap
from minsnap.errors import LimitError
from minsnap.limits.compliance import most_used
from minsnap.limits.limits import Limits
from minsnap.limits.measures import sampled_motion
from minsnap.limits.vehicle_use import VehicleBound, lateral_alike
from minsnap.vehicle import BodyDrag, Quadrotor, RotorSpeedDrag, flat_states, flatness_of

VEHICLES = {"f330": Quadrotor.dji_f330(), "crazyflie": Quadrotor.crazyflie()}


def thrusts(vehicle, path, count=40001):
    t = np.linspace(0.0, path.duration, count)
    speed = flatness_of(vehicle, path, t).rotor_speed
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
    assert Limits.of(dataclasses.replace(vehicle, gravity=1.62)).gravity == 1.62


@pytest.mark.slow
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
    assert all(path.breaks[used.leg] <= used.instant <= path.breaks[used.leg + 1] for used in (most, least))
    assert found.max() <= most.value <= found.max() + 2e-3 * body.hover_thrust
    assert found.min() >= least.value >= found.min() - 2e-3 * body.hover_thrust
    assert most.limit == pytest.approx(body.rotor_thrust_limits[1])
    assert least.limit == pytest.approx(body.rotor_thrust_limits[0], abs=1e-15)
    hover, reserved = body.hover_thrust, rotors(Limits.of(body, 0.25), path)
    for used, whole in zip(reserved, (most, least), strict=True):
        assert used.value == whole.value
        assert used.limit - hover == pytest.approx(0.75 * (whole.limit - hover))
        assert used.fraction == pytest.approx(whole.fraction / 0.75)


def test_a_yaw_along_the_velocity_is_sampled_and_says_so():
    path = minsnap.plan(REFERENCE, total_time=12.0, corridor=0.5, yaw="velocity")
    most, least = rotors(Limits.of(VEHICLES["f330"]), path)
    found = thrusts(VEHICLES["f330"], path)
    assert most.method == least.method == "sampled"
    assert found.max() <= most.value <= 1.01 * found.max()


def test_what_a_rotor_does_just_before_a_knot_counts_below_higher_peaks():
    """Of four peaks the highest three were looked at closely: a rotor went 16 % further than was told."""
    body = Quadrotor(1.0, (5.2e-3, 5.5e-3, 9.5e-3), 0.165, 7e-6, 2e-7, 2070.0, 565.0, gravity=24.8)
    body = dataclasses.replace(body, drag=BodyDrag((0.54, 0.16, 0.2)))
    view = minsnap.LookAt((50, 50))
    path = minsnap.plan([(0.2, 9.8, -0.1), (0.9, 2.3, 28.4), (12.9, 14.2, 40.0)], limits=Limits.of(body), yaw=view)
    states = flatness_of(body, path, np.nextafter(path.breaks[1:-1], 0.0))
    assert rotors(Limits.of(body), path)[1].value <= body.thrusts(states.rotor_speed).min()


def test_many_instants_of_every_piece_are_sampled():
    body, path = VEHICLES["f330"], minsnap.plan(*random_legs(0, 2), yaw="velocity")
    bound = VehicleBound(body, path, dict.fromkeys(LIFTED, 1.0))
    t, (most, least, tilt, turning, upwards, downwards) = bound.sampled()
    assert t == pytest.approx(np.append(np.interp(np.arange(512.0), [0.0, 256.0, 512.0], path.breaks), path.duration))
    states = flatness_of(body, path, t, drag=body.drag)
    assert most == pytest.approx(states.thrust / body.weight) and (least == -most).all()
    assert np.cos(tilt) == pytest.approx(states.rotation[:, 2, 2]) and (tilt >= 0.0).all()
    assert turning == pytest.approx(np.linalg.norm(states.body_rates[:, :2], axis=1))
    forces = body.thrust_coefficient * states.rotor_speed * np.abs(states.rotor_speed)
    assert body.hover_thrust + upwards == pytest.approx(forces.max(axis=1))
    assert body.hover_thrust - downwards == pytest.approx(forces.min(axis=1))


def test_hover_uses_neither_side():
    path = minsnap.plan([(0, 0, 0), (0.01, 0, 0)], [20.0])
    most, least = rotors(Limits.of(VEHICLES["f330"]), path)
    assert most.fraction < 1e-3 and least.fraction < 1e-3


@pytest.mark.slow
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


LIFTED = {"max_thrust": 3.0, "min_thrust": 0.2, "tilt": 1.4, "body_rate": 20.0}


def lifted(vehicle, path, count=40001):
    """Thrust over weight, tilt and body rate at many instants, from the states of a vehicle with its drag."""
    states = flatness_of(vehicle, path, np.linspace(0.0, path.duration, count))
    up = states.rotation[:, :, 2]
    turning = np.linalg.norm(states.body_rates[:, :2], axis=1)
    return states.thrust / vehicle.weight, np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2]), turning


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("seed", range(4))
def test_with_drag_thrust_tilt_and_body_rate_are_proved_and_close(seed, vehicle):
    points, durations = random_legs(seed, 3)
    path, body = minsnap.plan(points, 0.8 * durations, yaw="velocity"), VEHICLES[vehicle]
    used = {entry.name: entry for entry in Limits.of(body, 0.0, **LIFTED).utilisation(path)}
    thrust, tilt, turning = lifted(body, path)
    for name, found in (("max_thrust", thrust.max()), ("tilt", tilt.max()), ("body_rate", turning.max())):
        assert used[name].method == "interval"
        assert found <= used[name].value <= found + 1e-3 * LIFTED[name]
    assert thrust.min() >= used["min_thrust"].value >= thrust.min() - 1e-3 * LIFTED["min_thrust"]
    bare = dataclasses.replace(body, drag=BodyDrag())
    without = {entry.name: entry for entry in Limits.of(bare, 0.0, **LIFTED).utilisation(path)}
    assert without["tilt"].method == "exact" and abs(without["tilt"].value / used["tilt"].value - 1.0) > 2e-3


def test_drag_that_differs_sideways_is_sampled_and_says_so():
    body = dataclasses.replace(VEHICLES["f330"], drag=BodyDrag((0.3, 0.1, 0.2), (0.01, 0.03, 0.0)))
    path = minsnap.plan(*random_legs(2, 3))
    used = {entry.name: entry for entry in Limits.of(body, 0.0, tilt=1.0).utilisation(path)}
    assert {used[name].method for name in ("rotor_thrust", "tilt")} == {"sampled"}
    assert lifted(body, path)[1].max() <= used["tilt"].value and thrusts(body, path).max() <= used["rotor_thrust"].value


def test_a_plan_keeps_the_limits_of_a_vehicle_with_drag_and_uses_them():
    """Without drag in the search the tilt of this plan was 4 % beyond its limit, and it had to be slowed down."""
    body = dataclasses.replace(VEHICLES["f330"], drag=BodyDrag((0.3, 0.3, 0.1), (0.02, 0.02, 0.05)))
    limits = Limits.of(body, 0.1, tilt=0.7, body_rate=6.0)
    points = [(0, 0, 1), (6, 3, 2), (8, -4, 3), (1, -6, 1)]
    path = minsnap.plan(points, limits=limits, yaw="tilt")
    assert path.yaw.medium.values[1:3] == (limits.medium.linear, limits.medium.quadratic)
    thrust, tilt, turning = lifted(body, path, 5001)
    assert thrust.max() <= limits.max_thrust and tilt.max() <= 0.7 and turning.max() <= 6.0
    assert 0.999 <= most_used(limits, path).fraction <= 1.0 + 1e-9
    found = thrusts(body, path, 5001)
    room = 0.9 * (body.rotor_thrust_limits[1] - body.hover_thrust)
    assert found.max() <= body.hover_thrust + room and found.min() >= body.rotor_thrust_limits[0]


@pytest.mark.parametrize("factor", [1.0, 1.2, 1.5])
def test_drag_is_kept_in_given_durations(factor):
    body = dataclasses.replace(VEHICLES["f330"], drag=BodyDrag((0.3, 0.3, 0.1), (0.02, 0.02, 0.05)))
    limits = Limits.of(body, 0.2, tilt=0.4)
    points = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
    durations = factor * np.array([2.79, 1.28, 2.17, 1.69])
    path = minsnap.plan(points, durations, limits=limits, yaw="tilt")
    assert lifted(body, path, 5001)[1].max() <= 0.4 and minsnap.certify(path, limits=limits).ok
    assert np.diff(path.leg_breaks) == pytest.approx(durations, rel=1e-14)


def test_states_pinned_count_drag():
    """At 12 m/s the drag alone tilts this vehicle by 20 degrees."""
    body = dataclasses.replace(VEHICLES["f330"], drag=BodyDrag((0.3, 0.3, 0.3)))
    limits, end = Limits.of(body, 0.0, tilt=0.2), {"velocity": (12.0, 0.0, 0.0)}
    with pytest.raises(LimitError, match="tilt"):
        minsnap.plan([(0, 0, 1), (20, 0, 1), (40, 3, 1)], [2.0, 4.0], limits=limits, end=end)


@pytest.mark.parametrize("reserve", [-0.1, 1.0, float("nan")])
def test_a_reserve_out_of_range_is_refused(reserve):
    with pytest.raises(LimitError, match="reserve"):
        Limits.of(VEHICLES["f330"], reserve)


def test_a_vehicle_that_cannot_hover_is_refused():
    with pytest.raises(LimitError, match="cannot hover") as refused:
        Limits.of(dataclasses.replace(VEHICLES["f330"], mass=3.0))
    assert refused.value.smallest == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("seed", range(4))
def test_rotors_without_spin_are_proved_too(seed, vehicle):
    points, durations = random_legs(seed, 3)
    body = VEHICLES[vehicle]
    path = spinless(minsnap.plan(points, durations), body)
    most, least = rotors(Limits.of(body, 0.0), path)
    found = thrusts(body, path)
    assert most.method == least.method == "interval"
    assert all(path.breaks[used.leg] <= used.instant <= path.breaks[used.leg + 1] for used in (most, least))
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


def test_a_vehicle_that_just_flies_has_limits():
    heavy = dataclasses.replace(
        VEHICLES["f330"], mass=VEHICLES["f330"].mass * VEHICLES["f330"].max_thrust_to_weight / 1.5
    )
    assert Limits.of(heavy, 0.0).max_thrust == pytest.approx(1.5)


def test_sampled_thrust_counts_drag_along_the_thrust_axis():
    body = dataclasses.replace(VEHICLES["f330"], drag=BodyDrag((0.3, 0.3, 0.1), (0.02, 0.02, 0.05)))
    samples = minsnap.plan(*random_legs(2, 3)).sample(20.0)
    force = sampled_motion(samples, "euclidean", Limits.of(body, 0.0).medium).thrust()
    expected = flat_states(body, samples.velocity, samples.acceleration, samples.jerk, samples.snap, drag=body.drag)
    assert np.linalg.norm(force, axis=1) == pytest.approx(expected.thrust / body.weight, rel=1e-9)


@pytest.mark.parametrize(("linear", "quadratic", "alike"), [(0.3, 0.02, True), (0.1, 0.02, False), (0.3, 0.01, False)])
def test_drag_is_the_same_sideways_if_all_of_it_is(linear, quadratic, alike):
    body = dataclasses.replace(VEHICLES["f330"], drag=BodyDrag((0.3, linear, 0.1), (0.02, quadratic, 0.05)))
    assert lateral_alike(body) is alike


def test_a_drag_that_is_not_of_the_body_has_no_part_in_limits():
    vehicle = dataclasses.replace(Quadrotor.dji_f330(), drag=RotorSpeedDrag((1e-4, 1e-4, 1e-4)))
    assert not vehicle.flat_drag.linear.any() and not Limits.of(vehicle).medium.drags
    path = minsnap.plan(*random_legs(0, 1))
    bare = rotors(Limits.of(dataclasses.replace(vehicle, drag=BodyDrag())), path)
    assert [used.value for used in rotors(Limits.of(vehicle), path)] == [used.value for used in bare]


def test_limits_of_a_vehicle_have_its_gravity():
    """Else its rotors were measured in one, and thrust in another."""
    limits = Limits.of(VEHICLES["crazyflie"])
    with pytest.raises(minsnap.InputError, match="vehicle"):
        dataclasses.replace(limits, gravity=1.62)
