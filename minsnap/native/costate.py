"""The native search for the costate that proves the greatest bound of the flight time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.library import Entry
from minsnap.native.records import CostateSearch

_SEARCH = Entry("minsnap_costate", CostateSearch)

MOST_SETS = 5
"""Sets that bound accelerations, or velocities, at most: ``CostateSettings::sets``."""


class CostateQuestion(NamedTuple):
    """What bounds a flight, in units of order one; see ``src/bounds/border.hpp``.

    Parameters
    ----------
    steps : ndarray, shape (legs, 3)
    rounds, sides : ndarray, shape (legs + 1, 3, 3)
    ends : ndarray, shape (2, 3)
    closed : bool
    accelerations, velocities : ndarray, shape (sets, 12)
    costate_axes, rate_axes : int
        Bits of the coordinates that may differ from zero.
    times : ndarray, shape (legs,)
    grid : ndarray, shape (legs, cells + 1)
        Where cells end to begin with, on [0, 1].
    costate : ndarray, shape (legs, cells + 1, 3)
        To begin with.
    rate : ndarray, shape (legs, 3)
    fine, parts : int
        Cells at the end, and parts of each in which norms are summed.
    """

    steps: FloatArray
    rounds: FloatArray
    sides: FloatArray
    ends: FloatArray
    closed: bool
    accelerations: FloatArray
    velocities: FloatArray
    costate_axes: int
    rate_axes: int
    times: FloatArray
    grid: FloatArray
    costate: FloatArray
    rate: FloatArray
    fine: int
    parts: int


class FoundCostate(NamedTuple):
    """Costate (legs, cells + 1, 3) at the ends of cells (legs, cells + 1), and rates (legs, 3).

    Sets after the first have shares of the costate at every instant, ``splits`` (legs, cells, parts + 1, sets - 1, 3),
    and of the rate in every cell, ``rate_splits`` (legs, cells, sets - 1, 3).
    """

    grid: FloatArray
    costate: FloatArray
    rate: FloatArray
    splits: FloatArray
    rate_splits: FloatArray
    iterations: int


def find_costate(asked: CostateQuestion) -> FoundCostate | None:
    """Return the best costate; None where the native core is not in use, or fails."""
    legs, cells, fine = len(asked.steps), asked.costate.shape[1] - 1, asked.fine
    own, other = len(asked.accelerations), len(asked.velocities)
    grid, costate = np.zeros((legs, fine + 1)), np.zeros((legs, fine + 1, 3))
    grid[:, : cells + 1], costate[:, : cells + 1] = asked.grid, asked.costate
    found = FoundCostate(
        grid,
        costate,
        np.array(asked.rate),
        np.zeros((legs, fine, asked.parts + 1, own - 1, 3)),
        np.zeros((legs, fine, other - 1, 3)),
        0,
    )
    sizes = {"legs": legs, "cells": cells, "fine": fine, "parts": asked.parts, "closed": int(asked.closed)}
    kinds = {"accelerations": own, "velocities": other}
    axes = {"costate_axes": asked.costate_axes, "rate_axes": asked.rate_axes}
    arrays = {
        name: np.ascontiguousarray(getattr(asked, name)) for name in ("steps", "rounds", "sides", "times", "ends")
    }
    arrays["sets"] = np.concatenate((asked.accelerations, asked.velocities))
    written = {name: getattr(found, name) for name in ("grid", "costate", "rate", "splits", "rate_splits")}
    record = CostateSearch(**sizes, **kinds, **axes, **arrays, **written)
    return None if _SEARCH(record) else found._replace(iterations=int(record.iterations))
