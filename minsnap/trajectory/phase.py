"""Curves as functions of a phase: the common part of circle, helix and lemniscate, with exact derivatives.

They are also piecewise polynomials, with a proved bound on the difference.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass
from math import comb, factorial, nextafter

import numpy as np
from numpy.polynomial import Polynomial

from minsnap.basics.arrays import FloatArray, NDArray, ReadOnly, set_fields
from minsnap.basics.checks import check_positive
from minsnap.basics.messages import explains_names
from minsnap.errors import InputError, ShapeError
from minsnap.polynomials.bernstein import ends_to_points
from minsnap.trajectory.heading import ZERO_YAW, Heading
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory

ComplexArray = NDArray[np.complex128]

SPIN_UP = Polynomial([0.0, 0.0, 0.0, 0.0, 0.0, 7.0, -14.0, 10.0, -2.5])
"""Phase covered by a spin-up of unit time to unit rate, 1/2 at its end.

The integral of 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7, which goes from 0 to 1 with three zero derivatives at both ends.
"""


@dataclass(frozen=True)
class ShapeSettings:
    """How a shape is written as polynomials.

    Parameters
    ----------
    error : float
        Largest distance between the shape and the polynomials, by default [m].
    degree : int
        The interpolant meets 4 derivatives at both ends of a piece.
    orders : int
        Its error follows from this derivative.
    roundings : float
        What all roundings add to the error, relative to the size of the path: 256 units in the last place.
    pieces : int
        Polynomials at most.
    ramp : float
        Share of the duration that a spin-up takes at least.
    """

    error: float = 1e-6
    degree: int = 7
    orders: int = 8
    roundings: float = 2.0**-44
    pieces: int = 100_000
    ramp: float = 1e-9


SHAPE = ShapeSettings()


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
class PhasePath(ReadOnly, Path):
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
    yaw: Heading = ZERO_YAW

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

    def as_trajectory(self, error: float = SHAPE.error) -> Trajectory:
        """Return the path as polynomials that differ from it by ``error`` [m] at most; see :func:`as_polynomials`."""
        return as_polynomials(self, error)

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


@explains_names({})
def as_polynomials(path: Path, error: float = SHAPE.error) -> Trajectory:
    r"""Approximate a shape by a trajectory of degree 7, within a distance at every instant.

    Each piece has the shape's position, velocity, acceleration and jerk at both ends, so the trajectory is three times
    continuously differentiable and starts and ends exactly as the shape does. On a piece of duration 2w,

    .. math:: \|r(t) - q(t)\| \le \frac{w^8}{8!} \max \|r^{(8)}\|, \qquad
              \|r^{(p)}(t) - q^{(p)}(t)\| \le \frac{2^p w^{8-p}}{p!\,(8-2p)!} \max \|r^{(8)}\|

    (P. G. Ciarlet, M. H. Schultz, R. S. Varga, Numerische Mathematik 9, 1967, theorem 9, applied along each direction);
    the maximum is bounded from the Taylor coefficients of the phase. The numbers of pieces are the least for which this
    bound, rounding included, is at most ``error``.

    Parameters
    ----------
    path : Path
        A circle, helix or lemniscate; a :class:`~minsnap.Trajectory` is returned as it is.
    error : float
        Largest distance [m]. The bound on the p-th derivative's error is ``8! 2^p / (p! (8 - 2p)! w^p)`` times that on
        the distance, for example ``112 / w`` for the velocity.

    Returns
    -------
    Trajectory
        Of the same duration. A heading along the velocity, or from the tilt, follows the polynomials.

    Raises
    ------
    InputError
        If no bound is known for such a path, or the error is not positive.
    ShapeError
        If rounding alone exceeds the error, more than 100,000 pieces are needed, or the spin-up has no length.

    Examples
    --------
    >>> import minsnap
    >>> circle = minsnap.circle(radius=2.0, period=8.0)
    >>> curve = minsnap.as_polynomials(circle, error=1e-6)
    >>> len(curve.durations), bool(abs(curve(5.0) - circle(5.0)).max() < 1e-6)
    (19, True)
    """
    if isinstance(path, Trajectory):
        return path
    if not isinstance(path, PhasePath):
        raise InputError(
            f"no polynomials of a proved error are known for a {type(path).__name__}: give a circle, helix or "
            "lemniscate, or write samples of it"
        )
    knots = _knots(path, check_positive("the error", error, "m", InputError))
    durations, states = np.diff(knots), path.states(np.minimum(knots, path.duration), 4)
    powers = durations[:, None, None] ** np.arange(4)[None, :, None]
    ends = np.concatenate([states[:-1] * powers, states[1:] * powers], axis=1)
    curve = Trajectory(np.einsum("ij,mjd->mid", ends_to_points(SHAPE.degree), ends), durations)
    return curve.with_yaw(path.yaw.by_rule(curve))


def _error_bound(path: PhasePath) -> tuple[Callable[[FloatArray], float], float]:
    r"""Return what bounds the distance over pieces, and how much of it is rounding [m].

    It takes bounds :math:`|\varphi^{(j)}| w^j / j!` of the phase, shape (9, pieces). ``|Re(a exp(ix))|`` is at most the
    spectral norm of the real and the imaginary part of a.
    """
    sizes = np.array([np.linalg.norm(np.stack([a.real, a.imag]), 2) for a in path.harmonics])
    drift, turns = float(np.linalg.norm(path.drift)), np.arange(1, len(sizes) + 1) * path.law.angle
    extent = float(np.linalg.norm(path.center)) + drift * path.law.angle + float(sizes @ (1.0 + turns))
    rounding, sizes, drift = SHAPE.roundings * extent, sizes * (1.0 + 1e-12), drift * (1.0 + 1e-12)

    def bound(phase: FloatArray) -> float:
        waves = [size * _majorant(k * phase) for k, size in enumerate(sizes, 1)]
        return float(np.max(drift * phase[SHAPE.orders] + sum(waves))) + rounding

    return bound, rounding


def _majorant(phase: FloatArray) -> FloatArray:
    r"""Bound of the 8th Taylor coefficient of :math:`e^{i\varphi}`: the recurrence of its terms, with their sizes."""
    terms = np.ones_like(phase)
    for n in range(1, SHAPE.orders + 1):
        terms[n] = sum(j * phase[j] * terms[n - j] for j in range(1, n + 1)) / n
    return np.asarray(terms[SHAPE.orders])


def _spinning(law: PhaseLaw, pieces: int) -> FloatArray:
    """Bounds of the phase's scaled derivatives on equal pieces of the spin-up, by Taylor's formula about their middles.

    Returns
    -------
    ndarray, shape (9, pieces)
    """
    half = 0.5 / pieces
    middles = (2.0 * np.arange(pieces) + 1.0) * half
    sizes = [abs(SPIN_UP.deriv(j)(middles)) * half**j / factorial(j) for j in range(SHAPE.orders + 1)]
    reach = [sum(comb(k, j) * sizes[k] for k in range(j, SHAPE.orders + 1)) for j in range(SHAPE.orders + 1)]
    return law.rate * law.spin_time * np.array(reach) * (1.0 + 1e-12)


def _steady(law: PhaseLaw, pieces: int) -> FloatArray:
    """Return the same on equal pieces of the part at full rate, where only the first derivative is not zero."""
    half = (law.angle - 2.0 * law.ramp) / pieces / 2.0
    return np.array([[0.0], [half], *[[0.0]] * (SHAPE.orders - 1)]) * (1.0 + 1e-12)


def _knots(path: PhasePath, error: float) -> FloatArray:
    law, (bound, rounding) = path.law, _error_bound(path)
    if rounding >= error:
        raise ShapeError(
            f"an error of {error:g} m is not more than rounding, {rounding:.2g} m: "
            "allow more, or give a smaller shape nearer to the origin, or fewer laps"
        )
    if 0.0 < law.spin_time < SHAPE.ramp * law.duration:
        raise ShapeError(
            f"a spin-up of {law.spin_time:.2g} s is too short for polynomials: give ramp=0 or a longer one"
        )
    pieces = _count(lambda n: bound(_spinning(law, n)), error) if law.ramp > 0.0 else 0
    spin = np.linspace(0.0, law.spin_time, pieces + 1)
    down = law.duration - spin[-2::-1]
    if law.duration - 2.0 * law.spin_time <= SHAPE.ramp * law.duration:
        return np.concatenate((spin, down))
    pieces, last = _count(lambda n: bound(_steady(law, n)), error), law.duration - law.spin_time
    while law.duration - last < law.spin_time:  # the last instant at full rate has derivatives free of rounding
        last = nextafter(last, 0.0)
    return np.concatenate((spin, np.linspace(law.spin_time, last, pieces + 1)[1:], down))


def _count(bound: Callable[[int], float], error: float) -> int:
    """Return the number of pieces from which on the bound is at most the error."""
    high = 1
    while bound(high) > error:
        high *= 2
        if high > SHAPE.pieces:
            raise ShapeError(
                f"an error of {error:g} m takes more than {SHAPE.pieces} polynomials: allow more, or give fewer laps"
            )
    return bisect_left(range(high), True, lo=high // 2 + 1, key=lambda n: bound(n) <= error)
