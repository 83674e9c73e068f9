"""A sparse QP solved near some rows, the unknowns elsewhere held.

What a row changes decays along the course. Late rounds of the exchange add rows on a few of many legs, and need not
solve for all of them; what holding the others costs is bounded by the dual (S. Boyd and L. Vandenberghe, "Convex
Optimization", 2004, section 5.5.1).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.optimisation.qp import ACCURACY, Programme, Solution, solve_qp


def solve_near(asked: Programme, last: Solution, near: IntArray, room: FloatArray) -> Solution | None:
    """Solve a programme with rows and no equalities for some of its unknowns; None where that is not good enough.

    Parameters
    ----------
    last : Solution
        Of a similar programme, and by which solver; multipliers of new rows are zero.
    near : ndarray of int, shape (m,)
        Unknowns that are not held.
    room : ndarray, shape (r,)
        By how much a row may be broken.
    """
    P, G, h = asked.P, asked.G, np.asarray(asked.h)
    x, multipliers = last.x.copy(), last.multipliers.copy()
    x[near] = 0.0
    own = G[:, near]
    rows = np.unique(own.indices)
    part = Programme(P[:, near][near], (asked.q + P @ x)[near], own[rows], (h - G @ x)[rows])
    found = solve_qp(part, last.solver)
    if found is None:
        return None
    x[near], multipliers[rows] = found.x, found.multipliers
    whole = replace(found, x=x, multipliers=multipliers)
    kept = bool((G @ x <= h + room).all())
    return whole if kept and loss(asked, whole) <= ACCURACY * float(x @ (P @ x)) else None


def loss(asked: Programme, found: Solution) -> float:
    r"""Bound of what a solution costs more than the least: :math:`z^\top (h - G x) + r^\top P^{-1} r / 2`.

    With :math:`r = P x + q + G^\top z`, which is zero where nothing was held.
    """
    from scipy.sparse.linalg import spsolve

    x, z = found.x, found.multipliers
    rest = asked.P @ x + asked.q + asked.G.T @ z
    return float(z @ (np.asarray(asked.h) - asked.G @ x)) + 0.5 * float(rest @ spsolve(asked.P, rest))
