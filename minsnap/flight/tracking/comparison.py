"""Tracking error of a flight: errors per axis, delay, and distance to the path separated from the error in time.

The delay is that of the best cross-correlation, refined to a fraction of a sample. The reference counts as a curve
through its samples, by Hermite interpolation where it has velocities.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, OwnsArrays, bounded, interpolated
from minsnap.basics.checks import SIZE, check_kind, check_number, check_switch, is_number
from minsnap.basics.messages import aligned, shown
from minsnap.basics.tolerances import ROUNDING
from minsnap.errors import InputError
from minsnap.trajectory import MOST_SAMPLES, Samples, axis_names, gap_remarks, gaps, in_gaps


@dataclass(frozen=True)
class ComparisonSettings:
    """How finely a flight is compared with its reference.

    Parameters
    ----------
    slow : float
        Speed below which a velocity has no direction [m/s].
    density : int
        Chords a sample for the distance to a curve whose velocity is known.
    chords : int
        Least number of chords that a curve is cut into.
    rate : float
        Rate of the grid on which signals are correlated, at most [Hz].
    resolution : float
        Resolution of a delay [s].
    overlap : float
        Least part of the shorter signal that must overlap at a lag.
    jump : float
        Change of position from one sample to the next, beyond what speed explains, that no vehicle makes [m].
    noise : float
        Such a change is no jump below so many median ones.
    """

    slow: float = 0.05
    density: int = 16
    chords: int = 10_000
    rate: float = 100.0
    resolution: float = 1e-5
    overlap: float = 0.5
    jump: float = 0.5
    noise: float = 6.0


COMPARED = ComparisonSettings()


def position_at(samples: Samples, t: FloatArray) -> FloatArray:
    """Return position between samples, shape (m, dim) [m].

    By the cubic through position and velocity, or linearly where velocity is not known; held before the first sample
    and after the last.

    Parameters
    ----------
    samples : Samples
    t : ndarray, shape (m,)
        Instants in the samples' own time [s].
    """
    inside = np.clip(t, samples.t[0], samples.t[-1])
    if samples.velocity is None or len(samples) < 2:
        return interpolated(inside, samples.t, samples.position)
    from scipy.interpolate import CubicHermiteSpline

    return np.asarray(CubicHermiteSpline(samples.t, samples.position, samples.velocity)(inside))


def direction_at(samples: Samples, t: FloatArray) -> FloatArray:
    """Return unit vectors along the velocity between samples, shape (m, dim); zero where it is slower than 0.05 m/s.

    Parameters
    ----------
    samples : Samples
        Their velocity, or the differences of their positions.
    t : ndarray, shape (m,)
        Instants in the samples' own time [s].
    """
    velocity = samples.velocity
    if velocity is None:
        velocity = np.gradient(samples.position, samples.t, axis=0) if len(samples) > 1 else 0.0 * samples.position
    there = interpolated(t, samples.t, velocity)
    speed = np.linalg.norm(there, axis=1, keepdims=True)
    return np.asarray(np.where(speed < COMPARED.slow, 0.0, there / np.maximum(speed, COMPARED.slow)))


def distance_to_curve(points: FloatArray, samples: Samples) -> FloatArray:
    """Return the distance of points to the curve through samples, independent of time, shape (m,) [m].

    The curve is approximated by chords, sixteen per sample where the velocity is known. For samples at 20 Hz on a
    circle of 3 m radius at 3 m/s the error of a chord is 4 micrometres.

    Parameters
    ----------
    points : ndarray, shape (m, dim)
        [m].
    samples : Samples
        The curve.
    """
    from scipy.spatial import cKDTree

    vertices = _vertices(samples)
    if len(vertices) == 1:
        return np.asarray(np.linalg.norm(points - vertices[0], axis=-1))
    _, nearest = cKDTree(vertices).query(points)
    before = np.clip(nearest - 1, 0, len(vertices) - 2)
    after = np.clip(nearest, 0, len(vertices) - 2)
    sides = [_to_chords(points, vertices[index], vertices[index + 1]) for index in (before, after)]
    return np.minimum(*sides)


def _vertices(samples: Samples) -> FloatArray:
    """Return points along the curve, none further apart than a ten-thousandth of its length."""
    count = len(samples)
    points = samples.position
    if samples.velocity is not None and count > 1:
        dense = np.interp(np.arange((count - 1) * COMPARED.density + 1) / COMPARED.density, np.arange(count), samples.t)
        points = position_at(samples, dense)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    if not lengths.any():
        return points[:1]
    pieces = np.ceil(lengths / lengths.sum() * COMPARED.chords).astype(int)
    own = np.concatenate([[0], np.cumsum(pieces)])
    at = np.interp(np.arange(own[-1] + 1), own, np.arange(len(points)))
    return position_at(Samples(np.arange(float(len(points))), points), at)


def _to_chords(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the distance of each point to its own chord, shape (m,)."""
    along = end - start
    squared = np.einsum("ij,ij->i", along, along)
    part = np.einsum("ij,ij->i", points - start, along) / np.where(squared > 0, squared, 1.0)
    return np.asarray(np.linalg.norm(points - start - np.clip(part, 0.0, 1.0)[:, None] * along, axis=-1))


