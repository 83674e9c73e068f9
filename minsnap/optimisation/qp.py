"""One call of a QP solver: its tolerances, and the check of its solution."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import ROUNDING
from minsnap.errors import UnknownSolverError
from minsnap.optimisation.least_distance import Spend, least_distance

DENSE = 150
"""Unknowns up to which one QP takes all axes, its Hessian is made the identity, and it is dense."""

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
DENSE_SOLVERS = frozenset({"quadprog", "ecos", "cvxopt", "proxqp_dense", "qpax"})


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
    equality_multipliers : ndarray, shape (equalities,)
    solver : str
        Who found it.
    """

    x: FloatArray
    multipliers: FloatArray
    equality_multipliers: FloatArray
    solver: str


def check_solver(solver: str) -> str:
    """Return the name of an installed solver, or raise UnknownSolverError with the list of installed ones."""
    if solver == "auto" or solver in TOLERANCES:
        return solver
    import qpsolvers

    if solver not in qpsolvers.available_solvers:
        installed = ", ".join(sorted(qpsolvers.available_solvers))
        raise UnknownSolverError(f"the solver {shown(solver)} is not installed: use 'auto' or one of {installed}")
    return solver


def solve_qp(
    asked: Programme,
    solver: str,
    tiny: float = ROUNDING,
    active: BoolArray | None = None,
    weight: float = 1.0,
    accuracy: float = ACCURACY,
    spend: Spend | None = None,
) -> Solution | None:
    """Solve a programme, or return None if the solver fails or gives an answer that fails the check.

    Parameters
    ----------
    solver : str
        Name of a solver of qpsolvers, or ``"nnls"`` for least distance by non-negative least squares, which needs a
        Hessian that is ``weight`` times the identity.
    tiny : float
        Cost below which a duality gap does not matter.
    active : ndarray of bool, shape (a,), optional
        Which of the first a rows were active in a similar programme: where ``"nnls"`` begins.
    accuracy : float
        Relative duality gap that is accepted.
    spend : callable, optional
        Counts the calls of DAQP and of non-negative least squares, and ends the latter.
    """
    if solver == "nnls":
        found = _nearest(asked, active, weight, spend)
    else:
        found = _by_daqp(asked, spend) if solver == "daqp" else _through_qpsolvers(asked, solver)
    return found if found is not None and _holds(asked, found, tiny, accuracy) else None


def _nearest(asked: Programme, active: BoolArray | None, weight: float, spend: Spend | None) -> Solution | None:
    if asked.G is None or asked.h is None:
        return None
    answer = least_distance(asked.G, asked.h, asked.A, asked.b, asked.q / weight, active, spend)
    return None if answer is None else Solution(answer[0], weight * answer[1], weight * answer[2], "nnls")


def _by_daqp(asked: Programme, spend: Spend | None) -> Solution | None:
    """Solve by DAQP itself: qpsolvers does not say how many iterations it took."""
    import daqp

    count, nothing = len(asked.q), np.zeros((0, len(asked.q)))
    G, A = (nothing if rows is None else _dense(rows) for rows in (asked.G, asked.A))
    sides = np.concatenate([np.zeros(0) if side is None else side for side in (asked.h, asked.b)])
    equal = np.repeat(np.array([0, 5], dtype=np.int32), (len(G), len(A)))
    rows = np.vstack((G, A)) if len(A) else G
    asked_of = _dense(asked.P), asked.q, rows, sides, np.full(len(sides), -1e30), equal
    x, _, status, told = daqp.solve(*asked_of, **TOLERANCES["daqp"])
    if spend is not None:
        spend("daqp", len(sides), count, told["iterations"])
    if status <= 0 or not np.isfinite(x).all():
        return None
    return Solution(x, np.maximum(told["lam"][: len(G)], 0.0), told["lam"][len(G) :], "daqp")


def _dense(matrix: Any) -> FloatArray:
    return np.ascontiguousarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix)


def _through_qpsolvers(asked: Programme, solver: str) -> Solution | None:
    import qpsolvers

    P, G, A = asked.P, asked.G, asked.A
    if solver in DENSE_SOLVERS:
        P, G, A = (None if matrix is None else _dense(matrix) for matrix in (P, G, A))
    elif solver != "piqp" or not isinstance(P, np.ndarray):
        P, G, A = (_sparse(matrix) for matrix in (P, G, A))
    sides = None if asked.h is None else finite_for_piqp(asked.h)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            problem = qpsolvers.Problem(P, asked.q, G, sides, A, asked.b)
            solution = qpsolvers.solve_problem(problem, solver, **TOLERANCES.get(solver, {}))
    except (qpsolvers.exceptions.QPError, ValueError, ArithmeticError):
        return None
    if not solution.found or solution.x is None or not np.isfinite(solution.x).all():
        return None
    z = np.maximum(solution.z, 0.0) if G is not None and solution.z is not None else np.zeros(0)
    y = solution.y if A is not None and solution.y is not None else np.zeros(0)
    return Solution(solution.x, z, y, solver)


def finite_for_piqp(sides: FloatArray) -> FloatArray:
    """Return sides of rows below 1e30: PIQP takes others for infinite, and prints a note of them."""
    return np.minimum(sides, 1e29)


def _holds(asked: Programme, found: Solution, tiny: float, accuracy: float) -> bool:
    """Whether a solution satisfies its rows with that relative duality gap; ``found`` alone is not sufficient."""
    x = found.x
    Px, linear = asked.P @ x, float(asked.q @ x)
    gap = float(x @ Px) + linear
    if asked.G is not None and asked.h is not None:
        if not _within(asked.G @ x - asked.h, x, asked.h):
            return False
        gap += float(asked.h @ found.multipliers)
    if asked.A is not None and asked.b is not None:
        if not _within(np.abs(asked.A @ x - asked.b), x, asked.b):
            return False
        gap += float(asked.b @ found.equality_multipliers)
    return abs(gap) <= accuracy * (float(x @ Px) + abs(linear) + tiny)


def _within(violation: FloatArray, x: FloatArray, bounds: FloatArray) -> bool:
    """Whether violations are rounding relative to a solution and bounds of at least order one."""
    size = max(1.0, float(np.abs(x).max(initial=0.0)), float(np.abs(bounds).max(initial=0.0)))
    return float(violation.max(initial=0.0)) <= 0.1 * ACCURACY * size


def _sparse(matrix: Any) -> Any:
    from scipy.sparse import csc_matrix

    return matrix if matrix is None or hasattr(matrix, "tocsc") else csc_matrix(matrix)
