r"""Iterative learning over flights: the error of each, filtered and shifted by the vehicle's delay, corrects the next.

With the setpoints :math:`u_k`, the error :math:`e_k = r - y_k` to the plan and the delay :math:`\tau`,

.. math:: u_{k+1}(t) = u_k(t) + Q\,L\,e_k(t + \tau),

the law of D. A. Bristow, M. Tharayil and A. G. Alleyne (A survey of iterative learning control, IEEE Control Systems
Magazine 26, 2006), Q a low-pass filter without phase. Velocity and acceleration of the setpoints are those of the
corrected position, so that they stay consistent.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray, interpolated
from minsnap.errors import InputError
from minsnap.flight.tracking.reference_curve import position_at
from minsnap.trajectory.samples import Samples


@dataclass(frozen=True)
class LearningSettings:
    """How much of an error is corrected.

    Parameters
    ----------
    gain : float
        L: share of the error that the next flight corrects; below 1 for errors that do not repeat.
    cutoff : float
        Of Q [Hz]: faster errors are left to the vehicle's own loops, which are slower than this.
    largest : float
        Largest correction of a setpoint's position [m]; what asks for more is no error of tracking.
    ramp : float
        Over which corrections vanish at both ends, so that a path from rest to rest stays one [s].

    Raises
    ------
    InputError
        If one of them is not positive.
    """

    gain: float = 0.8
    cutoff: float = 0.6
    largest: float = 2.0
    ramp: float = 1.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0.0 < value < np.inf:
                raise InputError(f"{name} is {value}: it must be positive")


def learned(
    plan: Samples, sent: Samples, flown: Samples, delay: float, settings: LearningSettings | None = None
) -> Samples:
    """Return the setpoints of the next flight.

    Parameters
    ----------
    plan : Samples
        What is to be flown, at equal steps, with velocity and acceleration.
    sent : Samples
        The setpoints of the last flight, at the same instants: the plan's at first.
    flown : Samples
        Positions of the last flight, on the clock of the plan.
    delay : float
        Of the vehicle's position after its setpoint [s].
    settings : LearningSettings, optional

    Returns
    -------
    Samples
        Those that were sent, corrected; heading and feed-forward are kept.

    Raises
    ------
    InputError
        If instants differ, derivatives are missing, or the delay is negative.
    """
    settings = settings or LearningSettings()
    if len(plan) != len(sent) or not np.allclose(plan.t, sent.t):
        raise InputError("the setpoints that were sent have other instants than the plan")
    if plan.velocity is None or plan.acceleration is None or sent.velocity is None or sent.acceleration is None:
        raise InputError("learning needs velocity and acceleration of the plan and of the setpoints")
    if not 0.0 <= delay < plan.duration:
        raise InputError(f"the delay is {delay} s: it must be 0 or more, and shorter than the plan")
    error = plan.position - position_at(flown, plan.t)
    step = plan.duration / (len(plan) - 1)
    ahead = interpolated(plan.t + delay, plan.t, error)
    before = sent.position - plan.position
    change = before + settings.gain * _smooth(ahead, step, settings.cutoff)
    change = _bounded(change, settings.largest) * _window(plan, settings.ramp)[:, None]
    speed = np.gradient(change, step, axis=0)
    return replace(
        sent,
        position=plan.position + change,
        velocity=plan.velocity + speed,
        acceleration=plan.acceleration + np.gradient(speed, step, axis=0),
    )


def _smooth(values: FloatArray, step: float, cutoff: float) -> FloatArray:
    """Filter by a Gaussian of half power at the cutoff, without phase; the ends are held."""
    from scipy.ndimage import gaussian_filter1d

    deviation = np.sqrt(np.log(2.0)) / (2.0 * np.pi * cutoff * step)
    return np.asarray(gaussian_filter1d(values, deviation, axis=0, mode="nearest"))


def _bounded(change: FloatArray, largest: float) -> FloatArray:
    length = np.linalg.norm(change, axis=1, keepdims=True)
    return np.asarray(change * np.minimum(1.0, largest / np.maximum(length, 1e-12)))


def _window(plan: Samples, ramp: float) -> FloatArray:
    """Return a share from 0 at both ends to 1, shape (m,), three times differentiable."""
    t = plan.t - plan.t[0]
    s = np.clip(np.minimum(t, plan.duration - t) / min(ramp, 0.5 * plan.duration), 0.0, 1.0)
    return np.asarray(s**4 * (35.0 - 84.0 * s + 70.0 * s**2 - 20.0 * s**3))
