"""What every path answers, polynomial or not, so that whatever only evaluates takes any path."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import LARGEST, FloatArray, numbers
from minsnap.basics.checks import check_positive, is_number, is_whole
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import ROUNDING
from minsnap.errors import InputError, IntervalError, TimingError, YawError
from minsnap.trajectory.samples import Samples

MOST_SAMPLES = 20_000_000
"""Instants on which a path is sampled at most: 6 hours at 1 kHz, 2 GB."""


class Heading(Protocol):
    """Yaw of a path as a function of time [rad], continuous (never wrapped)."""

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
        """Yaw (order 0) or its derivative at ``t``: any shape in, the same shape out."""
        ...


class ConstantHeading:
    """A yaw that does not change.

    Parameters
    ----------
    angle : float
        Yaw [rad].
    """

    def __init__(self, angle: float = 0.0) -> None:
        if not is_number(angle):
            raise YawError(f"the yaw is {shown(angle)}: it must be an angle in radians")
        self.angle = float(angle)

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
        """Return ``angle`` for order 0 and zero for every derivative, in the shape of ``t``."""
        return np.full(as_instants(t).shape, self.angle if check_order(order) == 0 else 0.0)

    def __repr__(self) -> str:
        return f"ConstantHeading({shown(self.angle)})"


class Path(ABC):
    """A curve over [0, duration] with all the derivatives its users need.

    Implementations give ``duration``, ``dim``, ``yaw`` and ``evaluate``; calling, checking and sampling are shared.
    """

    yaw: Heading = ConstantHeading()

    @property
    @abstractmethod
    def duration(self) -> float:
        """Length of the interval [s]."""

    @property
    @abstractmethod
    def dim(self) -> int:
        """Number of coordinates."""

    @abstractmethod
    def _evaluate(self, t: FloatArray, order: int) -> FloatArray:
        """Return the derivative of that order at instants of shape (m,), all inside: (m, dim)."""

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
        """Position, or a derivative of it, at any instants.

        Parameters
        ----------
        t : array_like, any shape
            Instants [s] in [0, duration].
        order : int
            0 position, 1 velocity, 2 acceleration, …

        Returns
        -------
        ndarray, shape t.shape + (dim,)

        Raises
        ------
        IntervalError
            If an instant is outside [0, duration] or not a number.
        """
        instants = as_instants(t)
        flat = instants.reshape(-1)
        check_instants(flat, self.duration)
        inside = np.clip(flat, 0.0, self.duration)
        return self._evaluate(inside, check_order(order)).reshape(*instants.shape, self.dim)

    def as_trajectory(self) -> Any:
        """Return the path as a :class:`~minsnap.Trajectory`, piecewise polynomials.

        Raises
        ------
        InputError
            If no polynomials are known for such a path.
        """
        raise InputError(f"no polynomials are known for a {type(self).__name__}: write samples of it instead")

    def then(self, other: Path) -> Any:
        """Fly ``other`` after this path; both as trajectories."""
        return self.as_trajectory().then(other)

    def sample(self, rate: float = 20.0) -> Samples:
        """Evaluate on the grid 0, 1/rate, 2/rate, …; the last sample is the end state.

        Where the duration is not a whole number of steps the grid ends one step past it, and that last sample
        still is the state at the end.

        Parameters
        ----------
        rate : float
            Samples per second [Hz], positive.

        Returns
        -------
        Samples
            Position to snap, yaw and yaw rate.

        Raises
        ------
        TimingError
            If the rate is not a positive number.
        """
        grid = sample_times(self.duration, rate)
        inside = np.minimum(grid, self.duration)
        position, velocity, acceleration, jerk, snap = (self(inside, order) for order in range(5))
        yaw, yaw_rate = self.yaw(inside), self.yaw(inside, 1)
        return Samples(grid, position, velocity, acceleration, jerk, snap, yaw, yaw_rate)

    def _repr_html_(self) -> str:
        """Return what a notebook shows: a small drawing, and the facts."""
        from minsnap.trajectory.path_card import path_card

        return path_card(self)


def sample_times(duration: float, rate: float) -> FloatArray:
    """Return the uniform grid k/rate from 0 to the first instant at or past the duration, shape (m,) [s]."""
    known = LARGEST if isinstance(rate, float) and LARGEST < rate < math.inf else rate
    exact = duration * check_positive("the rate", known, "samples per second", TimingError)
    if not exact <= MOST_SAMPLES:
        raise TimingError(
            f"{rate:g} Hz for {duration:g} s are {exact:.3g} samples: at most {MOST_SAMPLES:.0e} are made"
        )
    steps = round(exact) if abs(exact - round(exact)) <= 1e-9 * max(1.0, exact) else math.ceil(exact)
    return np.arange(max(steps, 1) + 1) / float(rate)


def as_instants(t: npt.ArrayLike) -> FloatArray:
    """Return instants of any shape, or raise IntervalError where they are no numbers."""
    instants = numbers(t, copy=False)
    if instants is None:
        raise IntervalError(f"the instants are {shown(t)}: give numbers of seconds")
    return instants


def within(t: FloatArray, duration: float) -> FloatArray:
    """Return instants as (m,), those outside [0, duration] at its ends; IntervalError where one is not a number."""
    flat = t.reshape(-1)
    if np.isnan(flat).any():
        raise IntervalError("an instant is not a number: give seconds")
    return np.asarray(np.clip(flat, 0.0, duration))


def check_instants(t: FloatArray, duration: float) -> None:
    """Raise IntervalError unless every instant of shape (m,) is in [0, duration], but for rounding."""
    slack = ROUNDING * duration
    if t.size and not (t.min() >= -slack and t.max() <= duration + slack):
        bad = t[~((t >= -slack) & (t <= duration + slack))][0]
        raise IntervalError(f"t = {bad} s is outside the path's interval [0, {duration}] s")


def check_order(order: int) -> int:
    """Return the derivative order as an int, or raise IntervalError if it is not a whole number >= 0."""
    if not is_whole(order) or order < 0:
        raise IntervalError(f"order is {shown(order)}: the order of a derivative is a whole number, 0 or more")
    return int(order)
