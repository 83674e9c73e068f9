"""The search for the shortest common time of a fleet: joint searches at ever shorter times, each result certified.

A time counts once its curves are certified: pairs, room and obstacles as they are, limits after stretching
all of time by what they are exceeded, which leaves the curves and their distances as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from itertools import islice
from math import sqrt
from operator import add
from time import process_time

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.cached import cached_property
from minsnap.basics.limit_kinds import KIND
from minsnap.errors import UnprovedError
from minsnap.fleet.common_clock import Fleet
from minsnap.fleet.first_guess import frozen, guess, powers
from minsnap.fleet.fleet_certificate import FleetCertificate, FleetUse, certify_fleet, legs_left
from minsnap.fleet.fleet_task import FleetTask
from minsnap.limits.limits import Limits
from minsnap.native.joint_fleet import FleetSearch, Outcome, Settings
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class TimeSettings:
    """How the shortest common time is searched for.

    Parameters
    ----------
    coarse, fine : int
        Samples of a piece while the time falls fast, and in the end.
    inside : tuple of float
        Shares of the limits that curves are searched within which cannot be slowed down, at first and at least.
    narrower : float
        By how much that share is lowered where curves exceed a limit between two samples.
    openings : tuple of float
        Times tried first, in units of the bound.
    growth, enough : float
        How the share by which time is lowered grows, and from which share of the gain aimed at; else it is halved.
    guesses : tuple of int
        Kinds of guesses, in the order in which they are tried.
    near, agreeing, crowd : float, float, int
        Guesses end when a time is near the least by a share, two agree, or each ``crowd`` vehicles had one.
    exploring, lowering, ending : tuple of float
        Shares by which time is lowered, at first and at last: from each guess; then the best, coarsely and finely.
    below_alone : float
        Least time that is tried, over that of the slowest vehicle alone: shorter ones are hardly ever reached.
    longer, nearer : tuple of float
        Shares of the time, and of the separation, that are tried after a failed search, to say what would do.
    """

    coarse: int = 12
    fine: int = 16
    inside: tuple[float, float] = (0.995, 0.95)
    narrower: float = 0.99
    openings: tuple[float, ...] = (2.0, 2.6, 3.4, 5.4, 8.5)
    growth: float = 1.4
    enough: float = 0.3
    guesses: tuple[int, ...] = (0, 1, 4, 2)
    near: float = 0.01
    agreeing: float = 0.005
    crowd: int = 8
    exploring: tuple[float, float] = (0.07, 0.03)
    lowering: tuple[float, float] = (0.035, 0.01)
    ending: tuple[float, float] = (0.02, 0.004)
    below_alone: float = 0.9995
    longer: tuple[float, ...] = (1.25, 1.6, 2.0)
    nearer: tuple[float, ...] = (0.9, 0.75, 0.5)


TIMES = TimeSettings()

FIRST = Settings(iterations=200)
WARM = Settings(short_by=2.5e-3)
LAST = Settings(inflation=1.002, smoothness=1e-6, tau=0.005, iterations=60, inner=60, over_by=2e-3)

_LEFT = np.array([[1, 0, 0, 0], [1, 1 / 7, 0, 0], [1, 2 / 7, 1 / 42, 0], [1, 3 / 7, 3 / 42, 1 / 210]])


@dataclass(frozen=True, eq=False)
class Certified:
    """Curves that are proved to keep everything at a time, and by what."""

    curves: FloatArray
    time: float
    certificate: FleetCertificate


@dataclass(frozen=True, eq=False)
class TimeTried:
    """What came of a search at one time: nothing unless certified, and what was short."""

    curves: FloatArray
    time: float
    outcome: Outcome
    certified: Certified | None = None


@dataclass(eq=False)
class TimeSearch:
    """A search for one fleet with a number of pieces a vehicle.

    Parameters
    ----------
    task : FleetTask
    pieces : int
    threads : int
    stopped : callable
        Whether it is to end.
    told : callable or None
        Called with each certified time and its least distance.
    """

    task: FleetTask
    pieces: int
    threads: int
    stopped: Callable[[], bool]
    told: Callable[[float, float], None] | None = None
    best: Certified | None = None
    alone: float = 0.0
    tried: int = 0
    iterations: int = 0
    nearest: TimeTried | None = None
    inside: float = TIMES.inside[0]
    _began: float = field(default_factory=process_time)

    @property
    def shares(self) -> FloatArray:
        """Instants of the knots, in units of the flight time, shape (pieces + 1,)."""
        return self.task.shares_of(self.pieces)

    def search_of(self, samples: int) -> FleetSearch:
        """Return a joint search with a number of samples a piece."""
        task = self.task
        obstacles = np.array([each.numbers() for each in task.avoid]).reshape(-1, 13)
        downwash = 1.0 if task.separation is None else task.separation.downwash
        limits, shares = task.limit_table * (1.0 if task.free_time else self.inside), np.diff(self.shares)
        question = (task.radii, limits, task.walls(self.pieces), self._free(), shares, obstacles)
        return FleetSearch(*question, samples, downwash, task.length, self.threads)

    def _free(self) -> FloatArray:
        free = np.zeros((len(self.task) + len(self.task.fixed), self.pieces + 1, 4, 3))
        free[: len(self.task), 1:-1] = 1.0
        for vehicle in range(len(self.task)):
            for arrives, leaves in self.task.knots_of(vehicle, self.pieces):
                free[vehicle, arrives : leaves + 1, : 1 if leaves == arrives else None] = 0.0
        return free

    @property
    def unit(self) -> float:
        """Unit of acceleration in which the smoothness is weighed [m/s^2]."""
        table = self.task.limit_table[:, 1]
        if np.isfinite(table).any():
            return float(table[np.isfinite(table)].min())
        bound = max(float(self.task.bounds.max()), 1e-9)
        way = float(np.abs(self.task.goals - self.task.starts).max()) or 1.0
        return 4.0 * way / bound**2 if np.isfinite(bound) and bound > 1e-9 else way

    def opening(self, seed: int, kind: int, time: float) -> FloatArray:
        """Return a guess of a kind for a time."""
        curves = guess(self.task, self.pieces, seed, kind)
        still = np.zeros((len(self.task.fixed), *curves.shape[1:]))
        return np.ascontiguousarray(self.at_time(np.concatenate((curves, still)), time))

    def at_time(self, curves: FloatArray, time: float) -> FloatArray:
        """Return curves with the states that a time fixes: moving starts, and vehicles that fly as they do."""
        h, count = time / self.pieces, len(self.task)
        moved = curves.copy()
        for vehicle, state in enumerate(self.task.states):
            for order, value in state.items():
                moved[vehicle, 0, order] = value * powers(h)[order]
        for index, each in enumerate(self.task.fixed):
            moved[count + index] = frozen(each, time, self.shares)
        return moved

    def attempt(self, search: FleetSearch, curves: FloatArray, time: float, settings: Settings) -> TimeTried:
        """Search at one time, moving the curves, and certify the result."""
        outcome = search.run(curves, time, self.unit, settings, self.stopped)
        self.tried += 1
        self.iterations += outcome.iterations
        if outcome.short_by >= settings.short_by or outcome.over_by >= settings.over_by:
            return TimeTried(curves, time, outcome)
        certified = self.certify(curves, time)
        if certified is not None and (self.best is None or certified.time < self.best.time):
            self.best = certified
            if self.told is not None:
                self.told(certified.time, certified.certificate.least_distance or np.inf)
        return TimeTried(curves, time, outcome, certified)

    def certify(self, curves: FloatArray, time: float) -> Certified | None:
        """Return the curves at the least time at which they keep their limits, if they keep everything else."""
        task = self.task
        held_to = {"separation": task.separation, "room": task.room, "avoid": task.avoid, "threads": self.threads}
        if task.limits is not None and task.free_time:
            time *= slowed(flown(curves, time, self.shares), task.limits) or 1.0
        fleet = Fleet((*flown(curves[: len(task)], time, self.shares), *task.fixed))  # type: ignore[arg-type]
        certificate = certify_fleet(fleet, **held_to)  # type: ignore[arg-type]
        limited = task.limits is not None and not self._stretches
        kept = certificate.ok and self._inside(curves)
        kept = kept and (not limited or certify_fleet(fleet[: len(task)], limits=task.limits).ok)
        return Certified(curves.copy(), time, certificate) if kept else None

    @cached_property
    def _stretches(self) -> bool:
        """Whether stretching time is known to keep all limits: those on derivatives alone."""
        kinds = {name for own in self.task.limits or () for name in own.given()}
        return self.task.free_time and all(KIND[name].order > 0 for name in kinds)

    def _inside(self, curves: FloatArray) -> bool:
        """Whether vehicles with corridors are proved to be inside of them."""
        for vehicle, boxes in enumerate(self.task.corridors):
            if boxes is not None:
                (curve,) = flown(curves[vehicle : vehicle + 1], 1.0, self.shares)
                if legs_left(boxes, curve, self.task.legs_of(vehicle, self.pieces)):
                    return False
        return True

    def open(self, seed: int, kind: int, bound: float) -> Certified | None:
        """Find first certified curves from a guess, at ever longer times; None if there are none."""
        search = self.search_of(TIMES.coarse)
        # Long times are easy: vehicles have room to bend around each other. The first that is certified begins the
        # descent in `shorten`; what was learnt at a time that failed (the multipliers) is of no use at a longer one.
        for opening in TIMES.openings:
            self.nearest = self.attempt(search, self.opening(seed, kind, opening * bound), opening * bound, FIRST)
            if self.nearest.certified is not None or self.stopped():
                break
            search.forget()
        return None if self.nearest is None else self.nearest.certified

    def shorten(
        self, begun: Certified, samples: int, settings: Settings, shares: tuple[float, float], bound: float
    ) -> Certified:
        """Lower the time as far as it goes: by the first share at most, by less where a time is not reached."""
        self.inside = TIMES.inside[0]
        search, best, (largest, end) = self.search_of(samples), begun, shares
        share = largest
        while share > end and not self.stopped():
            time = max(best.time * (1.0 - share), bound)
            if time >= best.time * (1.0 - 0.2 * end):
                break
            self.nearest = self.attempt(search, self.at_time(best.curves, time), time, settings)
            # An attempt may succeed and still gain less than was aimed at, since certifying stretches time until all
            # limits are kept. The share grows only where most of the aim was gained, and is halved otherwise.
            certified, aim = self.nearest.certified, best.time - time
            gain = best.time - certified.time if certified is not None else 0.0
            if certified is not None and gain > 0.0:
                best = certified
            elif self.narrowed(self.nearest, settings):
                search = self.search_of(samples)
                continue
            else:
                search.forget()  # multipliers of a time that was not reached push the next curves too far apart
            share = min(largest, TIMES.growth * share) if gain > TIMES.enough * aim else 0.5 * share
        return best

    def narrowed(self, tried: TimeTried, settings: Settings) -> bool:
        """Lower the limits of the search if curves kept them at samples and were refused; return whether it did."""
        reached = tried.outcome.over_by < settings.over_by and tried.outcome.short_by < settings.short_by
        if self.task.free_time or tried.certified is not None or not reached or self.inside < TIMES.inside[1]:
            return False
        self.inside *= TIMES.narrower
        return True

    def least_snap(self, time: float) -> Certified | None:
        """Return curves of little snap that are certified at a time, from the best ones; None if none are."""
        assert self.best is not None
        for weight in (1.0, 1e-1, 1e-2, 1e-3, 1e-4):
            search, curves = self.search_of(TIMES.fine), self.at_time(self.best.curves, time)
            settings = replace(LAST, smoothness=weight, iterations=60, settle=True)
            outcome = search.run(curves, time, self.unit, settings, self.stopped)
            self.iterations += outcome.iterations
            certified = self.certify(curves, time)
            if certified is not None and certified.time <= time * (1.0 + 1e-9):
                return replace(certified, time=time)
        return None

    @property
    def seconds(self) -> float:
        """Processor time since the start [s]."""
        return process_time() - self._began


def slowed(curves: Sequence[Trajectory], limits: Limits | Sequence[Limits]) -> float:
    """Return by how much time is to be stretched so that curves keep limits on derivatives; 0 if nothing moves."""
    return stretch_of(certify_fleet(curves, limits=limits).utilisation)


def stretch_of(uses: Sequence[FleetUse]) -> float:
    """Return by how much time is to be stretched so that limits on derivatives are kept that are used so far."""
    factor = 0.0
    for entry in uses:
        order = KIND[entry.use.name].order
        share = max(entry.use.fraction, 0.0)
        factor = max(factor, _root(share, order) if order else max(1.0, share))
    return factor * (1.0 + 1e-13)


def _root(value: float, order: int) -> float:
    """Return the root of an order 1 to 4 with square roots and Newton's steps alone: the same bits on every machine."""
    if order in (1, 2, 4):
        for _ in range(order // 2):
            value = sqrt(value)
        return value
    root = max(1.0, value)
    for _ in range(200):
        lower = root - (root * root * root - value) / (3.0 * root * root)
        if not 0.0 < lower < root:
            break
        root = lower
    return root


def _weighed(data: FloatArray) -> FloatArray:
    """Return the four control points at an end of each piece, by sums whose order is fixed."""
    rows = [reduce(add, (weight * data[:, :, e] for e, weight in enumerate(weights))) for weights in _LEFT]
    return np.stack(rows, axis=2)


def flown(curves: FloatArray, time: float, shares: FloatArray) -> list[Trajectory]:
    """Return the trajectories of curves at a common flight time [s], with knots at shares of it."""
    pieces = curves.shape[1] - 1
    durations = np.diff(shares) * time
    scale = np.stack([powers(share * pieces) for share in np.diff(shares)])[:, :, None]
    left, right = curves[:, :-1] * scale, curves[:, 1:] * scale * np.array([1.0, -1.0, 1.0, -1.0])[:, None]
    points = np.concatenate((_weighed(left), _weighed(right)[:, :, ::-1]), axis=2)
    return [Trajectory(each, durations, pieces=pieces) for each in points]


def unproved_fleet(search: TimeSearch, when: str, seed: int) -> UnprovedError:
    """Say what was reached in the longest time that was tried, which pair presses, and what more or less would do."""
    tried = search.nearest
    if tried is None:
        return UnprovedError("no fleet was found, as the search ended before it began: give a longer time_limit")
    task, flew = search.task, flown(tried.curves[: len(search.task)], tried.time, search.shares)
    certificate = certify_fleet(flew, task.separation, avoid=task.avoid or None)
    text = f"no fleet was found that is apart at every instant{when}"
    if certificate.clearances is not None and certificate.clearances.min() < 0.0:
        vehicle = int(certificate.clearances.argmin())
        text += (
            f": in {tried.time:.4g} s vehicle {vehicle} was {-certificate.clearances[vehicle]:.3g} m inside an obstacle"
        )
    elif certificate.closest is not None and not certificate.ok:
        near = certificate.closest
        text += f": in {tried.time:.4g} s vehicles {near.pair[0]} and {near.pair[1]} came as near as "
        text += f"{near.distance:.3g} m at {near.instant:.4g} s, {near.share:.0%} of their separation"
    elif tried.outcome.over_by > 0.0:
        text += f": in {tried.time:.4g} s limits or walls were exceeded by {tried.outcome.over_by:.1%}"
    did = [] if search.stopped() else list(_what_did(search, tried, seed))
    advice = "give more time, more room, less separation, more pieces, or another seed"
    return UnprovedError(f"{text}; {' and '.join(did) + ': ' if did else ''}{advice}")


def _what_did(search: TimeSearch, tried: TimeTried, seed: int) -> Iterator[str]:
    """Yield the first longer time that did, and the first share of the separation that did in the same time."""

    def does(task: FleetTask, time: float) -> bool:
        other = TimeSearch(task, search.pieces, search.threads, search.stopped)
        again = other.attempt(other.search_of(TIMES.fine), other.opening(seed, 0, time), time, FIRST)
        return again.certified is not None

    times, apart = (more * tried.time for more in TIMES.longer), search.task.separation
    yield from islice((f"{time:.4g} s did" for time in times if does(search.task, time)), 1)
    if apart is not None:
        nearer = ((share, replace(search.task, separation=apart.scaled(share))) for share in TIMES.nearer)
        yield from islice((f"{share:.0%} of the separation did" for share, task in nearer if does(task, tried.time)), 1)
