"""Returns from every second of a show: how all fly home when they are called, proved apart from each other.

All stand where the show is at that second; vehicles that were moving swing out and back meanwhile. Then each flies a
straight line to a point above a home, the assignment that of least squared ways, and comes down there. The lines end
at one height, below which nobody flies: a vehicle that has arrived is then nowhere nearer to one that is still on its
way than at the top of its own column, however fast it descends.

Where two come too near, one waits for longer: the other one, if it has not left yet; the first, if it has arrived. A
second for which no such delays are found has no plan: a vehicle called then flies on to the next one that has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import ceil, floor, inf
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.tolerances import EXACT
from minsnap.files.formats import ReturnEntry, return_bytes
from minsnap.fleet import Fleet, Separation, assign, table_of, trapezoid
from minsnap.limits import ORDINARY, Limits
from minsnap.native import FleetArrays, NearPairs, near_pairs
from minsnap.polynomials import elevate
from minsnap.shows.formations import spacing_of


@dataclass(frozen=True)
class ReturnSettings:
    """How returns are planned.

    Parameters
    ----------
    margin : float
        How much farther apart than asked all stay, where the homes are: Skybrush's firmware rounds to whole units and
        milliseconds [m].
    still : float
        Speed below which a vehicle stands [m/s].
    column : float
        How far beside its home a vehicle is that lands where it is [m].
    rounds : int
        How often delays are changed for one second, at most.
    longest : int
        Longest wait [s].
    even : float
        How far apart the heights of all may be that return at their own [m].
    """

    margin: float = 0.02
    still: float = 1e-6
    column: float = 0.05
    rounds: int = 60
    longest: int = 120
    even: float = 5e-3


RETURNS = ReturnSettings()

SWING = 5.3
"""Greatest acceleration of a curve of degree 7 from a speed to rest in the same place, over speed and time."""

CEILING = 65.535
"""Greatest acceleration that a file of Skybrush can say [m/s^2]."""


@dataclass(frozen=True, eq=False)
class ReturnPlan:
    """How all return from one second.

    Parameters
    ----------
    second : int
        Of the show.
    starts : ndarray, shape (vehicles, 3)
        Where they are then [m].
    homes : ndarray of int, shape (vehicles,), or None
        To whose home each flies; None: all land where they are.
    goals : ndarray, shape (vehicles, 3)
        Where their lines end [m].
    waits : ndarray of int, shape (vehicles,)
        How long each stands before its line [s].
    lasts : int
        How long each line takes [s].
    distance : float
        Proved least distance of any two, heights divided by the downwash [m]; infinite for one vehicle.
    pair : tuple of int or None
        Which two these are.
    """

    second: int
    starts: FloatArray = field(repr=False)
    homes: IntArray | None = field(repr=False)
    goals: FloatArray = field(repr=False)
    waits: IntArray = field(repr=False)
    lasts: int
    distance: float
    pair: tuple[int, int] | None

    @property
    def duration(self) -> int:
        """Until the last one is above its home [s]."""
        return int(self.waits.max()) + self.lasts

    def entry(self, vehicle: int, homes: FloatArray) -> ReturnEntry:
        """Return what a vehicle does, with homes (vehicles, 3) [m]."""
        if self.homes is None:
            return ReturnEntry(self.second)
        x, y, z = homes[self.homes[vehicle]].tolist()
        return ReturnEntry(self.second, (x, y, z), float(self.goals[vehicle, 2]), int(self.waits[vehicle]), self.lasts)


@dataclass(frozen=True, eq=False)
class Returns:
    """Returns of a show.

    Parameters
    ----------
    plans : tuple of ReturnPlan
        Of the seconds for which there is one, ascending.
    unproved : tuple of int
        Seconds for which none was found.
    acceleration : float
        Of the lines [m/s^2].
    homes : ndarray, shape (vehicles, 3)
        [m].
    """

    plans: tuple[ReturnPlan, ...] = field(repr=False)
    unproved: tuple[int, ...]
    acceleration: float
    homes: FloatArray = field(repr=False)

    def entries(self, vehicle: int) -> tuple[ReturnEntry, ...]:
        """Return what a vehicle does from each second that has a plan."""
        return tuple(plan.entry(vehicle, self.homes) for plan in self.plans)

    def level_plan(self, vehicle: int) -> dict[str, Any]:
        """Return the plan of a vehicle in a ``.skyc``: landings, and flights at the height that it has."""
        return {"version": 1, "entries": [entry.level_json() for entry in self.entries(vehicle)]}

    def block(self, vehicle: int) -> bytes:
        """Return the block of a vehicle in a binary Skybrush show."""
        return return_bytes(self.entries(vehicle), self.acceleration)

    @property
    def least(self) -> ReturnPlan | None:
        """The plan in which two come nearest; None for one vehicle."""
        near = [plan for plan in self.plans if plan.pair is not None]
        return min(near, key=lambda plan: plan.distance) if near else None

    @property
    def longest_wait(self) -> int:
        """Longest time from a call to a second that has a plan [s]."""
        seconds = [-1, *(plan.second for plan in self.plans)]
        return int(np.diff(seconds).max())


def plan_returns(
    fleet: Fleet,
    separation: Separation,
    limits: Limits,
    height: float,
    told: Callable[[int, int], None] | None = None,
    level: bool = False,
) -> Returns:
    """Plan how all return from every whole second of a show.

    Parameters
    ----------
    fleet : Fleet
        The show as it is flown, which begins at home.
    separation : Separation
    limits : Limits
        Speed and acceleration of the lines.
    height : float
        Above the homes at which lines end, at most; lower where a vehicle is lower [m].
    told : callable, optional
        Is told each second, and how many there are.
    level : bool
        Whether all keep their heights on their lines, as a ``.skyc`` says returns: only seconds at which all are at one
        height have a plan then. It is proved at one speed throughout too, since a ``.skyc`` says no acceleration.
    """
    homes = np.stack([curve(0.0) for curve in fleet])
    ends = np.stack([curve(curve.duration) for curve in fleet])
    search = _ReturnSearch(homes, ends, separation, limits, height, level)
    plans, unproved, last = [], [], ceil(fleet.duration)
    instants = np.minimum(np.arange(last + 1), fleet.duration)
    states = np.stack([fleet(instants, order) for order in range(4)], axis=2)  # (vehicles, seconds, 4, 3)
    for second in range(last + 1):
        plan = search.plan(second, states[:, second])
        if plan is None:
            unproved.append(second)
        else:
            plans.append(plan)
        if told is not None:
            told(second, last)
    return Returns(tuple(plans), tuple(unproved), search.acceleration, homes)


class _ReturnSearch:
    """What is the same for all seconds."""

    def __init__(
        self, homes: FloatArray, ends: FloatArray, separation: Separation, limits: Limits, height: float, level: bool
    ) -> None:
        table = table_of(limits)
        self._ends, self._level = ends, level
        self._homes, self._separation, self._height, self._table = homes, separation, height, table
        hardest = float(table[1].min())
        self.acceleration = floor(1e3 * min(hardest if hardest < inf else ORDINARY["acceleration"], CEILING)) / 1e3
        self._radii = separation.radii_of(len(homes)) * (1.0 - EXACT)
        if len(homes) > 1:
            least, pair = spacing_of(separation.flat(homes))
            self._radii += 0.5 * min(RETURNS.margin, max(least - separation.between(*pair), 0.0))

    def plan(self, second: int, states: FloatArray) -> ReturnPlan | None:
        """Return the plan for one second, shape of states (vehicles, 4, 3); None if none is found."""
        starts, count = states[:, 0], len(states)
        beside = np.linalg.norm(starts[:, None, :2] - self._homes[None, :, :2], axis=2)
        nearest = beside.argmin(axis=1)
        if beside.min(axis=1).max() <= RETURNS.column and len(set(nearest.tolist())) == count:
            return self._landing(second, starts)
        if np.linalg.norm((starts - self._ends)[:, :2], axis=1).max() <= RETURNS.column:
            landing = self._landing(second, starts)
            if landing.distance >= 2.0 * float(self._radii.max()) * (1.0 - EXACT):
                return landing
        if self._level and np.ptp(starts[:, 2]) > RETURNS.even:
            return None
        level = min(float(self._homes[:, 2].max()) + (inf if self._level else self._height), float(starts[:, 2].min()))
        tops = np.column_stack((self._homes[:, :2], np.full(count, level))).round(3)
        order = np.asarray(assign(self._separation.flat(starts), self._separation.flat(tops)))
        goals, swing = tops[order], self._swing(states)
        if self._level:
            goals[:, 2] = starts[:, 2]
        lasts = self._lasts(goals - starts)
        waits = np.full(count, swing)
        if count == 1:
            return ReturnPlan(second, starts, order, goals, waits, lasts, inf, None)
        for _ in range(RETURNS.rounds):
            curves = self._curves(states, goals, waits, lasts, swing)
            pairs = near_pairs(curves, self._radii, self._separation.downwash, 1.0, False, 1)
            if not len(pairs.pairs) and self._level:
                curves = self._curves(states, goals, waits, lasts, swing, uniform=True)
                pairs = near_pairs(curves, self._radii, self._separation.downwash, 1.0, False, 1)
            if not len(pairs.pairs):
                nearest_pair = near_pairs(curves, self._radii, self._separation.downwash, 1.0, True, 1)
                return self._found(second, starts, order, goals, waits, lasts, nearest_pair)
            if (pairs.instant <= swing).any():  # they swing out into each other: nothing here changes that
                return None
            later = self._later(pairs.pairs, pairs.instant, waits, lasts, np.linalg.norm(goals - starts, axis=1))
            waits = waits + later
            if waits.max() > RETURNS.longest:
                return None
        return None

    def _found(
        self,
        second: int,
        starts: FloatArray,
        order: IntArray,
        goals: FloatArray,
        waits: IntArray,
        lasts: int,
        pairs: NearPairs,
    ) -> ReturnPlan:
        distance, pair = inf, None
        if len(pairs.pairs):
            which = int(pairs.least.argmin())
            distance, pair = float(pairs.least[which]), (int(pairs.pairs[which, 0]), int(pairs.pairs[which, 1]))
        return ReturnPlan(second, starts, order, goals, waits.astype(np.int64), lasts, distance, pair)

    def _landing(self, second: int, starts: FloatArray) -> ReturnPlan:
        """Return the plan of vehicles that are above where they land: straight down, apart as seen from above."""
        flat = np.linalg.norm(starts[:, None, :2] - starts[None, :, :2], axis=2)
        np.fill_diagonal(flat, inf)
        pair, distance = None, float(flat.min()) if len(flat) > 1 else inf
        if len(flat) > 1:
            one, two = np.unravel_index(int(flat.argmin()), flat.shape)
            pair = (int(min(one, two)), int(max(one, two)))
        waits = np.zeros(len(starts), dtype=np.int64)
        return ReturnPlan(second, starts, None, starts, waits, 0, distance, pair)

    def _swing(self, states: FloatArray) -> int:
        """Return for how many seconds all stand before the first line."""
        speeds = np.linalg.norm(states[:, 1], axis=1).max()
        return ceil(SWING * speeds / self.acceleration) if speeds > RETURNS.still else 0

    def _lasts(self, ways: FloatArray) -> int:
        """Return how long lines take so that the longest keeps the limits [s]."""
        norms = np.linalg.norm(ways, axis=1)
        parts = np.column_stack((np.abs(ways), norms, np.linalg.norm(ways[:, :2], axis=1)))  # as in the table
        ratios = np.divide(norms[:, None], parts, out=np.full_like(parts, inf), where=parts > 0.0)
        speeds = (self._table[0] * ratios).min(axis=1)
        each = zip(norms.tolist(), speeds.tolist(), strict=True)
        least = max(trapezoid(way, speed, self.acceleration) for way, speed in each)
        return max(1, ceil(least * (1.0 + 1e-9)))

    def _later(self, pairs: IntArray, instants: FloatArray, waits: IntArray, lasts: int, ways: FloatArray) -> IntArray:
        """Return by how much each is to wait longer [s]."""
        later = np.zeros(len(waits), dtype=np.int64)
        for (one, two), instant in zip(pairs.tolist(), instants.tolist(), strict=True):
            stands = [instant < waits[each] for each in (one, two)]
            arrived = [instant > waits[each] + lasts for each in (one, two)]
            if stands[0] != stands[1]:
                which = two if stands[0] else one
            elif arrived[0] != arrived[1]:
                which = one if arrived[0] else two
            else:
                which = one if ways[one] > ways[two] else two
            later[which] = 1
        return later

    def _curves(
        self,
        states: FloatArray,
        goals: FloatArray,
        waits: IntArray,
        lasts: int,
        swing: int,
        uniform: bool = False,
    ) -> FleetArrays:
        """Return the curves of all: standing or swinging, speeding up, at one speed, slowing down, standing.

        ``uniform``: at one speed from start to goal.
        """
        starts, ways = states[:, 0], goals - states[:, 0]
        norms = np.linalg.norm(ways, axis=1)
        a, end = self.acceleration, float(waits.max() + lasts)
        # Ramps of t seconds reach the speed a t, and the whole way is n = a t (lasts - t): a quadratic in t, of which
        # the lesser root has ramps that fit into the time. `travel` is the speed between them.
        travel = 0.5 * (a * lasts - np.sqrt(np.maximum(a * a * lasts * lasts - 4.0 * a * norms, 0.0)))
        ramps = 0.0 * travel if uniform else travel / a
        shares = travel * ramps / 2.0 / np.where(norms > 0.0, norms, 1.0)
        swings = _swings(states, float(swing)) if swing else None
        points, breaks = [], []
        for i in range(len(states)):
            knots, pieces = [0.0], []
            if swings is not None:
                knots, pieces = [0.0, float(swing)], [swings[i]]
            if waits[i] > swing:
                pieces.append(np.tile(starts[i], (8, 1)))
                knots.append(float(waits[i]))
            if norms[i] > 1e-9:
                one, two = starts[i] + shares[i] * ways[i], goals[i] - shares[i] * ways[i]
                ramp = ramps[i]
                if ramp > 0.0:
                    pieces.append(_QUADRATIC @ np.stack([starts[i], starts[i], one]))
                    knots.append(waits[i] + ramp)
                if lasts - 2.0 * ramp > 1e-9:
                    pieces.append(_LINE @ np.stack([one, two]))
                    knots.append(waits[i] + lasts - ramp)
                if ramp > 0.0:
                    pieces.append(_QUADRATIC @ np.stack([two, goals[i], goals[i]]))
                    knots.append(float(waits[i] + lasts))
            if knots[-1] < end:
                pieces.append(np.tile(goals[i], (8, 1)))
                knots.append(end)
            points.append(np.stack(pieces))
            breaks.append(np.array(knots))
        return FleetArrays(points, breaks)


_QUADRATIC, _LINE = elevate(np.eye(3), 8).T, elevate(np.eye(2), 8).T
"""Control points of degree 7 from those of a quadratic, and of a line."""


def _swings(states: FloatArray, lasts: float) -> FloatArray:
    """Return curves of degree 7 from states to rest in the same place, shape (vehicles, 8, 3)."""
    p, v, a, j = (states[:, order] * lasts**order for order in range(4))
    left = [p, p + v / 7.0, p + 2.0 * v / 7.0 + a / 42.0, p + 3.0 * v / 7.0 + a / 14.0 + j / 210.0]
    return np.stack([*left, p, p, p, p], axis=1)
