"""Headings on another clock or joined end to end, and angles unwrapped and wrapped."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.trajectory.path import ConstantHeading, Heading, as_instants


@dataclass(frozen=True, eq=False)
class RemappedHeading:
    """Another heading on another clock: ``yaw(t) = heading(start + rate t)``."""

    heading: Heading
    start: float
    rate: float = 1.0

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
        """Yaw or its derivative at ``t``, in the shape of ``t``."""
        return self.heading(self.start + self.rate * as_instants(t), order) * self.rate**order


def remapped(heading: Heading, start: float, rate: float = 1.0) -> Heading:
    """Return a heading on another clock: ``yaw(t) = heading(start + rate t)``, however often that was done before."""
    if isinstance(heading, ConstantHeading):
        return heading
    if isinstance(heading, RemappedHeading):
        return RemappedHeading(heading.heading, heading.start + heading.rate * start, heading.rate * rate)
    return RemappedHeading(heading, start, rate)


@dataclass(frozen=True, eq=False)
class JoinedHeading:
    """One heading up to an instant, another from there on, turned by whole turns to meet it."""

    first: Heading
    second: Heading
    switch: float

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
        """Yaw or its derivative at ``t``, in the shape of ``t``."""
        instants = as_instants(t)
        before = self.first(np.minimum(instants, self.switch), order)
        after = self.second(np.maximum(instants - self.switch, 0.0), order)
        return np.where(instants < self.switch, before, after + (self._turns() if order == 0 else 0.0))

    def _turns(self) -> float:
        gap = float(self.first(self.switch) - self.second(0.0))
        return 2.0 * np.pi * round(gap / (2.0 * np.pi))


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
    "remapped",
    "shortest_turns",
    "wrap",
]
