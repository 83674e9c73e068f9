"""How far thrust, tilt and body rate of a path without drag go over all time, in the native core."""

from __future__ import annotations

from collections.abc import Callable, Collection
from ctypes import c_double, c_int64, c_void_p
from math import atan, sqrt

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.library import Entry, address, readable

_LARGEST = Entry("minsnap_thrust_axis", *[c_int64] * 2, *[c_void_p] * 2, c_double, c_int64, *[c_void_p] * 2)


def _root(square: float) -> float:
    return sqrt(max(square, 0.0))


_FROM_SQUARE: dict[str, Callable[[float], float]] = {
    "thrust": _root,
    "least_thrust": lambda square: _root(-square),
    "tilt": lambda square: atan(_root(square)),
    "body_rate": _root,
}
"""Values from those of ``src/certificate/thrust_axis.cpp``, in the order of its ``ThrustMeasure``."""


def thrust_peaks(
    points: FloatArray, durations: FloatArray, gravity: float, measures: Collection[str]
) -> dict[str, tuple[float, int, float]]:
    """Return the largest value, its piece and its place on [0, 1] of those measures that the native core knows.

    There is none where the Python core has to answer: there is no native one, or the thrust points down.

    Parameters
    ----------
    points : ndarray, shape (pieces, n + 1, 3)
    durations : ndarray, shape (pieces,)
    gravity : float
    measures : collection of str
        By the names of ``MEASURES``.
    """
    known = [(name, number) for number, name in enumerate(_FROM_SQUARE) if name in measures]
    if not known:
        return {}
    found = np.empty((len(known), 3))
    numbers = readable(np.array([number for _, number in known]))
    path = points.shape[0], points.shape[1] - 1, readable(np.ascontiguousarray(points)), readable(durations)
    if _LARGEST(*path, gravity, len(known), numbers, address(found)):
        return {}
    peaks = zip(known, found.tolist(), strict=True)
    return {name: (_FROM_SQUARE[name](square), int(piece), s) for (name, _), (square, piece, s) in peaks}
