"""Instants at which paths and headings are evaluated, and checks of these and of the orders of derivatives."""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, numbers
from minsnap.basics.checks import check_number
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import ROUNDING
from minsnap.errors import IntervalError

SHORTEST_PIECE, LONGEST_PIECE = 1e-18, 1e18
"""Least and greatest duration of a piece [s]: a cut may leave far less of a leg than is planned."""


def as_instants(t: ArrayLike) -> FloatArray:
    """Return instants of any shape, or raise IntervalError where they are no numbers."""
    instants = numbers(t, copy=False)
    if instants is None:
        raise IntervalError(f"the instants are {shown(t)}: give numbers of seconds")
    return instants


def within(t: FloatArray, duration: float) -> FloatArray:
    """Return instants as (m,), in [0, duration] but for rounding; IntervalError where one is outside or no number."""
    flat, slack = t.reshape(-1), ROUNDING * duration
    if flat.size and not (flat.min() >= -slack and flat.max() <= duration + slack):
        bad = flat[~((flat >= -slack) & (flat <= duration + slack))][0]
        raise IntervalError(f"t = {bad} s is outside the path's interval [0, {duration}] s")
    return np.asarray(np.clip(flat, 0.0, duration))


def parted_instants(path: Any, parts: int, otherwise: int) -> FloatArray:
    """Return instants that cut every polynomial, or the whole of another path, into equal parts, both ends included."""
    breaks = getattr(path, "breaks", None)
    if breaks is None:
        return np.linspace(0.0, path.duration, otherwise + 1)
    inner = breaks[:-1, None] + np.diff(breaks)[:, None] * (np.arange(parts) / parts)
    return np.append(inner.reshape(-1), path.duration)


def check_order(order: int) -> int:
    """Return the derivative order as an int, or raise IntervalError if it is not a whole number >= 0."""
    give = "the order of a derivative is a whole number, 0 or more"
    return int(check_number("order", order, 0, inf, give, IntervalError, whole=True))
