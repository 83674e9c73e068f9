"""The protocol of a path, polynomial or not: code that only evaluates takes any path."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from importlib import import_module
from typing import Any

import numpy as np

from minsnap.basics.arrays import LARGEST, ArrayLike, FloatArray, owned
from minsnap.basics.checks import check_positive, is_whole
from minsnap.basics.storage.text import FileName
from minsnap.errors import InputError, TimingError
from minsnap.trajectory.heading import ZERO_YAW, Heading
from minsnap.trajectory.instants import as_instants, check_order, within
from minsnap.trajectory.samples import VECTORS, Samples

MOST_SAMPLES = 20_000_000
"""Instants on which a path is sampled at most: 6 hours at 1 kHz, 2 GB."""


ELSEWHERE = {
    **{f"max_{kind}": f"minsnap.certify(path).max_{kind}" for kind in ("speed", "acceleration", "jerk")},
    **dict.fromkeys(("time", "total_time", "T"), "path.duration"),
    **dict.fromkeys(("pos", "evaluate", "eval", "get_position", "get_point", "at"), "path(t), or path.position(t)"),
    **dict.fromkeys(("vel", "speed", "get_velocity"), "path.velocity(t), or path(t, 1)"),
    **dict.fromkeys(("acc", "accel", "get_acceleration"), "path.acceleration(t), or path(t, 2)"),
    **dict.fromkeys(("attitude", "quaternion", "rpy", "thrust"), "minsnap.vehicle.flatness_of(vehicle, path, t)"),
    **dict.fromkeys(("to_dataframe", "to_pandas", "dataframe"), "path.sample(rate=20).to_dataframe()"),
    "jerk": "path(t, 3)",
    "snap": "path(t, 4)",
    "yaw_rate": "path.yaw(t, 1)",
    **dict.fromkeys(("times", "knots", "timestamps"), "path.breaks, or path.leg_breaks at the waypoints"),
    **dict.fromkeys(("coefficients", "coeffs", "coefs", "polynomials"), "path.control_points, or path.to_ppoly().c"),
    **dict.fromkeys(("length", "distance"), "path.arc_length()"),
    **dict.fromkeys(("write", "write_csv", "export"), "path.save(file), or path.to_csv(file)"),
    **dict.fromkeys(("certificate", "certify", "ok"), "minsnap.certify(path)"),
}
"""What others call what a path has, and what it is here."""


class Path(ABC):
    """A curve over [0, duration] with all the derivatives its users need.

    Implementations give ``duration``, ``dim``, ``yaw`` and ``_evaluate``; calling, checking and sampling are shared.
    """

    __slots__ = ("__weakref__",)

    yaw: Heading = ZERO_YAW

    def __getattr__(self, name: str) -> Any:
        """Raise AttributeError with what is meant by a name that others have for it."""
        hint = f": it is {ELSEWHERE[name]}" if name in ELSEWHERE else ""
        raise AttributeError(f"{type(self).__name__} has no {name}{hint}", name=name, obj=self)

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

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
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
        inside = within(instants, self.duration)
        return self._evaluate(inside, check_order(order)).reshape(*instants.shape, self.dim)

    def states(self, t: ArrayLike, orders: int) -> FloatArray:
        """Position and its derivatives below an order, at any instants.

        Parameters
        ----------
        t : array_like, any shape
            Instants [s] in [0, duration].
        orders : int
            Number of them, at least 1: with 3 position, velocity and acceleration.

        Returns
        -------
        ndarray, shape t.shape + (orders, dim)

        Raises
        ------
        IntervalError
            If an instant is outside [0, duration] or not a number, or ``orders`` is not a whole number from 1 on.
        """
        check_order(orders - 1 if is_whole(orders) else orders)
        return np.stack([self(t, order) for order in range(orders)], axis=-2)

    def position(self, t: ArrayLike) -> FloatArray:
        """Return positions at instants of any shape [s], shape t.shape + (dim,) [m]."""
        return self(t)

    def velocity(self, t: ArrayLike) -> FloatArray:
        """Return velocities at instants of any shape [s], shape t.shape + (dim,) [m/s]."""
        return self(t, 1)

    def acceleration(self, t: ArrayLike) -> FloatArray:
        """Return accelerations at instants of any shape [s], shape t.shape + (dim,) [m/s^2]."""
        return self(t, 2)

    def plot(self, **drawn: Any) -> Any:
        """Draw the path and its profiles; see :func:`minsnap.plot.plot_overview`, which takes the same keywords.

        Returns
        -------
        matplotlib Figure
        """
        return _outside("plot").plot_overview(self, **drawn)

    def save(self, path: FileName, **how: Any) -> None:
        """Write the path in the format of the file's ending; see :func:`minsnap.files.convert.write_any`.

        ``.json`` and ``.npz`` keep the polynomials, ``.csv`` holds setpoints at 20 Hz; the page on formats names all.

        Raises
        ------
        FileError
            If no format has that ending, or the file cannot be written.
        """
        _outside("files.convert").write_any(self, path, **how)

    def to_csv(self, path: FileName, rate: float = 20.0, frame: str = "enu") -> None:
        """Write setpoints; see :func:`minsnap.write_csv`."""
        _outside("files.setpoint_csv").write_csv(self, path, rate, frame)

    def _is_like(self, other: Path) -> bool:
        """Whether another path is this one."""
        return other is self

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
        return self.sampled(sample_times(self.duration, rate))

    def sampled(self, t: ArrayLike) -> Samples:
        """Evaluate position to snap, yaw and yaw rate at increasing instants (m,) [s]; past the end, that at it."""
        instants = owned(t)
        inside = np.minimum(instants, self.duration)
        motion: dict[str, Any] = {name: self(inside, order) for order, name in enumerate(VECTORS[:5])}
        return Samples(instants, **motion, yaw=self.yaw(inside), yaw_rate=self.yaw(inside, 1))

    def _repr_html_(self) -> str:
        """Return the card of a notebook: a small drawing, and the facts."""
        from minsnap.trajectory.report import path_card

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


def _outside(room: str) -> Any:
    """Return a room that takes paths: what users look for at a path is loaded when it is asked for."""
    return import_module(f"minsnap.{room}")
