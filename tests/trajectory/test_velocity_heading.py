"""Headings along the velocity where the path turns back, rests or climbs: held, and turned within a rate."""

import numpy as np
import pytest

import minsnap
from minsnap import Limits
from minsnap.errors import YawError
from minsnap.files.convert import read_any
from minsnap.planning.request import plan_arguments
from minsnap.trajectory.heading import ConstantHeading
from minsnap.trajectory.velocity_heading import VelocityHeading

BACK = [(0, 0, 1), (4, 0, 1), (0, 0, 1)]
COURSES = {
    "back": (BACK, [4.0, 4.0]),
    "back at once": (BACK, [1.2, 1.2]),
    "to and fro": ([*BACK, (4, 0.1, 1), (0, 0, 1)], [1.5] * 4),
    "there and up": ([(0, 0, 0), (0, 0, 2), (4, 2, 2), (4, 2, 0)], [1.5, 2.0, 1.5]),
    "up twice": ([(0, 0, 0), (3, 0, 0), (3, 0, 3), (3, 3, 3)], [2.0, 2.0, 2.0]),
}


def differences(heading, duration):
    """Instants in the middle of small steps, and the mean rates over the steps."""
    t = np.linspace(0.0, duration, 60001)
    return 0.5 * (t[1:] + t[:-1]), np.diff(heading(t)) / np.diff(t)


@pytest.mark.slow
@pytest.mark.parametrize("name", COURSES)
def test_a_heading_is_continuous_with_the_rate_that_is_reported_exactly(name):
    traj = minsnap.plan(*COURSES[name], yaw=minsnap.Velocity(yaw_rate=1.5), corridor=0.5)
    middles, rates = differences(traj.yaw, traj.duration)
    largest = np.abs(rates).max()
    assert traj.yaw(middles, 1) == pytest.approx(rates, abs=2e-3 * max(largest, 1.0))
    used = Limits(yaw_rate=1.0).utilisation(traj)[0]
    assert used.method == "exact" and largest <= used.value * (1.0 + 1e-9) <= largest * (1.0 + 1e-3) + 1e-9
    assert traj.yaw.turns.largest(0.0, traj.duration)[0] <= 1.5


@pytest.mark.parametrize("name", COURSES)
def test_where_it_follows_it_is_the_angle_of_the_velocity_and_elsewhere_the_path_is_slow_or_near_it(name):
    traj = minsnap.plan(*COURSES[name], yaw=minsnap.Velocity(yaw_rate=50.0, hold_below=0.3), corridor=0.5)
    t = np.linspace(0.0, traj.duration, 2001)
    velocity = traj(t, 1)
    follows = traj.yaw.turns.follows[traj.yaw.turns.piece(t)]
    off = np.angle(np.exp(1j * (traj.yaw(t) - np.arctan2(velocity[:, 1], velocity[:, 0]))))
    assert follows.any() and np.abs(off[follows]).max() < 1e-9
    assert np.linalg.norm(velocity[follows, :2], axis=1).min() >= 0.3 * 0.9


@pytest.mark.slow
def test_a_path_that_turns_back_turns_half_a_turn_within_the_limit():
    limits = Limits(speed=3.0, acceleration=5.0, yaw_rate=2.0)
    traj = minsnap.plan(BACK, limits=limits, yaw="velocity", search=minsnap.Search(split="distance"))
    assert abs(traj.yaw(traj.duration) - traj.yaw(0.0)) == pytest.approx(np.pi)
    _, rates = differences(traj.yaw, traj.duration)
    assert 1.0 < np.abs(rates).max() <= 2.0
    free = minsnap.plan(BACK, limits=Limits(speed=3.0, acceleration=5.0), search=minsnap.Search(split="distance"))
    assert traj.duration == pytest.approx(free.duration, rel=1e-6)


@pytest.mark.parametrize(("durations", "hold_below"), [([1.1, 2.9], None), ([3.0, 1.7], 0.02)])
def test_a_path_that_turns_back_between_two_samples_does_not_jump(durations, hold_below):
    back = 10.0 * np.array(BACK)
    traj = minsnap.plan(back, durations, closed=True, yaw=minsnap.Velocity(hold_below=hold_below))
    assert np.abs(differences(traj.yaw, traj.duration)[1]).max() <= traj.yaw.largest_rate(0.0, traj.duration)[0] + 1e-9


