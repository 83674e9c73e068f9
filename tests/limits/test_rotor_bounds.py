"""Ranges of rotor thrusts: of single motions they are the thrusts, of ranges they hold whatever moves inside."""

import numpy as np
import pytest

import minsnap
from minsnap.limits.rotor_bounds import Part, axis_ranges, heading_ranges, rotor_ranges
from minsnap.polynomials.intervals import Interval, length
from minsnap.vehicle import BodyDrag, Quadrotor, flat_states

VEHICLE = Quadrotor.dji_f330()
SKEW = Quadrotor(1.0, [[5e-3, 1e-4, 2e-4], [1e-4, 6e-3, 3e-4], [2e-4, 3e-4, 9e-3]], 0.2, 1e-5, 2e-7, 900.0)


def motions(seed, count=200):
    """Acceleration, jerk, snap (count, 3) and yaw with two derivatives (count,), thrust upwards."""
    draw = np.random.default_rng(seed)
    return [scale * draw.normal(size=(count, 3)) for scale in (3.0, 5.0, 20.0)], draw.normal(size=(3, count))


def thrusts(vehicle, derivatives, yaw):
    states = flat_states(vehicle, np.zeros_like(derivatives[0]), *derivatives, *yaw, drag=BodyDrag())
    return vehicle.thrust_coefficient * states.rotor_speed * np.abs(states.rotor_speed)


def ranges(vehicle, derivatives, yaw, spread=0.0):
    """Ranges around motions, wider by a share of their size."""

    def around(values):
        half = spread * (1.0 + np.abs(values))
        return Interval(values - half, values + half)

    lift = derivatives[0] + [0.0, 0.0, vehicle.gravity]
    vectors = [tuple(around(column) for column in values.T) for values in (lift, *derivatives[1:])]
    return rotor_ranges(vehicle, Part(length(vectors[0]), *vectors, heading_ranges(*(around(row) for row in yaw))))


@pytest.mark.parametrize("vehicle", [VEHICLE, SKEW], ids=["f330", "skew inertia"])
@pytest.mark.parametrize("seed", range(3))
def test_of_single_motions_they_are_the_thrusts(seed, vehicle):
    derivatives, yaw = motions(seed)
    expected = thrusts(vehicle, derivatives, yaw)
    for rotor, found in enumerate(ranges(vehicle, derivatives, yaw)):
        assert found.low == pytest.approx(expected[:, rotor], rel=1e-9, abs=1e-9)
        assert found.high == pytest.approx(expected[:, rotor], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("spread", [1e-4, 1e-3, 1e-2])
def test_of_ranges_they_hold_whatever_moves_inside(spread):
    derivatives, yaw = motions(5)
    found = ranges(VEHICLE, derivatives, yaw, spread)
    draw = np.random.default_rng(6)
    for _ in range(20):
        moved = [v + spread * (1.0 + np.abs(v)) * draw.uniform(-0.7, 0.7, v.shape) for v in (*derivatives, yaw)]
        expected = thrusts(VEHICLE, moved[:3], moved[3])
        for rotor, bound in enumerate(found):
            assert (bound.low <= expected[:, rotor] + 1e-12).all() and (expected[:, rotor] <= bound.high + 1e-12).all()


def test_they_close_in_on_the_thrust_as_ranges_shrink():
    derivatives, yaw = motions(7)
    widths = [
        np.mean([np.median(r.high - r.low) for r in ranges(VEHICLE, derivatives, yaw, s)]) for s in (1e-3, 1e-4, 1e-5)
    ]
    assert widths[1] / widths[0] == pytest.approx(0.1, rel=0.2) and widths[2] / widths[1] == pytest.approx(0.1, rel=0.2)


def test_a_thrust_that_may_vanish_bounds_nothing():
    fall = [np.array([[0.0, 0.0, -VEHICLE.gravity]]), np.ones((1, 3)), np.zeros((1, 3))]
    with np.errstate(all="ignore"):
        found = ranges(VEHICLE, fall, np.zeros((3, 1)), 0.01)
    assert not np.isfinite(found[0].high).any()


def test_axes_without_spin_stay_within_their_ranges():
    path = minsnap.plan([(0, 0, 1), (3, 1, 3), (5, -2, 2), (1, -3, 1)], [0.7, 0.6, 0.75], yaw="tilt")
    ends = np.linspace(0.0, path.duration, 200)
    middle, half = (ends[1:] + ends[:-1]) / 2.0, np.diff(ends) / 2.0
    inside = middle[:, None] + half[:, None] * np.linspace(-1.0, 1.0, 9)
    force, jerk = (path(inside, order) for order in (2, 3))
    force = force + [0.0, 0.0, 9.80665]
    given = [
        tuple(Interval(values[..., i].min(axis=1), values[..., i].max(axis=1)) for i in range(3))
        for values in (force, jerk)
    ]
    ranges = axis_ranges(*given, path.yaw.axes(middle)[:2], half)
    wide = 0.0
    for found, axis in zip(ranges, path.yaw.axes(inside.reshape(-1))[:2], strict=True):
        for bound, values in zip(found, axis, strict=True):
            values = values.reshape(inside.shape)
            assert (values.min(axis=1) >= bound.low - 1e-12).all() and (values.max(axis=1) <= bound.high + 1e-12).all()
            wide = max(wide, float(np.max((bound.high - bound.low) - np.ptp(values, axis=1))))
    assert 0.0 < wide < 0.3
