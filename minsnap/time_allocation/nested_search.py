r"""The shortest durations that can be flown within limits.

For given durations let :math:`\tau` be the least relative relaxation of all limits that makes the problem solvable
(one more variable in the QP).  Making every leg slower by a factor relaxes all limits by known powers of it, so one
Newton step on :math:`\tau = 0` gives the least scale of these durations, and the multipliers give how it changes with
each of them.  The logarithm of the scaled total is minimised by L-BFGS (scipy); a few dozen solves.
"""

from __future__ import annotations

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.errors import SolverError
from minsnap.limits.limits import Limits
from minsnap.optimisation.elastic import Elastic, Give, Relaxed
from minsnap.optimisation.gradient import row_slopes
from minsnap.optimisation.normalised_constraints import Compiled, WallRows, compile_walls
from minsnap.optimisation.problem import Task
from minsnap.optimisation.reduced_qp import Problem
from minsnap.optimisation.unconstrained import unbounded_optimum
from minsnap.time_allocation.least_cost import (
    BARRED,
    PEAK_ACCELERATION,
    PEAK_JERK,
    PEAK_SNAP,
    PEAK_SPEED,
    Log,
    leg_sums,
)
from minsnap.time_allocation.time_stretch import nothing_limits
from minsnap.trajectory.report import Progress

CLOSE = 3e-3
"""Relaxation below which one Newton step gives the scale."""

NEWTON_STEPS = 40

FLAT = 1e-4
"""Slope of the relaxation in the logarithm of time below which it counts as flat."""

LARGEST_STEP = 0.7
"""Of the logarithm of the time scale."""

FEW_LEGS = 6
"""Legs up to which the search is carried on to the end; with more it stops where the rest is not worth the time."""

ITERATIONS = 40
ACCURACY = 1e-6
"""Relative change of the total at which the search ends."""

LOWEST = -0.5
"""Limits are tightened to half at most."""

TOUCHING = 1e-10
"""How far below 1 the largest utilisation may be."""

CROSSING_STEPS = 100
"""Steps in which a least thrust is looked for beyond the speed at which its vertical part is kept."""

OVERUSED = 2.0
"""Utilisation above which it does not matter by how much a limit is exceeded."""

SLOWEST = 40.0
"""Bound on the logarithm of a factor on time."""

FIRST_STEP = 0.02
"""Of the logarithm of a factor on time, from a guess."""

REACH = 3.0
"""Bound on the logarithm of a leg's factor on its first guess."""


def stop_and_go_times(lengths: FloatArray, limits: Limits) -> FloatArray:
    """Leg durations at which the rest-to-rest profile of degree 7 along each leg keeps the limits on norms."""
    speed, acceleration, jerk, snap = norm_limits(limits)
    times = [
        PEAK_SPEED * lengths / speed,
        np.sqrt(PEAK_ACCELERATION * lengths / acceleration),
        np.cbrt(PEAK_JERK * lengths / jerk),
        (PEAK_SNAP * lengths / snap) ** 0.25,
    ]
    longest = np.max(times, axis=0)
    return np.asarray(longest if longest.all() else np.maximum(longest, 1e-3 + lengths))


def norm_limits(limits: Limits) -> tuple[float, float, float, float]:
    """Speed, acceleration, jerk and snap that a motion in any direction may reach; infinite where free."""
    speeds = (limits.speed, limits.horizontal_speed, limits.vertical_speed, limits.climb_speed, limits.descent_speed)
    reserve = [] if limits.max_thrust is None else [(limits.max_thrust - 1.0) * limits.gravity]
    reserve += [] if limits.min_thrust is None else [(1.0 - limits.min_thrust) * limits.gravity]
    reserve += [] if limits.tilt is None else [limits.gravity * np.sin(limits.tilt)]
    accelerations = (limits.acceleration, limits.horizontal_acceleration, limits.vertical_acceleration, *reserve)
    jerks = (limits.jerk, None if limits.body_rate is None else 0.5 * limits.gravity * limits.body_rate)
    return _least(*speeds), _least(*accelerations), _least(*jerks), _least(limits.snap)


def _least(*values: float | None) -> float:
    return min((value for value in values if value is not None), default=np.inf)


