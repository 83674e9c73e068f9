"""Types of arrays, the arrays that a value owns (copied when it is made, read-only from then on), and gravity."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.errors import InputError

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]
BoolArray = npt.NDArray[np.bool_]

GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s^2]."""


def owned(values: npt.ArrayLike) -> FloatArray:
    """Return a read-only float64 array: a copy, unless it is already one that nobody can write to.

    Raises
    ------
    InputError
        If the values are not numbers in rows of equal length.
    """
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"numbers in rows of equal length were expected, not {values!r}") from None
    if array.flags.writeable or array.base is not None:
        array = array.copy()
        array.flags.writeable = False
    return array


def numbers(values: Any, copy: bool = True) -> FloatArray | None:
    """Return a read-only float64 copy in C order, or None of values that are not numbers in rows of equal length.

    Without ``copy`` it is a view of what is such an array already, which must not be kept.
    """
    try:
        array = np.array(values, np.float64, order="C") if copy else np.asarray(values, np.float64, order="C").view()
    except (TypeError, ValueError, OverflowError):
        return None
    array.flags.writeable = False
    return array


def lengths_of(points: FloatArray) -> FloatArray:
    """Return the straight lengths between points (m, dim), shape (m - 1,) [m]."""
    steps = points[1:] - points[:-1]
    return np.asarray(np.sqrt((steps * steps).sum(axis=1)))


def own_arrays(value: Any) -> None:
    """Replace every array field of a frozen dataclass by a read-only copy; called from ``__post_init__``."""
    for field in fields(value):
        array = getattr(value, field.name)
        if isinstance(array, np.ndarray):
            owned = array.copy()
            owned.flags.writeable = False
            object.__setattr__(value, field.name, owned)


class ReadOnly:
    """Base of values that own read-only arrays: they stay so when the value is pickled, copied or sent to a process."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            _freeze(value)
        self.__dict__.update(state)


def _freeze(value: Any) -> None:
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    elif isinstance(value, (list, tuple)):
        for entry in value:
            _freeze(entry)
