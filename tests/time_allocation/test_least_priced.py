"""The least cost within limits, for a price of time or a total: the curve and its durations searched together."""

import numpy as np
import pytest
from tasks import REFERENCE

import minsnap
from minsnap.files.plan_arguments import plan_arguments
from minsnap.limits.limits import Limits
from minsnap.time_allocation.initial_guess import guessed_lengths, stop_and_go, stop_and_go_times
from minsnap.time_allocation.joint_layout import JointState
from minsnap.time_allocation.joint_problem import JointProblem
from minsnap.time_allocation.objectives import PricedCost

LIMITS = Limits(speed=3.0, acceleration=6.0)
TURNING = Limits(speed=3.0, acceleration=6.0, body_rate=0.45)


def check(path, limits):
    assert minsnap.certify(path, REFERENCE, corridor=0.3, limits=limits).ok


def test_the_model_of_the_cost_is_that_of_differences(task_of_corners):
    """Gradient to rounding; the second derivative along changes that leave the durations alone is exact."""
    layout, state = task_of_corners
    objective = PricedCost(layout, 2.0, 1.1 * state.total, 3.0)
    terms, value = objective.terms(state), objective.value(state)
    random = np.random.default_rng(0)
    step = np.append(random.normal(size=layout.size + layout.pieces), [0.0, 0.0])
    ahead, behind = (objective.value(layout.moved(state, step, share)) for share in (1e-5, -1e-5))
    assert terms.linear @ step * value == pytest.approx((ahead - behind) / 2e-5, rel=1e-6)
    step[layout.size :] = 0.0
    ahead, behind = (objective.value(layout.moved(state, step, share)) for share in (1e-2, -1e-2))
    bend = 2.0 * (terms.change(layout.unknowns, step) - terms.linear @ step) * value
    assert bend == pytest.approx((ahead - 2.0 * value + behind) / 1e-4, rel=1e-6)


@pytest.fixture
def task_of_corners():
    from tasks import task_of

    task = task_of(REFERENCE)
    guess = stop_and_go_times(guessed_lengths(task), LIMITS)
    layout = JointProblem(task, LIMITS, guess).layout(1)
    state = stop_and_go(layout, guess / layout.units.time)
    free = layout.problem.columns >= 0
    noise = np.random.default_rng(1).normal(size=state.scaled.shape)
    return layout, JointState(state.scaled + np.where(free, 0.1 * noise, 0.0), state.durations * [0.8, 1.0, 1.2, 1.1])


def test_a_price_is_paid_as_by_searches_over_durations_alone():
    """Nested searches over durations, with the limits as walls of the QP, ended at 12839.55 and 1518.18."""
    for weight, least in ((100.0, 1518.18), (1000.0, 12839.55)):
        path = minsnap.plan(REFERENCE, limits=LIMITS, corridor=0.3, search=minsnap.Search(time_weight=weight))
        check(path, LIMITS)
        assert path.cost() + weight * path.duration <= 1.001 * least


def test_several_pieces_are_priced_within_the_limits():
    """A search that began from the shortest plan ended at 5,014,569 here, since that plan is so rough."""
    path = minsnap.plan(REFERENCE, limits=LIMITS, corridor=0.3, pieces=3, search=minsnap.Search(time_weight=1e4))
    check(path, LIMITS)
    assert path.cost() + 1e4 * path.duration <= 106_700


def test_a_total_is_split_as_by_searches_over_durations_alone():
    """Nested searches ended at 839.62 and 6384.58."""
    for total, least in ((12.0, 839.62), (11.0, 6384.58)):
        path = minsnap.plan(REFERENCE, total_time=total, limits=LIMITS, corridor=0.3)
        check(path, LIMITS)
        assert path.duration == pytest.approx(total, rel=1e-12) and path.cost() <= 1.003 * least


def test_limits_that_are_not_convex_are_kept_without_slowing_down():
    """The shortest plan slowed down to 13 s cost 2672; with a price of 1000 it ended at 14340."""
    path = minsnap.plan(REFERENCE, total_time=13.0, limits=TURNING, corridor=0.3)
    check(path, TURNING)
    assert path.duration == pytest.approx(13.0) and path.cost() <= 290.0
    priced = minsnap.plan(REFERENCE, limits=TURNING, corridor=0.3, search=minsnap.Search(time_weight=1e3))
    check(priced, TURNING)
    assert priced.cost() + 1e3 * priced.duration <= 13_060.0


def test_limits_that_do_not_bind_change_nothing():
    for asked in ({"total_time": 30.0}, {"time_weight": 1.0}):
        free, path = (
            minsnap.plan(REFERENCE, corridor=0.3, **plan_arguments(asked | more)) for more in ({}, {"limits": LIMITS})
        )
        assert path.cost() == pytest.approx(free.cost(), rel=1e-6)


def test_a_moving_start_is_priced_too():
    start = {"velocity": (1.0, 0.3, 0.0)}
    path = minsnap.plan(REFERENCE, limits=LIMITS, corridor=0.5, start=start, search=minsnap.Search(time_weight=1e3))
    assert minsnap.certify(path, REFERENCE, corridor=0.5, limits=LIMITS).ok
    assert path(0.0, 1) == pytest.approx(start["velocity"])
