"""What a vehicle meets that fails in a show and comes straight down, while all others fly on.

Until it would have sunk to the ground, it is anywhere below its place that it can have reached, from falling freely
to sinking at a slow speed: what is said does not depend on how it comes down. Distances are taken at instants, and
lowered by how far both can have moved since the nearest of them: a distance that is returned is never more than the
exact one.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from minsnap.basics.arrays import GRAVITY, BoolArray, FloatArray, IntArray
from minsnap.fleet import Fleet, Separation

STEPS = (0.2, 0.02)
"""Time between instants, for all pairs and for those that it decides [s]."""

SINKS = 1.0
"""Slowest speed at which a vehicle that fails comes down, unless the caller says another [m/s]."""


@dataclass(frozen=True, eq=False)
class Failures:
    """What any single vehicle that fails meets, for each whole second.

    Parameters
    ----------
    distances : ndarray, shape (seconds,)
        Proved lower bound of its distance to any other, of the vehicle for which that is least, heights divided by the
        downwash [m]; 0 where it meets one.
    pairs : ndarray of int, shape (seconds, 2)
        Which fails, and whom it comes near.
    clear : ndarray of bool, shape (seconds, vehicles)
        Which may fail and keep their separation from all others, proved.
    """

    distances: FloatArray
    pairs: IntArray
    clear: BoolArray

    @property
    def seconds_apart(self) -> int:
        """For how many seconds any single vehicle may fail."""
        return int(self.clear.all(axis=1).sum())


def failures_of(fleet: Fleet, separation: Separation, sinks: float = SINKS) -> Failures:
    """Return what a vehicle meets that fails at a whole second and comes straight down.

    Parameters
    ----------
    fleet : Fleet
        Two vehicles or more, as they are flown.
    separation : Separation
    sinks : float
        Slowest speed at which it comes down [m/s].
    """
    look = _Look(fleet, separation, sinks)
    found = [look.at(second) for second in range(ceil(fleet.duration) + 1)]
    distances, pairs, clear = zip(*found, strict=True)
    return Failures(np.array(distances), np.array(pairs, dtype=np.intp), np.array(clear))


class _Look:
    """What is the same for all seconds: places of all at coarse instants, and how fast each is at most."""

    def __init__(self, fleet: Fleet, separation: Separation, sinks: float) -> None:
        self._fleet, self._separation, self._sinks = fleet, separation, sinks
        radii = separation.radii_of(len(fleet))
        self._required = radii[:, None] + radii[None, :]
        self._speeds = np.array([curve.max_norm(1)[0] for curve in fleet]) + sinks
        instants = np.arange(0.0, ceil(fleet.duration) + STEPS[0], STEPS[0])
        self._places = np.moveaxis(fleet(np.minimum(instants, fleet.duration)), 0, 1)
        self._floor = float(self._places[..., 2].min())

    def at(self, second: int) -> tuple[float, tuple[int, int], BoolArray]:
        """Return the least distance at a second, of whom, and which may fail."""
        tops = self._fleet(min(float(second), self._fleet.duration))
        lasts = (tops[:, 2] - self._floor) / self._sinks
        away = np.stack([self._coarsely(*each, second) for each in zip(tops, lasts.tolist(), strict=True)])
        np.fill_diagonal(away, np.inf)
        sure = away - 0.5 * STEPS[0] * self._speeds
        most = float((away / self._required).min())
        undecided = (sure < self._required) & (away >= self._required)
        if most >= 1.0:
            undecided |= sure < most * self._required
        for failing, other in np.argwhere(undecided).tolist():
            sure[failing, other] = self._closely(tops[failing], other, second, float(lasts[failing]))
        shares = sure / self._required
        failing, other = (int(i) for i in np.unravel_index(int(shares.argmin()), shares.shape))
        return max(float(sure[failing, other]), 0.0), (failing, other), shares.min(axis=1) >= 1.0

    def _coarsely(self, top: FloatArray, lasts: float, second: int) -> FloatArray:
        """Return the least distance of each from one that fails at a place; seen from above where that is far."""
        first, count = round(second / STEPS[0]), ceil(lasts / STEPS[0]) + 2
        places = self._places[first : first + count]
        places = places if len(places) else self._places[-1:]
        square = (places[..., 0] - top[0]) ** 2
        square += (places[..., 1] - top[1]) ** 2
        away = np.sqrt(square.min(axis=0))
        near = np.flatnonzero(away < self._required.max() + STEPS[0] * self._speeds)
        since: FloatArray = np.asarray(STEPS[0] * np.arange(len(places)))
        away[near] = self._away(top, places[:, near], square[:, near], since[:, None], STEPS[0])
        return np.asarray(away)

    def _closely(self, top: FloatArray, other: int, second: int, lasts: float) -> float:
        since, curve = np.arange(0.0, lasts + STEPS[1], STEPS[1]), self._fleet[other]
        places = curve(np.minimum(second + since, curve.duration))
        away = self._away(top, places, ((places - top)[:, :2] ** 2).sum(axis=1), since, STEPS[1])
        return float(away - 0.5 * STEPS[1] * self._speeds[other])

    def _away(
        self, top: FloatArray, places: FloatArray, square: FloatArray, since: FloatArray, step: float
    ) -> FloatArray:
        """Return the least distance over time (axis 0) of places from where one that fails can be."""
        highest = np.maximum(top[2] - self._sinks * since, self._floor)
        lowest = top[2] - 0.5 * GRAVITY * (since + step) ** 2
        heights = np.maximum(np.maximum(places[..., 2] - highest, lowest - places[..., 2]), 0.0)
        return np.asarray(np.sqrt((square + (heights / self._separation.downwash) ** 2).min(axis=0)))
