"""One quadratic program through qpsolvers: which solver, how exactly, and what to try when it fails."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.arrays import BoolArray, FloatArray
from minsnap.errors import UnknownSolverError
from minsnap.optimisation.least_distance import least_distance

SMALL = 60
"""Unknowns up to which many rows at the start are cheaper than further rounds."""

DENSE_SIZE = 150
"""Unknowns up to which problems are whitened and dense."""

MIDDLE = 1500
"""Unknowns up to which the dense solver is still tried, in whitened coordinates, after the sparse ones."""

FEASIBLE = 1e-7
"""Largest violation of a normalised row that is taken for a solution before it is repaired."""

GAP = 1e-6
"""Largest duality gap, as a share of the cost, that is taken for an optimum."""

TINY = 1e-12
"""Cost, in scaled units, below which a gap does not matter."""

TOLERANCES: dict[str, dict[str, Any]] = {
    "daqp": {"primal_tol": 1e-13, "sing_tol": 1e-13, "dual_tol": 1e-12, "iter_limit": 10_000, "time_limit": 2.0},
    "piqp": {"eps_abs": 1e-10, "eps_rel": 1e-10, "eps_duality_gap_abs": 1e-10, "eps_duality_gap_rel": 1e-10},
    "clarabel": {"tol_gap_abs": 1e-10, "tol_gap_rel": 1e-10, "tol_feas": 1e-10},
    "osqp": {"eps_abs": 1e-7, "eps_rel": 1e-7, "max_iter": 200_000, "polishing": True},
}
DENSE = frozenset({"daqp", "quadprog", "ecos", "cvxopt", "proxqp_dense", "qpax"})


@dataclass(frozen=True, eq=False)
class Solution:
    """What a QP solver found.

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


def solver_names(solver: str, size: int) -> tuple[str, ...]:
    """Solvers to try in turn for a problem with that many unknowns.

    Raises
    ------
    UnknownSolverError
        If ``solver`` is neither ``"auto"`` nor installed.
    """
    if solver != "auto":
        return (check_solver(solver), *(other for other in _preferred(size) if other != solver))
    return _preferred(size)


def _preferred(size: int) -> tuple[str, ...]:
    if size <= DENSE_SIZE:
        return ("daqp", "piqp", "clarabel")
    return ("piqp", "clarabel")


def check_solver(solver: str) -> str:
    """Return the name of an installed solver, or raise UnknownSolverError with the list of those there are."""
    if solver == "auto" or solver in TOLERANCES:
        return solver
    import qpsolvers

    if solver not in qpsolvers.available_solvers:
        installed = ", ".join(sorted(qpsolvers.available_solvers))
        raise UnknownSolverError(f"the solver {solver!r} is not installed: use 'auto' or one of {installed}")
    return solver


def solve_qp(
    P: Any,
    q: FloatArray,
    G: Any,
    h: FloatArray | None,
    A: Any,
    b: FloatArray | None,
    names: Sequence[str],
    tiny: float = TINY,
    active: BoolArray | None = None,
) -> tuple[Solution | None, tuple[str, ...]]:
    """Minimise x'Px/2 + q'x over Gx <= h, Ax = b; rows normalised, costs of order one or not below ``tiny``.

    Returns
    -------
    Solution or None
        None if every solver failed or called the problem infeasible.
    failed : tuple of str
        Names of the solvers that did.
    """
    failed: list[str] = []
    for name in names:
        found = _attempt(P, q, G, h, A, b, name, tiny, active)
        if found is not None:
            return found, tuple(failed)
        failed.append(name)
    return None, tuple(failed)


def _attempt(
    P: Any,
    q: FloatArray,
    G: Any,
    h: FloatArray | None,
    A: Any,
    b: FloatArray | None,
    name: str,
    tiny: float,
    active: BoolArray | None,
) -> Solution | None:
    if name == "nnls":
        if G is None or h is None:
            return None
        answer = least_distance(G, h, A, b, q, active)
        found = None if answer is None else Solution(*answer, name)
        return found if found is not None and _holds(P, q, G, h, A, b, found, tiny) else None
    import qpsolvers

    if name in DENSE:
        P, G, A = (matrix.toarray() if hasattr(matrix, "toarray") else matrix for matrix in (P, G, A))
    elif name != "piqp" or not isinstance(P, np.ndarray):
        P, G, A = (_sparse(matrix) for matrix in (P, G, A))
    try:
        with _silence(name):
            solution = qpsolvers.solve_problem(qpsolvers.Problem(P, q, G, h, A, b), name, **TOLERANCES.get(name, {}))
    except (qpsolvers.exceptions.QPError, ValueError, ArithmeticError):
        return None
    if not solution.found or solution.x is None or not np.isfinite(solution.x).all():
        return None
    z = np.maximum(solution.z, 0.0) if G is not None and solution.z is not None else np.zeros(0)
    y = solution.y if A is not None and solution.y is not None else np.zeros(0)
    found = Solution(solution.x, z, y, name)
    return found if _holds(P, q, G, h, A, b, found, tiny) else None


def _holds(
    P: Any,
    q: FloatArray,
    G: Any,
    h: FloatArray | None,
    A: Any,
    b: FloatArray | None,
    found: Solution,
    tiny: float,
) -> bool:
    """Whether a solution is feasible, and its duality gap small beside its cost: solvers' own words are not enough."""
    x = found.x
    Px = P @ x
    gap = float(x @ Px + q @ x)
    if G is not None and h is not None:
        if not _within(G @ x - h, x, h):
            return False
        gap += float(h @ found.multipliers)
    if A is not None and b is not None:
        if not _within(np.abs(A @ x - b), x, b):
            return False
        gap += float(b @ found.equality_multipliers)
    return abs(gap) <= GAP * (float(x @ Px) + abs(float(q @ x)) + tiny)


@contextmanager
def _silence(name: str) -> Iterator[None]:
    """Ignore what solvers warn of; the one that is called most often never does."""
    if name == "daqp":
        yield
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _within(violation: FloatArray, x: FloatArray, bounds: FloatArray) -> bool:
    """Whether violations are rounding beside a solution and bounds of at least order one."""
    largest = float(violation.max(initial=0.0))
    if largest <= FEASIBLE:
        return True
    return largest <= FEASIBLE * max(float(np.abs(x).max(initial=0.0)), float(np.abs(bounds).max(initial=0.0)))


def _sparse(matrix: Any) -> Any:
    from scipy.sparse import csc_matrix

    return matrix if matrix is None or hasattr(matrix, "tocsc") else csc_matrix(matrix)
