"""The optimum for given durations, from the native core or from Python."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray


class InfeasibleRowsError(Exception):
    """No curve is known that keeps the rows so far."""


class GaveUpError(InfeasibleRowsError):
    """The native core gave up, for the reason that is the argument, and no other core tried."""


class Contacts(NamedTuple):
    """Where a curve touches its walls, or has rows of the last QP.

    Parameters
    ----------
    wall : ndarray of int, shape (r,)
        Counted over ``all_walls``; planes of gates and what comes after them are no walls, but parts of the problem.
    s : ndarray, shape (r,)
        Where on its piece, in [0, 1].
    multiplier : ndarray, shape (r,)
        For the normalised cost without 1/2.
    """

    wall: IntArray
    s: FloatArray
    multiplier: FloatArray


NO_CONTACTS = Contacts(np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0))

BLEND, ONE_PIECE = "blend", "one polynomial per leg"
"""Names of fallbacks: with another curve that has room to all walls, and the optimum of fewer pieces."""

NO_KNOTS = np.zeros((0, 0, 0))
"""Those of a curve that was searched together with its durations."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """The optimum for given durations, in normalised units, and its method.

    Parameters
    ----------
    knots : ndarray, shape (knots, slots, dim)
    rounds : int
    solver : str
    contacts : Contacts
    fallback : tuple of str
        Solvers that failed on the way.
    rungs : tuple of str
        Names of the fallbacks taken.
    core : str
        Core that solved it, ``"native"`` or ``"python"``.
    handed_over : str
        Why the native core did not; empty where it did or was not asked.
    points : ndarray, shape (pieces, 2k, dim), or None
        Control points that were proved to be inside [m]; None where they follow from ``knots``.
    """

    knots: FloatArray
    rounds: int
    solver: str
    contacts: Contacts = NO_CONTACTS
    fallback: tuple[str, ...] = ()
    rungs: tuple[str, ...] = ()
    core: str = "python"
    handed_over: str = ""
    points: FloatArray | None = None
