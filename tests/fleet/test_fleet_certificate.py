"""Least distances of pairs against exact rationals and dense samples, and what else a fleet's certificate says."""

import re
from fractions import Fraction
from math import comb

import numpy as np
import pytest

import minsnap


def curve(rng, pieces, degree, end=8.0, span=6.0):
    """Return a smooth curve between random points, its pieces of random durations on dyadic breaks."""
    breaks = np.sort(rng.choice(np.arange(1, 64), pieces - 1, replace=False)) / 64.0
    durations = np.diff(np.concatenate(([0.0], breaks, [1.0]))) * end
    knots = rng.uniform(0.0, span, (pieces * degree + 1, 3))
    return minsnap.Trajectory(np.stack([knots[i * degree : (i + 1) * degree + 1] for i in range(pieces)]), durations)


def exact_square(one, two, t, downwash):
    """Return the squared distance at a rational instant, in exact arithmetic of the stored numbers."""
    places = []
    for each in (one, two):
        i = min(int(np.searchsorted(each.breaks, float(t), side="right")) - 1, len(each.durations) - 1)
        begin, end = Fraction(each.breaks[i]), Fraction(each.breaks[i + 1])
        s, n = (t - begin) / (end - begin), each.degree
        weights = [comb(n, j) * s**j * (1 - s) ** (n - j) for j in range(n + 1)]
        points = each.control_points[i].tolist()
        places.append([sum(w * Fraction(p[d]) for w, p in zip(weights, points, strict=True)) for d in range(3)])
    apart = [a - b for a, b in zip(*places, strict=True)]
    return apart[0] ** 2 + apart[1] ** 2 + (apart[2] / Fraction(downwash)) ** 2


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_least_distance_is_never_more_than_the_exact_one_and_is_reached(seed):
    rng = np.random.default_rng(seed)
    fleet = [curve(rng, int(rng.integers(1, 6)), int(degree)) for degree in rng.choice([3, 5, 7, 9, 12], 5)]
    found = minsnap.certify_fleet(fleet, minsnap.Separation(1.0, downwash=2.0), reach=1e6)
    assert len(found.nearest) == 10
    for near in found.nearest:
        one, two = (fleet[i] for i in near.pair)
        least = Fraction(near.distance) ** 2
        at = Fraction(near.instant)
        assert least <= exact_square(one, two, at, 2) <= least * Fraction(1 + 1e-9)
        instants = [at + Fraction(k, 512) for k in range(-4, 5)] + [Fraction(k, 16) for k in range(129)]
        assert all(least <= exact_square(one, two, t, 2) for t in instants if 0 <= t <= 8)


def test_the_fleets_least_distance_is_that_of_its_nearest_pair_however_far_apart():
    rng = np.random.default_rng(8)
    fleet = [curve(rng, 3, 7) for _ in range(9)]
    every = minsnap.certify_fleet(fleet, 1.0, reach=1e6).nearest[0]
    alone = minsnap.certify_fleet(fleet, 1e-6)
    assert (alone.least_distance, alone.pair, alone.instant) == (every.distance, every.pair, every.instant)
    assert alone.ok
    assert not alone.nearest
    assert not minsnap.certify_fleet(fleet, 1.01 * every.distance).ok


def test_threads_order_and_mirrors_change_nothing():
    rng = np.random.default_rng(3)
    fleet = [curve(rng, 2, 7) for _ in range(7)]
    first = minsnap.certify_fleet(fleet, 2.0, threads=1)
    assert minsnap.certify_fleet(fleet, 2.0, threads=3).nearest == first.nearest
    order = rng.permutation(7)
    permuted = minsnap.certify_fleet([fleet[i] for i in order], 2.0)
    assert permuted.least_distance == first.least_distance
    assert sorted(order[i] for i in permuted.pair) == list(first.pair)
    mirrored = [minsnap.Trajectory(each.control_points * [-1.0, 1.0, 1.0], each.durations) for each in fleet]
    assert minsnap.certify_fleet(mirrored, 2.0).least_distance == first.least_distance


