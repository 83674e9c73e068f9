"""Search for the costate that proves the longest time: units of order one, a costate to begin with, the native core."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.bounds.costate_proof import CostateProof, support
from minsnap.bounds.derivative_sets import BoundingSets, DerivativeSet, Sets
from minsnap.bounds.passed_course import PassedCourse
from minsnap.native.costate import CostateQuestion, FoundCostate, find_costate


@dataclass(frozen=True)
class CostateSearchSettings:
    """How finely a costate is searched for.

    Parameters
    ----------
    cells, fine : int
        Of each leg, at first and at the end, where velocities are bounded; else a costate is linear on a leg.
    parts : int
        Parts of a leg in which norms of the costate are summed where it is linear there.
    finer : int
        Into how many each part is divided when the time is proved.
    fast : float
        Speed that no shortest flight has, over that of an acceleration along the whole way; where none is bounded.
    least : float
        Share of a leg in which its speed is reached below which that counts as at once.
    factors : tuple of float
        That are tried on the costate at the end.
    larger : tuple of float
        On it where flights begin or end hovering, which makes a larger costate worth it.
    enough : float
        Factor on the time that each of them must gain for the next one to be tried.
    later : tuple of float
        Ends of intervals of the durations of such a leg, over that at the bound without it.
    """

    cells: int = 8
    fine: int = 32
    parts: int = 64
    finer: int = 2
    fast: float = 30.0
    least: float = 1e-7
    factors: tuple[float, ...] = (0.999, 0.9997, 1.0003, 1.001)
    larger: tuple[float, ...] = (1.01, 1.1, 1.3, 1.6)
    enough: float = 1.01
    later: tuple[float, ...] = (0.97, 1.02, 1.06, 1.1, 1.16, 1.25, 1.5, 2.0, 3.0, 4.5)


SETTINGS = CostateSearchSettings()


def longest_proof(course: PassedCourse, sets: BoundingSets) -> CostateProof | None:
    """Return the proof of the longest time; None where none is found.

    Parameters
    ----------
    course : PassedCourse
        Whose regions are left one for the next.
    sets : BoundingSets
        At least one of accelerations or of velocities.
    """
    units = _Units.of(course, sets)
    found = find_costate(units.question(course, sets))
    if found is None:
        return None
    proof = _proof(course, sets, found, units.length / units.time**2)
    # The bound is concave in the costate, whose size the search knows to its tolerance only: a few sizes beside cost
    # nothing to prove.
    tried = [proof.times(factor) for factor in (1.0, *SETTINGS.factors)]
    best = max(tried, key=lambda one: one.seconds()[0])
    return _from_hover(best) if best.growing and max(course.calm) > 1 else best


def _from_hover(proof: CostateProof) -> CostateProof:
    """Return the proof with what flights keep soon after they hover, and before they hover again, where it gains."""
    best, most = proof, proof.seconds()[0]
    for factor in SETTINGS.larger:
        one = _hovering(proof.times(factor))
        now = one.seconds()[0]
        enough = now >= SETTINGS.enough * most
        if now > most:
            best, most = one, now
        if not enough:
            break
    return best


def _hovering(proof: CostateProof) -> CostateProof:
    """Return the proof with shares of the sets that grow."""
    sums, ends, shape = proof.sums, proof.end_legs, proof.hovering.shape
    times = np.sqrt(np.maximum(sums.product, 0.0) / np.maximum(sums.room, SETTINGS.least))[list(ends)]
    latest = times[:, None] * np.array(SETTINGS.later)
    proof = replace(proof, latest=latest)
    along, hovering = proof.instants(), np.zeros((2, len(SETTINGS.later), *shape[2:]))
    for end, leg in enumerate(ends):
        after = proof.after(end)[..., None]
        places, shares = proof.of_parts(along[leg]), proof.of_parts(proof.splits[leg])
        before, gained = support(proof.accelerations, places, shares), np.zeros(after.shape[:2])
        near = after[..., 0] <= (1.0 if ends[1] else 0.5 + 1e-9) * latest[end, :, None]  # half of a single leg each
        for g, one in enumerate(proof.growing):
            if proof.course.calm[end] > one.power:
                own = np.broadcast_to(one.share(places - shares.sum(axis=2), after), (*gained.shape, 2, 3))
                rest = support(proof.accelerations, places - own, shares)
                gain = (before - rest - one.support(own, after)).sum(axis=2)
                better = near & (gain > gained)
                gained[better], hovering[end][better] = gain[better], 0.0
                hovering[end][better, :, g] = own[better]
    return replace(proof, hovering=hovering)


def bounds_legs(course: PassedCourse, sets: BoundingSets) -> bool:
    """Whether a set bounds how fast each leg is flown: a limit on horizontal speed says nothing of a climb."""
    along = course.steps / np.sqrt((course.steps**2).sum(axis=1))[:, None]
    reach = np.minimum(_along(sets.velocities, along), _along(sets.accelerations, along))
    return bool(np.isfinite(reach).all())


@dataclass(frozen=True)
class _Units:
    """Length [m] and time [s] in which all numbers of a search are of order one."""

    length: float
    time: float

    @classmethod
    def of(cls, course: PassedCourse, sets: BoundingSets) -> _Units:
        lengths = np.sqrt((course.steps**2).sum(axis=1))
        return cls(float(lengths.mean()), float(_times(course.steps, sets.accelerations, sets.velocities)[0].mean()))

    def question(self, course: PassedCourse, sets: BoundingSets) -> CostateQuestion:
        """Return the question of the native core."""
        speed, acceleration = self.length / self.time, self.length / self.time**2
        steps, ends = course.steps / self.length, course.ends / speed
        velocities = tuple(one.scaled(1.0 / speed) for one in sets.velocities)
        accelerations = tuple(one.scaled(1.0 / acceleration) for one in sets.accelerations)
        times, starting = _times(steps, accelerations, velocities)
        linear, axes = not velocities, frozenset(range(course.dim))
        rates = axes if linear else velocities[0].covered & axes
        costates = (accelerations[0].covered if accelerations else frozenset()) & rates
        begun = _by_places(course, steps, accelerations) if linear else _by_speed(steps, velocities, starting / times)
        return CostateQuestion(
            steps,
            course.rounds / self.length,
            course.sides / self.length,
            ends,
            course.closed,
            _rows(accelerations or _unbounded(1.0)),
            _rows(velocities or _unbounded(SETTINGS.fast * float(times.sum() + np.abs(ends).max()))),
            sum(1 << axis for axis in costates),
            sum(1 << axis for axis in rates),
            times,
            *begun,
            1 if linear else SETTINGS.fine,
            SETTINGS.parts if linear else 1,
        )


def _unbounded(size: float) -> Sets:
    """Return a ball in the place of no bound: no costate reaches it, or no flight."""
    return (DerivativeSet(((tuple(range(3)), size),)),)


Begun = tuple[FloatArray, FloatArray, FloatArray]
"""Grid, costate and rates to begin with."""


def _by_places(course: PassedCourse, steps: FloatArray, accelerations: Sets) -> Begun:
    """Begin with a costate that falls along the way: every leg then has a positive product."""
    places = np.cumsum(np.concatenate((np.zeros((1, 3)), steps)), axis=0)
    places -= places[0] if course.closed else places.mean(axis=0)
    most = max(float(one.support(side).max()) for side in (places, -places) for one in accelerations)
    factor = 0.25 / most
    return np.tile([0.0, 1.0], (len(steps), 1)), -factor * np.stack((places[:-1], places[1:]), axis=1), factor * steps


def _by_speed(steps: FloatArray, velocities: Sets, share: FloatArray) -> Begun:
    """Begin with what the speed alone proves; ``share`` (legs,) is that of a leg in which it is reached."""
    squares, most = (steps**2).sum(axis=1), velocities[0].support(steps)
    # The costate bends while the speed builds up at the ends of a leg and is flat between: four cells within 1.5 times
    # that share at each end, and two halves between them. Even cells where it takes most of the leg, or no time at all.
    close, even = share[:, None] * np.array([0.0, 0.5, 1.0, 1.5]), np.linspace(0.0, 1.0, SETTINGS.cells + 1)
    graded = np.hstack((close, np.full((len(steps), 1), 0.5), 1.0 - close[:, ::-1]))
    grid = np.where(((share < 0.25) & (share > SETTINGS.least))[:, None], graded, even)
    return grid, np.zeros((*grid.shape, 3)), (squares / most**2)[:, None] * steps


def _times(steps: FloatArray, accelerations: Sets, velocities: Sets) -> tuple[FloatArray, FloatArray]:
    """Return roughly the times of legs, and how long the speed takes to change in them."""
    lengths = np.sqrt((steps**2).sum(axis=1))
    along = steps / lengths[:, None]
    acceleration, speed = _along(accelerations, along), _along(velocities, along)
    # From rest to rest a leg takes L/V where the speed is reached, and of the order of sqrt(L/A) where it is not: the
    # root of the sum of squares is near the larger of the two. Only the scale of the search depends on it.
    return np.sqrt((lengths / speed) ** 2 + lengths / acceleration), speed / acceleration


def _along(sets: Sets, along: FloatArray) -> FloatArray:
    """Return how far sets reach along directions (legs, 3), one way or the other; infinity where none bounds that."""
    reach = np.full(len(along), np.inf)
    for one in sets:
        free = [axis for axis in range(3) if axis not in one.covered]
        own = np.maximum(one.support(along), one.support(-along))
        reach = np.where(along[:, free].any(axis=1), reach, np.minimum(reach, own))
    return reach


def _rows(sets: Sets) -> FloatArray:
    """Return sets as the native core takes them, (sets, 12): see ``SupportSet``."""
    rows = np.zeros((len(sets), 12))
    rows[:, 4:7] = -1.0
    for row, one in zip(rows, sets, strict=True):
        row[0], row[1:4], row[10:] = float(one.height > 0.0), one.center, (one.slope, one.height)
        for group, (axes, radius) in enumerate(one.balls):
            row[[4 + axis for axis in axes]], row[7 + group] = group, radius
    return rows


def _proof(course: PassedCourse, sets: BoundingSets, found: FoundCostate, unit: float) -> CostateProof:
    """Return what was found in units of the question; a costate is the inverse of an acceleration."""
    costate, rate = found.costate / unit, found.rate / unit
    splits, rate_splits = _finer(found.splits) / unit, found.rate_splits / unit
    if not sets.velocities:
        rate, rate_splits = costate[:, 0] - costate[:, -1], rate_splits[:, :, :0]
    kinds = sets.accelerations, sets.velocities
    known = found.grid, costate, rate, splits, rate_splits
    none = np.zeros((2, 0, splits.shape[1] * (splits.shape[2] - 1), 2, len(sets.growing), 3))
    return CostateProof(course, *kinds, *known, sets.growing, np.zeros((2, 0)), none)


def _finer(splits: FloatArray) -> FloatArray:
    """Return shares at the instants of more parts, linear between those that are known."""
    parts = splits.shape[2] - 1
    places = np.arange(parts * SETTINGS.finer + 1) / SETTINGS.finer
    low = np.minimum(places.astype(int), parts - 1)
    share = (places - low)[:, None, None]
    return np.asarray((1.0 - share) * splits[:, :, low] + share * splits[:, :, low + 1])
