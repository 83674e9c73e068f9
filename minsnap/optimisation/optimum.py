"""The optimum for given durations, from the native core or from Python."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.corridor import CorridorAnswer

if TYPE_CHECKING:
    from minsnap.optimisation.normalised_constraints import WallRows


class InfeasibleRowsError(Exception):
    """No curve is known that keeps the rows so far."""


class GaveUpError(InfeasibleRowsError):
    """The native core gave up, for the reason that is the argument, and no other core tried."""


NO_KNOTS = np.zeros((0, 0, 0))
"""Those of a curve that was searched together with its durations."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """The optimum for given durations, in normalised units, and its method.

    Parameters
    ----------
    knots : ndarray, shape (knots, slots, dim)
    rows : WallRows or None
        Rows of the last QP of the Python core.
    multipliers : ndarray, shape (r,)
        Of these rows, for the normalised cost without 1/2.
    rounds : int
    solver : str
    fallback : tuple of str
        Solvers that failed on the way.
    rungs : tuple of str
        Names of the fallbacks taken.
    native : CorridorAnswer or None
        What the native core returned, with the contacts that take the place of rows.
    core : str
        Core that solved it, ``"native"`` or ``"python"``.
    handed_over : str
        Why the native core did not; empty where it did or was not asked.
    points : ndarray, shape (pieces, 2k, dim), or None
        Control points that were proved to be inside [m]; None where they follow from ``knots``.
    """

    knots: FloatArray
    rows: WallRows | None
    multipliers: FloatArray
    rounds: int
    solver: str
    fallback: tuple[str, ...] = ()
    rungs: tuple[str, ...] = ()
    core: str = "python"
    handed_over: str = ""
    points: FloatArray | None = None
    native: CorridorAnswer | None = None

    @property
    def active(self) -> int:
        """Number of rows, or of contacts with walls."""
        if self.native is not None:
            return len(self.native.wall)
        return 0 if self.rows is None else len(self.rows.wall)