def test_a_shifted_clock_is_caught():
    there = minsnap.plan([(0.0, 0.0, 1.0), (4.0, 0.0, 1.0)], total_time=4.0)
    across = minsnap.plan([(2.0, -2.0, 1.0), (2.0, 2.0, 1.0)], total_time=4.0)
    late = minsnap.plan([(2.0, -2.0, 1.0), (2.0, 2.0, 1.0)], total_time=6.0)
    assert minsnap.certify_fleet([there, across], 0.5).least_distance < 1e-9
    apart = minsnap.certify_fleet([there, late], 0.5)
    assert apart.ok
    assert minsnap.Fleet([there, late]).duration == 6.0
    assert minsnap.Fleet([there, late])(6.0)[0] == pytest.approx([4.0, 0.0, 1.0])
    with pytest.raises(minsnap.errors.IntervalError, match="the instants are 'x': give numbers"):
        minsnap.Fleet([there, late])("x")


def test_own_radii_add_up():
    lines = [minsnap.plan([(0.0, y, 1.0), (1.0, y, 1.0)], total_time=2.0) for y in (0.0, 1.0, 3.0)]
    found = minsnap.certify_fleet(lines, minsnap.Separation(radii=[0.4, 0.5, 1.8]))
    assert not found.ok
    assert (found.pair, found.nearest[0].required) == ((1, 2), 2.3)
    assert found.least_distance == pytest.approx(2.0, rel=1e-12)


def test_limits_and_room_name_the_vehicle():
    slow = minsnap.plan([(0.0, 0.0, 1.0), (1.0, 0.0, 1.0)], total_time=4.0)
    fast = minsnap.plan([(0.0, 2.0, 1.0), (4.0, 2.0, 1.0), (5.0, 2.0, 1.0)], total_time=4.0, degree=9)
    limits, room = minsnap.Limits(speed=2.0), ((-1.0, -1.0, 0.0), (4.5, 3.0, 2.0))
    found = minsnap.certify_fleet([slow, fast], 0.5, limits=limits, room=room)
    assert not found.ok
    assert found.utilisation[0].vehicle == 1
    assert found.utilisation[0].use.value == pytest.approx(fast.max_norm(1)[0])
    assert found.room_margins == pytest.approx([1.0, -0.5], abs=1e-9)
    own = minsnap.certify_fleet([slow, fast], 0.5, limits=[limits, minsnap.Limits(speed=9.0)])
    assert own.ok


@pytest.mark.parametrize(
    ("obstacle", "clearance"),
    [
        (minsnap.Cylinder((2.0, 1.0), 0.4), 0.6),
        (minsnap.Cylinder((2.0, 0.0), 0.4, high=0.7), 0.3),
        (minsnap.Cylinder((2.0, 0.1), 0.4), -0.3),
        (minsnap.Ellipsoid((2.0, 0.0, 3.0), 0.5), 1.5),
        (minsnap.Ellipsoid((2.0, 1.0, 1.0), (3.0, 0.25, 0.25)), 0.75),
        (minsnap.Cuboid((1.0, 0.5, 0.0), (2.0, 3.0, 2.0)), 0.5),
        (minsnap.Cuboid((1.0, -1.0, 0.5), (2.0, 1.0, 1.25)), -0.25),
    ],
)
def test_clearance_of_a_straight_line_is_that_of_geometry(obstacle, clearance):
    line = minsnap.plan([(0.0, 0.0, 1.0), (4.0, 0.0, 1.0)], total_time=4.0)
    found = minsnap.certify_fleet([line, line], avoid=[minsnap.Cylinder((9.0, 9.0), 1.0), obstacle])
    assert found.clearances == pytest.approx([clearance] * 2, abs=1e-9)
    assert found.nearest_obstacles.tolist() == [1, 1]
    assert found.ok == (clearance > 0.0)


