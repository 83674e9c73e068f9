"""Many plans without walls, and their evaluation, by the native core over threads."""

from __future__ import annotations

from ctypes import c_double, c_int32, c_int64, c_void_p

import numpy as np

from minsnap.arrays import BoolArray, FloatArray, IntArray
from minsnap.native.library import Entry, address

_SOLVE = Entry(
    "minsnap_many",
    *(c_void_p, c_void_p, c_void_p, c_int64, c_int32, c_int32, c_void_p, c_void_p, c_int32),
    *(c_void_p, c_void_p, c_void_p),
)
_TUBES = Entry(
    "minsnap_many_tubes",
    *(c_void_p, c_void_p, c_void_p, c_void_p, c_int64, c_int32, c_int32, c_double, c_int32),
    *(c_void_p, c_void_p, c_void_p, c_void_p),
)
_EVALUATE = Entry(
    "minsnap_evaluate_many",
    *(c_void_p, c_void_p, c_void_p, c_void_p, c_void_p, c_int64, c_int32, c_int32, c_int32),
    *(c_void_p, c_int64, c_int32, c_int32, c_void_p, c_void_p),
)


def many_optima(
    points: FloatArray,
    durations: FloatArray,
    offsets: IntArray,
    half: int,
    ends: tuple[FloatArray | None, FloatArray | None],
    threads: int,
) -> tuple[FloatArray, FloatArray, IntArray] | None:
    """Return curves of least integral of the squared k-th derivative; all problems one after the other.

    Parameters
    ----------
    points : ndarray, shape (knots in all, dim)
        C-contiguous [m]; problem b has one knot more than legs.
    durations : ndarray, shape (legs in all,)
        [s].
    offsets : ndarray of int64, shape (problems + 1,)
        First leg of each problem, and the number of all legs.
    half : int
        k, for degree 2k - 1.
    ends : tuple of ndarray, shape (problems, k - 1, dim), or None
        Derivatives at start and end; None at rest.
    threads : int

    Returns
    -------
    (control points (legs in all, 2k, dim), breaks (knots in all,), statuses (problems,)) or None
        None where the Python core is in use.
    """
    solve = _SOLVE.ready or _SOLVE.function()
    if solve is None:
        return None
    count, dim = len(offsets) - 1, points.shape[1]
    found, breaks = np.empty((len(durations), 2 * half, dim)), np.empty(len(points))
    statuses = np.zeros(count, dtype=np.int32)
    states = [None if state is None else address(state) for state in ends]
    solve(
        *(address(points), address(durations), address(offsets), count, dim, half, *states, threads),
        *(address(found), address(breaks), address(statuses)),
    )
    return found, breaks, statuses.astype(np.intp)


def many_tubes(
    points: FloatArray,
    durations: FloatArray,
    offsets: IntArray,
    half: int,
    widths: FloatArray,
    threads: int,
    gap: float = 1e-6,
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray] | None:
    """Return curves from rest to rest that are proved to stay in their tubes; see ``minsnap.native.tube``.

    Parameters
    ----------
    points, durations, offsets, half, threads
        As for ``many_optima``.
    widths : ndarray, shape (legs in all,)
        Half-widths [m].
    gap : float
        Share of the cost that may be given away.

    Returns
    -------
    (control points (legs in all, 2k, dim), breaks (knots in all,), figures (problems, 4), statuses (problems,)) or None
        The figures are those of ``TubeCurve``; None where the Python core is in use.
    """
    solve = _TUBES.ready or _TUBES.function()
    if solve is None:
        return None
    count, dim = len(offsets) - 1, points.shape[1]
    found, breaks = np.empty((len(durations), 2 * half, dim)), np.empty(len(points))
    figures, statuses = np.zeros((count, 4)), np.zeros(count, dtype=np.int32)
    solve(
        *map(address, (points, durations, widths, offsets)),
        *(count, dim, half, gap, threads, *map(address, (found, breaks, figures, statuses))),
    )
    return found, breaks, figures, statuses.astype(np.intp)


def many_values(
    curves: tuple[FloatArray, FloatArray, FloatArray, IntArray],
    present: BoolArray,
    order: int,
    t: FloatArray,
    threads: int,
) -> tuple[FloatArray, IntArray] | None:
    """Return a derivative of every curve at instants (m,) for all, or (problems, m).

    Parameters
    ----------
    curves : tuple
        Control points, durations, breaks and offsets, as ``many_optima`` takes and gives them.
    present : ndarray of bool, shape (problems,)
        Which curves there are; the others give not a number.

    Returns
    -------
    (values (problems, m, dim), statuses (problems,)) or None
        None where the Python core is in use.
    """
    evaluate = _EVALUATE.ready or _EVALUATE.function()
    if evaluate is None:
        return None
    points, durations, breaks, offsets = curves
    count, (_, size, dim), instants = len(present), points.shape, np.ascontiguousarray(t)
    values, statuses = np.empty((count, t.shape[-1], dim)), np.zeros(count, dtype=np.int32)
    evaluate(
        *map(address, (points, durations, breaks, offsets, present.view(np.uint8))),
        *(count, size - 1, dim, order, address(instants), t.shape[-1], t.ndim == 1, threads),
        *(address(values), address(statuses)),
    )
    return values, statuses.astype(np.intp)