def test_a_stretched_path_holds_its_heading_by_the_same_rules():
    traj = minsnap.plan(BACK, [2.0, 2.0], yaw="velocity").stretched(2.0)
    again = minsnap.plan(BACK, [4.0, 4.0], yaw="velocity")
    t = np.linspace(0.0, 8.0, 301)
    assert traj.yaw(t) == pytest.approx(again.yaw(t), abs=1e-6)


def test_a_path_slower_than_the_hold_everywhere_keeps_one_heading():
    traj = minsnap.plan([(0, 0), (1, 1)], [4.0], yaw=minsnap.Velocity(hold_below=5.0))
    assert traj.yaw(np.linspace(0.0, 4.0, 101)) == pytest.approx(np.full(101, np.pi / 4.0))


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"yaw": 1.0, "yaw_rate": 1.0}, "give yaw='velocity'"),
        ({"hold_below": 1.0}, "give yaw='velocity'"),
        ({"yaw": "velocity", "yaw_rate": -1.0}, "yaw_rate is -1.0"),
        ({"yaw": "velocity", "hold_below": float("nan")}, "hold_below is nan"),
    ],
)
def test_what_would_be_ignored_or_means_nothing_is_refused(asked, words):
    with pytest.raises(YawError, match=words):
        minsnap.plan(BACK, [2.0, 2.0], **plan_arguments(asked))


def test_a_rate_above_the_limit_is_refused():
    with pytest.raises(YawError, match="more than the limit"):
        minsnap.plan(BACK, limits=Limits(speed=3.0, yaw_rate=1.0), yaw=minsnap.Velocity(yaw_rate=2.0))


def test_the_heading_itself_refuses_a_rate_of_zero():
    path = minsnap.plan(BACK, [2.0, 2.0]).with_yaw(ConstantHeading())
    with pytest.raises(YawError, match="yaw_rate is 0"):
        VelocityHeading(path, yaw_rate=0.0)


@pytest.mark.parametrize("angle", [0.0, 2.0, np.pi, -3.0])
@pytest.mark.parametrize("start", [None, {"velocity": (1.0, 0.0, 0.0)}])
def test_the_heading_of_the_vehicle_at_the_start_is_where_it_turns_from(angle, start, tmp_path):
    """At rest and at speed, at the rate that a hold is turned at; a stored plan has it too."""
    points = [(0, 0, 1), (4, 0, 1), (4, 4, 1)]
    traj = minsnap.plan(points, [3.0, 3.0], start=start, yaw=minsnap.Velocity(yaw_rate=1.5, yaw_at_start=angle))
    t = np.linspace(0.0, traj.duration, 4001)
    rates = np.diff(traj.yaw(t)) / np.diff(t)
    assert traj.yaw(0.0) == angle and abs(rates[0]) < 0.02 and np.abs(rates).max() <= 1.5
    velocity = traj(t, 1)
    follows = traj.yaw.turns.follows[traj.yaw.turns.piece(t)]
    off = np.angle(np.exp(1j * (traj.yaw(t) - np.arctan2(velocity[:, 1], velocity[:, 0]))))
    assert follows.any() and np.abs(off[follows]).max() < 1e-9
    traj.save(tmp_path / "plan.json")
    assert np.array_equal(read_any(tmp_path / "plan.json").yaw(t), traj.yaw(t))


def test_a_path_that_is_slow_is_turned_to_from_the_start():
    traj = minsnap.plan([(0, 0), (1, 1)], [4.0], yaw=minsnap.Velocity(hold_below=5.0, yaw_at_start=2.0))
    assert traj.yaw([0.0, 4.0]) == pytest.approx([2.0, np.pi / 4.0])
    with pytest.raises(YawError, match="yaw_at_start is 90"):
        minsnap.Velocity(yaw_at_start=90.0)
