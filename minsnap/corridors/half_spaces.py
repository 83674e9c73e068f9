r"""Sets of half-spaces :math:`A r \le b`: their checks, inner balls and bounding boxes.

Balls and boxes come from linear programmes; those of all sets are solved at once, as one block-diagonal programme
(S. Boyd and L. Vandenberghe, "Convex Optimization", 2004, section 4.3.1, for the largest ball).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.errors import CorridorError, SolverError
from minsnap.tolerances import EXACT

HalfSpaceRows = tuple[FloatArray, FloatArray]
"""A (m, dim) with rows of unit length, and b (m,)."""

FAR = 1e3
"""Inner balls are not sought larger than so many times the largest offset: that is unbounded."""

PRECISE = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


def inner_balls(sets: Sequence[HalfSpaceRows]) -> tuple[FloatArray, FloatArray]:
    """Return the largest ball in each set: centres (m, dim) and radii (m,); negative radii where a set is empty."""
    from scipy.optimize import linprog

    dim = sets[0][0].shape[1]
    blocks = [np.column_stack([A, np.ones(len(b))]) for A, b in sets]
    cost = np.tile(np.append(np.zeros(dim), -1.0), len(sets))
    bounds = [limit for _, b in sets for limit in [(None, None)] * dim + [(None, FAR * _size(b))]]
    found = linprog(
        cost, _diagonal(blocks), np.concatenate([b for _, b in sets]), bounds=bounds, method="highs", options=PRECISE
    )
    if found.x is None:
        raise SolverError(f"the linear programme for the polytopes' inner balls failed: {found.message}")
    solution = found.x.reshape(len(sets), dim + 1)
    return solution[:, :dim], solution[:, dim].copy()


def bounding_boxes(sets: Sequence[HalfSpaceRows]) -> tuple[FloatArray, FloatArray]:
    """Return the corners (m, dim) of the boxes around sets, infinite where these are unbounded."""
    from scipy.optimize import linprog

    dim = sets[0][0].shape[1]
    bounds = [(-FAR * _size(b), FAR * _size(b)) for _, b in sets for _ in range(dim)]
    matrix, right = _diagonal([A for A, _ in sets]), np.concatenate([b for _, b in sets])
    corners = np.empty((2, len(sets), dim))
    for side, sign in enumerate((1.0, -1.0)):
        for axis in range(dim):
            cost = np.tile(sign * np.eye(dim)[axis], len(sets))
            found = linprog(cost, matrix, right, bounds=bounds, method="highs", options=PRECISE)
            if found.x is None:
                raise SolverError(f"the linear programme for the polytopes' bounding boxes failed: {found.message}")
            corners[side, :, axis] = found.x.reshape(len(sets), dim)[:, axis]
    far = 0.99 * FAR * np.array([_size(b) for _, b in sets])[:, None]
    return np.where(corners[0] < -far, -np.inf, corners[0]), np.where(corners[1] > far, np.inf, corners[1])


def check_half_spaces(normal: FloatArray, offset: FloatArray, what: str) -> None:
    """Raise CorridorError unless normals (m, dim) and offsets (m,) match, are finite, and no normal is zero."""
    if normal.ndim != 2 or 0 in normal.shape or offset.shape != (len(normal),):
        raise CorridorError(
            f"the normals of {what} have shape {normal.shape} and the offsets {offset.shape}: give (m, dim) and (m,)"
        )
    wrong = ~(np.isfinite(normal).all(axis=1) & np.isfinite(offset))
    if wrong.any():
        raise CorridorError(f"row {int(np.argmax(wrong))} of {what} is not finite: every entry must be a finite number")
    flat = ~normal.any(axis=1)
    if flat.any():
        raise CorridorError(
            f"row {int(np.argmax(flat))} of {what} has a normal of zeros: it has no direction; remove it"
        )


def _size(offsets: FloatArray) -> float:
    return 1.0 + float(np.abs(offsets).max())


def flatness(rows: HalfSpaceRows) -> float:
    """Radius below which a set counts as having no interior [m]."""
    return EXACT * _size(rows[1])


def _diagonal(blocks: Sequence[FloatArray]) -> Any:
    from scipy.sparse import block_diag

    return block_diag(blocks, format="csc")
