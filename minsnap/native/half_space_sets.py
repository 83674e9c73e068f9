"""Linear programmes of the native core over sets of half-spaces A x <= b: largest balls, reach along directions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.library import Entry
from minsnap.native.records import SetsRecord

_SOLVE = Entry("minsnap_half_spaces", SetsRecord)

Sets = Sequence[tuple[FloatArray, FloatArray]]
"""A (m, dim) with rows of unit length, and b (m,)."""


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
