"""Ranges that proofs of a vehicle's limits begin with: of single motions exact, else around all that moves inside."""

from dataclasses import replace

import numpy as np
import pytest
from tasks import spinless

import minsnap
from minsnap.limits import proved_bound
from minsnap.limits.proved_bound import Lift, _divided, _pieces, proved
from minsnap.limits.rotor_bounds import axis_ranges, heading_ranges
from minsnap.limits.vehicle_use import LIFTED, VehicleBound
from minsnap.polynomials.intervals import Interval
from minsnap.trajectory.heading import RemappedHeading
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle import BodyDrag, Quadrotor, flatness_of

VEHICLE = Quadrotor.dji_f330()
QUADRATIC = 0.3
STEP = 1e-4


def columns(values):
    """Ranges of single vectors (m, 3)."""
    return tuple(Interval(column, column) for column in values.T)


def ranges(middle, half):
    """Ranges around vectors (m, 3)."""
    return tuple(Interval(column - spread, column + spread) for column, spread in zip(middle.T, half.T, strict=True))


def force(values, t):
    """Of f + q |v| v with linear f and v: rows are control points of f, f', f'', v, v', v'' at a single instant."""
    f, change, bend, v, a, j = values
    moved, speed = f + t * change + t * t / 2.0 * bend, v + t * a + t * t / 2.0 * j
    return moved + QUADRATIC * np.linalg.norm(speed) * speed


@pytest.mark.parametrize("seed", range(5))
def test_quadratic_drag_is_differentiated_twice(seed):
    """Against differences of the formula itself."""
    values = np.random.default_rng(seed).normal(size=(6, 3)) + [2.0, 0.0, 1.0]
    lift = Lift.of(QUADRATIC, values.reshape(1, 18, 1))
    before, at, after = (force(values, t) for t in (-STEP, 0.0, STEP))
    exact = at, (after - before) / (2.0 * STEP), (after - 2.0 * at + before) / STEP**2
    for found, expected in zip((lift.force, lift.change, lift.bend), exact, strict=True):
        for axis, value in zip(found, expected, strict=True):
            assert (axis.low[0], axis.high[0]) == pytest.approx((value, value), rel=1e-6, abs=1e-6)
    assert [axis.low[0] for axis in lift.velocity] == list(values[3])


@pytest.mark.parametrize(
    ("share_open", "counts"),
    ((1.0, [1, 32, 128, 512]), (0.0, [1, 32, 4, 4, 4, 4, 4, 4, 4])),
)
def test_what_is_not_proved_is_raised_to_its_own_bound(share_open, counts, monkeypatch):
    """Parts that begin up to ``share_open`` are open, until they would be too many, or were divided too often."""
    monkeypatch.setattr(proved_bound, "MOST", 512)
    path, found = Trajectory(np.zeros((1, 4, 3)), [1.0]), []

    def bounds(lift, start, width):
        found.append(len(start))
        return np.stack((np.where(start <= share_open, 2.0, 0.5), np.full(len(start), 4.0)))

    medium = VehicleBound(VEHICLE, path, {}).medium
    assert proved(np.array([1.0, 5.0]), bounds, medium, path).tolist() == [2.0, 5.0]
    assert found == counts


def test_what_has_no_bound_is_infinite(monkeypatch):
    path = Trajectory(np.zeros((1, 4, 3)), [1.0])
    medium = VehicleBound(VEHICLE, path, {}).medium
    monkeypatch.setattr(proved_bound, "MOST", 512)
    assert proved(np.array([1.0]), lambda lift, start, width: start[None] * np.nan, medium, path) == np.inf


def test_without_drag_there_is_no_velocity():
    lift = Lift.of(0.0, np.arange(9.0).reshape(1, 9, 1))
    assert lift.velocity is None
    assert [axis.low[0] for axis in (*lift.force, *lift.change, *lift.bend)] == list(range(9))


def test_bounds_of_single_motions_are_what_they_bound():
    random = np.random.default_rng(3)
    f, change = random.normal(size=(2, 50, 3)) * [[[9.0, 9.0, 9.0]], [[5.0, 5.0, 5.0]]]
    f[:10] /= 50.0  # close to free fall
    path = Trajectory(np.zeros((1, 4, 3)), [1.0])
    bound = VehicleBound(VEHICLE, path, {})
    lift = Lift(columns(f), columns(change), columns(f), columns(np.zeros((50, 3))))
    most, least, tilt, rate = bound.bounds(LIFTED, lift, np.zeros(50), np.ones(50))
    size = np.linalg.norm(f, axis=1)
    assert most == pytest.approx(size / VEHICLE.gravity) and least == pytest.approx(-size / VEHICLE.gravity)
    up = f[:, 2] > 0.0
    assert tilt[up] == pytest.approx(np.arccos(f[up, 2] / size[up])) and (tilt[~up] == np.pi).all()
    assert rate == pytest.approx(np.linalg.norm(np.cross(f, change), axis=1) / size**2)


@pytest.mark.parametrize("seed", range(3))
def test_bounds_of_ranges_hold_for_every_motion_inside(seed):
    random = np.random.default_rng(seed)
    middle, half = random.normal(size=(2, 40, 3)) * 5.0, random.uniform(0.1, 1.0, (2, 40, 3))
    middle[0, :, 2] += 9.0
    lift = Lift(*(ranges(m, h) for m, h in zip(middle, half, strict=True)), columns(middle[0]), None)
    bound = VehicleBound(VEHICLE, Trajectory(np.zeros((1, 4, 3)), [1.0]), {})
    most, least, tilt, rate = bound.bounds(LIFTED, lift, np.zeros(40), np.ones(40))
    for _ in range(300):
        f, change = middle + half * random.choice((-1.0, 0.0, 1.0), (2, 40, 3))
        size = np.linalg.norm(f, axis=1)
        assert (size <= (1.0 + 1e-12) * most * VEHICLE.gravity).all()
        assert (size >= -(1.0 - 1e-12) * least * VEHICLE.gravity).all()
        assert (np.arccos(f[:, 2] / size) <= tilt + 1e-12).all()
        assert (np.linalg.norm(np.cross(f, change), axis=1) <= (1.0 + 1e-12) * rate * size**2).all()


