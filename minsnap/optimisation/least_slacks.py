r"""By how much walls must give way for a curve to keep them, and what presses against them then.

Each group of walls gets a slack: :math:`g(z) \le b + \sigma\,\text{width}\,\text{weight}`.  The native core answers
most questions.  Where it does not, or there is none, the least sum of the slacks is a linear programme of rows at many
instants, to which those are added where its curve leaves the walls that gave way; the cost of the curve has no part in
it.  HiGHS ends at a vertex, whose multipliers are those of a proof: the rows that press add up to nothing but slacks.
Where they differ by too many decades for that, non-negative least squares find others.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.deadline import WORK
from minsnap.basics.tolerances import EXACT, ROUNDING
from minsnap.native.corridor import Give, LeastSlack, least_slack
from minsnap.native.status import Status
from minsnap.optimisation.linear_rows import equations, point_scale
from minsnap.optimisation.native_solve import corridor_question
from minsnap.optimisation.rows import Curve, Rows, everywhere, outside
from minsnap.optimisation.task import Task
from minsnap.optimisation.task_walls import AllWalls, all_walls, normalised_walls

ROUNDS = 20
"""Linear programmes at most; the slacks are then from below, and what presses may prove that they are not zero."""

ACCURACY = 3e-4
"""Excess over the walls that gave way, in widths, that ends them."""

STALLED = 1e-4
"""Share by which the sum of the slacks must grow in a round, once it is above zero."""


def common_slack(walls: AllWalls) -> Give:
    """Return one slack for all walls but the planes on which the curve lies."""
    return Give(np.where(walls.equal, -1, 0), np.ones(len(walls)), 1)


def native_slacks(
    task: Task, durations: FloatArray, give: Give, lowest: float = 0.0, sign: bool = False, effort: float = 2.2
) -> LeastSlack | None:
    """Return the least slacks, from a lowest that is not positive, by the native core; None without it.

    With ``sign`` they end where they are known to be more; ``effort`` is as for a solve, of all stages together.

    Raises
    ------
    LateError
        Where time or work are over.
    """
    walls = all_walls(task)
    if lowest:
        walls = walls.relaxed(lowest * np.where(give.group < 0, 0.0, give.weight))
    question = corridor_question(replace(task, solver="auto"), durations, task.units(durations), walls)
    if isinstance(question, str):
        return None
    least = least_slack(question, give, sign, min(effort, task.deadline.solves), task.deadline.left)
    task.deadline.spend(WORK.solve * least.work)
    task.deadline.require()
    return replace(least, slacks=least.slacks + lowest)


class SlackProgramme:
    """Linear programmes of the least sum of slacks.

    Parameters
    ----------
    task : Task
    durations : ndarray, shape (pieces,)
        [s].
    give : Give
    lowest : float
        Least value of a slack, not positive: below zero walls move inwards.
    """

    def __init__(self, task: Task, durations: FloatArray, give: Give, lowest: float = 0.0) -> None:
        units, self.deadline, self.lowest = task.units(durations), task.deadline, lowest
        self.problem = problem = task.problem(durations, units)
        self.walls = normalised_walls(task, problem, units)
        count = len(self.walls)  # planes of gates, which come after them, are equations here
        self.give = replace(give, group=give.group[:count], weight=give.weight[:count])
        self.base = problem.values
        self.scale, self.ends = point_scale(problem), problem.plain_ends(self.base)
        self.equal, self.sides = equations(problem, self.base)
        self._last: tuple[Rows, FloatArray, FloatArray, FloatArray] | None = None

    def run(self, sign: bool = False) -> LeastSlack:
        """Return the least slacks and the rows that press; neither where there is no solution.

        Parameters
        ----------
        sign : bool
            Whether it is sufficient to know that walls must give way, or a curve with half of the room that there is.

        Raises
        ------
        LateError
            Where time or work are over.
        """
        start = Curve(self.problem, self.walls, self.base)
        rows = start.rows(everywhere(self.walls, self.problem.degree + 1), self.ends)
        last, total = None, -np.inf
        for _ in range(ROUNDS):
            solution = None if last and not self.deadline.affords(0.0) else self._solved(rows)
            if solution is None:
                break
            last = rows, *solution
            _, knots, slacks, _ = last
            amounts = np.append(slacks, 0.0)[self.give.group] * self.give.weight
            curve = Curve(self.problem, self.walls.relaxed(amounts), knots)
            places, excess = outside(curve, ACCURACY)
            before, total = total, float(slacks.sum())
            stays = total > ACCURACY and total - before < STALLED * total
            known = sign and (total > ACCURACY or excess < -total / 2.0)
            if not places or stays or known:
                break
            rows = rows.joined(curve.rows(places, self.ends, amounts * self.walls.width))
        self._last = last
        return self._pressed(*last) if last else self._nothing()

    def evidence(self) -> LeastSlack:
        """Return the same with multipliers by non-negative least squares, where those of the vertex prove nothing.

        They are sought among the rows that press most, eight for each unknown, in coordinates of the solutions of all
        equations in which these rows have orthonormal columns.
        """
        from scipy.linalg import null_space
        from scipy.optimize import nnls

        if self._last is None or not self.problem.size:
            return self._nothing()
        self.deadline.require()
        rows, knots, slacks, multipliers = self._last
        width = self.walls.width[rows.wall]
        chosen = np.sort(np.argsort(-multipliers * width, kind="stable")[: 8 * (self.problem.size + 1)])
        matrix = rows.matrix[chosen].multiply(self.scale).toarray() / width[chosen, None]
        right = (rows.bound / width)[chosen]
        if len(self.sides):
            dense = self.equal.toarray()
            right = right - matrix @ np.linalg.lstsq(dense, self.sides, rcond=None)[0]
            matrix = matrix @ null_space(dense)
        _, sizes, directions = np.linalg.svd(np.linalg.qr(matrix, mode="r"), full_matrices=False)
        told = sizes > ROUNDING * sizes.max(initial=0.0)
        along = directions[told] / sizes[told, None] @ matrix.T
        system = np.vstack((along, right / (np.abs(right).max() or 1.0)))
        steps = max(1, int(6e8 / len(right) ** 2))  # which takes a second or two: a step that of the square
        try:
            found = nnls(system, np.append(np.zeros(len(system) - 1), -1.0), maxiter=steps)[0]
        except RuntimeError:
            return self._nothing()
        evidence = np.zeros(len(width))
        evidence[chosen] = found / width[chosen]
        return self._pressed(rows, knots, slacks, evidence)

    def _solved(self, rows: Rows) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """Knots, slacks and the multipliers of rows in normalised units; None where there is no solution."""
        from scipy.optimize import linprog
        from scipy.sparse import coo_matrix, csr_matrix, diags, hstack

        width, wall, slacks = self.walls.width[rows.wall], rows.wall, self.give.slacks
        matrix = diags(1.0 / width) @ rows.matrix.multiply(self.scale)
        gives = np.flatnonzero(self.give.group[wall] >= 0)
        places = gives, self.give.group[wall[gives]]
        moved = coo_matrix((-self.give.weight[wall[gives]], places), shape=(len(wall), slacks))
        sums, size = csr_matrix(hstack((matrix, moved))), self.problem.size
        self.deadline.require()
        price = WORK.slacks * (sums.nnz + 1)
        pivots = 5 * sum(sums.shape)  # of the simplex method, which can cycle; up to three were needed
        found = linprog(
            np.append(np.zeros(size), np.ones(slacks)),
            sums,
            rows.bound / width,
            hstack((self.equal, csr_matrix((len(self.sides), slacks)))) if len(self.sides) else None,
            self.sides if len(self.sides) else None,
            [(None, None)] * size + [(self.lowest, None)] * slacks,
            options={
                "maxiter": int(min(pivots, 1.0 + self.deadline.left_of_work / price)),
                "presolve": bool(np.abs(sums.data).max(initial=0.0) < 1e9),  # beyond, one did not end, without a pivot
            },
        )
        self.deadline.spend(price * found.nit)
        if not found.success:
            return None
        knots = self.problem.add(self.base, found.x[:size] * self.scale)
        return knots, found.x[size:], np.maximum(-found.ineqlin.marginals, 0.0) / width

    def _pressed(self, rows: Rows, knots: FloatArray, slacks: FloatArray, multipliers: FloatArray) -> LeastSlack:
        """Return the rows that press, with the directions of tangent planes."""
        press = np.flatnonzero(multipliers)
        wall, multiplier, direction = rows.wall[press], multipliers[press], np.zeros((len(press), self.problem.dim))
        for row, (number, normal) in enumerate(zip(wall.tolist(), rows.normal[press], strict=True)):
            block, index = self.walls.place(number)
            if not block.flat:
                own = np.linalg.lstsq(block.matrix[index].T, normal + block.slope[index], rcond=None)[0]
                direction[row, : len(own)] = own / max(float(np.linalg.norm(own)) * (1.0 + EXACT), EXACT)
        largest, remainder = multiplier.max(initial=0.0) or 1.0, np.zeros(len(press))
        known = wall.astype(np.int64), rows.s[press], multiplier / largest, direction, remainder
        return LeastSlack(Status.DONE, slacks, knots, *known, work=0.0)

    def _nothing(self) -> LeastSlack:
        none, still, vectors = np.zeros(0), np.zeros(self.give.slacks), np.zeros((0, self.problem.dim))
        known = none.astype(np.int64), none, none, vectors, none
        return LeastSlack(Status.NO_PROGRESS, still, self.base, *known, work=0.0)
