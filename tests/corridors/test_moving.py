"""Obstacles that move: how near curves come to them, against samples and exact arithmetic; what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import minsnap
from minsnap.corridors.keep_out import as_still, name_of, named_obstacle, standing_at
from minsnap.corridors.moving import Moving, keeps_margin, nearest_moving
from minsnap.corridors.obstacle_margins import nearest_obstacle
from minsnap.errors import CorridorError
from minsnap.trajectory.trajectory import Trajectory

LINE = minsnap.line((0, 0, 1), (8, 0, 1), total_time=8.0).as_trajectory()


def curve_of(draw, dim, pieces=3, degree=5):
    points = draw.normal(size=(pieces, degree + 1, dim))
    points[1:, 0] = points[:-1, -1]
    return Trajectory(points, draw.uniform(0.3, 2.0, pieces))


@given(st.integers(0, 10_000))
def test_the_margin_is_below_all_samples_and_near_to_the_least_of_them(seed):
    draw = np.random.default_rng(seed)
    curve = curve_of(draw, int(draw.integers(2, 4)))
    rows = np.column_stack(
        (np.cumsum(draw.uniform(0.1, 1.5, 4)) - 1.0, draw.normal(size=(4, int(draw.integers(2, 4)))))
    )
    path = rows if draw.random() < 0.5 else curve_of(draw, rows.shape[1] - 1, degree=3)
    obstacle = Moving(path, draw.uniform(0.01, 0.3), growth=draw.choice([0.0, 0.1]))
    near = nearest_moving(curve, obstacle)
    instants = np.linspace(0.0, curve.duration, 20_001)
    sampled = obstacle.clearances(curve(instants), instants)
    assert sampled.min() - 2e-3 <= near.value <= sampled.min() + 1e-12
    assert obstacle.clearances(curve(near.instant), near.instant) == pytest.approx(near.value, abs=1e-6)


def test_the_margin_is_proved_in_exact_arithmetic_and_a_larger_one_is_not():
    draw = np.random.default_rng(3)
    for dim in (2, 3):
        curve, obstacle = curve_of(draw, dim), Moving(curve_of(draw, dim, degree=4), 0.01, growth=0.01)
        near = nearest_moving(curve, obstacle)
        assert near.value > 0.0 and keeps_margin(curve, obstacle, near.value)
        assert not keeps_margin(curve, obstacle, near.value + 1e-6)
    certificate = minsnap.certify(curve, avoid=[obstacle, minsnap.Cylinder((50, 50), 1.0)])
    assert certificate.verify() and certificate.nearest_obstacle.obstacle == 0
    wrong = replace(certificate.nearest_obstacle, value=certificate.obstacle_margin + 1e-6)
    assert not replace(certificate, nearest_obstacle=wrong).verify()


def test_a_crossing_obstacle_is_met_only_at_its_time():
    crossing = Moving([(0, 4, -4, 1), (8, 4, 4, 1)], 0.5)
    beside = Moving([(0, 4, -4, 1), (4, 4, -4, 1), (12, 4, 4, 1)], 0.5)
    met, passed = (nearest_obstacle(LINE, [each]) for each in (crossing, beside))
    assert met.value == pytest.approx(-0.5, abs=1e-6) and met.instant == pytest.approx(4.0, abs=1e-3)
    assert passed.value > 1.0
    assert "inside obstacle 0 at 4 s" in met.inside
    assert nearest_obstacle(LINE, [beside, crossing]).obstacle == 1


def test_what_grows_is_larger_later_and_a_later_clock_sees_it_where_it_is():
    seen = Moving([(1.0, 0, 0)], 0.3, growth=0.5)
    assert seen.radius_at(np.array([0.0, 1.0, 3.0])) == pytest.approx([0.3, 0.3, 1.3])
    assert seen.after(2.0).radius_at(1.0) == pytest.approx(1.3)
    moving = Moving([(0, 0, 0), (4, 8, 0)], 0.3)
    assert moving.after(1.0).center(1.0) == pytest.approx([4.0, 0.0])
    assert moving.center([-1.0, 9.0]).tolist() == [[0.0, 0.0], [8.0, 0.0]]
    assert [each.center.tolist() for each in standing_at(moving, np.array([0.0, 4.0]))] == [[0.0, 0.0], [8.0, 0.0]]


@pytest.mark.parametrize(
    "obstacle",
    [
        Moving([(0.5, 1, 2), (2, 3, 4), (5, 3, 4)], 0.4, growth=0.1),
        Moving([(1, 1, 2, 3)], 0.4, growth=0.5),
        Moving(LINE, 0.2),
        Moving(LINE, 0.2).after(1.5),
    ],
)
def test_names_and_numbers_make_it_again(obstacle):
    again = named_obstacle(*name_of(obstacle))
    instants = np.linspace(-1.0, 9.0, 41)
    assert (again.center(instants) == obstacle.center(instants)).all()
    assert (again.radius_at(instants) == obstacle.radius_at(instants)).all()


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Moving([(0, 1)], 0.5), "the path of a moving obstacle is .*: give a trajectory, or rows t, x, y"),
        (lambda: Moving([(0, 1, np.nan)], 0.5), "give a trajectory, or rows"),
        (lambda: Moving([], 0.5), "give a trajectory, or rows"),
        (lambda: Moving([(1, 0, 0), (1, 1, 0)], 0.5), "the instants of a moving obstacle do not increase at row 1"),
        (lambda: Moving(LINE, 0.0), "the radius of a moving obstacle is 0"),
        (lambda: Moving(LINE, 1.0, growth=-1), "the growth of a moving obstacle is -1"),
        (
            lambda: Moving(Trajectory([[(0.0,), (1.0,)]], [1.0]), 1.0),
            "a moving obstacle has 1 coordinates: give two or",
        ),
        (lambda: named_obstacle("moving", [0.5, 0, 2, 0, 1]), "a moving obstacle has 5 numbers"),
        (
            lambda: named_obstacle("moving", [0.5, 0, 4, 0, 1, 2]),
            "a moving obstacle has 6 numbers: give radius, growth",
        ),
        (lambda: named_obstacle("moving_curve", [0.5, 0, 2, 3, 0, 1, 2]), "a moving curve has 7 numbers: give radius"),
        (lambda: as_still([minsnap.Cylinder((0, 0), 1.0), Moving(LINE, 1.0)]), "obstacle 1 moves: plan takes it; a fl"),
    ],
)
def test_what_is_malformed_is_refused(make, said):
    with pytest.raises(CorridorError, match=said):
        make()