def estimate_delay(reference: Samples, flight: Samples, most: float) -> float:
    """Return the delay of a flight: the lag of greatest correlation of position, summed over all axes [s].

    The correlation coefficient is computed for every lag on a uniform grid, by FFT, without the gaps of both; from the
    best lag, the delay is refined to the least mean squared distance within one step of it, but for a constant offset.

    Parameters
    ----------
    reference, flight : Samples
        Of equal dimension.
    most : float
        Longest delay, either way [s]; infinity for every lag at which half of the shorter signal overlaps.

    Returns
    -------
    float
        0 where one of them does not move.
    """
    step = 1.0 / min(COMPARED.rate, max(reference.rate, flight.rate, 1.0))
    (one, known), (other, seen) = _on_grid(reference, step), _on_grid(flight, step)
    if min(known.sum(), seen.sum()) < 3 or not (np.ptp(one[known], axis=0).any() and np.ptp(other[seen], axis=0).any()):
        return 0.0
    start = float(flight.t[0] - reference.t[0])
    lags = np.asarray((np.arange(len(one) + len(other) - 1) - (len(one) - 1)) * step + start, dtype=np.float64)
    scores = _coefficients(one, other, known, seen)
    scores[np.abs(lags) > most] = -1.0
    best = float(np.clip(lags[int(np.argmax(scores))], -most, most))
    return _refined(reference, flight, best, step, most)


def _on_grid(samples: Samples, step: float) -> tuple[FloatArray, BoolArray]:
    """Return positions at equal steps, shape (m, dim), and which of them are in no gap, shape (m,)."""
    if not samples.duration <= MOST_SAMPLES * step:
        raise InputError(f"the samples last {samples.duration:g} s: that is too long to find a delay in")
    count = int(np.floor(samples.duration / step + 1e-9)) + 1
    t = samples.t[0] + step * np.arange(count)
    return position_at(samples, t), ~in_gaps(t, samples.t)


def _coefficients(one: FloatArray, other: FloatArray, known: BoolArray, seen: BoolArray) -> FloatArray:
    """Return the correlation coefficient of two signals at every lag, over what is known of both there.

    Of equal coefficients the one of the longer overlap is greatest; it is -1 where they hardly overlap.
    """
    from scipy.signal import fftconvolve

    def summed(first: FloatArray, second: FloatArray) -> FloatArray:
        return np.asarray(fftconvolve(second, first[::-1], axes=0))

    def energy(squares: FloatArray, total: FloatArray) -> FloatArray:
        return np.asarray((squares - total**2 / shared).sum(axis=1) + 1e-9 * squares.sum(axis=1).max())

    here, there = (each[:, None].astype(np.float64) for each in (known, seen))
    x, y = here * (one - one[known].mean(axis=0)), there * (other - other[seen].mean(axis=0))
    shared = np.maximum(summed(here, there), 1.0)
    left, right = summed(x, there), summed(here, y)
    cross = (summed(x, y) - left * right / shared).sum(axis=1)
    scores = cross / np.sqrt(energy(summed(x**2, there), left) * energy(summed(here, y**2), right))
    scores[shared[:, 0] < COMPARED.overlap * min(known.sum(), seen.sum())] = -1.0
    return np.asarray(scores)


