"""Tracking error of a flight: errors per axis, delay, and distance to the path separated from the error in time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, bounded, own_arrays
from minsnap.basics.checks import SIZE, check_kind, check_switch, is_number
from minsnap.basics.messages import shown
from minsnap.basics.storage.text_columns import aligned
from minsnap.errors import InputError
from minsnap.flight.tracking.reference_curve import direction_at, distance_to_curve, estimate_delay, position_at
from minsnap.trajectory.samples import Samples

MAX_DELAY = 2.0
"""Longest delay that is looked for unless told otherwise [s]."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Comparison of a flight with its reference over the time interval that both cover.

    Parameters
    ----------
    t : ndarray, shape (m,)
        Instants of the flight, in the reference's time [s].
    error : ndarray, shape (m, dim)
        Position less reference at the same instant [m].
    late_error : ndarray, shape (m, dim)
        Position less the reference of ``delay`` before: what is left when the flight's lateness is taken off [m].
    path_error : ndarray, shape (m,)
        Distance to the reference's curve, whatever the time [m].
    direction : ndarray, shape (m, dim)
        Unit vector along the reference's velocity at these instants; zero where it is slower than 0.05 m/s.
    delay : float
        By how much the flight is late, by cross-correlation [s]; negative if it is early.
    offset : float
        What was added to the flight's time to align it with the reference's [s]; a lead is subtracted.
    """

    t: FloatArray
    error: FloatArray
    late_error: FloatArray
    path_error: FloatArray
    direction: FloatArray
    delay: float
    offset: float = 0.0

    def __post_init__(self) -> None:
        own_arrays(self)

    def __str__(self) -> str:
        return comparison_text({"flight": self})

    @property
    def rmse(self) -> FloatArray:
        """Root mean squared error of each axis, shape (dim,) [m]."""
        return np.asarray(np.sqrt(np.mean(self.error**2, axis=0)))

    @property
    def rmse_3d(self) -> float:
        """Root mean square of the distance to the reference at the same instant [m]."""
        return float(np.sqrt(np.mean(np.sum(self.error**2, axis=1))))

    @property
    def max_error(self) -> float:
        """Greatest distance to the reference at the same instant [m]."""
        return float(np.sqrt(np.max(np.sum(self.error**2, axis=1))))

    @property
    def along(self) -> FloatArray:
        """Error along the path, shape (m,) [m]: negative behind the reference."""
        return np.asarray((self.error * self.direction).sum(axis=1))

    @property
    def across(self) -> FloatArray:
        """Length of the error that is not along the path, shape (m,) [m]."""
        return np.asarray(np.linalg.norm(self.error - self.along[:, None] * self.direction, axis=1))

    @property
    def along_rmse(self) -> float:
        """Root mean square of the error along the path [m]."""
        return float(np.sqrt(np.mean(self.along**2)))

    @property
    def across_rmse(self) -> float:
        """Root mean square of the error across the path [m]."""
        return float(np.sqrt(np.mean(self.across**2)))

    @property
    def worst_instant(self) -> float:
        """When the distance to the reference at the same instant is greatest [s]."""
        return float(self.t[np.argmax(np.sum(self.error**2, axis=1))])

    @property
    def constant_offset(self) -> FloatArray:
        """Median error of each axis, shape (dim,) [m]: large where origin or frame differ."""
        return np.asarray(np.median(self.error, axis=0))

    @property
    def late_rmse_3d(self) -> float:
        """Root mean square of the distance after the delay is removed [m]."""
        return float(np.sqrt(np.mean(np.sum(self.late_error**2, axis=1))))

    @property
    def path_rmse(self) -> float:
        """Root mean square of the distance to the curve [m]."""
        return float(np.sqrt(np.mean(self.path_error**2)))

    @property
    def path_max(self) -> float:
        """Greatest distance to the curve [m]."""
        return float(self.path_error.max())

    @property
    def time_rmse(self) -> float:
        """Root mean square of the part of the error that delay adds to the distance to the curve [m]."""
        return float(np.sqrt(np.mean(np.maximum(np.sum(self.error**2, axis=1) - self.path_error**2, 0.0))))

    def within(self, start: float, end: float) -> Comparison:
        """Return the part between two instants of the reference's time; the delay of the whole flight is kept.

        Raises
        ------
        InputError
            If no instant lies between them.
        """
        if not (is_number(start) and is_number(end)):
            raise InputError(f"the part is from {shown(start)} to {shown(end)}: give two instants [s]")
        kept = (self.t >= start) & (self.t <= end)
        if not kept.any():
            raise InputError(f"nothing was flown between {start} and {end} s: it is {self.t[0]:g} to {self.t[-1]:g} s")
        parts = (self.t[kept], self.error[kept], self.late_error[kept], self.path_error[kept], self.direction[kept])
        return Comparison(*parts, self.delay, self.offset)

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain numbers, for JSON."""
        axes = "xyz" if self.error.shape[1] <= 3 else [str(axis) for axis in range(self.error.shape[1])]
        return {
            "rmse": {axis: float(value) for axis, value in zip(axes, self.rmse, strict=False)},
            "rmse_3d": self.rmse_3d,
            "max_error": self.max_error,
            "worst_instant": self.worst_instant,
            "along_rmse": self.along_rmse,
            "across_rmse": self.across_rmse,
            "constant_offset": [float(value) for value in self.constant_offset],
            "delay": self.delay,
            "rmse_3d_without_delay": self.late_rmse_3d,
            "path_rmse": self.path_rmse,
            "path_max": self.path_max,
            "time_rmse": self.time_rmse,
            "offset": self.offset,
            "start": float(self.t[0]),
            "end": float(self.t[-1]),
            "samples": len(self.t),
        }


