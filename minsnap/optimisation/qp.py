"""One call of a QP solver: its tolerances, and the check of its solution."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from threading import Lock
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import ROUNDING
from minsnap.errors import UnknownSolverError

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
DENSE_SOLVERS = frozenset({"daqp", "quadprog", "ecos", "cvxopt", "proxqp_dense", "qpax"})

INFINITE = 1e29
"""Sides of rows at most: PIQP takes those from 1e30 for infinite, and prints a note of them."""

QUIET = Lock()
"""Held while warnings of solvers are left out: filters of warnings belong to the process, and threads plan at once."""


@dataclass(frozen=True, eq=False)
class Programme:
    """Minimise x'Px/2 + q'x over Gx <= h, Ax = b; rows normalised, costs of order one.

    Parameters
    ----------
    P : ndarray or csc_matrix, shape (n, n)
    q : ndarray, shape (n,)
    G : ndarray or csc_matrix, shape (r, n), or None
    h : ndarray, shape (r,), or None
    A : ndarray or csc_matrix, shape (e, n), or None
    b : ndarray, shape (e,), or None
    """

    P: Any
    q: FloatArray
    G: Any = None
    h: FloatArray | None = None
    A: Any = None
    b: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Solution:
    """Solution of a QP.

    Parameters
    ----------
    x : ndarray, shape (n,)
    multipliers : ndarray, shape (rows,)
        Of the inequalities, non-negative.
    dual : ndarray, shape (equalities,)
    solver : str
        Who found it.
    """

    x: FloatArray
    multipliers: FloatArray
    dual: FloatArray
    solver: str


def check_solver(solver: str) -> str:
    """Return the name of an installed solver, or raise UnknownSolverError with the list of installed ones."""
    if solver == "auto":
        return solver
    import qpsolvers

    if solver not in qpsolvers.available_solvers:
        installed = ", ".join(sorted(qpsolvers.available_solvers))
        raise UnknownSolverError(f"the solver {shown(solver)} is not installed: use 'auto' or one of {installed}")
    return solver


def solve_qp(programme: Programme, solver: str, tiny: float = ROUNDING) -> Solution | None:
    """Solve a programme, or return None if the solver fails or gives an answer that fails the check.

    Gap tolerances of solvers are absolute: where a cost is small, a second solve has it of order one.

    Parameters
    ----------
    solver : str
        Name of a solver of qpsolvers.
    tiny : float
        Cost below which a duality gap does not matter.
    """
    weight = 1.0
    for _ in range(2):
        solution = _through_qpsolvers(replace(programme, P=programme.P / weight, q=programme.q / weight), solver)
        if solution is None:
            return None
        solution = replace(solution, multipliers=weight * solution.multipliers, dual=weight * solution.dual)
        if _holds(programme, solution, tiny):
            return solution
        weight = max(float(solution.x @ (programme.P @ solution.x)) + abs(float(programme.q @ solution.x)), tiny)
    return None


def _dense(matrix: Any) -> FloatArray:
    return np.ascontiguousarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix)


def _through_qpsolvers(programme: Programme, solver: str) -> Solution | None:
    import qpsolvers
    from scipy.sparse import csc_matrix

    P, G, A = programme.P, programme.G, programme.A
    if solver in DENSE_SOLVERS:
        P, G, A = (None if matrix is None else _dense(matrix) for matrix in (P, G, A))
    else:
        P, G, A = (None if matrix is None else csc_matrix(matrix) for matrix in (P, G, A))
    sides = None if programme.h is None else np.minimum(programme.h, INFINITE)
    try:
        with QUIET, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            problem = qpsolvers.Problem(P, programme.q, G, sides, A, programme.b)
            solution = qpsolvers.solve_problem(problem, solver, **TOLERANCES.get(solver, {}))
    except (qpsolvers.exceptions.QPError, ValueError, ArithmeticError):
        return None
    if solution.x is None or not np.isfinite(solution.x).all():
        return None
    none: FloatArray = np.zeros(0)
    z = none if G is None or solution.z is None else np.maximum(solution.z, 0.0)
    y = none if A is None or solution.y is None else np.asarray(solution.y, dtype=np.float64)
    return Solution(solution.x, z, y, solver)


def _holds(programme: Programme, solution: Solution, tiny: float) -> bool:
    """Whether a solution satisfies its rows with that relative duality gap; ``found`` alone is not sufficient."""
    x = solution.x
    Px, linear = programme.P @ x, float(programme.q @ x)
    gap = float(x @ Px) + linear
    if programme.G is not None and programme.h is not None:
        if not _within(programme.G @ x - programme.h, x, programme.h):
            return False
        gap += float(programme.h @ solution.multipliers)
    if programme.A is not None and programme.b is not None:
        if not _within(np.abs(programme.A @ x - programme.b), x, programme.b):
            return False
        gap += float(programme.b @ solution.dual)
    return abs(gap) <= ACCURACY * (float(x @ Px) + abs(linear) + tiny)


def _within(violation: FloatArray, x: FloatArray, bounds: FloatArray) -> bool:
    """Whether violations are rounding relative to a solution and bounds of at least order one."""
    size = max(1.0, float(np.abs(x).max(initial=0.0)), float(np.abs(bounds).max(initial=0.0)))
    return float(violation.max(initial=0.0)) <= 0.1 * ACCURACY * size