def _refined(reference: Samples, flight: Samples, best: float, step: float, most: float) -> float:
    """Return the delay within one step of the best lag at which the distance varies least: an offset is no delay.

    Where it varies by rounding alone, as on a line at constant speed, nothing tells of another one.
    """
    from scipy.optimize import minimize_scalar

    def distance(more: float) -> float:
        at = flight.t - best - more
        inside = (at >= reference.t[0]) & (at <= reference.t[-1]) & ~in_gaps(at, reference.t)
        gap = flight.position[inside] - position_at(reference, at[inside])
        return float(np.var(gap, axis=0).sum()) if inside.any() else np.inf

    low, high = max(-step, -most - best), min(step, most - best)
    if high - low < COMPARED.resolution or distance(0.0) <= (ROUNDING * np.abs(flight.position).max()) ** 2:
        return best
    minimum = minimize_scalar(distance, bounds=(low, high), method="bounded", options={"xatol": COMPARED.resolution})
    return best + float(minimum.x)


def jump_remarks(flight: Samples) -> list[str]:
    """Return a sentence on where positions jump, as they do when an estimator is reset; none if they do not.

    A step of position, between two samples without a gap, is a jump if neither the velocity there nor the steps before
    and after explain it to within 0.5 m, or six times what they usually leave.

    Parameters
    ----------
    flight : Samples
    """
    if len(flight) < 4:
        return []
    apart, step = np.diff(flight.t)[:, None], np.diff(flight.position, axis=0)
    around = (step / apart)[[1, *range(len(step)), -2]]
    speeds = [around[:-2], around[2:], 0.5 * (around[:-2] + around[2:])]
    if flight.velocity is not None:
        speeds.append(0.5 * (flight.velocity[:-1] + flight.velocity[1:]))
    size = np.min([np.linalg.norm(step - speed * apart, axis=1) for speed in speeds], axis=0)
    size[in_gaps(0.5 * (flight.t[:-1] + flight.t[1:]), flight.t)] = 0.0
    size[[0, -1]] = 0.0
    where = np.flatnonzero(size > max(COMPARED.jump, COMPARED.noise * float(np.median(size))))
    if not len(where):
        return []
    places = np.split(where, np.flatnonzero(np.diff(where) > 2) + 1)
    first = flight.t[places[0][size[places[0]].argmax()] + 1]
    times = f"at {first:.2f} s" if len(places) == 1 else f"{len(places)} times, first at {first:.2f} s"
    what = f"the logged position jumps by {size.max():.3g} m {times}"
    return [f"{what}, as when an estimator is reset: figures count the jump"]


MAX_DELAY = 2.0
"""Longest delay that is looked for unless told otherwise [s]."""


@dataclass(frozen=True, eq=False)
class Comparison(OwnsArrays):
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

    def __str__(self) -> str:
        return "\n".join([comparison_text({"flight": self}), *self.remarks()])

    def remarks(self) -> list[str]:
        """Return a sentence on what is missing between the instants; none if nothing is."""
        return gap_remarks(self.t)

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
        return {
            "rmse": dict(zip(axis_names(self.error.shape[1]), self.rmse.tolist(), strict=True)),
            **{name: getattr(self, name) for name in FIGURES},
            "constant_offset": self.constant_offset.tolist(),
            "rmse_3d_without_delay": self.late_rmse_3d,
            "start": float(self.t[0]),
            "end": float(self.t[-1]),
            "samples": len(self.t),
            "gaps": gaps(self.t).tolist(),
        }


