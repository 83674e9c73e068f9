r"""Inner balls and reach of sets of half-spaces :math:`A r \le b`.

Both come from linear programmes of the native core (S. Boyd and L. Vandenberghe, "Convex Optimization", 2004, section
4.3.1, for the largest ball).  Without it HiGHS solves those of all sets at once, as one block-diagonal programme.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.errors import SolverError
from minsnap.native.half_space_sets import largest_balls, least_products

HalfSpaceRows = tuple[FloatArray, FloatArray]
"""A (m, dim) with rows of unit length, and b (m,)."""

UNBOUNDED = 1e3
"""Radius of an inner ball, over the largest offset, from which a set counts as unbounded."""

PRECISE = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


def inner_balls(sets: Sequence[HalfSpaceRows]) -> tuple[FloatArray, FloatArray]:
    """Return the largest ball in each set: centers (m, dim) and radii (m,); negative radii where a set is empty."""
    balls = largest_balls(sets, UNBOUNDED)
    if balls is not None:
        return balls
    dim = sets[0][0].shape[1]
    with_radius = [(np.column_stack([A, np.ones(len(b))]), b) for A, b in sets]
    bounds = [limit for _, b in sets for limit in [(None, None)] * dim + [(None, UNBOUNDED * _size(b))]]
    solution = _minimum(np.tile(-np.eye(dim + 1)[dim], (len(sets), 1)), with_radius, bounds)
    return solution[:, :dim], solution[:, dim].copy()


def reach(along: FloatArray, sets: Sequence[HalfSpaceRows]) -> FloatArray:
    """Return how far sets reach along directions (n, dim) of unit length: (m, n), possibly infinite."""
    far = UNBOUNDED * np.array([_size(b) for _, b in sets])
    least = least_products(-along, sets, UNBOUNDED)
    if least is None:
        bounds = [(-size, size) for size in far for _ in range(along.size)]
        found = _minimum(np.tile(-along, (len(sets), 1)), [rows for rows in sets for _ in along], bounds)
        least = -(found.reshape(len(sets), *along.shape) * along).sum(axis=2)
    return np.where(-least > 0.99 * far[:, None], np.inf, -least)


def bounding_boxes(sets: Sequence[HalfSpaceRows]) -> tuple[FloatArray, FloatArray]:
    """Return the corners (m, dim) of the boxes around sets, infinite where these are unbounded."""
    axes = np.eye(sets[0][0].shape[1])
    far = reach(np.concatenate((-axes, axes)), sets)
    return -far[:, : len(axes)], far[:, len(axes) :]


def flatness(rows: HalfSpaceRows) -> float:
    """Radius below which a set counts as having no interior [m]."""
    return EXACT * _size(rows[1])


def _minimum(
    costs: FloatArray, sets: Sequence[HalfSpaceRows], bounds: Sequence[tuple[float | None, float | None]]
) -> FloatArray:
    """Point of each set at which its linear cost is least; both of shape (m, n)."""
    from scipy.optimize import linprog
    from scipy.sparse import block_diag

    matrix, right = block_diag([A for A, _ in sets], format="csc"), np.concatenate([b for _, b in sets])
    solution = linprog(costs.reshape(-1), matrix, right, bounds=bounds, method="highs", options=PRECISE)
    if solution.x is None:
        raise SolverError(f"a linear programme for the polytopes failed: {solution.message}")
    return np.asarray(solution.x.reshape(costs.shape))


def _size(offsets: FloatArray) -> float:
    return 1.0 + float(np.abs(offsets).max())