def comparison_text(comparisons: Mapping[str, Comparison]) -> str:
    """Return one row per flight: errors per axis and in 3-D, greatest error, delay, errors in shape and in time."""
    count = max(comparison.error.shape[1] for comparison in comparisons.values())
    axes = list("xyz"[:count]) if count <= 3 else [str(axis) for axis in range(count)]
    head = ["along", "across", "greatest", "at [s]", "delay [s]", "less delay", "from the curve", "in time"]
    rows = [["flight", *axes, "3-D", *head]]
    for name, one in comparisons.items():
        path = [one.along_rmse, one.across_rmse, one.max_error, one.worst_instant]
        figures = [*one.rmse, one.rmse_3d, *path, one.delay, one.late_rmse_3d, one.path_rmse, one.time_rmse]
        rows.append([name, *(f"{value:.4f}" for value in figures)])
    return "\n".join(["Root mean squared error [m]", aligned(rows)])


def compare(reference: Samples, flight: Samples, *, align: bool = False, max_delay: float = MAX_DELAY) -> Comparison:
    """Compare a flight with its reference.

    Parameters
    ----------
    reference, flight : Samples
        Of equal dimension; each with its own instants. Only the time that both cover counts. With a lead the
        reference is what was sent, and what was planned for an instant is what was sent that much before it.
    align : bool
        The clocks differ by an unknown offset, as those of a log and a file do: find it first, by cross-correlation
        over every offset. A delay is then part of the offset, and no longer to be seen.
    max_delay : float
        Longest delay that is looked for [s].

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        If dimensions differ, or fewer than 2 instants are common.
    """
    for what, samples in (("reference", reference), ("flight", flight)):
        check_kind(f"the {what}", samples, Samples, "samples")
        if not (bounded(samples.t).all() and bounded(samples.position).all()):
            raise InputError(f"the {what} has times or positions that are no finite numbers, {SIZE}")
    check_switch("align", align)
    if not (is_number(max_delay) and max_delay >= 0.0):
        raise InputError(f"max_delay is {shown(max_delay)}: it must be a time of 0 or more [s]")
    if reference.dim != flight.dim:
        raise InputError(f"the reference has {reference.dim} coordinates and the flight {flight.dim}: they must agree")
    offset = -estimate_delay(reference, flight, None) if align else -reference.lead
    t, position = _common(reference, flight, offset)
    delay = estimate_delay(reference, Samples(t, position), max_delay)
    error = position - position_at(reference, t)
    late = position - position_at(reference, t - delay)
    curve = distance_to_curve(position, reference)
    return Comparison(t, error, late, curve, direction_at(reference, t), delay, offset)


def _common(reference: Samples, flight: Samples, offset: float) -> tuple[FloatArray, FloatArray]:
    """Return instants of the flight, in the time of the reference, and its positions over the common interval."""
    t = flight.t + offset
    kept = (t >= reference.t[0] - 1e-9) & (t <= reference.t[-1] + 1e-9)
    if np.count_nonzero(kept) < 2:
        raise InputError(
            f"the flight, {t[0]:g} to {t[-1]:g} s, and its reference, {reference.t[0]:g} to {reference.t[-1]:g} s, "
            "have no time in common: compare them with align=True"
        )
    return t[kept], flight.position[kept]


def moved(flight: Samples, offset: float) -> Samples:
    """Return a flight with ``offset`` seconds added to its instants."""
    return replace(flight, t=flight.t + offset)