class ShortestSearch:
    """Search for the leg durations of least sum at which corridor and limits can all be kept.

    Parameters
    ----------
    task : Task
        Its walls include those of the limits.
    first : ndarray, shape (legs,)
        Durations to begin with [s]; their proportions matter.
    progress : callable, optional
        Called with every Step.
    """

    def __init__(self, task: Task, first: FloatArray, progress: Progress | None = None) -> None:
        self.task, self.first = task, first
        self.units = task.units(task.piece_durations(first))
        self.scale = 0.0
        self.seed: WallRows | None = None
        self.best: tuple[float, FloatArray] = (np.inf, first)
        self.log = Log(progress)

    def run(self) -> FloatArray:
        """Return the best leg durations found, shape (legs,) [s]."""
        if self.task.legs == 1:
            self.evaluate(np.zeros(1))
            return self.best[1]
        from scipy.optimize import minimize

        bounds = [(-REACH, REACH)] * self.task.legs
        few = self.task.legs <= FEW_LEGS
        options = {"maxiter": ITERATIONS if few else ITERATIONS // 3, "ftol": ACCURACY if few else 100.0 * ACCURACY}
        minimize(self.evaluate, np.zeros(self.task.legs), jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        return self.best[1]

    def evaluate(self, logarithms: FloatArray) -> tuple[float, FloatArray]:
        """Logarithm of the least total in these proportions, and its gradient."""
        shares, scale = self.first * np.exp(logarithms), self.scale
        try:
            slopes = self._rescale(shares)
        except SolverError:
            if not np.isfinite(self.best[0]):
                raise
            self.scale = scale
            return self.best[0] + BARRED, np.zeros(len(shares))
        value = float(np.log(shares.sum()) + self.scale)
        if value < self.best[0]:
            self.best = (value, shares * np.exp(self.scale))
        self.log.add(np.exp(value), np.exp(value))
        return value, shares / shares.sum() - slopes / slopes.sum()

    def _rescale(self, shares: FloatArray) -> FloatArray:
        """Find the least scale of these proportions by Newton's method; return the slopes there.

        Where a pin uses a limit up, or the durations are very long, the relaxation is flat: then time is shortened
        until it is not.
        """
        steep: FloatArray | None = None
        for _ in range(NEWTON_STEPS):
            slack, slopes = self.relaxation(shares * np.exp(self.scale))
            total = float(slopes.sum())
            if total > -FLAT:
                if slack > CLOSE:
                    self.scale += LARGEST_STEP
                    continue
                if steep is not None:
                    return steep
                self.scale -= LARGEST_STEP
                continue
            steep = slopes
            self.scale += float(np.clip(-slack / total, -LARGEST_STEP, LARGEST_STEP))
            if abs(slack) < CLOSE:
                return slopes
        if slack <= CLOSE and steep is None:
            raise nothing_limits(sorted({wall.name for wall in self.task.walls if wall.order}))
        raise SolverError("no durations were found at which the corridor and the limits agree")

    def relaxation(self, durations: FloatArray) -> tuple[float, FloatArray]:
        r"""Return :math:`\tau` at these leg durations, and :math:`T_i \partial\tau / \partial T_i`, shape (legs,)."""
        problem = self.task.problem(self.task.piece_durations(durations), self.units)
        found = self._relaxed(problem)
        rows, multipliers = found.rows, found.multipliers
        if rows is None:
            return LOWEST, np.zeros(len(durations))
        self.seed = rows.source.chosen(multipliers > 1e-9 * multipliers.max(initial=1e-300))
        slopes = row_slopes(problem, found.knots, rows, multipliers)
        return float(found.slacks[0]), leg_sums(slopes, self.task.pieces)

    def _relaxed(self, problem: Problem) -> Relaxed:
        compiled = compile_walls(self.task, problem, self.units)
        base = unbounded_optimum(problem)
        return Elastic(problem, base, compiled, self.task.solver, give_limits(compiled), self.seed).run()


def give_limits(compiled: Compiled) -> Give:
    """One slack for all walls on derivatives, weighted by what slowing down does: order times."""
    order = np.concatenate([np.full(len(block.piece), block.order) for block in compiled.blocks])
    return Give(np.where(order > 0, 0, -1), order.astype(np.float64), 1, LOWEST)
