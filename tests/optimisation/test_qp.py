"""One quadratic programme: four solvers against each other, what is refused, what is tried next."""

import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import numpy as np
import pytest
import qpsolvers
from programmes import change_daqp, least_distance
from qpsolvers import Problem
from scipy.sparse import csc_matrix

import minsnap
from minsnap.errors import UnknownSolverError
from minsnap.optimisation.qp import TOLERANCES, check_solver, solve_qp

SOLVERS = ("daqp", "piqp", "clarabel", "osqp")
CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("seed", range(5))
def test_a_solution_meets_the_conditions_of_optimality(solver, seed):
    P, q, G, h = least_distance(seed)
    found = solve_qp(Problem(P, q, G, h), solver)
    assert (G @ found.x - h).max() <= 1e-7
    assert found.z.min() >= 0.0
    assert np.abs(P @ found.x + q + G.T @ found.z).max() <= 1e-6
    assert np.abs(found.z * (G @ found.x - h)).max() <= 1e-6


@pytest.mark.parametrize("seed", range(5))
def test_solvers_agree(seed):
    P, q, G, h = least_distance(seed)
    found = [solve_qp(Problem(P, q, G, h), solver).x for solver in SOLVERS]
    for x in found[1:]:
        assert x == pytest.approx(found[0], abs=1e-5)


@pytest.mark.parametrize("solver", SOLVERS)
def test_sparse_and_dense_are_the_same(solver):
    P, q, G, h = least_distance(1)
    dense = solve_qp(Problem(P, q, G, h), solver).x
    sparse = solve_qp(Problem(csc_matrix(P), q, csc_matrix(G), h), solver).x
    assert sparse == pytest.approx(dense, abs=1e-6)


@pytest.mark.parametrize("solver", SOLVERS)
def test_equalities_hold(solver):
    P, q, G, h = least_distance(2)
    A = np.random.default_rng(9).normal(size=(2, 8))
    b = A @ np.linalg.lstsq(G[:4], h[:4] - 0.1)[0]
    found = solve_qp(Problem(P, q, G[:4], h[:4], A, b), solver)
    assert A @ found.x == pytest.approx(b, abs=1e-6)


@pytest.mark.parametrize("solver", SOLVERS)
def test_an_infeasible_programme_is_not_taken_for_solved(solver):
    P, q = np.eye(2), np.zeros(2)
    G, h = np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([-1.0, -1.0])
    assert solve_qp(Problem(P, q, G, h), solver) is None


def test_the_next_solver_is_tried_and_the_failure_told(monkeypatch):
    change_daqp(monkeypatch, lambda x: None)
    traj = minsnap.plan(CORNERS, [4, 2, 4, 2], corridor=0.3)
    assert traj.report.solver != "daqp"
    assert "daqp" in traj.report.fallback
    assert traj.cost() == pytest.approx(1557.0050, rel=1e-5)
    assert minsnap.certify(traj, CORNERS, 0.3).ok


@pytest.mark.parametrize("wrong", ("zeros", "huge", "nan", "near"))
def test_a_solver_that_lies_is_not_believed(monkeypatch, wrong):
    lies = {"zeros": lambda x: 0.0 * x, "huge": lambda x: x + 1e9, "nan": lambda x: x * np.nan}
    change_daqp(monkeypatch, lies.get(wrong, lambda x: x * (1.0 - 1e-4)))
    traj = minsnap.plan(CORNERS, [4, 2, 4, 2], corridor=0.3)
    assert traj.report.fallback == ("daqp",)
    assert traj.cost() == pytest.approx(1557.0050, rel=1e-5)


def test_an_answer_that_breaks_a_row_is_refused_even_at_the_right_cost(monkeypatch):
    # the optimum (1, 0) of least distance to x >= 1, |y| <= 1e-5; moved along y its cost stays and a row breaks
    P, q, G = np.eye(2), np.zeros(2), np.array([[-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    change_daqp(monkeypatch, lambda x: x + np.array([0.0, 1e-4]))
    asked = Problem(P, q, G, np.array([-1.0, 1e-5, 1e-5]))
    assert solve_qp(asked, "daqp") is None
    assert solve_qp(asked, "clarabel").x == pytest.approx([1.0, 0.0], abs=1e-6)


def test_an_answer_inside_that_costs_too_much_is_refused(monkeypatch):
    P, q, G = np.eye(2), np.zeros(2), np.array([[-1.0, 0.0]])
    change_daqp(monkeypatch, lambda x: x + np.array([1e-3, 0.0]))
    asked = Problem(P, q, G, np.array([-1.0]))
    assert solve_qp(asked, "daqp") is None
    assert solve_qp(asked, "clarabel").x == pytest.approx([1.0, 0.0], abs=1e-6)


def test_a_solver_that_is_wrong_by_very_little_still_leaves_the_curve_inside(monkeypatch):
    change_daqp(monkeypatch, lambda x: x + 1e-9 * np.sin(np.arange(len(x))))
    traj = minsnap.plan(CORNERS, [4, 2, 4, 2], corridor=0.3)
    assert minsnap.certify(traj, CORNERS, 0.3).corridor_margin >= 0.0
    assert traj.cost() == pytest.approx(1557.0050, rel=1e-5)


def test_when_every_solver_fails_stop_and_go_is_still_inside(monkeypatch):
    def refusing(problem, solver, **options):
        raise qpsolvers.SolverError("refused")

    monkeypatch.setattr(qpsolvers, "solve_problem", refusing)
    traj = minsnap.plan(CORNERS, [4, 2, 4, 2], corridor=0.3)
    assert minsnap.certify(traj, CORNERS, 0.3).corridor_margin >= 0.0
    assert "daqp" in traj.report.fallback


def test_no_warning_of_a_solver_leaves_a_thread_while_another_ends(monkeypatch):
    asked, started = Problem(np.eye(2), np.zeros(2)), Event()

    def warning(problem, solver, **options):
        seconds = 0.2 if started.is_set() else 0.1  # the second thread begins before the first ends, and ends later
        started.set()
        time.sleep(seconds)
        warnings.warn("not solved", stacklevel=1)
        return qpsolvers.Solution(problem)

    monkeypatch.setattr(qpsolvers, "solve_problem", warning)
    with ThreadPoolExecutor() as pool:
        first = pool.submit(solve_qp, asked, "clarabel")
        assert started.wait(10.0)
        assert pool.submit(solve_qp, asked, "clarabel").result() is None and first.result() is None


@pytest.mark.parametrize("name", SOLVERS)
def test_the_solver_named_is_the_first_tried(name):
    report = minsnap.plan(CORNERS, [4, 2, 4, 2], corridor=0.3, solver=name).report
    assert report.solver == name or report.fallback == (name,)


@pytest.mark.parametrize("name", ("gurobi", "", "DAQP", "nope"))
def test_a_solver_that_is_not_there_is_named_with_those_that_are(name):
    with pytest.raises(UnknownSolverError, match=f"solver '{name}' is not installed.*clarabel.*daqp.*piqp"):
        check_solver(name)


def test_every_solver_with_tolerances_is_installed():
    assert set(TOLERANCES) <= set(qpsolvers.available_solvers)
