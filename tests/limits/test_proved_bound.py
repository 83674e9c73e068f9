"""Proofs of a vehicle's limits: bounds on parts hold for all instants inside, and close in on them as parts shrink."""

from dataclasses import replace

import numpy as np
import pytest
from tasks import spinless

import minsnap
from minsnap.limits import vehicle_use
from minsnap.limits.vehicle_use import LIFTED, VehicleBound, _divided, motion_points, proved
from minsnap.native.library import using
from minsnap.native.vehicle_bounds import vehicle_bounds
from minsnap.trajectory.heading import RemappedHeading
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle import BodyDrag, Quadrotor, flatness_of

VEHICLE = Quadrotor.dji_f330()
SKEW = Quadrotor(1.0, [[5e-3, 1e-4, 2e-4], [1e-4, 6e-3, 3e-4], [2e-4, 3e-4, 9e-3]], 0.2, 1e-5, 2e-7, 900.0)
LINEAR, BOTH = BodyDrag((0.2, 0.2, 0.3)), BodyDrag((0.2, 0.2, 0.3), (0.05, 0.05, 0.1))
ALL = dict.fromkeys(LIFTED, 1.0)
STILL = Trajectory(np.zeros((1, 8, 3)), [1.0])


@pytest.mark.parametrize(
    ("share_open", "counts"),
    ((1.0, [1, 8, 32, 128, 512]), (0.0, [1, 8, 4, 4, 4, 4, 4, 4, 4])),
)
def test_what_is_not_proved_is_raised_to_its_own_bound(share_open, counts, monkeypatch):
    """Parts that begin up to ``share_open`` are open, until they would be too many, or were divided too often."""
    monkeypatch.setattr(vehicle_use, "VEHICLE_USE", replace(vehicle_use.VEHICLE_USE, most=512))
    found = []

    def bounds(points, start, width):
        found.append(len(start))
        return np.stack((np.where(start <= share_open, 2.0, 0.5), np.full(len(start), 4.0)))

    assert proved(np.array([1.0, 5.0]), bounds, STILL).tolist() == [2.0, 5.0]
    assert found == counts


@pytest.mark.parametrize(("attained", "most"), [(1.9, 2.0), (2.1, 2.1)])
def test_what_samples_missed_is_sampled_where_parts_stay_open(attained, most):
    """A peak that is narrow: parts are sampled in their middle, and closed once values are beyond it."""
    asked = []

    def bounds(points, start, width):
        return np.where((start <= 0.3) & (0.3 <= start + width), 2.0, 0.5)[None]

    def missed(middle):
        asked.append(middle)
        return np.array([attained if attained > 2.0 else np.nan])

    assert proved(np.array([1.0]), bounds, STILL, missed).tolist() == [most]
    found = np.concatenate(asked)
    assert (np.abs(found - 0.3) <= STILL.duration / 256.0).all() and (len(asked) == 1) == (attained > 2.0)


def test_what_has_no_bound_is_infinite(monkeypatch):
    monkeypatch.setattr(vehicle_use, "VEHICLE_USE", replace(vehicle_use.VEHICLE_USE, most=512))
    assert proved(np.array([1.0]), lambda points, start, width: start[None] * np.nan, STILL) == np.inf


def moving(vehicle, drag, yaw):
    """A path with its bounds: at speed from beginning to end, so that the direction of the drag is known."""
    vehicle = replace(vehicle, drag=drag)
    ends = {"start": {"velocity": (2.0, 0.5, 0.2)}, "end": {"velocity": (1.0, 2.0, 0.5)}}
    path = minsnap.plan([(0, 0, 0), (2, 1, 0), (3, 3, 1)], [1.2, 1.5], yaw=yaw, **ends)
    path = path if yaw else spinless(path, vehicle)
    return path, VehicleBound(vehicle, path, ALL)


def gaps(bound, path, parts, inside=5):
    """How far bounds on parts are above the largest of some samples inside, (quantities, parts)."""
    points, start, width = _divided(motion_points(path), path.breaks[:-1], path.durations, parts)
    t = start[:, None] + width[:, None] * np.linspace(0.0, 1.0, inside)
    states = flatness_of(bound.vehicle, path, t.reshape(-1), drag=bound.vehicle.drag)
    most = bound._quantities(states).reshape(len(bound.names), -1, inside).max(axis=2)
    return bound.bounds(bound.names, points, start, width) - most


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
    numbers = VehicleBound(VEHICLE, STILL, {})._numbers
    thrust, _, tangent, rate, most, _ = vehicle_bounds(numbers, falling, np.ones(1), np.array([[1.0, 0, 0, 0]]))[0]
    assert thrust <= 1.0 + 1e-12 and np.isinf([tangent, rate, most]).all()


def test_a_heading_around_its_middle_is_bounded_by_its_third_derivative():
    """A hover that begins to turn about its axis at that rate: torque follows from the angular acceleration."""
    hover, half, jerk = np.zeros((1, 4, 3, 1)), 1e-3, 3.0
    numbers, lever = VehicleBound(VEHICLE, STILL, {})._numbers, np.abs(VEHICLE.inverse_mixer[:, 3]).max()
    most = vehicle_bounds(numbers, hover, np.array([half]), np.array([[0.6, 0.8, 0.0, 0.0]]), jerk)[0, 4]
    torque = (VEHICLE.inertia @ [0.0, 0.0, half * jerk])[2]
    assert most - VEHICLE.hover_thrust == pytest.approx(lever * torque, rel=1e-2)


def test_more_control_points_than_it_takes_are_refused():
    numbers = VehicleBound(VEHICLE, STILL, {})._numbers
    with pytest.raises(ValueError, match="65 control points"):
        vehicle_bounds(numbers, np.zeros((1, 4, 3, 65)), np.ones(1))


def test_without_the_native_core_nothing_is_proved():
    with using("python"):
        assert not VehicleBound(VEHICLE, STILL, {})._provable.any()
        assert vehicle_bounds(VehicleBound(VEHICLE, STILL, {})._numbers, np.zeros((1, 4, 3, 2)), np.ones(1)) is None


def test_the_third_derivative_of_a_yaw_on_another_clock():
    path = minsnap.plan([(0, 0, 0), (2, 1, 0), (3, 3, 1)], [1.0, 1.5], yaw=[0.0, 2.0, -1.0])
    largest = path.yaw.largest_jerk
    assert largest >= np.abs(path.yaw(np.linspace(0.0, 2.5, 999), 3)).max() > 0.0
    assert RemappedHeading(path.yaw, 2.0, -0.5).largest_jerk == pytest.approx(largest / 8.0, rel=1e-12)
    assert minsnap.plan([(0, 0, 0), (2, 1, 0)], [1.0], yaw=0.3).yaw.largest_jerk == 0.0
    assert minsnap.plan([(0, 0, 0), (2, 1, 0)], [1.0], yaw="velocity").yaw.largest_jerk == np.inf
