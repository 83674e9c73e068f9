"""Curves as functions of a phase: the common part of circle, helix and lemniscate, with exact derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
import numpy.typing as npt
from numpy.polynomial import Polynomial

from minsnap.basics.arrays import FloatArray, set_fields
from minsnap.trajectory.heading import ConstantHeading, Heading
from minsnap.trajectory.path import Path

ComplexArray = npt.NDArray[np.complex128]

SPIN_UP = Polynomial([0.0, 0.0, 0.0, 0.0, 0.0, 7.0, -14.0, 10.0, -2.5])
"""Phase covered by a spin-up of unit time to unit rate, 1/2 at its end.

The integral of 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7, which goes from 0 to 1 with three zero derivatives at both ends.
"""


@dataclass(frozen=True)
class PhaseLaw:
    r"""Phase as a function of time: from rest up to a rate, constant at that rate, and down to rest.

    The rate rises as :math:`\omega\,(35 s^4 - 84 s^5 + 70 s^6 - 20 s^7)`, so that a path driven by the phase starts and
    ends with zero velocity, acceleration, jerk and snap, and its derivatives to the fourth are continuous throughout. A
    spin-up or spin-down takes twice the time that its angle takes at full rate. With ``ramp=0`` the rate is constant
    and the path starts and ends at speed.

    Parameters
    ----------
    rate : float
        Full rate, positive [rad/s].
    angle : float
        Whole phase covered, positive [rad].
    ramp : float
        Phase covered while spinning up, and again while spinning down, in [0, angle / 2] [rad].
    """

    rate: float
    angle: float
    ramp: float

    @property
    def spin_time(self) -> float:
        """Duration of the spin-up and of the spin-down [s]."""
        return 2.0 * self.ramp / self.rate

    @property
    def duration(self) -> float:
        """Duration of the whole [s]."""
        return (self.angle + 2.0 * self.ramp) / self.rate

    def derivative(self, t: FloatArray, order: int) -> FloatArray:
        """Phase or its derivative at instants in [0, duration], shape (m,) [rad/s^order]."""
        falling = t > self.duration / 2.0
        rising = self._rise(np.where(falling, self.duration - t, t), order)
        mirrored = self.angle - rising if order == 0 else (-1.0) ** (order + 1) * rising
        return np.where(falling, mirrored, rising)

    def _rise(self, t: FloatArray, order: int) -> FloatArray:
        """Return the phase without spin-down, at instants up to half the duration."""
        steady = (self.ramp + self.rate * (t - self.spin_time), np.full_like(t, self.rate), np.zeros_like(t))
        if self.ramp == 0.0:
            return steady[min(order, 2)]
        s = np.minimum(t / self.spin_time, 1.0)
        spinning = self.rate * self.spin_time ** (1 - order) * SPIN_UP.deriv(order)(s)
        return np.where(t < self.spin_time, spinning, steady[min(order, 2)])


@dataclass(frozen=True, eq=False)
class PhasePath(Path):
    r"""A sum of harmonics of a phase, plus a drift proportional to the phase.

    .. math:: r(t) = c + d\,\varphi(t) + \operatorname{Re} \sum_k a_k\, e^{i k \varphi(t)}

    Parameters
    ----------
    law : PhaseLaw
        The phase.
    center : array_like, shape (dim,)
        c [m].
    drift : array_like, shape (dim,)
        d [m/rad].
    harmonics : array_like of complex, shape (h, dim)
        a_k for k = 1, …, h [m].
    yaw : Heading, optional
        Yaw as a function of time; by default zero.
    """

    law: PhaseLaw
    center: FloatArray
    drift: FloatArray
    harmonics: ComplexArray
    yaw: Heading = ConstantHeading()

    def __post_init__(self) -> None:
        center, drift = (np.array(vector, dtype=np.float64) for vector in (self.center, self.drift))
        set_fields(self, center=center, drift=drift, harmonics=np.array(self.harmonics, dtype=np.complex128))

    @property
    def duration(self) -> float:
        """Length of the interval [s]."""
        return self.law.duration

    @property
    def dim(self) -> int:
        """Number of coordinates."""
        return len(self.center)

    def __repr__(self) -> str:
        return f"PhasePath(duration={self.duration:g} s, dim={self.dim}, harmonics={len(self.harmonics)})"

    def _evaluate(self, t: FloatArray, order: int) -> FloatArray:
        phase = np.stack([self.law.derivative(t, n) / factorial(n) for n in range(order + 1)])
        value = np.outer(phase[order], self.drift)
        for k, amplitude in enumerate(self.harmonics, 1):
            value += np.outer(_exponential(k * phase), amplitude).real
        value *= factorial(order)
        return value + self.center if order == 0 else value


def _exponential(phase: FloatArray) -> ComplexArray:
    r"""Last Taylor coefficient of :math:`e^{i\varphi}` from those of the phase.

    From :math:`u' = i\varphi' u`: :math:`u_n = (i / n) \sum_{j=1}^{n} j\,\varphi_j\,u_{n-j}`, with coefficients
    :math:`u_n = u^{(n)} / n!` (Griewank and Walther, Evaluating Derivatives, 2008, section 13.2).

    Parameters
    ----------
    phase : ndarray, shape (n + 1, m)
        Taylor coefficients of the phase at m instants.

    Returns
    -------
    ndarray of complex, shape (m,)
    """
    terms = np.empty(phase.shape, dtype=np.complex128)
    terms[0] = np.exp(1j * phase[0])
    weighted = np.arange(len(phase))[:, None] * phase
    for n in range(1, len(phase)):
        terms[n] = (1j / n) * (weighted[1 : n + 1] * terms[n - 1 :: -1][:n]).sum(axis=0)
    return np.asarray(terms[-1])
