"""Plans without walls by the native core: the linear system of a chain of legs, eliminated from both ends."""

from __future__ import annotations

from collections.abc import Mapping
from ctypes import c_int32, c_int64, c_void_p

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.library import Entry, address, writable
from minsnap.native.status import Status

_RESTING = Entry("minsnap_unconstrained", c_void_p, c_void_p, c_int64, c_int32, c_int32, c_void_p, c_void_p)
_PINNED = Entry(
    "minsnap_unconstrained_pinned",
    *(c_void_p, c_void_p, c_int64, c_int32, c_int32, c_void_p, c_void_p),
    *(c_int64, c_void_p, c_void_p, c_void_p, c_int32, c_void_p, c_void_p, c_void_p),
)

Curve = tuple[FloatArray, FloatArray]
"""Control points (legs, 2k, dim) [m] and instants of the knots (legs + 1,) [s]."""

PinnedCurve = tuple[FloatArray, FloatArray, FloatArray]
"""The same and derivatives 1 … k - 1 at the knots, (legs + 1, k - 1, dim) [m/s^order]."""

Pins = Mapping[int, Mapping[int, FloatArray]]
"""Derivatives of order 1 … k - 1 by waypoint and order."""


def resting_optimum(points: FloatArray, durations: FloatArray, half: int) -> Curve | Status | None:
    """Return the curve of least integral of the squared k-th derivative through points, at rest at both ends.

    Parameters
    ----------
    points : ndarray, shape (legs + 1, dim)
        C-contiguous [m]; nothing is assumed of its values.
    durations : ndarray, shape (legs,)
        C-contiguous [s].
    half : int
        k, for degree 2k - 1.

    Returns
    -------
    (control points, breaks), Status or None
        A status says why the native core does not answer; None, that the Python core is in use.
    """
    solve = _RESTING.ready or _RESTING.function()
    if solve is None:
        return None
    legs, dim = len(durations), points.shape[1]
    found, breaks = np.empty((legs, 2 * half, dim)), np.empty(legs + 1)
    status = solve(address(points), address(durations), legs, dim, half, writable(found), writable(breaks))
    return Status(status) if status else (found, breaks)


def pinned_optimum(
    points: FloatArray, durations: FloatArray, half: int, pins: Pins, closed: bool
) -> PinnedCurve | Status | None:
    """Return the same and the states of the knots, with derivatives pinned; those of an open end not given are zero.

    Parameters
    ----------
    points, durations, half
        As for ``resting_optimum``.
    pins : mapping
    closed : bool
        The state at the end is the state at the start, and free.
    """
    solve = _PINNED.ready or _PINNED.function()
    if solve is None:
        return None
    legs, dim = len(durations), points.shape[1]
    ends = [_state(pins.get(knot, {}), half, dim) for knot in (0, legs)]
    inner = sorted(knot for knot in pins if 0 < knot < legs and pins[knot])
    knots = np.array(inner, dtype=np.int64)
    masks = np.array([sum(1 << order for order in pins[knot]) for knot in inner], dtype=np.uint32)
    values = np.array([_state(pins[knot], half, dim) for knot in inner]).reshape(len(inner), half - 1, dim)
    found, breaks, states = np.empty((legs, 2 * half, dim)), np.empty(legs + 1), np.empty((legs + 1, half - 1, dim))
    status = solve(
        *(address(points), address(durations), legs, dim, half, address(ends[0]), address(ends[1])),
        *(
            len(inner),
            address(knots),
            address(masks),
            address(values),
            closed,
            writable(found),
            writable(breaks),
            writable(states),
        ),
    )
    return Status(status) if status else (found, breaks, states)


def _state(state: Mapping[int, FloatArray], half: int, dim: int) -> FloatArray:
    """Return derivatives 1 … k - 1, shape (k - 1, dim); those not given are zero."""
    values = np.zeros((half - 1, dim))
    for order, value in state.items():
        values[order - 1] = value
    return values