def test_clearance_is_below_every_sample():
    rng = np.random.default_rng(5)
    curves = [curve(rng, 3, 7) for _ in range(4)]
    found = minsnap.certify_fleet(curves, avoid=minsnap.Cylinder((3.0, 3.0), 0.5))
    for each, least in zip(curves, found.clearances, strict=True):
        away = np.linalg.norm(each(np.linspace(0.0, each.duration, 20001))[:, :2] - 3.0, axis=1) - 0.5
        assert least <= away.min() <= least + 1e-3


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"fleet": []}, "at least one"),
        ({"fleet": 3}, "not int"),
        ({"fleet": [1.0]}, "give a Trajectory"),
        ({"separation": 0.0}, "positive distance"),
        ({"separation": minsnap.Separation(radii=[1.0])}, "1 radii for 2"),
        ({"avoid": [4]}, "cylinders"),
        ({"limits": [minsnap.Limits(speed=1.0)]}, "1 limits for 2"),
        ({"room": ((0, 0), (1, 1))}, "Room with as many"),
        ({"reach": 0.1}, "reach"),
        ({"threads": 0}, "threads"),
    ],
)
def test_bad_input_is_one_sentence(arguments, sentence):
    line = minsnap.plan([(0.0, 0.0, 1.0), (4.0, 0.0, 1.0)], total_time=4.0)
    with pytest.raises(minsnap.InputError, match=sentence):
        minsnap.certify_fleet(**{"fleet": [line, line], "separation": 0.1, **arguments})


@pytest.mark.parametrize(
    ("asked", "fault"),
    [
        ({}, None),
        ({"separation": 1.5}, r"vehicles \(0, 1\) come as near as 1 m at"),
        ({"limits": minsnap.Limits(speed=1.0)}, r"vehicle [01]: speed reaches 2\.\d+ at .* s where 1 is allowed"),
        ({"room": [(0.0, 0.0, 0.0), (4.0, 0.8, 2.0)]}, "vehicle 1 leaves the room by 0.2 m"),
        ({"avoid": minsnap.Cylinder((2.0, 1.0), 0.25)}, r"vehicle 1 is 0\.25 m inside an obstacle"),
    ],
)
def test_a_certificate_names_its_first_fault(asked, fault):
    fleet = [minsnap.plan([(0.0, y, 1.0), (4.0, y, 1.0)], total_time=4.0) for y in (0.0, 1.0)]
    found = minsnap.certify_fleet(fleet, **{"separation": 0.9} | asked)
    assert found.ok is (fault is None)
    assert found.fault is None if fault is None else re.match(fault, found.fault)


def test_a_vehicle_that_jumps_does_not_fly():
    """A show whose formation began to move beside its place was called proved."""
    still = minsnap.plan([(0.0, 5.0, 1.0), (4.0, 5.0, 1.0)], total_time=4.0)
    one, two = (minsnap.plan([(x, 0.0, 1.0), (x + 1.0, 0.0, 1.0)], total_time=4.0) for x in (0.0, 1.5))
    jumping = minsnap.Trajectory(
        np.concatenate((one.control_points, two.control_points)), np.concatenate((one.durations, two.durations))
    )
    certificate = minsnap.certify_fleet([still, jumping], minsnap.Separation(1.0))
    assert not certificate.ok and certificate.jump == pytest.approx((1, 4.0, 0.5))
    assert minsnap.certify_fleet([still], minsnap.Separation(1.0)).jump is None


@pytest.mark.parametrize(
    "make",
    [
        lambda: minsnap.Separation(),
        lambda: minsnap.Separation(1.0, radii=[1.0]),
        lambda: minsnap.Separation(1.0, downwash=0.5),
        lambda: minsnap.Separation(radii=[1.0, -1.0]),
        lambda: minsnap.Cylinder((0.0,), 1.0),
        lambda: minsnap.Cylinder((0.0, 0.0), 0.0),
        lambda: minsnap.Cylinder((0.0, 0.0), 1.0, low=2.0, high=1.0),
        lambda: minsnap.Ellipsoid((0.0, 0.0, 0.0), (1.0, 0.0, 1.0)),
        lambda: minsnap.Cuboid((0.0, 0.0, 0.0), (1.0, -1.0, 1.0)),
    ],
)
def test_malformed_values_are_refused(make):
    with pytest.raises((minsnap.errors.FleetError, minsnap.errors.CorridorError)):
        make()
