r"""One search for a curve and its durations: the shortest time within walls and limits, by sequential cone programmes.

Every step solves a convex model of the whole problem (``joint_model``) and is accepted only if the true merit, the time
and the price of the largest true excesses, falls by a share of what the model promised; else it is solved again with
the instants at which the model was wrong and corrected by what the conditions turned out to be, then less of it is
tried, and the next step is kept shorter.  This is the exact-penalty method of sequential programming with second-order
correction (R. Fletcher, "Practical Methods of Optimization", 1987) with convex cones in place of tangents.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.time_allocation.joint_layout import JointLayout, JointState, end_metric
from minsnap.time_allocation.joint_model import Caution, JointModel
from minsnap.time_allocation.joint_rows import Block, WallBlock
from minsnap.time_allocation.native_steps import Tried, native_steps
from minsnap.time_allocation.objectives import Objective, Penalties, TotalTime
from minsnap.time_allocation.true_peaks import Measured, PeakFinder, Peaks

ITERATIONS = 80
SHARES = (1.0, 0.5, 0.25, 0.1)
"""Of a step that are tried."""

PATIENCE = 2
"""Steps in a row that gain nothing that end the search; one is enough where the gain is given."""

HOPEFUL = 5.0
"""Times the gain that counts as none which a step with several pieces promised, so that the search goes on after it."""

FAILURES = 6
"""Steps in a row without descent that end the search."""

REMEMBERED = 3
"""Sets of former peaks at which rows stay."""

SHORT = 0.3
"""Share of the median length below which a piece is taken to be that long."""

COARSER = 10.0
"""Times the objective's accuracy to which steps with several pieces are solved, where the last one gained as much.

