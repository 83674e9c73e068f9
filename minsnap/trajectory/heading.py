"""Headings that follow other paths: along the velocity, shifted in time, joined end to end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.arrays import FloatArray
from minsnap.errors import YawError
from minsnap.trajectory.path import ConstantHeading, Heading, Path

RESTING = 1e-6
"""Share of the top speed below which a path counts as resting and its heading is held."""

GRID = 64
"""Instants a polynomial piece at which the turns of the velocity are counted."""


@dataclass(frozen=True, eq=False)
class RemappedHeading:
    """Another heading on another clock: ``yaw(t) = heading(start + rate t)``."""

    heading: Heading
    start: float
    rate: float = 1.0

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
        """Yaw or its derivative at ``t``, in the shape of ``t``."""
        return self.heading(self.start + self.rate * np.asarray(t, dtype=np.float64), order) * self.rate**order


@dataclass(frozen=True, eq=False)
class JoinedHeading:
    """One heading up to an instant, another from there on, turned by whole turns to meet it."""

    first: Heading
    second: Heading
    switch: float

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
        """Yaw or its derivative at ``t``, in the shape of ``t``."""
        instants = np.asarray(t, dtype=np.float64)
        before = self.first(np.minimum(instants, self.switch), order)
        after = self.second(np.maximum(instants - self.switch, 0.0), order)
        return np.where(instants < self.switch, before, after + (self._turns() if order == 0 else 0.0))

    def _turns(self) -> float:
        gap = float(self.first(self.switch) - self.second(0.0))
        return 2.0 * np.pi * round(gap / (2.0 * np.pi))


class VelocityHeading:
    r"""Yaw along the horizontal velocity, continuous over the whole path.

    :math:`\psi = \operatorname{atan2}(v_y, v_x)`,
    :math:`\dot\psi = (v_x a_y - v_y a_x) / (v_x^2 + v_y^2)`.  Where the path rests (slower than ``RESTING`` of its
    top speed) the heading is held, going over linearly from how it arrives to how it leaves.

    Parameters
    ----------
    path : Path
        Anything with a horizontal velocity: dim 2 or more.

    Raises
    ------
    YawError
        If the path has fewer than two coordinates or never moves horizontally.
    """

    def __init__(self, path: Path) -> None:
        if path.dim < 2:
            raise YawError("a yaw along the velocity needs at least two coordinates, this path has one")
        self._path = path
        grid = _turning_grid(path)
        speed = np.linalg.norm(path(grid, 1)[:, :2], axis=1)
        if not speed.max() > 0.0:
            raise YawError("a yaw along the velocity needs a horizontal velocity, and this path has none")
        self._slow = RESTING * float(speed.max())
        moving = speed > self._slow
        self._grid = grid[moving]
        self._angle = np.unwrap(_angle(path(self._grid, 1)))

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
        """Yaw, yaw rate or yaw acceleration (order 0, 1, 2) at ``t``, in the shape of ``t``.

        Raises
        ------
        YawError
            For a higher order.
        """
        if order > 2:
            raise YawError(f"a yaw along the velocity has derivatives up to order 2, not {order}")
        instants = np.asarray(t, dtype=np.float64)
        flat = np.minimum(instants.reshape(-1), self._path.duration)
        velocity = self._path(flat, 1)[:, :2]
        moving = np.linalg.norm(velocity, axis=1) > self._slow
        value = self._held(flat, order)
        value[moving] = self._turning(flat[moving], velocity[moving], order)
        return value.reshape(instants.shape)

    def _held(self, t: FloatArray, order: int) -> FloatArray:
        return np.interp(t, self._grid, self._angle) if order == 0 else np.zeros(len(t))

    def _turning(self, t: FloatArray, velocity: FloatArray, order: int) -> FloatArray:
        if order == 0:
            near = np.interp(t, self._grid, self._angle)
            raw = _angle(velocity)
            return np.asarray(raw + 2.0 * np.pi * np.round((near - raw) / (2.0 * np.pi)))
        acceleration = self._path(t, 2)[:, :2]
        square = (velocity**2).sum(axis=1)
        rate = _cross(velocity, acceleration) / square
        if order == 1:
            return np.asarray(rate)
        jerk = self._path(t, 3)[:, :2]
        along = (velocity * acceleration).sum(axis=1)
        return np.asarray(_cross(velocity, jerk) / square - 2.0 * rate * along / square)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _angle(velocity: FloatArray) -> FloatArray:
    return np.arctan2(velocity[:, 1], velocity[:, 0])


def _turning_grid(path: Path) -> FloatArray:
    breaks = getattr(path, "breaks", None)
    if breaks is None:
        return np.linspace(0.0, path.duration, 4096)
    inner = breaks[:-1, None] + np.diff(breaks)[:, None] * (np.arange(GRID) / GRID)
    return np.append(inner.reshape(-1), path.duration)


def shortest_turns(angles: npt.ArrayLike) -> FloatArray:
    """Unwrap yaw angles so that every step is the shortest way round: shape (n,) [rad]."""
    return np.unwrap(np.asarray(angles, dtype=np.float64))


def wrap(angle: npt.ArrayLike) -> FloatArray:
    """Bring angles of any shape into [-pi, pi) [rad], for the formats that want it."""
    return np.asarray((np.asarray(angle, dtype=np.float64) + np.pi) % (2.0 * np.pi) - np.pi)


__all__ = [
    "ConstantHeading",
    "JoinedHeading",
    "RemappedHeading",
    "VelocityHeading",
    "shortest_turns",
    "wrap",
]
