"""Samples: a path evaluated on a uniform grid of instants, as files and vehicles take it."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, ReadOnly, owned, set_fields
from minsnap.basics.optional_packages import optional

_PREFIXES = {"position": "", "velocity": "v", "acceleration": "a", "jerk": "j", "snap": "s", "feed_forward": "ff"}
VECTORS = tuple(_PREFIXES)
"""Fields of shape (m, dim), whose columns in a table begin so."""


@dataclass(frozen=True, eq=False)
class Samples(ReadOnly):
    """A path at the instants ``t``; SI units, z up, read-only arrays.

    Parameters
    ----------
    t : ndarray, shape (m,)
        Instants [s], strictly increasing.
    position : ndarray, shape (m, dim)
        [m].
    velocity, acceleration, jerk, snap : ndarray, shape (m, dim), or None
        [m/s], [m/s^2], [m/s^3], [m/s^4]; None where the source does not have them.
    yaw : ndarray, shape (m,), or None
        Heading [rad], continuous (not wrapped).
    yaw_rate : ndarray, shape (m,), or None
        [rad/s].
    feed_forward : ndarray, shape (m, dim), or None
        Command in addition to the acceleration, against drag [m/s^2]; not a part of the motion.
    lead : float
        Time by which setpoints are sent early, against the delay of a vehicle [s]: the setpoint sent at ``t`` is the
        plan's at ``t + lead``.
    """

    t: FloatArray
    position: FloatArray
    velocity: FloatArray | None = None
    acceleration: FloatArray | None = None
    jerk: FloatArray | None = None
    snap: FloatArray | None = None
    yaw: FloatArray | None = None
    yaw_rate: FloatArray | None = None
    feed_forward: FloatArray | None = None
    lead: float = 0.0

    def __post_init__(self) -> None:
        for name in ARRAYS:
            value = getattr(self, name)
            if value is not None:
                set_fields(self, **{name: owned(value)})

    def vectors(self) -> dict[str, FloatArray]:
        """Return the arrays of shape (m, dim) that are known, by name."""
        return {name: getattr(self, name) for name in VECTORS if getattr(self, name) is not None}

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, rows: Any) -> Samples:
        """Return the samples of some rows: a slice, a mask or indices."""
        taken: dict[str, Any] = {name: values[rows] for name, values in self.arrays().items()}
        return replace(self, **taken)

    def sample(self, rate: float = 20.0) -> Samples:
        """Return the samples, which have their own instants: they serve wherever a path is sampled."""
        return self

    def arrays(self) -> dict[str, FloatArray]:
        """Return all arrays that are known, by name."""
        return {name: getattr(self, name) for name in ARRAYS if getattr(self, name) is not None}

    def to_dataframe(self) -> Any:
        """Return a pandas.DataFrame: columns t, x, y, z, vx, …, ax, …, jx, …, sx, …, ffx, …, yaw, yaw_rate if known.

        Raises
        ------
        ImportError
            If pandas is not installed.
        """
        return optional("pandas", "a table needs pandas", "tables").DataFrame(self.columns())

    def columns(self) -> dict[str, FloatArray]:
        """Return every column, shape (m,), by its name: ``t``, ``x``, ``vx``, ``ffz``, ``yaw`` and so on."""
        columns = {"t": self.t}
        for name, values in self.vectors().items():
            columns |= dict(zip(column_names(name, self.dim), values.T, strict=True))
        return columns | {name: getattr(self, name) for name in ("yaw", "yaw_rate") if getattr(self, name) is not None}

    @property
    def dim(self) -> int:
        """Number of position coordinates."""
        return int(self.position.shape[1])

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]; 0 without samples."""
        return float(self.t[-1] - self.t[0]) if len(self) else 0.0

    def commanded(self) -> Samples:
        """Return the samples for a vehicle: the feed-forward is added to the acceleration, not stated apart."""
        if self.feed_forward is None:
            return self
        own = 0.0 if self.acceleration is None else self.acceleration
        return replace(self, acceleration=own + self.feed_forward, feed_forward=None)

    @property
    def rate(self) -> float:
        """Samples per second [Hz]: the reciprocal of the mean step; 0 where they last no time."""
        return (len(self.t) - 1) / self.duration if self.duration > 0.0 else 0.0


ARRAYS = tuple(field.name for field in fields(Samples) if field.name != "lead")
"""The quantities of samples that are arrays."""


def axis_names(dim: int) -> tuple[str, ...]:
    """Return x, y, z, or x0, x1 and so on for more coordinates than three."""
    return tuple("xyz"[:dim]) if dim <= 3 else tuple(f"x{axis}" for axis in range(dim))


def column_names(quantity: str, dim: int = 3) -> tuple[str, ...]:
    """Return the names of the columns of a quantity in tables and files."""
    if quantity not in _PREFIXES:
        return (quantity,)
    return tuple(_PREFIXES[quantity] + axis for axis in axis_names(dim))


def gaps(t: FloatArray, *, longest: float = 0.3, steps: float = 3.0) -> FloatArray:
    """Return where samples are missing, shape (g, 2): the instants before and after each gap [s].

    Parameters
    ----------
    t : ndarray, shape (m,)
        Instants of the samples [s], increasing.
    longest : float
        Step above which samples are missing [s], if it is also longer than ``steps`` median ones.
    steps : float
        How many times the median step that is.
    """
    apart = np.diff(t)
    usual = float(np.median(apart)) if len(apart) else 0.0
    before = np.flatnonzero(apart > max(longest, steps * usual))
    return np.stack([t[before], t[before + 1]], axis=1)


def in_gaps(t: FloatArray, known: FloatArray, margin: float = 0.0) -> BoolArray:
    """Tell the instants (m,) that lie in the gaps of known ones (n,), or nearer to one than a margin [s]."""
    starts, ends = gaps(known).T
    return np.asarray(np.searchsorted(starts - margin, t) > np.searchsorted(ends + margin, t, side="right"))


def between_gaps(t: FloatArray, values: FloatArray) -> list[FloatArray]:
    """Return the parts of values (m,) at instants (m,) that the gaps between these separate."""
    return np.split(values, np.searchsorted(t, gaps(t)[:, 1]))


def gap_remarks(t: FloatArray) -> list[str]:
    """Return a sentence on the gaps between instants (m,); none if there are none."""
    missing = gaps(t)
    if not len(missing):
        return []
    lengths = np.diff(missing)[:, 0]
    start, end = missing[lengths.argmax()]
    where = f"the longest gap is from {start:.2f} to {end:.2f} s"
    return [f"samples are missing for {lengths.sum():.2f} s, which are left out: {where}"]
