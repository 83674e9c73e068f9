"""One call of a QP solver: its tolerances, and the check of its solution."""

from __future__ import annotations

import warnings
from dataclasses import replace
from threading import Lock
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from minsnap.basics.messages import shown
from minsnap.basics.tolerances import ROUNDING
from minsnap.errors import UnknownSolverError

if TYPE_CHECKING:
    from qpsolvers import Problem, Solution

Solver = Literal[
    "auto", "clarabel", "cvxopt", "daqp", "ecos", "gurobi", "highs", "hpipm", "kvxopt", "mosek", "osqp", "piqp",
    "proxqp", "qpalm", "qpoases", "qpswift", "quadprog", "scs",
]  # fmt: skip
"""A QP solver by its qpsolvers name, or the choice of the library."""

ACCURACY = 1e-6
"""Duality gap as a share of the cost, and a tenth of it the violation of a normalised row, that count as solved."""

TOLERANCES: dict[str, dict[str, Any]] = {
    "daqp": {"primal_tol": 1e-13, "sing_tol": 1e-13, "dual_tol": 1e-12, "iter_limit": 10_000},
    "piqp": {
        "eps_abs": 1e-9,
        "eps_rel": 1e-9,
        "eps_duality_gap_abs": 1e-8,
        "eps_duality_gap_rel": 1e-8,
        "max_iter": 100,
    },
    "clarabel": {"tol_gap_abs": 1e-10, "tol_gap_rel": 1e-10, "tol_feas": 1e-10, "max_iter": 60},
    "osqp": {"eps_abs": 1e-7, "eps_rel": 1e-7, "max_iter": 200_000, "polishing": True},
}

INFINITE = 1e29
"""Sides of rows at most: PIQP takes those from 1e30 for infinite, and prints a note of them."""

QUIET = Lock()
"""Held while warnings of solvers are left out: filters of warnings belong to the process, and threads plan at once."""


def check_solver(solver: Solver) -> Solver:
    """Return the name of an installed solver, or raise UnknownSolverError with the list of installed ones."""
    if solver == "auto":
        return solver
    import qpsolvers

    if solver not in qpsolvers.available_solvers:
        installed = ", ".join(sorted(qpsolvers.available_solvers))
        raise UnknownSolverError(f"the solver {shown(solver)} is not installed: use 'auto' or one of {installed}")
    return solver


def solve_qp(problem: Problem, solver: str, tiny: float = ROUNDING) -> Solution | None:
    """Solve a programme, or return None if the solver fails or gives an answer that fails the check.

    Gap tolerances of solvers are absolute: where a cost is small, a second solve has it of order one.

    Parameters
    ----------
    problem : qpsolvers.Problem
        Rows of unit length and costs of order one; matrices of any kind.
    solver : str
        Name of a solver of qpsolvers.
    tiny : float
        Cost below which a duality gap does not matter.

    Returns
    -------
    qpsolvers.Solution or None
        With multipliers of inequalities that are not negative.
    """
    weight = 1.0
    for _ in range(2):
        answer = _through_qpsolvers(problem, weight, solver)
        if answer is None:
            return None
        z, y = (None if part is None else weight * np.asarray(part) for part in (answer.z, answer.y))
        solution = replace(answer, problem=problem, found=True, z=None if z is None else np.maximum(z, 0.0), y=y)
        if _holds(solution, tiny):
            return solution
        weight = max(sum(_costs(solution)), tiny)
    return None


def _through_qpsolvers(problem: Problem, weight: float, solver: str) -> Solution | None:
    """Return what a solver answers to a problem whose cost is divided by a weight; None where it fails."""
    import qpsolvers
    from scipy.sparse import csc_matrix

    def taken(matrix: Any) -> Any:
        return csc_matrix(matrix) if solver in qpsolvers.sparse_solvers else csc_matrix(matrix).toarray()

    P, q, G, h, A, b, *_ = problem.unpack()
    G, A = (None if matrix is None else taken(matrix) for matrix in (G, A))
    sides = None if h is None else np.minimum(h, INFINITE)
    try:
        with QUIET, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            asked = qpsolvers.Problem(taken(P / weight), q / weight, G, sides, A, b)
            solution = qpsolvers.solve_problem(asked, solver, **TOLERANCES.get(solver, {}))
    except (qpsolvers.exceptions.QPError, ValueError, ArithmeticError):
        return None
    return None if solution.x is None or not np.isfinite(solution.x).all() else solution


def _costs(solution: Solution) -> tuple[float, float]:
    """Size of the square and of the linear part of the cost."""
    P, q, x = solution.problem.P, solution.problem.q, solution.x
    return float(x @ (P @ x)), abs(float(q @ x))


def _holds(solution: Solution, tiny: float) -> bool:
    """Whether a solution keeps its rows with that relative duality gap; ``found`` alone is not sufficient."""
    vectors = [one for one in (solution.x, solution.problem.h, solution.problem.b) if one is not None]
    size = max(np.abs(one).max(initial=1.0) for one in vectors)
    near = solution.primal_residual() <= 0.1 * ACCURACY * size
    return bool(near and solution.duality_gap() <= ACCURACY * (sum(_costs(solution)) + tiny))
