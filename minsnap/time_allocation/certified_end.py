"""From where the search ends to a curve that keeps every wall and every limit exactly.

The search leaves excesses of a millionth of a width and of a ten-thousandth of a limit.  Steps of the same model
towards walls and limits moved inwards by a little more than that remove them; what is left then of a limit is stretched
away.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from minsnap.corridors.constraint import Walls
from minsnap.errors import SolverError
from minsnap.limits.compliance import KEPT, largest_use
from minsnap.limits.limits import Limits
from minsnap.native.library import core
from minsnap.optimisation.optimum import Optimum
from minsnap.optimisation.solved_task import SolvedTask
from minsnap.time_allocation.derivative_walls import kept_factor, on_derivatives
from minsnap.time_allocation.joint_layout import JointLayout, JointState
from minsnap.time_allocation.joint_model import Caution, Inwards
from minsnap.time_allocation.joint_search import SHARES, Evaluated, JointSearch, firmer
from minsnap.time_allocation.time_stretch import nearby_factor, touching_factor
from minsnap.time_allocation.true_peaks import Measured
from minsnap.trajectory.trajectory import Trajectory

TRIES = 30
"""Steps towards walls and limits moved inwards."""

FLOOR, GROWTH = 2e-9, 8.0
"""By how much they are moved at first where only rounding is left, and how that grows from step to step."""

ENOUGH = 1.5
"""Times the excess by which they are moved."""

SMALL = 1e-5
"""Excess of the limits searched for, in factors on time, that may be stretched away."""

QUICK, ROOM, NEARBY = 3, 1e-7, 1e-2
"""Changes of time by measured excesses: how many, what they leave, and how far each goes at most."""

ALMOST = 1e-4
"""Room that may be left below the most used limit."""

FAR = 1e-3
"""Share by which the certified curve may be slower; beyond, it is not the one found, and steps inwards go on.