FIGURES = "rmse_3d max_error worst_instant along_rmse across_rmse delay path_rmse path_max time_rmse offset".split()
"""Properties of a comparison that are one number each."""


def comparison_text(comparisons: Mapping[str, Comparison]) -> str:
    """Return one row per flight: errors per axis and in 3-D, greatest error, delay, errors in shape and in time."""
    axes = axis_names(max(comparison.error.shape[1] for comparison in comparisons.values()))
    head = ["along", "across", "greatest", "at [s]", "delay [s]", "less delay", "from the curve", "in time"]
    rows = [["flight", *axes, "3-D", *head]]
    for name, one in comparisons.items():
        path = [one.along_rmse, one.across_rmse, one.max_error, one.worst_instant]
        figures = [*one.rmse, one.rmse_3d, *path, one.delay, one.late_rmse_3d, one.path_rmse, one.time_rmse]
        rows.append([name, *(f"{value:.4f}" for value in figures)])
    return "\n".join(["Root mean squared error [m], in axes with z up", aligned(rows)])


def compare(reference: Samples, flight: Samples, *, align: bool = False, max_delay: float = MAX_DELAY) -> Comparison:
    """Compare a flight with its reference.

    Parameters
    ----------
    reference, flight : Samples
        Of equal dimension; each with its own instants. Only the time that both cover counts, without the gaps of
        either. With a lead the reference is what was sent, and what was planned for an instant is what was sent that
        much before it.
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
        If dimensions differ, fewer than 2 instants are common, or times do not rise or numbers are not finite.
    """
    for what, samples in (("reference", reference), ("flight", flight)):
        check_samples(what, samples, "t", "position", "velocity")
    check_switch("align", align)
    check_number("max_delay", max_delay, 0.0, np.inf, "it must be a time of 0 or more [s]")
    if reference.dim != flight.dim:
        raise InputError(f"the reference has {reference.dim} coordinates and the flight {flight.dim}: they must agree")
    offset = -estimate_delay(reference, flight, np.inf) if align else -reference.lead
    delay = estimate_delay(reference, _common(reference, flight, offset), max_delay)
    there = _common(reference, flight, offset, delay)
    t, position = there.t, there.position
    error = position - position_at(reference, t)
    late = position - position_at(reference, t - delay)
    curve = distance_to_curve(position, reference)
    return Comparison(t, error, late, curve, direction_at(reference, t), delay, offset)


def check_samples(what: str, samples: Samples, *used: str) -> None:
    """Raise InputError unless instants rise and the arrays of these names, or all, have finite numbers."""
    check_kind(f"the {what}", samples, Samples, "samples")
    for name, values in samples.arrays().items():
        if (not used or name in used) and not bounded(values).all():
            raise InputError(f"the {what} has numbers in {name} that are not finite, {SIZE}")
    if not (len(samples) and (np.diff(samples.t) > 0.0).all()):
        give = "it needs one or more, each later than the one before"
        raise InputError(f"the {what} has {len(samples)} instants: {give}")


def _common(reference: Samples, flight: Samples, offset: float, delay: float = 0.0) -> Samples:
    """Return the flight in the time of the reference, over the common interval and outside the reference's gaps."""
    t = flight.t + offset
    kept = (t >= reference.t[0] - 1e-9) & (t <= reference.t[-1] + 1e-9)
    kept &= ~(in_gaps(t, reference.t) | in_gaps(t - delay, reference.t))
    if np.count_nonzero(kept) < 2:
        times = f"the flight, {t[0]:g} to {t[-1]:g} s, and its reference, {reference.t[0]:g} to {reference.t[-1]:g} s,"
        raise InputError(f"{times} have no time in common: compare them with align=True")
    return moved(flight, offset)[kept]


def moved(flight: Samples, offset: float) -> Samples:
    """Return a flight with ``offset`` seconds added to its instants."""
    return replace(flight, t=flight.t + offset)