@pytest.mark.parametrize("yaw", ([0.0, 2.0, -1.0], None))
@pytest.mark.parametrize("drag", (BodyDrag(), BodyDrag((0.2, 0.2, 0.3), (0.05, 0.05, 0.1))))
def test_bounds_of_parts_hold_for_samples_inside_and_close_in_on_them(drag, yaw):
    """With a planned yaw, or without spin; an eighth of the width leaves an eighth of the distance."""
    vehicle = replace(VEHICLE, drag=drag)
    path = minsnap.plan([(0, 0, 0), (2, 1, 0), (3, 3, 1)], [1.2, 1.5], yaw=yaw)
    path = path if yaw else spinless(path, vehicle)
    bound = VehicleBound(vehicle, path, dict.fromkeys(LIFTED, 1.0))
    gaps = []
    for parts in (32, 256):
        points, start, width = _divided(*_pieces(bound.medium, path), parts)
        found = bound.bounds(bound.names, Lift.of(bound.medium.quadratic, points), start, width)
        t = start[:, None] + width[:, None] * np.linspace(0.0, 1.0, 5)
        inside = bound._quantities(flatness_of(vehicle, path, t.reshape(-1), drag=drag))
        gap = found - inside.reshape(len(found), -1, 5).max(axis=2)
        assert (gap >= -1e-12).all()
        gaps.append(gap.max(axis=1))
    assert bound._provable.all() and (gaps[1] <= 0.2 * gaps[0]).all()


def test_ranges_of_a_planned_yaw_are_around_it_and_its_derivatives():
    path = minsnap.plan([(0, 0, 0), (2, 1, 0), (3, 3, 1)], [1.0, 1.5], yaw=[0.0, 2.0, -1.0])
    middle = np.linspace(0.1, 0.9, 9)
    half = np.full(9, 0.1)
    found = VehicleBound(VEHICLE, path, {})._yaw_ranges(middle, half)
    for share in np.linspace(-1.0, 1.0, 21):
        for order, part in enumerate(found):
            value = path.yaw(middle + share * half, order)
            assert (part.low <= value + 1e-9).all() and (value <= part.high + 1e-9).all()


def test_the_third_derivative_of_a_yaw_on_another_clock():
    path = minsnap.plan([(0, 0, 0), (2, 1, 0), (3, 3, 1)], [1.0, 1.5], yaw=[0.0, 2.0, -1.0])
    largest = path.yaw.largest_jerk
    assert largest >= np.abs(path.yaw(np.linspace(0.0, 2.5, 999), 3)).max() > 0.0
    assert RemappedHeading(path.yaw, 2.0, -0.5).largest_jerk == pytest.approx(largest / 8.0, rel=1e-12)
    assert minsnap.plan([(0, 0, 0), (2, 1, 0)], [1.0], yaw=0.3).yaw.largest_jerk == 0.0
    assert minsnap.plan([(0, 0, 0), (2, 1, 0)], [1.0], yaw="velocity").yaw.largest_jerk == np.inf


def test_directions_of_a_heading_are_around_all_that_it_can_be():
    random = np.random.default_rng(4)
    middle = random.normal(size=(3, 200)) * [[4.0], [2.0], [2.0]]
    half = 10.0 ** random.uniform(-4.0, -1.0, (3, 200))
    ranges = heading_ranges(*(Interval(m - h, m + h) for m, h in zip(middle, half, strict=True)))
    for share in (-1.0, -0.3, 0.0, 0.8, 1.0):
        yaw, rate, turn = middle + share * half
        c, s, zero = np.cos(yaw), np.sin(yaw), np.zeros(200)
        exact = (c, s, zero), (-rate * s, rate * c, zero), (-turn * s - rate**2 * c, turn * c - rate**2 * s, zero)
        for vector, values in zip(ranges, exact, strict=True):
            for axis, value in zip(vector, values, strict=True):
                assert (axis.low <= value + 1e-12).all() and (value <= axis.high + 1e-12).all()
                assert (axis.high - axis.low <= 500.0 * half.max(axis=0)).all()


def test_components_of_axes_are_never_beyond_one():
    force, jerk = columns(np.array([[0.0, 0.0, 1.0]])), columns(np.array([[5.0, 0.0, 0.0]]))
    axes = np.array([[1.0], [0.0], [0.0]]), np.array([[0.0], [1.0], [0.0]])
    for axis in axis_ranges(force, jerk, axes, np.array([10.0])):
        assert all(-1.0 <= part.low[0] <= part.high[0] <= 1.0 for part in axis)


def test_axes_turn_as_fast_as_a_small_force_turns():
    """0.1 m/s^2 upwards and 1 m/s^3 across turn by 0.1 rad in 10 ms."""
    force, jerk = columns(np.array([[0.0, 0.0, 0.1]])), columns(np.array([[1.0, 0.0, 0.0]]))
    axes = np.zeros((3, 1)), np.zeros((3, 1))
    for axis in axis_ranges(force, jerk, axes, np.array([0.01])):
        assert [part.high[0] for part in axis] == pytest.approx([0.1] * 3)