Where the thrust nearly vanishes, its direction turns fast over an instant that a grid misses, and flying more slowly
does not always turn it more slowly.
"""

NARROW = 129
"""Instants a piece at which excesses are looked for."""

LAST = Caution(3.0, 0.05, accuracy=1e-5)

Finish = Callable[[Trajectory], Trajectory]


def solved_state(layout: JointLayout, state: JointState, iterations: int) -> SolvedTask:
    """Wrap a state as a solved task."""
    name = core().name
    solver = "clarabel" if name == "python" else "interior point"
    optimum = Optimum(layout.knots(state), None, np.zeros(0), iterations, solver, core=name)
    return SolvedTask(layout.task, state.durations * layout.units.time, layout.units, optimum)


class CertifiedEnd:
    """State of one such end.

    Parameters
    ----------
    search : JointSearch
    limits : Limits
    finish : callable
        Gives a trajectory its yaw.
    complete : bool
        Whether the search knows all limits; steps inwards cannot mend what is exceeded of others.
    """

    def __init__(self, search: JointSearch, limits: Limits, finish: Finish, complete: bool) -> None:
        self.search, self.limits, self.finish, self.complete = search, limits, finish, complete
        self.layout, self.still = search.layout, search.layout.task.still
        self.caution, self.inwards, self.penalties = LAST, Inwards(), search.penalties
        self._clipped = search.finder.regions.clipped
        self.inside: JointState | None = None

    def run(self, found: Evaluated) -> SolvedTask | None:
        """Return a curve near the one found that is certified, barely slower; None if there is none nearby."""
        self.search.finder.refine(NARROW)
        state, best = self._clipped(found.state), None
        for attempt in range(TRIES):
            measured = self.search.finder.measure(state)
            solved = solved_state(self.layout, state, self.search.iterations)
            kept = measured.limit < (SMALL if self.still else KEPT)
            if solved.inside:
                self.inside = state
                if kept and self.still:
                    best = shorter(best, self._touching(state, not self.complete))
                    if not self.complete or (best is not None and _duration(best) <= (1.0 + FAR) * _duration(solved)):
                        return best
                elif (kept or (self.still and attempt)) and self._excess(solved) <= KEPT:
                    return solved
            least = min(FLOOR * GROWTH**attempt, FAR)
            limit = 0.0 if kept and self.still and not solved.inside else max(ENOUGH * measured.limit, least)
            wall = 0.0 if solved.inside else max(ENOUGH * measured.wall, least)
            self.inwards = Inwards(self.inwards.limit + limit, self.inwards.wall + wall)
            state = self._closer(state, measured)
        if best is None and self.still and self.inside is not None:
            return self._touching(self.inside, True)
        return best

    def _excess(self, solved: SolvedTask) -> float:
        return largest_use(self.limits, self.finish(solved.trajectory)) - 1.0

    def _closer(self, state: JointState, measured: Measured) -> JointState:
        """Take a step towards walls and limits moved inwards, as much of it as brings the curve closer to them.

        Where none does, what is left costs more than to remove it: the next step is shorter, and excesses cost more.
        """
        search, over = self.search, _over(measured)
        step = search.model(state).step(
            state, measured.peaks, search.memory, self.caution, self.penalties, self.inwards
        )
        if step is None:
            self.caution = self.caution.failed()
            return state
        for share in SHARES:
            trial = self._clipped(self.layout.moved(state, step, share))
            if _over(search.finder.measure(trial)) < max(over, SMALL):
                return trial
        self.caution, self.penalties = self.caution.failed(), firmer(self.penalties)
        return state

    def _touching(self, state: JointState, far: bool) -> SolvedTask | None:
        """Fly the same path at the speed at which the most used limit is just kept.

        The limits searched for are measured first, which is quick; the exact measure has the last word.  Limits that
        are no part of the search, such as the rate of a planned yaw, are kept by that alone.  Where more time does not
        mean less use, the factor may lie far away, and is looked for there only if asked for: what keeps the limits as
        it is counts too.
        """
        walls = on_derivatives(self.layout.task.walls)
        if walls:
            return self._within(walls, state)
        touches, flown = self.search.objective.touches, state
        for _ in range(QUICK):
            measured = self.search.finder.measure(flown)
            change = float(np.clip(measured.limit + ROOM, -NEARBY if touches else 0.0, NEARBY))
            flown = JointState(flown.scaled, flown.durations * (1.0 + change))
        least = -ALMOST if touches else -np.inf
        solved, best = solved_state(self.layout, flown, self.search.iterations), None
        for one in (solved, solved_state(self.layout, state, self.search.iterations)):
            excess = self._excess(one)
            if least <= excess <= KEPT:
                return one
            if excess <= KEPT:
                best = one
                break
        curve = self.finish(solved.trajectory)
        factor = nearby_factor(self.limits, curve)
        if factor is None and far and best is None:
            factor = touching_factor(self.limits, curve)
        if factor is None:
            return best
        touching = JointState(flown.scaled, flown.durations * factor)
        return shorter(best, solved_state(self.layout, touching, self.search.iterations))

    def _within(self, walls: Sequence[Walls], state: JointState) -> SolvedTask | None:
        """Fly the same path at the least speed that keeps walls on derivatives, which a change of time breaks, too.

        Where a price of time has the last word the path keeps its time if it keeps the limits.
        """
        solved = solved_state(self.layout, state, self.search.iterations)
        if not self.search.objective.touches and self._excess(solved) <= KEPT:
            return solved
        try:
            factor = kept_factor(self.limits, walls, self.finish(solved.trajectory))
        except SolverError:
            return None
        return solved_state(self.layout, JointState(state.scaled, state.durations * factor), self.search.iterations)


def shorter(one: SolvedTask | None, other: SolvedTask | None) -> SolvedTask | None:
    """Return the shorter of two plans, either of which may be missing."""
    return min((plan for plan in (one, other) if plan is not None), key=_duration, default=None)


def _duration(solved: SolvedTask) -> float:
    return float(solved.durations.sum())


def _over(measured: Measured) -> float:
    return max(measured.limit, 0.0) + max(measured.wall, 0.0)
