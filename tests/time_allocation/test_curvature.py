"""The positive part of the second derivative of the Lagrangian, against dense matrices."""

import numpy as np
import pytest
from tasks import random_legs, task_of

from minsnap.time_allocation.curvature import Forces, positive_curvature
from minsnap.time_allocation.joint_layout import JointLayout, JointState

NEIGHBOURS = 3


def bent(seed, closed=False):
    """Layout, ends, scales and forces of a random state."""
    points, durations = random_legs(seed, 3)
    if closed:
        points[-1] = points[0]
    task = task_of(points, closed=closed)
    layout = JointLayout(task, task.units(durations))
    random = np.random.default_rng(seed)
    state = layout.state(layout.problem.values, durations / layout.units.time)
    state = layout.moved(state, np.append(random.normal(size=layout.size), np.zeros(layout.pieces)), 1.0)
    forces = Forces(random.normal(size=(3, 8, 3)), random.normal(size=3))
    return layout, state, forces


def work(layout, state, forces, piece, change):
    """Force times ends of one piece, and the bend of its duration, after a change in scaled ends and durations."""
    scales = layout.end_scales(state.durations)[piece]
    logarithms = np.zeros(layout.pieces)
    for q, other in enumerate(layout.neighbours[piece]):
        if other >= 0:
            logarithms[other] += np.log1p(change[-NEIGHBOURS + q])
    later = layout.end_scales(state.durations * np.exp(logarithms))[piece]
    nominal = np.zeros((8, 3))
    nominal[[0, 4]] = layout.problem.nominal[[piece, piece + 1]]
    free = (layout.ends(state)[piece] - nominal) / scales[:, None] + change[:-NEIGHBOURS].reshape(8, 3)
    return (forces.ends[piece] * (nominal + free * later[:, None])).sum() + forces.own[piece] * change[-2] ** 2 / 2.0


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_it_bends_no_less_than_the_lagrangian_and_never_downwards(seed, closed):
    layout, state, forces = bent(seed, closed)
    ends, scales = layout.ends(state), layout.end_scales(state.durations)
    found = positive_curvature(layout, ends, scales, forces, np.ones(3))
    random, step = np.random.default_rng(seed), 1e-4
    assert np.linalg.eigvalsh(found).min() >= -1e-9 * np.abs(found).max()
    for piece in range(3):
        movable = np.append((layout.columns[piece] >= 0).reshape(-1), layout.neighbours[piece] >= 0)
        for _ in range(10):
            change = step * np.where(movable, random.normal(size=27), 0.0)
            three = [work(layout, state, forces, piece, factor * change) for factor in (-1.0, 0.0, 1.0)]
            second = three[0] - 2.0 * three[1] + three[2]
            assert change @ found[piece] @ change >= second - 1e-3 * step**2 * np.abs(found[piece]).max()


def test_without_forces_nothing_bends():
    layout, state, _ = bent(0)
    forces = Forces(np.zeros((3, 8, 3)), np.zeros(3))
    ends, scales = layout.ends(state), layout.end_scales(state.durations)
    assert not positive_curvature(layout, ends, scales, forces, np.ones(3)).any()


def test_a_duration_that_bends_alone_is_kept_where_it_bends_upwards():
    layout, state, _ = bent(1)
    state = JointState(np.zeros_like(state.scaled), state.durations)
    forces = Forces(np.zeros((3, 8, 3)), np.array([2.0, -3.0, 1.0]))
    ends, scales = layout.ends(state), layout.end_scales(state.durations)
    found = positive_curvature(layout, ends, scales, forces, np.ones(3))[:, -2, -2]
    assert found == pytest.approx([2.0, 0.0, 1.0])
