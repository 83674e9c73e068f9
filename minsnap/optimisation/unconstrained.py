"""The optimum without inequalities: where the cost has no slope in what is free."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import lstsq
from scipy.sparse.linalg import splu

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import ROUNDING
from minsnap.errors import SolverError
from minsnap.optimisation.linear_rows import DENSE
from minsnap.optimisation.reduced_qp import ReducedProblem

RESOLVED = {2: np.inf, 3: 1e6, 4: 300.0, 5: 20.0, 6: 4.0}
"""By k: the ratio of durations up to which the Hessian gives the optimum to about 1e-9; it grows with its 2k - 1."""


def unbounded_optimum(problem: ReducedProblem) -> FloatArray:
    """Knot values of least cost that keep every pin, bounded positions held at their nominal values.

    Returns
    -------
    ndarray, shape (knots, slots, dim)

    Raises
    ------
    SolverError
        If double precision does not resolve the durations.
    """
    free = problem.free.copy()
    free[problem.held, 0] = False
    chain = replace(problem, free=free)
    if not chain.size:
        return chain.values
    extreme = np.ptp(np.log(chain.durations)) > np.log(RESOLVED[chain.half])
    unknowns = None if extreme else _by_hessian(chain)
    if unknowns is None:
        unknowns = _by_least_squares(chain)
    if unknowns is None:
        raise SolverError(
            "the system without inequalities is singular to working precision: durations or pins are too extreme"
        )
    return chain.add(chain.values, unknowns)


def _by_hessian(problem: ReducedProblem) -> FloatArray | None:
    """Unknowns (size,); None where the Hessian is not positive definite but for rounding."""
    try:
        factor = splu(problem.hessian, "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})
    except RuntimeError:
        return None
    slope = problem.slope(problem.values, np.ones(len(problem.held), dtype=bool))
    return np.asarray(factor.solve(-slope)) if factor.U.diagonal().min() > 0.0 else None


def _by_least_squares(problem: ReducedProblem) -> FloatArray | None:
    """Unknowns (size,), axis by axis, from the roots of the cost; None where these are too many, or not independent.

    The condition of the roots is the root of the Hessian's.  Householder's method with pivots keeps the digits of rows
    of any size if the largest come first (A. J. Cox and N. J. Higham, "Stability of Householder QR factorization for
    weighted least squares problems", 1998).
    """
    unknowns, right = np.zeros(problem.size), problem.weighted_roots(problem.values).reshape(problem.dim, -1)
    for axis, sides in enumerate(right):
        own = np.unique(problem.columns[:, :, axis])
        own = own[own >= 0]
        if len(own) > 10 * DENSE:  # which take 20 s
            return None
        matrix = problem.roots[axis * len(sides) : (axis + 1) * len(sides), own].toarray()
        sizes, order = (
            np.linalg.norm(matrix, axis=0),
            np.argsort(-np.abs(matrix).max(axis=1, initial=0.0), kind="stable"),
        )
        solution, _, rank, _ = lstsq(matrix[order] / sizes, -sides[order], cond=ROUNDING, lapack_driver="gelsy")
        if rank < len(own):
            return None
        unknowns[own] = solution / sizes
    return unknowns
