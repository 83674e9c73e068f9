r"""The least factor on time at which a corridor and convex limits agree, in given proportions of the durations.

For given durations let :math:`\tau` be the least relative relaxation of all limits that makes the problem solvable
(one more variable in the QP).  Slowing every leg by a factor relaxes all limits by known powers of it, so that the
multipliers give the slope of :math:`\tau`, and Newton's method the factor at which it vanishes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import SolverError
from minsnap.optimisation.elastic import Elastic, Relaxation, Relaxed
from minsnap.optimisation.gradient import row_slopes
from minsnap.optimisation.normalised_constraints import Compiled, WallRows, compile_walls
from minsnap.optimisation.reduced_qp import ReducedProblem
from minsnap.optimisation.task import Task
from minsnap.time_allocation.least_cost import leg_sums
from minsnap.time_allocation.time_stretch import nothing_limits


@dataclass(frozen=True)
class ScaleSettings:
    """How the least factor on time is found by relaxations.

    Parameters
    ----------
    scale_found : float
        Relaxation below which one Newton step gives the scale.
    elastic_far : float
        Relaxation above which it need not be known to more than a hundredth for a Newton step.
    newton_steps : int
        Newton steps at most.
    flat : float
        Slope of the relaxation in the logarithm of time below which it counts as flat.
    largest_step : float
        Largest step of the logarithm of the time scale.
    lowest : float
        Least relaxation: limits are tightened to half at most.
    """

    scale_found: float = 3e-3
    elastic_far: float = 0.1
    newton_steps: int = 40
    flat: float = 1e-4
    largest_step: float = 0.7
    lowest: float = -0.5


SCALE = ScaleSettings()


class ElasticScale:
    """Search for the least factor on time.

    Parameters
    ----------
    task : Task
        Its walls include those of the limits.
    shares : ndarray, shape (legs,)
        Durations whose proportions are kept [s].
    found : Relaxed
        Of the limits at these durations, as ``give_limits`` says.
    """

    def __init__(self, task: Task, shares: FloatArray, found: Relaxed) -> None:
        self.task, self.shares, self.found = task, shares, found
        self.units = task.units(task.piece_durations(shares))
        self.scale = 0.0
        self.seed: WallRows | None = None

    def factor(self) -> float:
        """Return the least factor on the durations."""
        self._rescale(self.shares)
        return float(np.exp(self.scale))

    def _rescale(self, shares: FloatArray) -> FloatArray:
        """Find the least scale of these proportions by Newton's method; return the slopes there.

        Where a pin uses a limit up, or the durations are very long, the relaxation is flat: then time is shortened
        until it is not.
        """
        steep: FloatArray | None = None
        found: Relaxed | None = self.found
        for _ in range(SCALE.newton_steps):
            slack, slopes = self._relaxation(shares * np.exp(self.scale), found)
            found = None
            total = float(slopes.sum())
            if total > -SCALE.flat:
                if slack > SCALE.scale_found:
                    self.scale += SCALE.largest_step
                    continue
                if steep is not None:
                    return steep
                self.scale -= SCALE.largest_step
                continue
            steep = slopes
            self.scale += float(np.clip(-slack / total, -SCALE.largest_step, SCALE.largest_step))
            if abs(slack) < SCALE.scale_found:
                return slopes
        if slack <= SCALE.scale_found and steep is None:
            raise nothing_limits(sorted({wall.name for wall in self.task.walls if wall.order}))
        raise SolverError("no durations were found at which the corridor and the limits agree")

    def _relaxation(self, durations: FloatArray, known: Relaxed | None) -> tuple[float, FloatArray]:
        r"""Return :math:`\tau` at these leg durations, and :math:`T_i \partial\tau / \partial T_i`, shape (legs,)."""
        problem = self.task.problem(self.task.piece_durations(durations), self.units)
        found = known or self._relaxed(problem)
        rows, multipliers = found.rows, found.multipliers
        if rows is None:
            return SCALE.lowest, np.zeros(len(durations))
        self.seed = rows.source.chosen(multipliers > 1e-9 * multipliers.max(initial=1e-300))
        slopes = row_slopes(problem, found.knots, rows, multipliers)
        return float(found.slacks[0]), leg_sums(slopes, self.task.pieces)

    def _relaxed(self, problem: ReducedProblem) -> Relaxed:
        compiled = compile_walls(self.task, problem, self.units)
        return Elastic(problem, compiled, give_limits(compiled), seed=self.seed, far=SCALE.elastic_far).run()


def give_limits(compiled: Compiled) -> Relaxation:
    """One slack for all walls on derivatives, weighted by what slowing down does: order times."""
    order = np.concatenate([np.full(len(block.leg), block.order) for block in compiled.blocks])
    return Relaxation(np.where(order > 0, 0, -1), order.astype(np.float64), 1, SCALE.lowest)
