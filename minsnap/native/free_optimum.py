"""Plans without walls by the native core: the linear system of a chain of legs, eliminated from both ends."""

from __future__ import annotations

from collections.abc import Mapping
from ctypes import c_char, c_int64, c_void_p

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.library import Entry, address, readable
from minsnap.native.records import ChainRecord
from minsnap.native.status import Status

_BYTES = c_char * 0  # an array of which is passed by its address
_RESTING = Entry("minsnap_unconstrained")  # converts its own arguments, which takes half as long
_PINNED = Entry("minsnap_unconstrained_pinned", ChainRecord, c_void_p, c_void_p)

SHORT = 100
"""Legs of which arrays are copied without a look at their size, which takes as long as the copy."""

Pins = Mapping[int, Mapping[int, FloatArray]]
"""Derivatives of order 1 … k - 1 by waypoint and order; what is left out at an open end is zero."""


def resting_optimum(points: FloatArray, durations: FloatArray, half: int) -> FloatArray | Status:
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
    ndarray of shape (legs, 2k, dim), or Status
        Control points [m]; a status says why the native core does not answer.
    """
    legs, dim = len(durations), points.shape[1]
    control_points = np.empty((legs, 2 * half, dim))
    solve = _RESTING.ready or _RESTING
    given = (points.tobytes(), durations.tobytes()) if legs <= SHORT else (readable(points), readable(durations))
    place = _BYTES.from_buffer(control_points)  # type: ignore[arg-type]
    status = solve(*given, c_int64(legs), dim, half, place)
    return Status(status) if status else control_points


def pinned_optimum(
    points: FloatArray, durations: FloatArray, half: int, pins: Pins, closed: bool
) -> tuple[FloatArray, FloatArray] | Status:
    """Return the same and derivatives 1 … k - 1 at the knots, (legs + 1, k - 1, dim) [m/s^order], with pins.

    Parameters
    ----------
    points, durations, half
        As for ``resting_optimum``.
    pins : mapping
    closed : bool
        The state at the end is the state at the start, and free.
    """
    legs, dim = len(durations), points.shape[1]
    control_points, states = np.empty((legs, 2 * half, dim)), np.empty((legs + 1, half - 1, dim))
    status = _PINNED(chain_record(points, durations, half, pins, closed), address(control_points), address(states))
    return Status(status) if status else (control_points, states)


def chain_record(points: FloatArray, durations: FloatArray, half: int, pins: Pins, closed: bool) -> ChainRecord:
    """Return a chain of legs as the native core takes it; arguments as of ``pinned_optimum``."""
    legs, dim = len(durations), points.shape[1]
    ends = [_state(pins[knot], half, dim) if knot in pins else None for knot in (0, legs)]
    inner = sorted(knot for knot in pins if 0 < knot < legs and pins[knot])
    return ChainRecord(
        **{"half": half, "legs": legs, "dim": dim, "pins": len(inner), "closed": closed},
        **{"points": points, "durations": durations, "start": ends[0], "end": ends[1]},
        knots=np.array(inner, dtype=np.int64),
        masks=np.array([sum(1 << order for order in pins[knot]) for knot in inner], dtype=np.uint32),
        values=np.array([_state(pins[knot], half, dim) for knot in inner]).reshape(len(inner), half - 1, dim),
    )


def _state(state: Mapping[int, FloatArray], half: int, dim: int) -> FloatArray:
    """Return derivatives 1 … k - 1, shape (k - 1, dim); those left out are zero."""
    values = np.zeros((half - 1, dim))
    for order, value in state.items():
        values[order - 1] = value
    return values
