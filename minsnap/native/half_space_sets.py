"""Linear programmes over sets of half-spaces A x <= b: largest balls, reach along directions, boxes around them.

S. Boyd and L. Vandenberghe, "Convex Optimization", 2004, section 4.3.1, for the largest ball.  Without the native core
HiGHS solves those of all sets at once, as one block-diagonal programme.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import EXACT
from minsnap.errors import SolverError
from minsnap.native.library import Entry
from minsnap.native.records import SetsRecord

_SOLVE = Entry("minsnap_half_spaces", SetsRecord)

HalfSpaceRows = tuple[FloatArray, FloatArray]
"""A (m, dim) with rows of unit length, and b (m,)."""

Sets = Sequence[HalfSpaceRows]

UNBOUNDED = 1e3
"""Radius of an inner ball, over the largest offset, from which a set counts as unbounded."""

PRECISE = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


def inner_balls(sets: Sets) -> tuple[FloatArray, FloatArray]:
    """Return the largest ball in each set: centers (m, dim) and radii (m,); negative radii where a set is empty."""
    balls = largest_balls(sets, UNBOUNDED)
    if balls is not None:
        return balls
    dim = sets[0][0].shape[1]
    with_radius = [(np.column_stack([A, np.ones(len(b))]), b) for A, b in sets]
    bounds = [limit for _, b in sets for limit in [(None, None)] * dim + [(None, UNBOUNDED * _size(b))]]
    solution = _minimum(np.tile(-np.eye(dim + 1)[dim], (len(sets), 1)), with_radius, bounds)
    return solution[:, :dim], solution[:, dim].copy()


def reach(along: FloatArray, sets: Sets) -> FloatArray:
    """Return how far sets reach along directions (n, dim) of unit length: (m, n), possibly infinite."""
    far = UNBOUNDED * np.array([_size(b) for _, b in sets])
    least = least_products(-along, sets, UNBOUNDED)
    if least is None:
        bounds = [(-size, size) for size in far for _ in range(along.size)]
        found = _minimum(np.tile(-along, (len(sets), 1)), [rows for rows in sets for _ in along], bounds)
        least = -(found.reshape(len(sets), *along.shape) * along).sum(axis=2)
    return np.where(-least > 0.99 * far[:, None], np.inf, -least)


def bounding_boxes(sets: Sets) -> tuple[FloatArray, FloatArray]:
    """Return the corners (m, dim) of the boxes around sets, infinite where these are unbounded."""
    axes = np.eye(sets[0][0].shape[1])
    far = reach(np.concatenate((-axes, axes)), sets)
    return -far[:, : len(axes)], far[:, len(axes) :]


def flatness(rows: HalfSpaceRows) -> float:
    """Radius below which a set counts as having no interior [m]."""
    return EXACT * _size(rows[1])


def _minimum(costs: FloatArray, sets: Sets, bounds: Sequence[tuple[float | None, float | None]]) -> FloatArray:
    """Point of each set at which its linear cost is least; both of shape (m, n)."""
    from scipy.optimize import linprog
    from scipy.sparse import block_diag

    matrix, right = block_diag([A for A, _ in sets], format="csc"), np.concatenate([b for _, b in sets])
    options = PRECISE | {"maxiter": 20 * sum(matrix.shape)}  # far more than it needs, and it may cycle
    solution = linprog(costs.reshape(-1), matrix, right, bounds=bounds, method="highs", options=options)
    if solution.x is None or solution.status == 1:
        raise SolverError(f"a linear programme for the polytopes failed: {solution.message}")
    return np.asarray(solution.x.reshape(costs.shape))


def _size(offsets: FloatArray) -> float:
    return 1.0 + float(np.abs(offsets).max())


def largest_balls(sets: Sets, far: float) -> tuple[FloatArray, FloatArray] | None:
    """Return centers (sets, dim) and radii (sets,), negative where a set is empty; None where another solver has to.

    Parameters
    ----------
    far : float
        Largest radius, over 1 m and the largest offset of a set.
    """
    balls = np.empty((len(sets), sets[0][0].shape[1])), np.empty(len(sets))
    return None if _solve(sets, far, centers=balls[0], radii=balls[1]) else balls


def least_products(along: FloatArray, sets: Sets, far: float) -> FloatArray | None:
    """Return the least products of points of sets with directions (ways, dim): (sets, ways), or None as above.

    Parameters
    ----------
    far : float
        Size of coordinates at most, over 1 m and the largest offset of a set.
    """
    least = np.empty((len(sets), len(along)))
    return None if _solve(sets, far, ways=len(along), along=along, least=least) else least


def _solve(sets: Sets, far: float, **rest: Any) -> int:
    normals, bounds = (np.concatenate(part, dtype=np.float64) for part in zip(*sets, strict=True))
    first = np.zeros(len(sets) + 1, dtype=np.int64)
    np.cumsum([len(b) for _, b in sets], out=first[1:])
    known = {"sets": len(sets), "dim": normals.shape[1], "far": far}
    return _SOLVE(SetsRecord(**known, first=first, normals=normals, bounds=bounds, **rest))
