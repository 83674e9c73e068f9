"""Unknowns of the joint search: what they make of a curve, and how it changes with them."""

from dataclasses import replace

import numpy as np
import pytest
from tasks import random_legs, task_of

from minsnap.time_allocation.joint_layout import JointLayout, JointState, end_basis, end_metric
from minsnap.time_allocation.refinement import divided, slowed


def layout_of(seed, closed=False, pieces=1, half=4, continuity=None, legs=3):
    points, durations = random_legs(seed, legs)
    if closed:
        points[-1] = points[0]
    pins = {} if closed else {0: {1: np.array([1.0, 2.0, 0.5])} | {p: np.zeros(3) for p in range(2, half)}}
    task = task_of(points, closed=closed, pieces=pieces, half=half, pins=pins, continuity=continuity)
    return JointLayout(task, task.units(durations)), np.repeat(durations / pieces, pieces)


def random_state(layout, durations, seed):
    """State with random free derivatives, continuous where a lap is closed."""
    random = np.random.default_rng(seed)
    durations = durations / layout.units.time
    state = layout.state(layout.problem.values.copy(), durations)
    step = np.concatenate((0.3 * random.normal(size=layout.size), np.zeros(layout.pieces)))
    return layout.moved(state, step, 1.0)


CASES = [{}, {"closed": True}, {"pieces": 3}, {"half": 3}, {"half": 5}, {"continuity": 2}, {"legs": 1}]
CASES += [{"closed": True, "pieces": 2}, {"closed": True, "legs": 2}]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_ends_are_the_derivatives_of_the_trajectory(case):
    layout, durations = layout_of(0, **case)
    state = random_state(layout, durations, 1)
    ends, curve = layout.ends(state), layout.trajectory(state)
    for piece, span in enumerate(curve.durations):
        for order in range(layout.half):
            first = curve.breaks[piece]
            known = curve(np.array([first, first + span * (1.0 - 1e-12)]), order) * span**order
            known -= layout.units.origin if order == 0 else 0.0
            mine = ends[piece, [order, layout.half + order]] * layout.units.length
            assert mine == pytest.approx(known, rel=1e-6, abs=1e-7 * max(1.0, np.abs(known).max())), (piece, order)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_exponents_are_the_derivatives_in_the_logarithms_of_durations(case):
    layout, durations = layout_of(2, **case)
    state = random_state(layout, durations, 3)
    ends, step = layout.ends(state), 1e-6
    predicted = np.zeros((layout.pieces, *ends.shape))
    for q in range(3):
        for piece, other in enumerate(layout.neighbours[:, q]):
            if other >= 0:
                predicted[other, piece] += layout.exponents[piece, :, q, None] * ends[piece]
    for other in range(layout.pieces):
        longer = state.durations.copy()
        longer[other] *= np.exp(step)
        found = (layout.ends(JointState(state.scaled, longer)) - ends) / step
        assert found == pytest.approx(predicted[other], abs=1e-4 * np.abs(ends).max())


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_free_derivative_does_not_change_with_time_when_all_is_slowed(case):
    layout, durations = layout_of(4, **case)
    layout = JointLayout(replace(layout.task, pins={}) if not layout.task.closed else layout.task, layout.units)
    state = random_state(layout, durations, 5)
    curve, slower = layout.trajectory(state), layout.trajectory(slowed(state))
    assert slower.control_points == pytest.approx(curve.stretched(1.1).control_points, abs=1e-9)


@pytest.mark.parametrize("parts", [2, 3, 5])
@pytest.mark.parametrize("case", [{}, {"closed": True}, {"continuity": 2}, {"half": 3}], ids=str)
def test_division_keeps_the_curve(case, parts):
    layout, durations = layout_of(6, **case)
    state = random_state(layout, durations, 7)
    fine = JointLayout(replace(layout.task, pieces=parts), layout.units)
    coarse, finer = layout.trajectory(state), fine.trajectory(divided(layout, state, fine))
    assert finer.duration == pytest.approx(coarse.duration, rel=1e-12)
    t = np.linspace(0.0, coarse.duration * (1.0 - 1e-12), 301)
    for order in range(5):
        known = coarse(t, order)
        assert finer(np.minimum(t, finer.duration), order) == pytest.approx(known, abs=1e-6 * np.abs(known).max()), (
            order
        )


def test_basis_and_metric_against_a_polynomial():
    """s^5: end derivatives 0 0 0 0 and 1 5 20 60; its third derivative 60 s^2 has the squared norm 720."""
    ends = np.array([0.0, 0, 0, 0, 1, 5, 20, 60])
    s = np.array([0.0, 0.3, 1.0])
    assert end_basis(7, 2, s) @ ends == pytest.approx(20.0 * s**3, abs=1e-11)
    assert not end_basis(7, 8, s).any()
    assert ends @ end_metric(7, 3) @ ends == pytest.approx(720.0)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_the_chain_puts_the_unknowns_of_a_piece_side_by_side(case):
    layout, _ = layout_of(0, **case)
    place = layout.places
    assert sorted(place) == list(range(len(place)))
    shared = np.intersect1d(layout.columns[0], layout.columns[-1])
    for mine in layout.columns:
        mine = place[np.setdiff1d(mine[mine >= 0], shared)]
        assert np.ptp(mine) <= 2 * layout.half * layout.dim * 2 if len(mine) else True
