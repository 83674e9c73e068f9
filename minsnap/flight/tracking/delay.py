"""Delay of a flight by cross-correlation, refined to a fraction of a sample."""

from __future__ import annotations

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import InputError
from minsnap.flight.tracking.reference_curve import position_at
from minsnap.trajectory.path import MOST_SAMPLES
from minsnap.trajectory.samples import Samples

_RATE = 100.0
"""Rate of the grid on which signals are correlated, at most [Hz]."""
RESOLUTION = 1e-5
"""Resolution of a delay [s]."""
_OVERLAP = 0.5
"""Least part of the shorter signal that must overlap at a lag."""


def estimate_delay(reference: Samples, flight: Samples, most: float | None) -> float:
    """Return the delay of a flight: the lag of greatest correlation of position, summed over all axes [s].

    The correlation coefficient is computed for every lag on a uniform grid, by FFT; from the best lag, the delay is
    refined to the least mean squared distance within one step of it.

    Parameters
    ----------
    reference, flight : Samples
        Of equal dimension.
    most : float or None
        Longest delay, either way [s]; None looks at every lag at which half of the shorter signal overlaps.

    Returns
    -------
    float
        0 where one of them does not move.
    """
    step = 1.0 / min(_RATE, max(reference.rate, flight.rate, 1.0))
    one, other = _on_grid(reference, step), _on_grid(flight, step)
    if min(len(one), len(other)) < 3 or not (np.ptp(one, axis=0).any() and np.ptp(other, axis=0).any()):
        return 0.0
    start = float(flight.t[0] - reference.t[0])
    lags = np.asarray((np.arange(len(one) + len(other) - 1) - (len(one) - 1)) * step + start, dtype=np.float64)
    scores = _coefficients(one, other)
    most = np.inf if most is None else most
    scores[np.abs(lags) > most] = -1.0
    best = float(np.clip(lags[int(np.argmax(scores))], -most, most))
    return _refined(reference, flight, best, step, most)


def _on_grid(samples: Samples, step: float) -> FloatArray:
    if not samples.duration <= MOST_SAMPLES * step:
        raise InputError(f"the samples last {samples.duration:g} s: that is too long to find a delay in")
    count = int(np.floor(samples.duration / step + 1e-9)) + 1
    return position_at(samples, samples.t[0] + step * np.arange(count))


def _coefficients(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the correlation coefficient of two centered signals at every lag; -1 where they hardly overlap."""
    from scipy.signal import correlate

    x, y = one - one.mean(axis=0), other - other.mean(axis=0)
    shared = correlate(np.ones(len(y)), np.ones(len(x)), method="fft")
    cross = sum(correlate(v, u, method="fft") for u, v in zip(x.T, y.T, strict=True))
    energy = correlate(np.ones(len(y)), np.sum(x**2, axis=1), method="fft") * correlate(
        np.sum(y**2, axis=1), np.ones(len(x)), method="fft"
    )
    floor = 1e-9 * float(np.sum(x**2) * np.sum(y**2))
    scores = cross / np.sqrt(np.maximum(energy, floor))
    scores[shared < _OVERLAP * min(len(x), len(y))] = -1.0
    return np.asarray(scores)


def _refined(reference: Samples, flight: Samples, best: float, step: float, most: float) -> float:
    """Return the delay within one step of the best lag at which the mean squared distance is least."""
    from scipy.optimize import minimize_scalar

    def distance(delay: float) -> float:
        at = flight.t - delay
        inside = (at >= reference.t[0]) & (at <= reference.t[-1])
        gap = flight.position[inside] - position_at(reference, at[inside])
        return float(np.mean(np.sum(gap**2, axis=1))) if inside.any() else np.inf

    low, high = max(best - step, -most), min(best + step, most)
    if high - low < RESOLUTION:
        return best
    minimum = minimize_scalar(distance, bounds=(low, high), method="bounded", options={"xatol": RESOLUTION})
    return float(minimum.x)
