"""The reference values: an 8 m by 4 m rectangle flown in 12 s from rest to rest, corner by corner.

Costs are integrals of the squared snap, at degree 7 with three continuous derivatives.  They were found once with other
means (a semidefinite programme at every instant, a full quadratic programme at samples) and are matched, not repeated.
"""

import numpy as np
import pytest
from oracles.sum_of_squares import optimum

import minsnap

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
DURATIONS = [4.0, 2.0, 4.0, 2.0]
REACH = {"rel": 1e-5}

AT_EVERY_INSTANT = {1.0: 722.550, 0.3: 1557.0050, 0.1: 3225.19, 0.05: 4174.92, 0.01: 15890.6}


def test_no_corridor():
    traj = minsnap.plan(CORNERS, DURATIONS)
    assert traj.cost() == pytest.approx(216.8955, abs=5e-5)
    assert traj.report.solver == "banded"


def test_durations_by_distance():
    traj = minsnap.plan(CORNERS, total_time=12.0, search=minsnap.Search(split="distance"))
    assert traj.durations == pytest.approx(DURATIONS)
    assert traj.cost() == pytest.approx(216.8955, abs=5e-5)


@pytest.mark.parametrize("width", AT_EVERY_INSTANT)
def test_corridor_at_every_instant(width):
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=width)
    assert traj.cost() == pytest.approx(AT_EVERY_INSTANT[width], **REACH)
    assert minsnap.certify(traj, CORNERS, width).corridor_margin >= 0.0


@pytest.mark.slow
@pytest.mark.parametrize("width", np.geomspace(1e-4, 2.0, 9))
def test_corridor_of_any_width_reaches_the_sum_of_squares_optimum(width):
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=width)
    assert traj.cost() == pytest.approx(optimum(CORNERS, DURATIONS, width), **REACH)
    assert minsnap.certify(traj, CORNERS, width).corridor_margin >= 0.0
    assert not traj.report.fallback


@pytest.mark.parametrize("solver", ("daqp", "piqp", "clarabel", "osqp"))
def test_every_solver_reaches_the_reference_value(solver):
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=0.3, solver=solver)
    assert traj.cost() == pytest.approx(1557.0050, **REACH)
    assert traj.report.solver == solver
    assert minsnap.certify(traj, CORNERS, 0.3).ok


@pytest.mark.parametrize(("continuity", "cost", "outside"), ((3, 1545.5717, 4.7e-3), (4, 1582.8615, 5.5e-3)))
def test_twenty_samples_a_leg_leave_the_corridor_between_them(continuity, cost, outside):
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=minsnap.Sampled(0.3, 20), continuity=continuity)
    assert traj.cost() == pytest.approx(cost, rel=1e-6)
    assert minsnap.certify(traj, CORNERS, 0.3).corridor_margin == pytest.approx(-outside, abs=1e-4)


def test_best_split_without_a_corridor():
    traj = minsnap.plan(CORNERS, total_time=12.0)
    assert traj.cost() == pytest.approx(47.58486, rel=1e-6)
    assert traj.duration == pytest.approx(12.0, rel=1e-12)


@pytest.mark.slow
def test_best_split_in_a_corridor():
    traj = minsnap.plan(CORNERS, total_time=12.0, corridor=0.3)
    assert traj.cost() <= 303.82 * (1.0 + 1e-4)
    assert minsnap.certify(traj, CORNERS, 0.3).ok


def test_corners_free_within_the_overlaps():
    asked = {"corridor": 0.3, "waypoint_tolerance": 0.3}
    traj = minsnap.plan(CORNERS, DURATIONS, **asked)
    assert traj.cost() == pytest.approx(813.610, **REACH)
    assert traj.cost() == pytest.approx(optimum(CORNERS, DURATIONS, 0.3, tolerance=0.3), **REACH)
    assert minsnap.certify(traj, CORNERS, 0.3, tolerance=0.3).ok


@pytest.mark.parametrize(("width", "feasible"), ((0.3, True), (0.05, True), (0.02, False)))
def test_four_continuous_derivatives_need_width(width, feasible):
    if feasible:
        assert minsnap.certify(minsnap.plan(CORNERS, DURATIONS, corridor=width, continuity=4), CORNERS, width).ok
        return
    with pytest.raises(minsnap.InfeasibleError, match="continuity=4"):
        minsnap.plan(CORNERS, DURATIONS, corridor=width, continuity=4)


@pytest.mark.parametrize("continuity", (5, 6))
def test_five_and_six_continuous_derivatives_leave_too_little_freedom(continuity):
    with pytest.raises(minsnap.InfeasibleError, match=f"continuity={continuity}, which leaves.*: continuity=3"):
        minsnap.plan(CORNERS, DURATIONS, corridor=0.3, continuity=continuity)
