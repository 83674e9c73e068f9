"""Sets of acceleration and velocity: every state that limits allow lies in all of them; their support is attained."""

from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap import Limits
from minsnap.bounds.derivative_sets import bounding_sets
from minsnap.vehicle import BodyDrag, Quadrotor

RANDOM = np.random.default_rng(5)
LIMITS = [
    Limits(speed=3, acceleration=5),
    Limits(speed=3, acceleration=5, norm="axis"),
    Limits(horizontal_speed=3, climb_speed=1, descent_speed=2, horizontal_acceleration=4, vertical_acceleration=2),
    Limits(speed=3, climb_speed=1, max_thrust=1.8, tilt=0.6),
    Limits(speed=3, vertical_speed=1, acceleration=5, max_thrust=1.6, tilt=0.4, min_thrust=0.5),
]


def allowed(limits, order, count=400):
    """Random derivatives that limits allow, with others zero: many are at or near a limit."""
    values = RANDOM.normal(size=(count, 3)) * 10.0 ** RANDOM.uniform(-1, 0.5, (count, 1))
    found = []
    for value in values:
        for scale in (1.0, 0.5, 0.2, 0.05):
            used = limits.use_of_state({order: scale * value}, 3)
            if all(one.fraction <= 1.0 for one in used):
                found.append(scale * value)
                break
    return np.array(found)


def support(one, along):
    return float(one.support(along))


@pytest.mark.parametrize("limits", LIMITS)
@pytest.mark.parametrize("order", [1, 2])
def test_what_limits_allow_is_in_every_set(limits, order):
    sets = bounding_sets(limits, 3)
    states = allowed(limits, order)
    assert len(states) > 100
    for one in sets.velocities if order == 1 else sets.accelerations:
        for along in RANDOM.normal(size=(50, 3)) * [axis in one.covered for axis in range(3)]:
            assert (states @ along).max() <= support(one, along) * (1.0 + 1e-12)


def test_the_support_of_a_cut_cone_is_attained():
    cone = bounding_sets(Limits(max_thrust=2, tilt=0.6, gravity=10), 3).accelerations[1]
    turns = np.linspace(0, 2 * np.pi, 2001)
    rim = np.stack((20 * np.tan(0.6) * np.cos(turns), 20 * np.tan(0.6) * np.sin(turns), np.full(2001, 10.0)), axis=1)
    corners = np.concatenate((rim, [(0, 0, -10)]))
    for along in RANDOM.normal(size=(50, 3)):
        assert support(cone, along) == pytest.approx((corners @ along).max(), rel=1e-5)


def test_sets_scale_with_units():
    for one in bounding_sets(LIMITS[4], 3).accelerations:
        along = RANDOM.normal(size=3)
        assert support(one.scaled(3.0), along) == pytest.approx(3.0 * support(one, along))


@pytest.mark.parametrize(
    ("limits", "left_out"),
    [
        (Limits(speed=3, jerk=10, snap=50), ("jerk", "snap")),
        (Limits(speed=3, body_rate=3, yaw_rate=1), ("body rate", "yaw rate")),
        (Limits(max_thrust=2, min_thrust=0.5), ("the least thrust",)),
        (Limits(climb_speed=2, acceleration=3), ("climb speed",)),
        (Limits(climb_speed=2, speed=3), ()),
        (Limits(tilt=0.5, speed=3), ("tilt",)),
        (Limits(tilt=0.5, speed=3, acceleration=3), ()),
        (Limits(horizontal_speed=2, vertical_acceleration=3), ()),
    ],
)
def test_limits_are_used_or_named(limits, left_out):
    assert bounding_sets(limits, 3).left_out == left_out


def test_drag_leaves_out_thrust_where_no_speed_is_bounded():
    """Thrust then depends on the velocity, too."""
    dragged = Quadrotor.dji_f330()
    assert dragged.drag != BodyDrag()
    sets = bounding_sets(Limits.of(dragged), 3)
    assert not sets.accelerations
    assert "max thrust with drag" in sets.left_out
    without = bounding_sets(Limits.of(replace(dragged, drag=BodyDrag())), 3)
    assert without.accelerations[0].center == (0.0, 0.0, -dragged.gravity)
    assert without.left_out == ("the least thrust", "single rotors")


def test_the_first_set_covers_what_any_covers():
    sets = bounding_sets(Limits(horizontal_acceleration=3, max_thrust=2), 3)
    assert [len(one.covered) for one in sets.accelerations] == [3, 2]
    plane = bounding_sets(Limits(speed=3, acceleration=2), 2)
    assert plane.velocities[0].covered == {0, 1}


@pytest.mark.parametrize(
    ("speeds", "top"),
    [
        ({"speed": 6.0}, 6.0),
        ({"speed": 4.0, "norm": "axis"}, 4.0 * 3.0**0.5),
        ({"horizontal_speed": 4.0, "vertical_speed": 3.0}, 5.0),
        ({"horizontal_speed": 4.0, "climb_speed": 2.0, "descent_speed": 3.0}, 5.0),
    ],
)
def test_drag_widens_thrust_by_what_it_is_at_the_top_speed(speeds, top):
    """Any acceleration that a thrust within its limit makes at any allowed velocity is in the set, from the forces."""
    vehicle = replace(Quadrotor.dji_f330(), drag=BodyDrag((0.3, 0.4, 0.2), (0.02, 0.01, 0.05)))
    limits = Limits.of(vehicle, reserve=0.2, **speeds)
    sets = bounding_sets(limits, 3)
    (thrust,) = [one for one in sets.accelerations if one.center[2] < 0.0]
    assert not any("drag" in name for name in sets.left_out)
    random, (_, radius) = np.random.default_rng(1), thrust.balls[0]
    nearest = np.inf
    for _ in range(2000):
        velocity = random.normal(size=3)
        velocity *= top / np.linalg.norm(velocity)
        axes = np.linalg.qr(random.normal(size=(3, 3)))[0]
        along = axes.T @ velocity
        drag = -axes @ ((vehicle.drag.linear + np.linalg.norm(velocity) * vehicle.drag.quadratic) * along)
        pushed = limits.max_thrust * vehicle.weight * axes[:, 2] + drag
        nearest = min(nearest, radius - np.linalg.norm(pushed / vehicle.mass))
    assert 0.0 <= nearest < 0.6 * radius


def test_a_bound_with_drag_is_proved_and_above_that_of_the_speed_alone():
    points = [(0, 0, 1), (4, 1, 1), (2, 5, 2), (-1, 2, 1)]
    limits = Limits.of(Quadrotor.dji_f330(), reserve=0.2, speed=6.0)
    path = minsnap.plan(points, limits=limits, pieces=1)
    bound, speed = minsnap.least_time(points, limits), minsnap.least_time(points, Limits(speed=6.0))
    assert bound.verify() and speed.seconds < bound.seconds < path.duration
    assert bound.left_out == ("the least thrust", "single rotors away from hover")
    assert "max thrust with drag" in minsnap.least_time(points, Limits.of(Quadrotor.dji_f330(), tilt=0.5)).left_out
