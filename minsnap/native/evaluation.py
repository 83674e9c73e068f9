"""Evaluation of piecewise polynomials by the native core."""

from __future__ import annotations

from ctypes import addressof, byref, c_double, c_int32, c_int64, c_void_p
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, numbers
from minsnap.native.library import FEW, Entry, address, writable
from minsnap.native.records import PiecewiseCurve

_MANY = Entry("minsnap_evaluate", c_void_p, c_int32, c_void_p, c_int64, c_void_p)
_ONE = Entry("minsnap_evaluate_one")  # converts its own arguments, which takes half as long
_STATES = Entry("minsnap_evaluate_states", c_void_p, c_int32, c_void_p, c_int64, c_void_p)
_COSTS = Entry("minsnap_costs")  # the same


class Evaluator:
    """A curve's arrays, as the native core takes them.

    Parameters
    ----------
    points : ndarray, shape (pieces, degree + 1, dim)
        Bernstein control points.
    durations : ndarray, shape (pieces,)
    breaks : ndarray, shape (pieces + 1,)
        Instants of the knots, from 0.
    """

    __slots__ = ("_at", "_curve", "_dim")

    def __init__(self, points: FloatArray, durations: FloatArray, breaks: FloatArray) -> None:
        pieces, size, self._dim = points.shape
        points, durations, breaks = (np.ascontiguousarray(array) for array in (points, durations, breaks))
        sizes = {"pieces": pieces, "degree": size - 1, "dim": self._dim}
        self._curve = PiecewiseCurve(points=points, durations=durations, breaks=breaks, **sizes)
        self._at = c_void_p(addressof(self._curve))

    def one(self, t: float, order: int) -> FloatArray | None:
        """Return a derivative at one instant, shape (dim,); None where the Python core has to answer."""
        evaluate = _ONE.ready or _ONE.function()
        if evaluate is None:
            return None
        values = np.empty(self._dim)
        return None if evaluate(self._at, order, c_double(t), writable(values)) else values

    def many(self, t: Any, order: int) -> FloatArray | None:
        """Return a derivative at instants of any shape: t.shape + (dim,); None where the Python core has to answer."""
        return self._filled(_MANY, t, order, ())

    def states(self, t: Any, orders: int) -> FloatArray | None:
        """Return the derivatives 0 ... orders - 1 at instants: t.shape + (orders, dim); None as for others."""
        return self._filled(_STATES, t, orders, (orders,))

    def _filled(self, entry: Entry, t: Any, asked: int, shape: tuple[int, ...]) -> FloatArray | None:
        instants = numbers(t, copy=False)
        if instants is None:
            return None
        values = np.empty((*instants.shape, *shape, self._dim))
        return None if entry(self._at, asked, address(instants), instants.size, address(values)) else values


class PieceCosts:
    """What the pieces of a curve cost: integrals of the squared norm of a derivative.

    None comes back where the Python core has to answer: for positions, and for degrees and coordinates beyond those of
    plans.

    Parameters
    ----------
    points : ndarray, shape (pieces, degree + 1, dim)
        Bernstein control points.
    durations : ndarray, shape (pieces,)
    """

    __slots__ = ("_arrays", "_question")

    def __init__(self, points: FloatArray, durations: FloatArray) -> None:
        self._arrays = points, durations = np.ascontiguousarray(points), np.ascontiguousarray(durations)
        pieces, count, dim = points.shape
        times = durations.tobytes() if durations.nbytes <= FEW else c_void_p(durations.ctypes.data)
        self._question = pieces, count - 1, dim, c_void_p(points.ctypes.data), times

    def total(self, order: int) -> float | None:
        """Return the sum of all costs."""
        total = c_double()
        return None if _COSTS(*self._question, order, None, byref(total)) else total.value

    def each(self, order: int) -> FloatArray | None:
        """Return the costs of all pieces, shape (pieces,)."""
        costs = np.empty(len(self._arrays[1]))
        return None if _COSTS(*self._question, order, address(costs), byref(c_double())) else costs
