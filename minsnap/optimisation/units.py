"""Units in which the lengths and durations of a problem are of order one."""

from __future__ import annotations

from dataclasses import dataclass

from minsnap.basics.arrays import FloatArray


@dataclass(frozen=True)
class Units:
    """Size of the normalised units of length and time.

    Parameters
    ----------
    length : float
        [m].
    time : float
        [s].
    origin : ndarray, shape (dim,)
        Point taken as zero [m].
    """

    length: float
    time: float
    origin: FloatArray

    def of_order(self, order: int) -> float:
        """Value of one normalised unit of a derivative [m/s^order]."""
        return self.length / self.time**order
