"""Plans from rest to rest in a tube around the legs: one call of the native core, which proves its answer."""

from __future__ import annotations

from ctypes import c_double, c_int32, c_int64, c_void_p
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.tolerances import GAP
from minsnap.native.library import Entry, address, writable

_SOLVE = Entry(
    "minsnap_tube",
    *(c_void_p, c_void_p, c_void_p, c_int64, c_int32, c_int32, c_int32, c_double, c_void_p, c_void_p, c_void_p),
)


class TubeCurve(NamedTuple):
    """A curve that is proved to stay inside a tube.

    Parameters
    ----------
    points : ndarray, shape (legs, 2k, dim)
        Control points [m].
    breaks : ndarray, shape (legs + 1,)
        Instants of the knots [s].
    figures : ndarray, shape (4,)
        Cost and lower bound of any cost [m^2/s^(2k - 1)], contacts with walls, rounds.
    """

    points: FloatArray
    breaks: FloatArray
    figures: FloatArray


def tube_optimum(
    points: FloatArray, durations: FloatArray, widths: FloatArray, half: int, gap: float = GAP
) -> TubeCurve | None:
    """Return the curve of least cost from rest to rest in a ``Tube``; None where the Python core has to answer.

    Parameters
    ----------
    points : ndarray, shape (legs + 1, dim)
        C-contiguous [m]; nothing is assumed of its values.
    durations : ndarray, shape (legs,)
        [s].
    widths : ndarray, shape () or (legs,)
        Half-widths [m].
    half : int
        k, for degree 2k - 1.
    gap : float
        Share of the cost that may be given away.
    """
    legs, dim = len(durations), points.shape[1]
    curves, breaks, figures = np.empty((legs, 2 * half, dim)), np.empty(legs + 1), np.empty(4)
    status = _SOLVE(
        *(address(points), address(durations), address(widths), legs, dim, half, widths.ndim == 0, gap),
        *(writable(curves), writable(breaks), writable(figures)),
    )
    finite = not status and np.isfinite(curves).all() and np.isfinite(figures).all()
    return TubeCurve(curves, breaks, figures) if finite else None
