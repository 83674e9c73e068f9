"""Take-off and landing in turn: homes that are nearer to each other than vehicles may be in flight.

Vehicles are divided into groups, in each of which all homes are apart. The first group climbs highest; the next leaves
the ground as soon as it stays below the one before it by what both need, and ends lower by as much. A landing is a
climb backwards. Nobody waits for another to arrive, so that all take hardly longer than the highest climb.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.errors import FleetError
from minsnap.fleet import Separation
from minsnap.limits import Limits
from minsnap.planning import plan
from minsnap.trajectory import Trajectory

SLACK = 1e-3
"""Share of a height by which vehicles are farther apart than they must be: instants are found between samples."""

SAMPLES = 2000
"""Instants at which the heights of two groups are compared; what flies is proved."""

FAINT = 1e-9
"""A wait that is none [s]."""

HALVINGS = 40
"""Of the interval in which a group leaves."""


@dataclass(frozen=True, eq=False)
class ClimbTurns:
    """Groups that climb one after the other.

    Parameters
    ----------
    group : ndarray of int, shape (vehicles,)
        Of each vehicle; 0 climbs first and highest.
    tops : ndarray, shape (vehicles,)
        Height at which the climb of each ends [m].
    below : ndarray, shape (groups, groups)
        How far a later group stays below an earlier one, counted from their homes [m]; minus infinity where none of
        their homes are near.
    """

    group: IntArray
    tops: FloatArray
    below: FloatArray

    def climbs(self, home: FloatArray, limits: Limits) -> list[Trajectory]:
        """Return the curve of each vehicle from its home to its top, all of one duration, those that wait included.

        Parameters
        ----------
        home : ndarray, shape (vehicles, 3)
            [m].
        limits : Limits
        """
        ways = self.tops - home[:, 2]
        climbs = [_climb(float(ways[self.group == each].max()), limits) for each in range(len(self.below))]
        leaves = self._leaves(climbs)
        end = max(left + climb.duration for left, climb in zip(leaves, climbs, strict=True))
        return [
            _placed(climbs[each], place, float(top), leaves[each], end)
            for each, place, top in zip(self.group.tolist(), home, self.tops.tolist(), strict=True)
        ]

    def _leaves(self, climbs: list[Trajectory]) -> list[float]:
        """Return when each group leaves the ground, as early as it stays below all before it [s]."""
        leaves = [0.0]
        for late in range(1, len(climbs)):
            earliest = leaves[-1]
            for early in range(late):
                if np.isfinite(self.below[early, late]):
                    needed = float(self.below[early, late]) - FAINT
                    earliest = max(earliest, leaves[early] + _wait(climbs[early], climbs[late], needed))
            leaves.append(earliest)
        return leaves


def turns_of(home: FloatArray, separation: Separation, height: float, layer: float | None) -> ClimbTurns | None:
    """Return groups of vehicles that climb in turn; None where all homes are apart.

    Parameters
    ----------
    home : ndarray, shape (vehicles, 3)
        [m].
    separation : Separation
    height : float
        At which the lowest group ends above its homes [m].
    layer : float or None
        Least height between groups that are near each other; more where the separation asks for it [m]. None: so much
        that their ends are apart by root two of the separation, from where straight flights are apart.
    """
    flat = np.linalg.norm(home[:, None, :2] - home[None, :, :2], axis=2)
    radii = separation.radii_of(len(home))
    asked = radii[:, None] + radii[None, :]
    near = (flat < asked) & ~np.eye(len(home), dtype=bool)
    if separation.ground is None or not near.any():
        return None
    # With downwash what is kept free is an ellipsoid, `asked` wide and `downwash` times as high. Two vehicles that are
    # `flat` apart, seen from above, keep it from the height on that its surface has there.
    group = _coloured(near)
    rise = separation.downwash * np.sqrt(np.maximum(asked * asked - flat * flat, 0.0)) * (1.0 + SLACK)
    wider = separation.downwash * np.sqrt(2.0 * asked * asked - flat * flat * near) if layer is None else layer
    between = np.where(near, np.maximum(rise, wider), -np.inf) + home[None, :, 2] - home[:, None, 2]
    needed = np.where(near, rise + home[None, :, 2] - home[:, None, 2], -np.inf)  # of the row above the column
    count = int(group.max()) + 1
    below, layers = np.full((2, count, count), -np.inf)
    for early in range(count):
        for late in range(early + 1, count):
            pairs = np.ix_(group == early, group == late)
            below[early, late], layers[early, late] = needed[pairs].max(), between[pairs].max()
    tops = np.zeros(count)
    for early in range(count - 1, -1, -1):  # the last one is lowest
        tops[early] = max([height, *(tops[early + 1 :] + layers[early, early + 1 :]).tolist()])
    return ClimbTurns(group, home[:, 2] + tops[group], below)


def _coloured(near: np.ndarray[tuple[int, int], np.dtype[np.bool_]]) -> IntArray:
    """Return groups without two that are near: each vehicle takes the first that is free, in order of saturation."""
    count = len(near)
    group, taken = np.full(count, -1, dtype=np.intp), np.zeros((count, count), dtype=bool)
    degrees = near.sum(axis=1)
    for _ in range(count):
        saturation = np.where(group < 0, taken.sum(axis=1) * (count + 1) + degrees, -1)
        vehicle = int(saturation.argmax())
        group[vehicle] = int(np.flatnonzero(~taken[vehicle])[0])
        taken[near[vehicle], group[vehicle]] = True
    return group


def _climb(way: float, limits: Limits) -> Trajectory:
    if not way > 0.0:
        raise FleetError("homes nearer than the separation are left in turn, in layers: give take_off a height")
    return plan([(0.0, 0.0, 0.0), (0.0, 0.0, way)], limits=limits)


def _wait(early: Trajectory, late: Trajectory, needed: float) -> float:
    """Return how long after the first a second climb begins that stays below it by so much [s]."""
    instants = np.linspace(0.0, early.duration + late.duration, SAMPLES)
    first = early(np.minimum(instants, early.duration))[:, 2]
    low, high = 0.0, early.duration
    for _ in range(HALVINGS):
        wait = 0.5 * (low + high)
        second = late(np.clip(instants - wait, 0.0, late.duration))[:, 2]
        apart = (first - second)[instants >= wait].min() >= needed and early(wait)[2] >= needed
        low, high = (low, wait) if apart else (wait, high)
    return high


def _placed(climb: Trajectory, place: FloatArray, top: float, leaves: float, end: float) -> Trajectory:
    """Return a climb from a place to a height, with what it waits before and after."""
    points = place + climb.control_points
    points[-1, -1] = (*place[:2], top)
    first, last = (np.tile(each, (1, points.shape[1], 1)) for each in (place, points[-1, -1]))
    parts, lasts = [points], [climb.durations]
    if leaves > FAINT:
        parts, lasts = [first, *parts], [np.array([leaves]), *lasts]
    if end - leaves - climb.duration > FAINT:
        parts, lasts = [*parts, last], [*lasts, np.array([end - leaves - climb.duration])]
    return Trajectory(np.concatenate(parts), np.concatenate(lasts))


def backwards(curve: Trajectory) -> Trajectory:
    """Return a curve flown from its end to its start."""
    return Trajectory(curve.control_points[::-1, ::-1], curve.durations[::-1])
