"""Whether control points keep their conditions, by the native core: waypoints, states at the ends, joints, a tube."""

from __future__ import annotations

from ctypes import c_int32, c_int64, c_void_p

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.native.library import Entry, readable
from minsnap.native.plan_batches import ManyChains
from minsnap.native.records import ManyRecord

_ONE = Entry("minsnap_last_look", *[c_void_p] * 4, c_int64, *[c_int32] * 6, c_void_p)
_MANY = Entry("minsnap_last_looks", ManyRecord)


def keeps(
    points: FloatArray,
    durations: FloatArray,
    curve: FloatArray,
    continuity: int,
    pinned: int,
    widths: FloatArray | None = None,
    states: FloatArray | None = None,
) -> bool:
    """Whether a curve is seen to pass the waypoints, to have its states at the ends, to join, and to stay in a tube.

    Parameters
    ----------
    points : ndarray, shape (legs + 1, dim)
        Waypoints [m], passed exactly.
    durations : ndarray, shape (pieces in all,)
        [s].
    curve : ndarray, shape (pieces in all, degree + 1, dim)
        Control points [m].
    continuity : int
        Derivatives that are continuous.
    pinned : int
        Derivatives that are zero at both ends, or as in ``states``.
    widths : ndarray, shape () or (legs,), optional
        Half-widths of a ``Tube`` [m], for one piece per leg.
    states : ndarray, shape (2, pinned, dim), optional
        Derivatives of order 1 ... at the start and at the end [m/s^order].

    Returns
    -------
    bool
        False also where rounding is more than this quick look allows, or where the Python core is in use.
    """
    pieces, size, dim = curve.shape
    legs = len(points) - 1
    return not _ONE(
        *(readable(points), readable(durations)),
        *(None if widths is None else readable(widths), None if states is None else readable(states)),
        *(legs, pieces // legs, dim, size - 1),
        *(continuity, pinned, widths is not None and widths.ndim == 0, readable(curve)),
    )


def look_over(chains: ManyChains, widths: FloatArray, curves: FloatArray, statuses: IntArray) -> None:
    """Change the statuses of those of many plans in tubes of which this is not seen.

    Parameters
    ----------
    chains, widths
        As for ``many_tubes``.
    curves : ndarray, shape (legs in all, 2k, dim)
        Control points [m].
    statuses : ndarray of int, shape (problems,)
        Overwritten.
    """
    verdicts = statuses.astype(np.int32)
    _MANY(chains.record(widths=widths, curves=curves, statuses=verdicts))
    statuses[:] = verdicts
