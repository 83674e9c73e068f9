"""The full problem: what its rows say, and that the reduced one is the same problem."""

import numpy as np
import pytest
import qpsolvers
from hypothesis import given, settings
from hypothesis import strategies as st
from properties.strategies import corridors
from scipy.linalg import null_space
from scipy.sparse import csc_matrix, issparse

import minsnap
from minsnap.errors import CorridorError, DegreeError, TimingError, WaypointError
from minsnap.optimisation.textbook_qp import FullProblem, build_qp

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
DURATIONS = [4.0, 2.0, 4.0, 2.0]
MILD = {"lengths": (1.0, 4.0), "pace": 0.15}
"""Power coefficients carry no more than durations that differ by a factor of a few."""


def unknowns(traj):
    """Coefficients of 1, s, s², … of a curve, in the order of the full problem."""
    ppoly = traj.to_ppoly()
    powers = ppoly.c[::-1] * np.diff(ppoly.x)[None, :, None] ** np.arange(traj.degree + 1)[:, None, None]
    return powers.transpose(1, 2, 0).reshape(-1)


def dense_optimum(problem):
    """Minimum over the equations alone, by their null space."""
    A, P = problem.A.toarray(), problem.P.toarray()
    norms = np.linalg.norm(A, axis=1)
    start = np.linalg.lstsq(A / norms[:, None], problem.b / norms)[0]
    N = null_space(A / norms[:, None])
    return start - N @ np.linalg.solve(N.T @ P @ N, N.T @ P @ start)


def optimum(problem, x):
    """Minimum over all rows, by steps from x in directions that the equations leave, in which the cost is a square."""
    A, P = problem.A.toarray(), problem.P.toarray()
    N = null_space(A / np.linalg.norm(A, axis=1)[:, None])
    H = N.T @ P @ N
    unit = 1.0 / np.sqrt(np.diag(H))
    Z = np.linalg.solve(np.linalg.cholesky(H * unit[:, None] * unit), (N * unit).T).T * np.sqrt(value(problem, x))
    room = np.maximum(problem.h - problem.G @ x, 0.0)
    rows = problem.G @ Z
    norms = np.linalg.norm(rows, axis=1)
    gradient = Z.T @ (P @ x) / value(problem, x)
    G = csc_matrix(rows / norms[:, None])
    question = qpsolvers.Problem(csc_matrix(np.eye(Z.shape[1])), gradient, G, room / norms)
    step = qpsolvers.solve_problem(question, "clarabel")
    assert step.found
    return x + Z @ step.x


def value(problem, x):
    return 0.5 * x @ (problem.P @ x) + problem.q @ x


def for_qp(asked):
    """Return a problem without what only ``plan`` asks for: the number of coordinates."""
    return {name: value for name, value in asked.items() if name != "dim"}


