"""Cone programmes of a chain of pieces, solved by the native core."""

from __future__ import annotations

from ctypes import c_double, c_int64, c_void_p

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.library import Entry, address
from minsnap.native.status import Status

_SOLVE = Entry("minsnap_cone_programme", *[c_void_p] * 9, c_double, c_int64, *[c_void_p] * 3)


def solve_chain(
    columns: np.ndarray[tuple[int, ...], np.dtype[np.int64]],
    costs: tuple[FloatArray, FloatArray, FloatArray],
    cones: tuple[np.ndarray[tuple[int, ...], np.dtype[np.int64]], np.ndarray[tuple[int, ...], np.dtype[np.int64]]],
    rows: tuple[FloatArray, FloatArray],
    tolerance: float,
) -> tuple[FloatArray, FloatArray] | None:
    """Minimise 1/2 x'Px + q'x subject to h - G x in a product of cones.

    Parameters
    ----------
    columns : ndarray of int64, shape (pieces, width)
        Unknowns of each piece, their number for none.
    costs : tuple of ndarray
        Hessian of each piece (pieces, width, width), further diagonal (size,), and q (size,).
    cones : tuple of ndarray of int64
        Piece, not falling, and number of rows of each cone: (cones,) each.
    rows : tuple of ndarray
        G (rows, width) in the unknowns of the cone's piece, and h (rows,).
    tolerance : float
        Of residuals and gap.

    Returns
    -------
    tuple of ndarray or None
        x (size,) and multipliers (rows,); None where the native core is not in use or does not solve it.
    """
    solve = _SOLVE.function()
    if solve is None:
        return None
    hessian, diagonal, linear = (np.ascontiguousarray(part) for part in costs)
    matrix, bound = (np.ascontiguousarray(part) for part in rows)
    sizes = np.array([len(diagonal), *columns.shape, len(cones[0]), len(bound)], dtype=np.int64)
    x, z, iterations = np.zeros(len(diagonal)), np.zeros(len(bound)), np.zeros(1, dtype=np.int64)
    arguments = (sizes, columns, hessian, diagonal, linear, *cones, matrix, bound)
    results = (address(part) for part in (x, z, iterations))
    status = solve(*(address(part) for part in arguments), tolerance, 60, *results)
    return (x, z) if Status(status) is Status.DONE else None
