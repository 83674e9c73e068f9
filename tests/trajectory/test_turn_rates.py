"""How fast the velocity turns: exact against dense grids, with sharp turns and rests."""

import numpy as np
import pytest
from tasks import random_legs

import minsnap
from minsnap.trajectory.trajectory import Trajectory
from minsnap.trajectory.turn_rates import largest_turn_within


def largest_turn_rate(path):
    return largest_turn_within(path, np.array([[0.0, path.duration]]))


def sampled(path, count=200001):
    t = np.linspace(0.0, path.duration, count)
    v, a = path(t, 1)[:, :2], path(t, 2)[:, :2]
    speed = np.linalg.norm(v, axis=1)
    rate = np.abs(v[:, 0] * a[:, 1] - v[:, 1] * a[:, 0]) / np.where(speed > 1e-5 * speed.max(), speed, np.inf) ** 2
    return rate.max(), t[rate.argmax()]


@pytest.mark.parametrize("corridor", [None, 0.05])
@pytest.mark.parametrize("seed", range(8))
def test_nothing_sampled_is_faster_and_it_is_attained(seed, corridor):
    points, durations = random_legs(seed, dim=2 + seed % 2)
    path = minsnap.plan(points, durations, corridor=corridor)
    rate, instant = largest_turn_rate(path)
    most, when = sampled(path)
    assert most <= rate * (1.0 + 1e-9)
    if instant == pytest.approx(when, abs=1e-2 * path.duration):
        assert rate == pytest.approx(most, rel=2e-2)


def test_a_parabola_turns_fastest_at_its_vertex():
    """In closed form: v = (1, 2 t), the rate is 2 / (1 + 4 t^2)."""
    path = Trajectory(np.array([[(0.0, 0.0), (0.5, 0.0), (1.0, 1.0)]]), [1.0])
    assert largest_turn_rate(path) == (pytest.approx(2.0), pytest.approx(0.0))
    assert largest_turn_rate(path.stretched(2.0))[0] == pytest.approx(1.0)


def test_a_straight_leg_from_rest_does_not_turn():
    assert largest_turn_rate(minsnap.plan([(0, 0, 0), (3, 1, 2)], [2.0]))[0] == pytest.approx(0.0, abs=1e-9)


def test_a_piece_that_only_climbs_does_not_turn():
    assert largest_turn_rate(minsnap.plan([(0, 0, 0), (0, 0, 2)], [2.0])) == (0.0, 0.0)


def test_a_narrow_turn_between_samples_is_found():
    """v = (s - 1/pi, 1e-4): it turns by pi within 1e-4 of the piece, at 1e4 rad/s."""
    at = 1.0 / np.pi
    points = np.array([[(0.0, 0.0), (-at / 2.0, 0.5e-4), (0.5 - at, 1e-4)]])
    rate, instant = largest_turn_rate(Trajectory(points, [1.0]))
    assert rate == pytest.approx(1e4, rel=1e-6) and instant == pytest.approx(at, abs=1e-7)
