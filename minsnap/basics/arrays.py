"""Types of arrays, the arrays that a value owns (copied when it is made, read-only from then on), and gravity."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from math import isfinite
from typing import Any, TypeGuard, TypeVar

import numpy as np
from numpy.typing import ArrayLike as ArrayLike
from numpy.typing import NDArray as NDArray

from minsnap.basics.messages import shown
from minsnap.errors import InputError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]
FLOAT64 = np.dtype(np.float64)

GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s^2]."""

SMALLEST, LARGEST = 1e-40, 1e40
"""Least positive number of a question, and greatest number: squares and ratios of them are then well within the range
of a double, also beside the greatest ratio of durations."""


Array = TypeVar("Array", bound=NDArray[Any])


def read_only(array: Array) -> Array:
    """Return the array itself, to which nobody can write through it any more."""
    array.setflags(False)  # type: ignore[call-arg]  # write: by its name it takes three times as long
    return array


def owned(values: ArrayLike) -> FloatArray:
    """Return a read-only float64 array: a copy, unless it is already one that nobody can write to.

    Raises
    ------
    InputError
        If the values are not numbers in rows of equal length.
    """
    try:
        array = values if _is_ready(values) else _floats(values)
    except InputError:
        raise
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"numbers in rows of equal length were expected, not {shown(values)}") from None
    return read_only(array.copy()) if array.flags.writeable or array.base is not None else array


def numbers(values: Any, copy: bool = True) -> FloatArray | None:
    """Return a read-only float64 copy in C order, or None of values that are not numbers in rows of equal length.

    Without ``copy`` it is the array itself where that is such an array already: it must not be kept.
    """
    if _is_ready(values):
        return read_only(values.copy()) if copy else values
    try:
        array = _floats(values)
    except InputError:  # says more
        raise
    except (TypeError, ValueError, OverflowError):
        return None
    return read_only(array.copy() if copy and not isinstance(values, (list, tuple)) else array.view())


def _is_ready(values: Any) -> TypeGuard[FloatArray]:
    """Whether values are an array as it is kept, the usual case."""
    return type(values) is np.ndarray and values.dtype is FLOAT64 and values.flags.c_contiguous


def _floats(values: Any) -> FloatArray:
    """Convert to float64 in C order, perhaps the caller's own array; what is masked is not a number.

    Complex numbers, dates and records are no numbers here, for which NumPy would drop a part or a unit.
    """
    if hasattr(values, "filled") and isinstance(values, np.ma.MaskedArray):
        values = np.ma.filled(values.astype(np.float64), np.nan)
    try:
        array: Any = np.asarray(values)
    except RuntimeError:  # torch's own
        raise InputError("a tensor with gradients was given for numbers: give what its .detach() returns") from None
    if array.dtype.kind not in "biufOUS":
        raise TypeError(f"{array.dtype} is no type of numbers")
    if array.dtype.itemsize <= 8:
        return np.asarray(array, np.float64, order="C")
    with np.errstate(over="ignore"):  # of a long double
        return np.asarray(array, np.float64, order="C")


def bounded(values: FloatArray) -> BoolArray:
    """Whether each is a number of the size that a question may have, at most ``LARGEST``."""
    return np.asarray(np.abs(values) <= LARGEST)


def rounded(values: FloatArray, digits: int) -> FloatArray:
    """Return values of so many significant digits, so that no rounding of a library decides what follows."""
    return np.array([significant(value, digits) for value in values.ravel().tolist()]).reshape(values.shape)


def significant(value: float, digits: int = 6) -> float:
    """Return a number of so many significant digits; see :func:`rounded`."""
    return float(f"{value:.{digits}g}")


def positive(values: FloatArray) -> BoolArray:
    """Whether each is a positive number of that size, at least ``SMALLEST``."""
    return np.asarray((values >= SMALLEST) & bounded(values))


def lengths_of(points: FloatArray) -> FloatArray:
    """Return the straight lengths between points (m, dim), shape (m - 1,) [m]."""
    steps = points[1:] - points[:-1]
    return np.asarray(np.sqrt((steps * steps).sum(axis=1)))


def interpolated(t: FloatArray, known: FloatArray, values: FloatArray) -> FloatArray:
    """Interpolate values (n, dim) at increasing instants (n,) linearly at others (m,), shape (m, dim)."""
    return np.stack([np.interp(t, known, column) for column in values.T], axis=1)


def plain(value: Any) -> Any:
    """Return a value as files hold it: lists of numbers, mappings of fields, and what is not finite as text."""
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, dict):
        return {name: plain(entry) for name, entry in value.items()}
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value) if field.init}
    return str(value) if isinstance(value, float) and not isfinite(value) else value


def set_fields(value: Any, **entries: Any) -> None:
    """Set fields of a frozen dataclass while it is made; its arrays, which must be its own, become read-only.

    No other function writes to a frozen value.
    """
    for name, entry in entries.items():
        _freeze(entry)
        object.__setattr__(value, name, entry)


class ReadOnly:
    """Base of values that own read-only arrays: they stay so when the value is pickled, copied or sent to a process."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        set_fields(self, **state)


class OwnsArrays(ReadOnly):
    """Base of frozen dataclasses whose array fields become read-only copies when they are made."""

    def __post_init__(self) -> None:
        set_fields(self, **{name: array.copy() for name, array in vars(self).items() if isinstance(array, np.ndarray)})


def _freeze(value: Any) -> None:
    if isinstance(value, np.ndarray):
        read_only(value)
    elif isinstance(value, (list, tuple)):
        for entry in value:
            _freeze(entry)
