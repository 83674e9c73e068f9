"""Proofs of a vehicle's limits: bounds on parts hold for all instants inside, and close in on them as parts shrink."""

from dataclasses import replace

import numpy as np
import pytest
from tasks import spinless

import minsnap
from minsnap.limits import vehicle_use
from minsnap.limits.vehicle_use import LIFTED, VehicleBound
from minsnap.native.library import using
from minsnap.native.vehicle_proof import vehicle_bounds
from minsnap.polynomials.bernstein import differentiate, elevate, subdivide
from minsnap.trajectory.heading import RemappedHeading
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle import BodyDrag, Quadrotor, flatness_of

VEHICLE = Quadrotor.dji_f330()
SKEW = Quadrotor(1.0, [[5e-3, 1e-4, 2e-4], [1e-4, 6e-3, 3e-4], [2e-4, 3e-4, 9e-3]], 0.2, 1e-5, 2e-7, 900.0)
LINEAR, BOTH = BodyDrag((0.2, 0.2, 0.3)), BodyDrag((0.2, 0.2, 0.3), (0.05, 0.05, 0.1))
ALL = dict.fromkeys(LIFTED, 1.0)
STILL = Trajectory(np.zeros((1, 8, 3)), [1.0])


def through_a_turn(**asked):
    path = minsnap.plan([(0, 0, 0), (2, 1, 0), (3, 3, 1)], [1.2, 1.5], yaw=[0.0, 2.0, -1.0], **asked)
    return path, VehicleBound(replace(VEHICLE, drag=BOTH), path, ALL)


def proved(bound, values):
    return bound._proved(values, np.ones(len(values), dtype=np.bool_))


@pytest.mark.parametrize(("rounds", "parts"), [(1, 1), (2, 8), (3, 32)])
def test_what_is_not_proved_is_raised_to_its_own_bound(rounds, parts, monkeypatch):
    """Nothing is proved of values that are exceeded everywhere, and all parts are divided round after round."""
    monkeypatch.setattr(vehicle_use, "VEHICLE_USE", replace(vehicle_use.VEHICLE_USE, rounds=rounds))
    path, bound = through_a_turn()
    found = proved(bound, np.full(6, -9.0))
    assert found == pytest.approx(bounds_on_parts(bound, path, parts)[0].max(axis=1), rel=1e-9)


def test_parts_are_divided_no_more_where_they_would_be_too_many(monkeypatch):
    monkeypatch.setattr(vehicle_use, "VEHICLE_USE", replace(vehicle_use.VEHICLE_USE, most=2 * 32 - 1))
    path, bound = through_a_turn()
    assert proved(bound, np.full(6, -9.0)) == pytest.approx(bounds_on_parts(bound, path, 8)[0].max(axis=1), rel=1e-9)


def test_what_samples_missed_is_sampled_where_parts_stay_open():
    """From values that are exceeded, it comes to the largest of many samples, and barely beyond."""
    path, bound = through_a_turn()
    largest = bound.sampled(4096)[1].max(axis=1)
    found = proved(bound, largest - 0.2 * np.abs(largest))
    assert (largest <= found).all() and (found <= largest + 0.2 * bound.margins).all()


def test_values_that_hold_stay_as_they_are():
    path, bound = through_a_turn()
    above = bound.sampled()[1].max(axis=1) + bound.margins
    assert (proved(bound, above) == above).all()


def test_what_has_no_bound_is_infinite():
    """Thrust that vanishes on the way down has no direction."""
    falling = Trajectory(np.array([[(0.0, 0.0, z) for z in (0.0, 0.0, 0.25, 0.25, -0.75, -3.75)]]), [1.0])
    found = proved(VehicleBound(VEHICLE, falling, ALL), np.zeros(6))
    assert np.isinf(found[3:]).all() and np.isfinite(found[:3]).all()


