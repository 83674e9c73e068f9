"""What a plan or a refusal may take is counted in calls of solvers, and never in seconds."""

import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.optimize

import minsnap
from minsnap.errors import InfeasibleError, MinsnapError
from minsnap.native.library import using
from minsnap.optimisation import effort, elastic, fallbacks, master_qp, slack_programme
from minsnap.optimisation.effort import Effort
from minsnap.optimisation.least_distance import least_distance
from minsnap.optimisation.qp import Programme, solve_qp

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import compare_cores
from corners import problem
from random_plans import question


@pytest.fixture
def calls(monkeypatch):
    """Calls of QP solvers and of solvers of elastic problems, as (rows, unknowns)."""
    counted = []

    def solve_qp(asked, *rest, solve=master_qp.solve_qp, **options):
        counted.append((0 if asked.G is None else len(asked.h), len(asked.q)))
        return solve(asked, *rest, **options)

    def least_sum(programme, solver, solve=elastic.least_sum):
        counted.append(programme.rows.shape)
        return solve(programme, solver)

    monkeypatch.setattr(master_qp, "solve_qp", solve_qp)
    monkeypatch.setattr(elastic, "least_sum", least_sum)
    return counted


@pytest.mark.parametrize(
    ("kind", "seed"), [("further tubes", 41), ("further tubes", 119), ("further tubes", 6814), ("rooms", 1092)]
)
def test_a_refusal_takes_few_solves_and_its_proof_holds(calls, kind, seed):
    """The width that is named is planned with: half of the solves are those of that plan."""
    with pytest.raises(InfeasibleError) as refused:
        minsnap.plan(**question(kind, seed)[1])
    assert len(calls) <= 60
    assert max(unknowns for _, unknowns in calls) <= 200
    assert refused.value.verify()


def test_what_many_pieces_contradict_is_found_by_the_native_core_and_proved_where_they_press(monkeypatch):
    """Seven legs of three pieces, 342 unknowns, of which those of the first legs are contradicted."""
    solvers, unknowns = [], []

    def solved(programme, solver, solve=elastic.least_sum):
        solvers.append(slack_programme.NAMES[solver])
        return solve(programme, solver)

    def least_squares(matrix, right, solve=scipy.optimize.nnls, **options):
        unknowns.append(len(matrix))
        return solve(matrix, right, **options)

    monkeypatch.setattr(elastic, "least_sum", solved)
    monkeypatch.setattr(scipy.optimize, "nnls", least_squares)
    with using("auto") as core, pytest.raises(InfeasibleError) as refused:
        if core.library is None:
            pytest.skip("there is no native core")
        minsnap.plan(**question("rooms", 140941)[1])
    assert "native" in solvers and len(solvers) <= 24  # those of the plan with the width that is named among them
    assert max(unknowns) <= 100 and max(refused.value.contradiction.legs) <= 1
    assert refused.value.verify()


@pytest.mark.parametrize("seed", [1, 4, 12, 15])
def test_extreme_corridors_of_several_pieces_end_with_the_plan_of_one_piece_after_few_solves(calls, seed):
    points, durations, width, degree, pieces = problem(seed)
    traj = minsnap.plan(points, durations, corridor=width, degree=degree, pieces=pieces)
    assert len(calls) <= 30
    assert minsnap.certify(traj, points, width).ok
    one = minsnap.plan(points, durations, corridor=width, degree=degree)
    assert traj.cost() <= 1.001 * one.cost()


def test_effort_is_over_after_a_count_of_work_that_grows_with_the_legs(monkeypatch):
    monkeypatch.setattr(effort, "MOST", 1.5e6)
    few, many, shared = Effort(10), Effort(20), Effort(20, share=0.5)
    for spent in (few, many, shared):
        spent.spend("piqp", 50, 50, 50)
    assert few.spent == many.spent and few.over and not many.over and shared.over


def test_dear_solvers_count_more():
    spent = {}
    for solver in ("piqp", "clarabel", "another"):
        counted = Effort(10)
        counted.spend(solver, 300, 100, 100)
        spent[solver] = counted.spent
    assert spent["piqp"] < spent["clarabel"] == spent["another"]


def test_daqp_counts_by_its_iterations():
    """The same rows in a square take more the more of them are broken."""
    spent, corner = [], np.vstack((np.eye(20), -np.eye(20)))
    for broken in (1, 20):
        counted = Effort(10)
        sides = np.where(np.arange(40) < broken, -1.0, 10.0)
        solve_qp(Programme(np.eye(20), np.zeros(20), corner, sides), "daqp", spend=counted.spend_on_iterations)
        spent.append(counted.spent - effort.ITERATED["daqp"][0])
    assert spent[1] > 5.0 * spent[0] > 0.0


def test_least_squares_end_with_the_effort(monkeypatch):
    monkeypatch.setattr(effort, "MOST", 1e6)
    counted = Effort(10)
    assert counted.spend_on_iterations("nnls", 10, 10, 4) and not counted.spend_on_iterations("nnls", 1000, 100, 51)
    G, h = np.array([[-1.0]]), np.array([-1.0])
    assert least_distance(G, h, None, None, np.zeros(1), None) is not None
    assert least_distance(G, h, None, None, np.zeros(1), None, counted.spend_on_iterations) is None


def test_the_elastic_problem_ends_with_the_effort(calls, monkeypatch):
    asked = question("further tubes", 41)[1]
    with pytest.raises(InfeasibleError):
        minsnap.plan(**asked)
    before = len(calls)
    calls.clear()
    monkeypatch.setattr(effort, "MOST", 1.0)
    with pytest.raises(MinsnapError):
        minsnap.plan(**asked)
    assert len(calls) < before


def test_a_problem_with_extreme_durations_is_solved_by_the_python_core():
    """Durations in ratio 27 at degree 11: many small programmes by non-negative least squares, 0.6 s in all."""
    points, asked = compare_cores.problem(739)
    assert minsnap.plan(points, **asked).cost() == pytest.approx(7.72626e18, rel=1e-3)  # by the native core


def test_a_ladder_without_effort_ends_in_a_blend(monkeypatch):
    monkeypatch.setattr(effort, "MOST", 0.0)
    points = [(0, 0, 0), (8, 0, 0), (8, 4, 0), (0, 4, 0), (0, 0, 0)]
    traj = minsnap.plan(points, [4.0, 2.0, 4.0, 2.0], corridor=0.3, solver="daqp")
    assert traj.report.rungs == ("blend",)
    assert minsnap.certify(traj, points, 0.3).ok


def test_what_no_curve_keeps_is_found_before_any_rung(monkeypatch):
    monkeypatch.setattr(fallbacks, "LADDER", ())
    with pytest.raises(InfeasibleError, match="too narrow"):
        minsnap.plan(**question("further tubes", 41)[1])


def test_a_problem_without_a_simpler_curve_is_solved():
    """Three rungs reach a start that flies towards a wall 1 cm ahead at 3 m/s, where no curve has room to spare."""
    traj = minsnap.plan(**question("half-spaces", 84067)[1])
    assert traj.report.rungs.count("inward shift") == 3


def test_a_problem_whose_stop_and_go_is_outside_is_worth_more():
    assert minsnap.plan(**question("round tubes", 96125)[1]).report.rungs[-1] == "blend"
