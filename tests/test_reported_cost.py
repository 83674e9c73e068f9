"""The cost that a plan reports is that of the curve it returns, to rounding, however its durations differ."""

import numpy as np
import pytest
from oracles.exact import Spline, curve_cost
from tasks import task_of

import minsnap
from minsnap.optimisation.gradient import cost_gradient
from minsnap.optimisation.solve import solve

ZIGZAG = [(0, 0, 0), (1, 0, 0), (2, 1, 0), (3, 1, 0)]


@pytest.mark.parametrize("pieces", (1, 5))
@pytest.mark.parametrize("degree", (3, 7, 11))
@pytest.mark.parametrize("durations", ([5, 0.1, 5], [10, 1e-3, 5], [1e-4, 1, 1]))
def test_the_cost_is_that_of_the_stored_control_points(durations, degree, pieces):
    traj = minsnap.plan(ZIGZAG, durations, degree=degree, pieces=pieces)
    exact = float(curve_cost(traj.control_points, traj.durations, (degree + 1) // 2))
    assert traj.report.cost == pytest.approx(exact, rel=1e-12)
    assert traj.report.cost >= 0.0


def test_a_cost_that_cancelled_to_less_than_nothing():
    """That the control points of pieces of 0.02 s are doubles moves the cost by up to 1e-4; of 0.1 s, by 1e-9."""
    one, five = (minsnap.plan(ZIGZAG, [5, 0.1, 5], degree=11, pieces=pieces) for pieces in (1, 5))
    assert 22305.34 <= one.report.cost <= 22305.35
    assert five.report.core == one.report.core
    assert five.report.cost == pytest.approx(one.report.cost, rel=1e-4)


def test_the_cost_far_from_the_origin_is_that_of_the_stored_curve():
    traj = minsnap.plan(np.array(ZIGZAG) + 4.5e6, [1, 1, 1])
    assert traj.report.cost == pytest.approx(float(curve_cost(traj.control_points, traj.durations, 4)), rel=1e-12)


@pytest.mark.parametrize("durations", ([5.0, 0.1, 5.0], [3.0, 3e-4, 2.0]))
def test_searches_see_the_cost_of_the_optimum(durations):
    solved = solve(task_of(np.array(ZIGZAG, float)), np.array(durations))
    assert solved.cost == pytest.approx(Spline(ZIGZAG, durations).cost(), rel=1e-8)


def test_searches_see_its_gradient():
    """Euler: J(a T) = a^-7 J(T), so T . dJ/dT = -7 J."""
    durations = np.array([5.0, 0.1, 5.0])
    solved = solve(task_of(np.array(ZIGZAG, float)), durations)
    assert durations @ cost_gradient(solved) == pytest.approx(-7.0 * solved.cost, rel=1e-6)


def test_a_straight_line_at_rest_costs_what_its_profile_does():
    """The rest-to-rest septic over L in T costs 100,800 L^2 / T^7."""
    assert minsnap.plan([(0, 0), (3, 4)], [2.0]).report.cost == pytest.approx(100_800 * 25.0 / 2.0**7, rel=1e-14)