Not where limits are not convex: there such steps end in other curves, some of them 7 % slower.
"""

VANISHING = 1e-6
"""Share of the first total below which nothing limits the time."""


@dataclass(frozen=True, eq=False)
class Evaluated:
    """A state, its true excesses and its merit."""

    state: JointState
    measured: Measured
    merit: float


Told = Callable[[Evaluated], None]
"""Called with every accepted state."""


class JointSearch:
    """State of one search.

    Parameters
    ----------
    layout : JointLayout
    blocks : sequence of Block
        Walls and limits.
    told : callable, optional
        Called with every state accepted; what it raises ends the search.
    ticked : callable, optional
        Called before every step, accepted or not; what it raises ends the search.
    objective : Objective, optional
        What is minimised; the time unless given.
    least : ndarray, shape (pieces in all,), optional
        Durations that no step goes below.
    """

    def __init__(
        self,
        layout: JointLayout,
        blocks: Sequence[Block],
        told: Told | None = None,
        ticked: Callable[[], None] | None = None,
        objective: Objective | None = None,
        least: FloatArray | None = None,
    ) -> None:
        self.layout, self.blocks, self.told, self.ticked = layout, blocks, told, ticked
        self.objective = TotalTime(layout) if objective is None else objective
        self.native = native_steps(layout, blocks)
        self.finder = PeakFinder(layout, blocks, None if self.native is None else self.native.terms)
        self.penalties, self.least = self.objective.penalties, least
        self.memory: list[list[Peaks]] = [[] for _ in blocks]
        self.iterations = 0
        self._best: Evaluated | None = None

    @property
    def best(self) -> Evaluated:
        """The state with the least merit so far; KeyboardInterrupt where there is none yet."""
        if self._best is None:
            raise KeyboardInterrupt
        return self._best

    def evaluate(self, state: JointState) -> Evaluated:
        """Measure a state."""
        found = self.finder.measure(state)
        price = self.penalties.limit * max(found.limit, 0.0) + self.penalties.wall * max(found.wall, 0.0)
        return Evaluated(state, found, self.objective.value(state) * (1.0 + price))

    def run(self, state: JointState, gain: float | None = None) -> Evaluated:
        """Descend from a state until steps gain nothing, as the objective counts it, or one gains less than a share."""
        gain, patience = (self.objective.gain, PATIENCE) if gain is None else (gain, 1)
        now, model = self.evaluate(state), self.model(state)
        self._best = now
        caution, idle, fails = Caution(accuracy=self._accuracy(1.0)), 0, 0
        tried: Tried | None = None
        for _ in range(ITERATIONS):
            if self.ticked is not None:
                self.ticked()
            promised, step = self._step(model, now, caution, tried)
            fails += 1
            if step is not None and tried is None and self._done(now, promised, gain):
                break
            share, best = (0.0, None) if step is None else self._descended(now, step, promised, tried)
            if best is None:
                if step is not None and tried is None:
                    tried = Tried(step, self.layout.moved(now.state, step))
                else:
                    tried, caution = None, caution.failed()
                if fails > FAILURES:
                    break
                continue
            won, fails, tried = now.merit - best.merit, 0, None
            caution = replace(caution.after(share, won > 0.6 * promised), accuracy=self._accuracy(won / now.merit))
            now = self._best = best
            if self.told is not None:
                self.told(now)
            hopeful = patience == 1 and self.layout.task.pieces > 1 and promised > HOPEFUL * gain * now.merit
            idle = idle + 1 if won < gain * now.merit and not hopeful else 0
            if idle >= patience or now.state.total < VANISHING * state.total:
                break
        return now

    def model(self, state: JointState) -> JointModel:
        """Return a model in units of the lengths of a state's pieces, none taken much shorter than most."""
        ends = self.layout.ends(state)
        lengths = np.sqrt(np.einsum("ijd,jk,ikd->i", ends, end_metric(self.layout.degree, 1), ends))
        typical = np.asarray(np.maximum(lengths, SHORT * np.median(lengths)))
        given = self.layout, self.blocks, self.finder.regions
        return JointModel(*given, typical, self.native, self.objective, self.least)

    def _accuracy(self, gained: float) -> float:
        """Gap and residuals at which a step is solved after one that gained a share of the merit."""
        least, convex = self.objective.accuracy, all(isinstance(block, WallBlock) for block in self.blocks)
        return min(max(gained, least), COARSER * least) if convex and self.layout.task.pieces > 1 else least

    def _done(self, now: Evaluated, promised: float, gain: float) -> bool:
        excess = max(now.measured.limit, now.measured.wall)
        return promised < 0.2 * gain * now.merit and excess <= gain

    def _step(
        self, model: JointModel, now: Evaluated, caution: Caution, tried: Tried | None
    ) -> tuple[float, FloatArray | None]:
        """Solve the model: what it promises, and the step; None where it has no solution."""
        self.iterations += 1
        x = model.step(now.state, now.measured.peaks, self.memory, caution, self.penalties, tried=tried)
        if x is None:
            return 0.0, None
        price = self.penalties.limit * x[-2] + self.penalties.wall * x[-1]
        change = self.objective.terms(now.state).change(self.layout.unknowns, x)
        return now.merit - self.objective.value(now.state) * (1.0 + price + change), x

    def _descended(
        self, now: Evaluated, step: FloatArray, promised: float, tried: Tried | None
    ) -> tuple[float, Evaluated | None]:
        """Take a step that descends enough, or the largest share of a corrected one, on a parabola from the first.

        Peaks where it failed are remembered.
        """
        failed: Measured | None = None
        for share in SHARES[: 1 if tried is None else None]:
            bent = step if tried is None else tried.step + share * (step - tried.step)
            trial = self.evaluate(self.layout.moved(now.state, bent, share))
            if now.merit - trial.merit > max(0.1 * share * promised, 0.0):
                self._remember(now.measured)
                if failed is not None:
                    self._remember(failed)
                return share, trial
            failed = failed or trial.measured
        if failed is not None:
            self._remember(failed)
        return 0.0, None

    def _remember(self, measured: Measured) -> None:
        for memory, peaks in zip(self.memory, measured.peaks, strict=True):
            memory[:] = [*memory, peaks][-REMEMBERED:]


def firmer(penalties: Penalties) -> Penalties:
    """Return ten times the penalties."""
    return replace(penalties, limit=10.0 * penalties.limit, wall=10.0 * penalties.wall)