@pytest.mark.parametrize("yaw", [0.4, [0.0, 2.0, -1.0, 0.0, 3.0], None], ids=["constant", "turning", "without spin"])
@pytest.mark.parametrize("drag", (BodyDrag(), LINEAR, BOTH), ids=["no drag", "linear", "quadratic too"])
def test_largest_samples_are_those_of_the_python_core(yaw, drag):
    """Of one that flies at speed, and over its back."""
    vehicle = replace(SKEW, drag=drag)
    path = minsnap.plan([(0, 0, 0), (2, 1, 0), (3, 3, 1), (3, 3, 4), (4, 3, 0)], [1.2, 1.0, 0.5, 0.6], yaw=yaw)
    bound = VehicleBound(vehicle, path if yaw else spinless(path, vehicle), ALL)
    t, sampled = bound.sampled(vehicle_use.VEHICLE_USE.fewer)
    values, instants = bound._largest(prove=True)
    assert sampled[2].max() > 1.6  # over its back
    assert values == pytest.approx(sampled.max(axis=1), rel=1e-8) and (instants == t[sampled.argmax(axis=1)]).all()


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 11])
def test_curves_of_every_degree_are_sampled_and_proved(degree):
    """Derivatives beyond the degree are zero."""
    path = Trajectory(np.random.default_rng(degree).normal(size=(2, degree + 1, 3)), [1.0, 1.5])
    bound = VehicleBound(VEHICLE, path, ALL)
    t, sampled = bound.sampled(vehicle_use.VEHICLE_USE.fewer)
    largest = bound._largest(True)[0]
    assert largest == pytest.approx(sampled.max(axis=1), rel=1e-9)
    assert (proved(bound, largest + bound.margins) >= bound.sampled(999)[1].max(axis=1)).all()


def test_a_yaw_on_another_clock_is_proved_too():
    path, _ = through_a_turn()
    back = path.with_yaw(RemappedHeading(RemappedHeading(path.yaw, path.duration, -1.0), 0.25, 0.5))
    bound = VehicleBound(VEHICLE, back, {})
    t, sampled = bound.sampled(vehicle_use.VEHICLE_USE.fewer)
    assert bound._provable.all() and bound._largest(True)[0] == pytest.approx(sampled.max(axis=1), rel=1e-9)


def moving(vehicle, drag, yaw):
    """A path with its bounds: at speed from beginning to end, so that the direction of the drag is known."""
    vehicle = replace(vehicle, drag=drag)
    ends = {"start": {"velocity": (2.0, 0.5, 0.2)}, "end": {"velocity": (1.0, 2.0, 0.5)}}
    path = minsnap.plan([(0, 0, 0), (2, 1, 0), (3, 3, 1)], [1.2, 1.5], yaw=yaw, **ends)
    path = path if yaw else spinless(path, vehicle)
    return path, VehicleBound(vehicle, path, ALL)


def bounds_on_parts(bound, path, parts):
    """Bounds on equal parts of every piece, (quantities, parts), and where these begin and how wide they are [s]."""
    control, size = path.control_points, path.control_points.shape[1] - 1
    scaled = (differentiate(control, order) / path.durations[:, None, None] ** order for order in range(1, 5))
    motion = np.stack([elevate(part.transpose(0, 2, 1), size) for part in scaled], axis=1)
    points = subdivide(motion.reshape(-1, size), parts).reshape(-1, 12, parts, size).transpose(0, 2, 1, 3)
    start = (path.breaks[:-1, None] + path.durations[:, None] * np.arange(parts) / parts).reshape(-1)
    half = np.repeat(0.5 * path.durations / parts, parts)
    axes, yaw = path.yaw.axes(start + half), [path.yaw(start + half, order) for order in range(3)]
    turns = np.stack((np.cos(yaw[0]), np.sin(yaw[0]), yaw[1], yaw[2]), axis=1)
    heading = {"yaw": turns, "jerk": path.yaw.largest_jerk}
    if axes is not None:
        heading = {"axes": np.ascontiguousarray(np.moveaxis(np.array(axes[:2]), 2, 0))}
    points = np.ascontiguousarray(points).reshape(-1, 4, 3, size)
    thrust, least, tangent, rate, most, down = vehicle_bounds(bound._question().vehicle, points, half, **heading).T
    tilt = np.where(np.isfinite(tangent), np.arctan(np.sqrt(tangent)), np.pi)
    lifted = thrust / bound.medium.gravity, least / bound.medium.gravity, tilt, np.sqrt(rate)
    return np.array([*lifted, most - bound.hover, down + bound.hover]), start, 2.0 * half


def gaps(bound, path, parts, inside=5):
    """How far bounds on parts are above the largest of some samples inside, (quantities, parts)."""
    found, start, width = bounds_on_parts(bound, path, parts)
    t = start[:, None] + width[:, None] * np.linspace(0.0, 1.0, inside)
    states = flatness_of(bound.vehicle, path, t.reshape(-1), drag=bound.vehicle.drag)
    return found - bound._quantities(states).reshape(len(bound.names), -1, inside).max(axis=2)


@pytest.mark.parametrize("yaw", ([0.0, 2.0, -1.0], None), ids=["turning", "without spin"])
@pytest.mark.parametrize("drag", (BodyDrag(), LINEAR, BOTH), ids=["no drag", "linear", "quadratic too"])
@pytest.mark.parametrize("vehicle", [VEHICLE, SKEW], ids=["f330", "skew inertia"])
def test_bounds_of_parts_hold_for_samples_inside_and_close_in_with_the_square_of_the_length(vehicle, drag, yaw):
    path, bound = moving(vehicle, drag, yaw)
    coarse, fine = (gaps(bound, path, parts) for parts in (32, 256))
    assert min(coarse.min(), fine.min()) >= -1e-11
    assert bound._provable.all() and (fine.max(axis=1) <= 0.07 * coarse.max(axis=1)).all()


