"""Memory that is not there: one sentence that says how much was needed."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from math import prod
from typing import Any, ParamSpec, TypeVar

import numpy as np

from minsnap.errors import OutOfMemoryError

P = ParamSpec("P")
R = TypeVar("R")

UNITS = ("B", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB")


def short_of_memory(work: str, needed: Callable[..., int]) -> Callable[..., OutOfMemoryError]:
    """Return what makes the error of a call for which there was too little memory, from the same arguments.

    Parameters
    ----------
    work : str
        What the call does.
    needed : callable
        Returns what that takes at least [bytes], from the same arguments.
    """

    def made(*args: Any, **options: Any) -> OutOfMemoryError:
        size = needed(*args, **options)
        sentence = f"{work} takes at least {size_text(size)} of memory, which are not free: plan less at once"
        return OutOfMemoryError(sentence, needed=size)

    return made


def within_memory(work: str, needed: Callable[..., int]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Return a decorator of what raises OutOfMemoryError in place of MemoryError; see :func:`short_of_memory`."""
    error = short_of_memory(work, needed)

    def decorated(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def call(*args: P.args, **options: P.kwargs) -> R:
            try:
                return function(*args, **options)
            except OutOfMemoryError:
                raise
            except MemoryError:
                pass
            raise error(*args, **options)

        return call

    return decorated


def size_text(size: float) -> str:
    """Return a number of bytes with a unit."""
    power = min(int(np.log2(max(size, 1.0)) // 10), len(UNITS) - 1)
    return f"{size / 1024.0**power:.4g} {UNITS[power]}"


def planned_bytes(waypoints: Any = None, *_: Any, degree: Any = 7, **__: Any) -> int:
    """Return the memory of the control points of plans [bytes].

    Parameters
    ----------
    waypoints : array_like
        Shape (n, dim), or (B, n, dim), or rows of their own lengths.
    degree : int
    """
    shape = getattr(waypoints, "shape", None)
    if shape is not None and len(shape) > 1:
        *many, knots, dim = map(int, shape)
        return 8 * (int(degree) + 1) * prod(many) * max(knots - 1, 0) * dim
    rows = [] if waypoints is None else list(waypoints)
    if rows and np.ndim(rows[0]) > 1:
        return sum(planned_bytes(np.asarray(row), degree=degree) for row in rows)
    return planned_bytes(np.asarray(rows), degree=degree) if rows and np.ndim(rows[0]) else 0
