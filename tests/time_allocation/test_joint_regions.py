"""Regions of knots in the joint search, against the regions themselves."""

import numpy as np
import pytest

import minsnap
from minsnap.limits.limits import Limits
from minsnap.planning.planner import placed_task
from minsnap.time_allocation.initial_guess import stop_and_go
from minsnap.time_allocation.joint_layout import SLACKS, JointState
from minsnap.time_allocation.joint_problem import JointProblem
from minsnap.time_allocation.joint_regions import JointRegions

GATE = minsnap.Gate((4.0, 1.0, 1.0), (1.0, 0.4, 0.1), 1.2, crossing=1)
POINTS = [(0, 0, 1), (2, 0.5, 1), GATE, (6, 0, 1.5), (8, 0, 1)]


def layout_of(pieces, tolerance):
    state = {"velocity": (0.0, 0.0, 0.0)}
    task = placed_task(POINTS, tolerance, state, state, None, False, [], 4, 3, pieces, "auto")
    problem = JointProblem(task, Limits(speed=3.0), np.full(task.legs, 2.0))
    return problem.layout(pieces)


def moved_state(layout, seed):
    state = stop_and_go(layout, np.ones(layout.pieces))
    free = layout.problem.columns >= 0
    change = np.random.default_rng(seed).normal(0.0, 0.4, state.scaled.shape)
    return JointState(state.scaled + np.where(free, change, 0.0), state.durations)


@pytest.mark.parametrize("tolerance", (0.3, minsnap.Ball(0.4), [0.0, 0.3, 0.3, 0.2, 0.5]), ids=str)
@pytest.mark.parametrize("pieces", (1, 2))
def test_excess_is_that_of_the_regions_and_clipping_removes_it(tolerance, pieces):
    layout = layout_of(pieces, tolerance)
    regions = JointRegions(layout)
    for seed in range(5):
        state = moved_state(layout, seed)
        knots = {waypoint: state.scaled[waypoint * pieces, 0] * layout.units.length for waypoint in regions.regions}
        asked = [
            region.excess(knots[waypoint]) / ((region.upper - region.lower).max() / 2.0)
            for waypoint, region in regions.regions.items()
        ]
        assert regions.excess(state) == pytest.approx(max(asked), rel=1e-9)
        assert regions.excess(regions.clipped(state)) <= 1e-12


@pytest.mark.parametrize("tolerance", (0.3, minsnap.Ball(0.4), [0.0, 0.3, 0.3, 0.2, 0.5]), ids=str)
@pytest.mark.parametrize("pieces", (1, 2))
def test_rows_leave_after_a_step_what_the_state_then_leaves(tolerance, pieces):
    layout = layout_of(pieces, tolerance)
    regions, random = JointRegions(layout), np.random.default_rng(1)
    state, inwards = moved_state(layout, 7), 0.01
    step = np.append(0.1 * random.normal(size=layout.size), np.zeros(layout.pieces + SLACKS + 1))
    moved = JointState(state.scaled + np.append(step[: layout.size], 0.0)[layout.problem.columns], state.durations)
    slack = step.copy()
    slack[-2] = 0.5
    for before, after in zip(regions.rows(state, inwards), regions.rows(moved, inwards), strict=True):
        left = before.bound - np.einsum("ncw,nw->nc", before.matrix, step[layout.unknowns[before.piece]])
        assert left == pytest.approx(after.bound, abs=1e-12)
        wider = before.bound - np.einsum("ncw,nw->nc", before.matrix, slack[layout.unknowns[before.piece]])
        assert (wider - left)[:, 0] == pytest.approx(0.5)


def test_a_crossing_is_kept_by_velocities_along_it_alone():
    layout = layout_of(1, None)
    regions = JointRegions(layout)
    for sign in (1.0, -1.0):
        state = stop_and_go(layout, np.ones(layout.pieces))
        scaled = state.scaled.copy()
        scaled[2, 1] = sign * np.array([1.0, 0.4, 0.1])
        rows = regions.rows(JointState(scaled, state.durations), 0.0)
        assert (min(group.bound.min() for group in rows) >= 0.0) == (sign > 0.0)