@pytest.mark.parametrize("drag", (BodyDrag(), BOTH), ids=["no drag", "drag"])
def test_at_rest_they_hold_and_close_in_too(drag):
    """The direction of the drag is not known there."""
    path = minsnap.plan([(0, 0, 0), (2, 1, 0), (3, 3, 1)], [1.2, 1.5], yaw=[0.0, 2.0, -1.0])
    bound = VehicleBound(replace(VEHICLE, drag=drag), path, ALL)
    coarse, fine = (gaps(bound, path, parts) for parts in (32, 256))
    assert min(coarse.min(), fine.min()) >= -1e-11
    assert (fine.max(axis=1) <= 0.2 * coarse.max(axis=1)).all()


@pytest.mark.parametrize("seed", range(30))
def test_bounds_hold_for_wild_curves(seed):
    """Many samples inside parts of a random curve, which may fall and turn over."""
    random = np.random.default_rng(seed)
    path = Trajectory(random.normal(size=(1, 8, 3)) * [1.0, 1.0, 0.3], random.uniform(0.8, 3.0, 1))
    bound = VehicleBound(replace(SKEW, drag=BOTH if seed % 2 else BodyDrag()), path, ALL)
    found = gaps(bound, path, 64, 41)
    assert (found >= -1e-9 * (1.0 + np.abs(found))).all()
    assert np.isfinite(found).any(axis=1).all()


def test_a_thrust_that_may_vanish_bounds_no_rate():
    falling = np.zeros((1, 4, 3, 3))
    falling[0, 1, 2] = -VEHICLE.gravity + np.array([-1.0, 0.0, 1.0])
    numbers = VehicleBound(VEHICLE, STILL, {})._question().vehicle
    thrust, _, tangent, rate, most, _ = vehicle_bounds(numbers, falling, np.ones(1), np.array([[1.0, 0, 0, 0]]))[0]
    assert thrust <= 1.0 + 1e-12 and np.isinf([tangent, rate, most]).all()


def test_a_heading_around_its_middle_is_bounded_by_its_third_derivative():
    """A hover that begins to turn about its axis at that rate: torque follows from the angular acceleration."""
    hover, half, jerk = np.zeros((1, 4, 3, 1)), 1e-3, 3.0
    numbers, lever = VehicleBound(VEHICLE, STILL, {})._question().vehicle, np.abs(VEHICLE.inverse_mixer[:, 3]).max()
    most = vehicle_bounds(numbers, hover, np.array([half]), np.array([[0.6, 0.8, 0.0, 0.0]]), jerk)[0, 4]
    torque = (VEHICLE.inertia @ [0.0, 0.0, half * jerk])[2]
    assert most - VEHICLE.hover_thrust == pytest.approx(lever * torque, rel=1e-2)


def test_more_control_points_than_it_takes_are_refused():
    numbers = VehicleBound(VEHICLE, STILL, {})._question().vehicle
    with pytest.raises(ValueError, match="65 control points"):
        vehicle_bounds(numbers, np.zeros((1, 4, 3, 65)), np.ones(1))


def test_without_the_native_core_nothing_is_proved():
    with using("python"):
        assert not VehicleBound(VEHICLE, STILL, {})._provable.any()
        assert (
            vehicle_bounds(VehicleBound(VEHICLE, STILL, {})._question().vehicle, np.zeros((1, 4, 3, 2)), np.ones(1))
            is None
        )


def test_the_third_derivative_of_a_yaw_on_another_clock():
    path = minsnap.plan([(0, 0, 0), (2, 1, 0), (3, 3, 1)], [1.0, 1.5], yaw=[0.0, 2.0, -1.0])
    largest = path.yaw.largest_jerk
    assert largest >= np.abs(path.yaw(np.linspace(0.0, 2.5, 999), 3)).max() > 0.0
    assert RemappedHeading(path.yaw, 2.0, -0.5).largest_jerk == pytest.approx(largest / 8.0, rel=1e-12)
    assert minsnap.plan([(0, 0, 0), (2, 1, 0)], [1.0], yaw=0.3).yaw.largest_jerk == 0.0
    assert minsnap.plan([(0, 0, 0), (2, 1, 0)], [1.0], yaw="velocity").yaw.largest_jerk == np.inf