@given(corridors(walls=False, legs=(1, 4), degrees=(3, 5, 7), **MILD), st.booleans())
def test_the_reduced_optimum_is_that_of_the_full_problem(asked, pinned):
    names = ("velocity", "acceleration", "jerk")[: (asked["degree"] + 1) // 2 - 1]
    extra = {}
    if pinned:
        dim = asked["waypoints"].shape[1]
        extra = {"start": {names[0]: np.ones(dim)}, "end": {names[-1]: -np.ones(dim)}}
        if len(asked["durations"]) > 1:
            extra["pins"] = {1: {names[0]: np.full(dim, 0.5)}}
    problem = build_qp(**for_qp(asked), **extra)
    traj = minsnap.plan(**asked, **extra)
    x, half = unknowns(traj), (asked["degree"] + 1) // 2
    assert value(problem, x) == pytest.approx(traj.cost(half), rel=1e-7)
    assert value(problem, dense_optimum(problem)) == pytest.approx(traj.cost(half), rel=1e-5)
    sizes = np.abs(problem.A) @ np.abs(x)
    assert (np.abs(problem.A @ x - problem.b) <= 1e-9 * (sizes + sizes.max())).all()


@pytest.mark.slow
@given(corridors(walls=False, closed=True, legs=(2, 4), degrees=(3, 5, 7), **MILD))
def test_closed_laps_are_those_of_the_full_problem(asked):
    problem, traj = build_qp(**for_qp(asked)), minsnap.plan(**asked)
    half = (asked["degree"] + 1) // 2
    assert value(problem, dense_optimum(problem)) == pytest.approx(traj.cost(half), rel=1e-5)


@settings(max_examples=15)
@given(corridors(legs=(2, 3), dims=(2, 3), degrees=(5, 7), **MILD))
def test_sampled_corridors_are_those_of_the_full_problem(asked):
    traj = minsnap.plan(**asked | {"corridor": minsnap.Sampled(asked["corridor"], 10)})
    problem = build_qp(**asked, samples=10)
    x = unknowns(traj)
    assert (problem.G @ x - problem.h).max() <= 1e-6 * np.abs(asked["waypoints"]).max()
    assert traj.cost((asked["degree"] + 1) // 2) <= value(problem, optimum(problem, x)) * (1.0 + 1e-4)


@pytest.mark.parametrize("solver", ("daqp", "piqp", "clarabel"))
@pytest.mark.parametrize(("continuity", "cost"), ((3, 1545.5717), (4, 1582.8615)))
def test_any_solver_of_qpsolvers_takes_it_as_it_is(continuity, cost, solver):
    problem = build_qp(CORNERS, DURATIONS, 0.3, continuity=continuity)
    accurate = {"piqp": {"eps_abs": 1e-9, "eps_rel": 1e-9}}.get(solver, {})
    solution = qpsolvers.solve_problem(problem.for_qpsolvers(dense=solver == "daqp"), solver, **accurate)
    assert value(problem, solution.x) == pytest.approx(cost, rel=1e-6)
    traj = problem.trajectory(solution.x)
    assert traj.cost() == pytest.approx(cost, rel=1e-6)
    assert traj(traj.breaks) == pytest.approx(np.array(CORNERS), abs=1e-6)
    assert minsnap.certify(traj, CORNERS, 0.3).corridor_margin < -4e-3


def test_without_a_corridor_there_are_no_inequalities_to_hand_over():
    question = build_qp(CORNERS, DURATIONS).for_qpsolvers()
    assert question.G is question.h is None
    solution = qpsolvers.solve_problem(question, "clarabel")
    assert 0.5 * solution.x @ (question.P @ solution.x) == pytest.approx(216.8955, rel=1e-6)


def test_its_size_is_that_of_the_thesis():
    problem = build_qp(np.array(CORNERS)[:, :2], DURATIONS, 0.3, samples=20, continuity=6)
    assert problem.P.shape == (64, 64)
    # 6 + 6 (m - 1) + 2 m equations per axis
    assert problem.A.shape == (2 * 32, 64)
    assert problem.G.shape == (4 * 20 * 2, 64)
    assert np.linalg.matrix_rank(problem.A.toarray()) == 64


def test_every_row_says_what_it_is():
    problem = build_qp(CORNERS, DURATIONS, 0.3, samples=3, pins={2: {"velocity": (1, 0, 0)}})
    assert len(problem.equalities) == problem.A.shape[0] == len(problem.b)
    assert len(problem.inequalities) == problem.G.shape[0] == len(problem.h)
    assert len(set(problem.equalities)) == len(problem.equalities)
    found = problem.equalities.index("leg 1 ends at waypoint 2, axis 1")
    assert problem.b[found] == 4.0
    assert problem.A[found].nnz == 8
    found = problem.equalities.index("derivative 2 is continuous from leg 0 to leg 1, axis 0")
    assert problem.A[found, :8].toarray()[0] == pytest.approx(np.arange(8) * np.arange(-1, 7) / 16.0)
    assert problem.A[found, 24:32].toarray()[0] == pytest.approx([0, 0, -2 / 4.0, 0, 0, 0, 0, 0])
    found = problem.equalities.index("velocity at waypoint 2, leg 1, axis 0")
    assert problem.b[found] == 1.0
    assert problem.inequalities[0] == "corridor, plane 0 of leg 0 at s = 0.25"


def test_the_cost_is_the_integral_of_the_squared_snap_without_a_half():
    problem = build_qp([[0.0], [1.0]], [1.0])
    x = np.zeros(8)
    x[4] = 1.0
    assert value(problem, x) == pytest.approx(24.0**2)
    assert value(build_qp([[0.0], [1.0]], [2.0]), x) == pytest.approx(24.0**2 / 2.0**7)


def test_walls_of_any_kind_made_of_planes_become_rows():
    corridor = [minsnap.Tube(0.3), minsnap.Boxes([(-1, -1, 0)] * 2, [(9, 5, 2)] * 2)]
    problem = build_qp(CORNERS[:3], DURATIONS[:2], corridor, samples=4)
    assert problem.G.shape[0] == 2 * 4 * (2 * 2 + 2 * 3)
    x = unknowns(minsnap.plan(CORNERS[:3], DURATIONS[:2], corridor=corridor))
    assert (problem.G @ x <= problem.h).all()


def test_nothing_of_it_can_be_changed():
    problem = build_qp(CORNERS, DURATIONS, 0.3)
    assert isinstance(problem, FullProblem)
    for array in (problem.q, problem.h, problem.b, problem.P.data, problem.G.data, problem.A.data):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    assert all(issparse(matrix) for matrix in (problem.P, problem.G, problem.A))


@pytest.mark.parametrize(
    ("change", "error", "words"),
    (
        ({"waypoints": [(0, 0, 1)]}, WaypointError, "at least 2"),
        ({"durations": [1, 2]}, TimingError, "4 legs need 4 durations"),
        ({"degree": 6}, DegreeError, "odd"),
        ({"continuity": 7}, DegreeError, "continuity is 7"),
        ({"samples": -1}, CorridorError, "samples is -1"),
        ({"samples": 2.5}, CorridorError, "samples is 2.5"),
        ({"corridor": minsnap.RoundTube(0.3)}, CorridorError, "round"),
        ({"corridor": -1.0}, CorridorError, "positive"),
        ({"start": {"snap": (0, 0, 0)}}, WaypointError, "start pins 'snap'"),
        ({"pins": {9: {"velocity": (0, 0, 0)}}}, WaypointError, "waypoint 9"),
        ({"closed": True, "end": {}}, WaypointError, "closed=True"),
    ),
)
def test_malformed_questions_are_refused(change, error, words):
    with pytest.raises(error, match=words):
        build_qp(**({"waypoints": CORNERS, "durations": DURATIONS} | change))


def test_unknowns_of_another_shape_are_refused():
    with pytest.raises(WaypointError, match=r"unknowns of shape \(96,\)"):
        build_qp(CORNERS, DURATIONS).trajectory(np.zeros(95))
