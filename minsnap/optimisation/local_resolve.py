r"""Windows: solve again only near where rows were added, and bound what that leaves of the optimum.

What a row changes fades along the chain, by about half from knot to knot.  Late rounds add rows on few legs: there it
is enough to solve for the knots around them, with all others held.  The dual function bounds what is lost (S. Boyd and
L. Vandenberghe, "Convex Optimization", 2004, section 5.5): :math:`x^\top H x + 2 q^\top x` exceeds its least value
over :math:`Gx \le h` by at most :math:`g^\top H^{-1} g + 2 m^\top (h - Gx)`, with :math:`m \ge 0` and
:math:`g = Hx + q + G^\top m`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from minsnap.arrays import BoolArray, FloatArray, IntArray
from minsnap.optimisation.qp import solve_qp
from minsnap.optimisation.reduced_qp import Problem

if TYPE_CHECKING:
    from minsnap.optimisation.axis_group import Component
    from minsnap.optimisation.rows import RowSet

REACH = 4
"""Pieces on both sides of a row that a window has."""

SHARE = 0.5
"""Share of all pieces in windows beyond which solving for everything is as quick."""


def solve_near(
    part: Component, rows: RowSet, chosen: IntArray, shrink: float, multipliers: FloatArray, fresh: BoolArray
) -> tuple[FloatArray, FloatArray] | None:
    """Solve a sparse component for the knots near its fresh rows: unknowns and multipliers, or None if it cannot.

    Parameters
    ----------
    chosen : ndarray of int, shape (c,)
        The component's rows.
    shrink : float
        Widths by which walls are moved inwards; there must be a solution with the same already.
    multipliers : ndarray, shape (c,)
        Of the last solution, zero where fresh.
    fresh : ndarray of bool, shape (c,)
        Rows that are new.
    """
    if not part.local_solves or part.shrink != shrink or not fresh.any():
        return None
    window = pieces_around(part.problem, rows.source.piece[chosen[fresh]])
    if window.mean() > SHARE:
        return None
    free, mine = _inner_columns(part, window), np.flatnonzero(window[rows.source.piece[chosen]])
    G, h, norms = part.matrix(rows, chosen[mine], shrink)
    hessian = part.space.hessian
    slope = (hessian @ part.x + part.slope)[free] / part.size
    room = (h - G @ part.x) / part.size
    found, _ = solve_qp(hessian[:, free][free], slope, G[:, free], room, None, None, part.names, 1.0)
    if found is None:
        return None
    x, multipliers = part.x.copy(), multipliers.copy()
    x[free] += part.size * found.x
    multipliers[mine] = 2.0 * part.size * found.multipliers / norms
    return part.take(x, held=True), multipliers


def pieces_around(problem: Problem, piece: IntArray) -> BoolArray:
    """Pieces within ``REACH`` of some, over the seam of a closed lap: shape (pieces in all,)."""
    hit = np.zeros(len(problem.durations))
    hit[piece] = 1.0
    if len(hit) <= 2 * REACH:
        return np.ones(len(hit), dtype=bool)
    padded = np.pad(hit, REACH, mode="wrap" if problem.closed else "constant")
    return np.asarray(np.convolve(padded, np.ones(2 * REACH + 1), "valid") > 0.5)


def loss(part: Component, rows: RowSet, chosen: IntArray, shrink: float, multipliers: FloatArray) -> float:
    """Bound on how much dearer a component's solution is than the optimum over its rows, normalised.

    Infinite where the Hessian is singular to working precision.
    """
    from scipy.sparse.linalg import splu

    G, h, norms = part.matrix(rows, chosen, shrink)
    hessian, force = part.space.hessian, multipliers * norms / 2.0
    rest = hessian @ part.x + part.slope + G.T @ force
    try:
        lost = float(rest @ splu(hessian).solve(rest))
    except RuntimeError:
        return np.inf
    return lost + 2.0 * float(force @ (h - G @ part.x)) if lost >= 0.0 else np.inf


def _inner_columns(part: Component, window: BoolArray) -> IntArray:
    """Unknowns of a component that no piece outside the window has."""
    n = len(part.columns)
    columns = part.local[part.problem.piece_columns[:, part.axes]].reshape(len(window), -1)
    inner = np.zeros(n + 1, dtype=bool)
    inner[columns[window]] = True
    inner[columns[~window]] = False
    return np.flatnonzero(inner[:n])
