"""What must happen to a plan when its question is moved, turned, mirrored, stretched or scaled."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from properties.strategies import corridors

import minsnap

SHARES = np.linspace(0.0, 1.0, 97)
LOOSE = 3e-3
"""How far apart, in extents, two curves may be whose costs agree to the millionth that the exchange may lose."""


def positions(traj):
    return traj(SHARES * traj.duration)


def cost(traj):
    return traj.cost((traj.degree + 1) // 2)


def agree(one, other, size, within=1e-6):
    assert np.abs(one - other).max() <= within * size


def extent(asked):
    return np.ptp(asked["waypoints"], axis=0).max()


@given(corridors(), st.floats(-3.0, 3.0))
def test_stretching_time_keeps_the_path(asked, power):
    factor = 10.0**power
    traj = minsnap.plan(**asked)
    slow = minsnap.plan(**asked | {"durations": factor * asked["durations"]})
    agree(positions(slow), positions(traj), extent(asked))
    assert cost(slow) == pytest.approx(cost(traj) * factor ** -float(traj.degree), rel=1e-6)


@given(corridors(), st.floats(-6.0, 6.0))
def test_scaling_lengths_scales_the_path(asked, power):
    factor = 10.0**power
    traj = minsnap.plan(**asked)
    scaled = {"waypoints": factor * asked["waypoints"], "corridor": factor * asked["corridor"]}
    large = minsnap.plan(**asked | scaled)
    agree(positions(large) / factor, positions(traj), extent(asked))
    assert cost(large) == pytest.approx(cost(traj) * factor**2, rel=1e-6)


@given(corridors())
def test_moving_the_origin_moves_the_path(asked):
    shift = 100.0 * np.arange(1, asked["waypoints"].shape[1] + 1)
    moved = minsnap.plan(**asked | {"waypoints": asked["waypoints"] + shift})
    traj = minsnap.plan(**asked)
    agree(positions(moved) - shift, positions(traj), extent(asked), within=LOOSE)
    assert cost(moved) == pytest.approx(cost(traj), rel=3e-6)


@given(corridors())
def test_time_reversed_is_the_same_path_backwards(asked):
    back = {name: asked[name][::-1] for name in ("waypoints", "durations", "corridor")}
    traj, reverse = minsnap.plan(**asked), minsnap.plan(**asked | back)
    assert cost(reverse) == pytest.approx(cost(traj), rel=3e-6)
    agree(positions(reverse)[::-1], positions(traj), extent(asked), within=LOOSE)


@given(corridors(walls=False, degrees=(3, 5, 7)))
def test_time_reversed_without_walls_is_the_same_path_backwards_exactly(asked):
    back = {name: asked[name][::-1] for name in ("waypoints", "durations")}
    agree(positions(minsnap.plan(**asked | back))[::-1], positions(minsnap.plan(**asked)), extent(asked), within=1e-6)


@given(corridors(dims=(2, 4)))
def test_a_quarter_turn_of_the_question_turns_the_answer(asked):
    turn = np.eye(asked["waypoints"].shape[1])
    turn[:2, :2] = ((0.0, -1.0), (1.0, 0.0))
    traj = minsnap.plan(**asked)
    turned = minsnap.plan(**asked | {"waypoints": asked["waypoints"] @ turn.T})
    assert cost(turned) == pytest.approx(cost(traj), rel=3e-6)
    agree(positions(turned), positions(traj) @ turn.T, extent(asked), within=LOOSE)


@given(corridors(dims=(2, 4)), st.randoms())
def test_permuting_the_axes_permutes_the_answer(asked, random):
    order = list(range(asked["waypoints"].shape[1]))
    random.shuffle(order)
    traj, permuted = minsnap.plan(**asked), minsnap.plan(**asked | {"waypoints": asked["waypoints"][:, order]})
    assert cost(permuted) == pytest.approx(cost(traj), rel=3e-6)
    agree(positions(permuted), positions(traj)[:, order], extent(asked), within=LOOSE)


@given(corridors(walls=False, dims=(2, 3), degrees=(3, 5, 7)), st.floats(0.0, 6.28))
def test_any_turn_without_walls_turns_the_answer(asked, angle):
    turn = np.eye(asked["waypoints"].shape[1])
    turn[:2, :2] = ((np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle)))
    turned = minsnap.plan(**asked | {"waypoints": asked["waypoints"] @ turn.T})
    agree(positions(turned), positions(minsnap.plan(**asked)) @ turn.T, extent(asked), within=1e-6)


@given(corridors(walls=False, closed=True, legs=(3, 5), degrees=(3, 5, 7)), st.integers(1, 2))
def test_where_a_closed_lap_begins_does_not_matter(asked, first):
    points, durations = asked["waypoints"], asked["durations"]
    assume(first < len(durations))
    later = np.concatenate((points[first:], points[1 : first + 1]))
    shifted = minsnap.plan(**asked | {"waypoints": later, "durations": np.roll(durations, -first)})
    traj = minsnap.plan(**asked)
    t = SHARES * traj.duration
    same = traj(np.minimum((t + traj.breaks[first]) % traj.duration, traj.duration))
    agree(shifted(np.minimum(t, shifted.duration)), same, extent(asked), within=1e-6)
    assert cost(shifted) == pytest.approx(cost(traj), rel=1e-6)


@pytest.mark.slow
@given(corridors(), st.floats(1.0, 3.0))
def test_a_wider_corridor_costs_no_more(asked, factor):
    wide = minsnap.plan(**asked | {"corridor": factor * asked["corridor"]})
    narrow = minsnap.plan(**asked)
    free = minsnap.plan(**asked | {"corridor": None})
    assert cost(free) * (1.0 - 1e-9) <= cost(wide) <= cost(narrow) * (1.0 + 3e-6)


@given(corridors(walls=False, dims=(2, 3)))
def test_a_corridor_that_touches_nothing_changes_nothing(asked):
    free = minsnap.plan(**asked)
    asked["corridor"] = 1.01 * np.abs(positions(free)).max() + 10.0 * extent(asked) + 1e3
    agree(positions(minsnap.plan(**asked)), positions(free), extent(asked), within=1e-10)
