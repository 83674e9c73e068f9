r"""The cone programme of one step of the joint search, around a state.

Its unknowns are changes of the scaled derivatives, relative changes of the durations, and one slack each for limits and
for walls.  Rows hold at a grid of instants near a limit and at the peaks that are known.  The cost is the objective to
second order, a proximal term in the units of the limits, and the positive part of the second derivative of the
Lagrangian, half of it: what curves there is how end derivatives depend on durations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.deadline import NEVER
from minsnap.native.joint_steps import Pull
from minsnap.time_allocation.cone_programme import ACCURACY, ConeProgramme, ConeSolution, Rows, solve_programme
from minsnap.time_allocation.curvature import Forces, positive_curvature
from minsnap.time_allocation.joint_layout import NEIGHBOURS, SLACKS, JointLayout, JointState, end_basis, end_metric
from minsnap.time_allocation.joint_regions import JointRegions
from minsnap.time_allocation.joint_rows import WALL, Block, largest_metrics
from minsnap.time_allocation.native_steps import PATH_METRIC, NativeSteps, Tried, instants, known_peaks
from minsnap.time_allocation.objectives import Objective, Penalties, TotalTime
from minsnap.time_allocation.true_peaks import Peaks, scattered

LONGEST, SHORTEST = 1.0, 0.6
"""Largest relative change of a duration in one step, longer and shorter."""

CURVATURE_SHARE = 0.5
"""Of the positive part of the Lagrangian's second derivative, which exceeds the whole along the active rows."""


@dataclass(frozen=True)
class Caution:
    """How far a step may go.

    Parameters
    ----------
    proximity : float
        Weight of the proximal term.
    reach : float
        By how much the relative changes of neighbouring durations may differ.
    accuracy : float
        Gap and residuals at which the native core may stop.
    """

    proximity: float = 1e-2
    reach: float = 0.2
    accuracy: float = ACCURACY

    def after(self, share: float, good: bool) -> Caution:
        """Return what to allow after an accepted share of a step."""
        if share == 1.0:
            return self._with(max(0.2 * self.proximity, 1e-7), min(1.6 * self.reach, 0.8)) if good else self
        if share == 0.5:
            return self._with(max(2.0 * self.proximity, 1e-5), max(0.7 * self.reach, 1e-3))
        return self._with(max(5.0 * self.proximity, 1e-4), max(0.4 * self.reach, 1e-3))

    def failed(self) -> Caution:
        """Return what to allow after a step without descent."""
        return self._with(max(10.0 * self.proximity, 1e-3), max(0.3 * self.reach, 1e-3))

    def _with(self, proximity: float, reach: float) -> Caution:
        return replace(self, proximity=proximity, reach=reach)


@dataclass(frozen=True)
class Inwards:
    """By how much limits (in factors on time) and walls (in widths) are moved inwards."""

    limit: float = 0.0
    wall: float = 0.0

    def of(self, slack: int) -> float:
        """Return what belongs to a slack."""
        return self.wall if slack == WALL else self.limit


class JointModel:
    """Builds the programmes of one search.

    Parameters
    ----------
    layout : JointLayout
    blocks : sequence of Block
    regions : JointRegions
    lengths : ndarray, shape (pieces in all,)
        Typical length of each piece, normalised.
    native : NativeSteps, optional
        The same in the native core, which is asked first.
    objective : Objective, optional
        The time unless given.
    least : ndarray, shape (pieces in all,), optional
        Durations that no step goes below.
    """

    def __init__(
        self,
        layout: JointLayout,
        blocks: Sequence[Block],
        regions: JointRegions,
        lengths: FloatArray,
        native: NativeSteps | None = None,
        objective: Objective | None = None,
        least: FloatArray | None = None,
    ) -> None:
        self.layout, self.blocks, self.regions, self.lengths, self.native = layout, blocks, regions, lengths, native
        self.objective = TotalTime(layout) if objective is None else objective
        self.least = least
        self._pull = Pull(np.zeros((layout.pieces, 2 * layout.half, layout.dim)), np.zeros(layout.pieces))
        self.grid = np.linspace(0.0, 1.0, instants(layout))
        self.orders = 1 + max(order for block in blocks for order in block.orders)
        self._gradients: list[tuple[IntArray, FloatArray, FloatArray]] = []

    @property
    def _size(self) -> int:
        return self.layout.size + self.layout.pieces + SLACKS

    def step(
        self,
        state: JointState,
        peaks: Sequence[Peaks],
        former: Sequence[Sequence[Peaks]],
        caution: Caution,
        penalties: Penalties,
        inwards: Inwards = Inwards(),
        tried: Tried | None = None,
    ) -> FloatArray | None:
        """Build the programme around a state and solve it; None where it has no solution.

        Before a deadline, what the native core does not solve counts as such: the other solver takes too long.

        Parameters
        ----------
        state : JointState
        peaks, former : sequence by block
            Where rows must stand: at the peaks of the state, and at remembered ones that are not close to those.
        caution : Caution
        penalties : Penalties
        inwards : Inwards
        tried : Tried, optional
            A step that failed: bounds are corrected so that the rows at it are what the conditions turned out to be.

        Returns
        -------
        ndarray, shape (unknowns,), or None
        """
        deadline = self.layout.task.deadline
        deadline.check()
        if self.native is not None:
            regions = self._given_rows(state, inwards)
            bounds = (caution.proximity, caution.reach, LONGEST, SHORTEST, penalties.limit, penalties.wall)
            numbers = (*bounds, inwards.limit, inwards.wall, caution.accuracy, deadline.left)
            terms, known = self.objective.terms(state), known_peaks(peaks, former)
            model = terms.linear, terms.hessian
            found = self.native.step(state, known, regions, self.lengths, numbers, model, self._pull, tried)
            deadline.resume()
            if found is not None or deadline is not NEVER:
                return found
        return self._step_in_python(state, peaks, former, caution, penalties, inwards, tried)

    def _step_in_python(
        self,
        state: JointState,
        peaks: Sequence[Peaks],
        former: Sequence[Sequence[Peaks]],
        caution: Caution,
        penalties: Penalties,
        inwards: Inwards,
        tried: Tried | None,
    ) -> FloatArray | None:
        known = [found.joined(others) for found, others in zip(peaks, former, strict=True)]
        self._gradients = []
        programme = self.programme(state, known, caution, penalties, inwards, tried)
        solution = solve_programme(programme)
        if solution is None:
            return None
        self.take_forces(solution)
        return solution.x

    def programme(
        self,
        state: JointState,
        peaks: list[Peaks],
        caution: Caution,
        penalties: Penalties,
        inwards: Inwards = Inwards(),
        tried: Tried | None = None,
    ) -> ConeProgramme:
        """Build the programme around a state.

        Parameters
        ----------
        peaks : list of Peaks
            Where rows must stand, by block.
        caution : Caution
        penalties : Penalties
        inwards : Inwards
        tried : Tried, optional
        """
        self._inwards, self._gradients, self._tried = inwards, [], tried
        self._state, self._ends = state, self.layout.ends(state)
        self._scales = self.layout.scales(state)
        rows = [self._block_rows(block, found) for block, found in zip(self.blocks, peaks, strict=True)]
        rows += [*self._step_rows(caution.reach), *self._given_rows(state, inwards)]
        terms, diagonal = self.objective.terms(state), np.full(self._size, 1e-10)
        share = state.durations / state.total
        begin = self.layout.size
        diagonal[begin:-SLACKS] += 0.1 * caution.proximity * share
        diagonal[-SLACKS:] = 1e-6
        linear = terms.linear.copy()
        linear[-SLACKS:] = penalties.limit, penalties.wall
        return ConeProgramme(
            self._size,
            self.layout.unknowns,
            self._hessian(caution.proximity * share) + (0.0 if terms.hessian is None else terms.hessian),
            diagonal,
            linear,
            rows,
            self.layout.places,
        )

    def _given_rows(self, state: JointState, inwards: Inwards) -> list[Rows]:
        """Rows of knots in regions, and of least durations."""
        width = self.layout.unknowns.shape[1]
        rows = self.regions.rows(state, inwards.wall)
        if self.least is not None:
            matrix = np.zeros((self.layout.pieces, 1, width))
            matrix[:, 0, width - SLACKS - 2] = -1.0
            rows.append(Rows(np.arange(self.layout.pieces), matrix, (1.0 - self.least / state.durations)[:, None]))
        return rows

    def _block_rows(self, block: Block, peaks: Peaks) -> Rows:
        """Cones of one block, at the instants of the grid near the limit and at peaks."""
        index, s = self._instants(block, peaks)
        piece = block.piece[index]
        x = scattered(self.layout, self._state, self._ends, piece, s, block.orders)
        cones = block.linearised(x, index)
        local = np.zeros((len(index), block.size, 2 * self.layout.half, self.layout.dim))
        for order, slope in cones.gradient.items():
            factors = end_basis(self.layout.degree, order, s) / self._state.durations[piece, None] ** order
            local += factors[:, None, :, None] * slope[:, :, None, :]
        self._gradients.append((piece, local, cones.curvature))
        slack = np.zeros((len(index), block.size, SLACKS))
        slack[:, 0, block.slack] = block.weight
        matrix, bound = -self._in_unknowns(piece, local, cones.own, slack), cones.value.copy()
        if self._tried is not None:
            bound = self._corrected(block, index, piece, s, matrix, self._tried)
        bound[:, 0] -= block.weight * self._inwards.of(block.slack)
        return Rows(piece, matrix, bound)

    def _corrected(
        self, block: Block, index: IntArray, piece: IntArray, s: FloatArray, matrix: FloatArray, tried: Tried
    ) -> FloatArray:
        """Bounds for which rows at a step are the conditions after it (second-order correction), (n, c)."""
        x = scattered(self.layout, tried.state, self.layout.ends(tried.state), piece, s, block.orders)
        longer = (tried.state.durations / self._state.durations)[piece, None] ** block.power
        step = np.append(tried.step[:-SLACKS], np.zeros(SLACKS + 1))[self.layout.unknowns[piece]]
        return np.asarray(block.linearised(x, index).value * longer + np.einsum("ncx,nx->nc", matrix, step))

    def _instants(self, block: Block, peaks: Peaks) -> tuple[IntArray, FloatArray]:
        x = {p: np.matmul(end_basis(self.layout.degree, p, self.grid), self._ends) for p in block.orders}
        x = {p: values / self._state.durations[:, None, None] ** p for p, values in x.items()}
        row, place = np.nonzero(block.on_grid(x) > -block.band)
        return np.concatenate((row, peaks.index)), np.concatenate((self.grid[place], peaks.s))

    def _in_unknowns(self, piece: IntArray, local: FloatArray, own: FloatArray, slack: FloatArray) -> FloatArray:
        """Rows (n, c, width) from gradients in ends (n, c, 2k, dim), in the own duration, and in the slacks."""
        shape = local.shape[:2]
        values = local * self._scales[piece][:, None, :, None]
        times = np.einsum("ncjd,njdq->ncq", local, self._bends[piece])
        times[:, :, 1] += own
        return np.concatenate((values.reshape(*shape, local.shape[2] * local.shape[3]), times, slack), axis=2)

    @property
    def _bends(self) -> FloatArray:
        """Derivatives of the ends in the logarithms of the durations around, (pieces, 2k, dim, 3)."""
        return np.asarray(self._ends[:, :, :, None] * self.layout.exponents[:, :, None, :])

    def _step_rows(self, reach: float) -> list[Rows]:
        """Bounds of the durations' changes, of their differences, and of the slacks."""
        pieces, width = self.layout.pieces, self.layout.unknowns.shape[1]
        own = width - SLACKS - 2
        every = np.arange(pieces)
        chain = every[self.layout.neighbours[:, 2] >= 0] if pieces > 1 else every[:0]
        bounds = np.zeros((2 * pieces + 2 * len(chain) + SLACKS, 1, width))
        limit = np.concatenate((np.full(pieces, LONGEST), np.full(pieces, SHORTEST), np.full(2 * len(chain), reach)))
        bounds[:pieces, 0, own], bounds[pieces : 2 * pieces, 0, own] = 1.0, -1.0
        first, second = slice(2 * pieces, 2 * pieces + len(chain)), slice(2 * pieces + len(chain), -SLACKS)
        bounds[first, 0, own], bounds[first, 0, own + 1] = 1.0, -1.0
        bounds[second, 0, own], bounds[second, 0, own + 1] = -1.0, 1.0
        bounds[-2, 0, -2] = bounds[-1, 0, -1] = -1.0
        piece = np.concatenate((every, every, chain, chain, np.zeros(SLACKS, dtype=np.intp)))
        return [Rows(piece, bounds, np.append(limit, np.zeros(SLACKS))[:, None])]

    def _hessian(self, weight: FloatArray) -> FloatArray:
        """Proximal term, objective and curvature, (pieces, width, width)."""
        layout = self.layout
        dim, ends, width = layout.dim, 2 * layout.half * layout.dim, self.layout.unknowns.shape[1]
        metric = self._metric() * weight[:, None, None]
        metric *= self._scales[:, :, None] * self._scales[:, None, :]
        whole = np.zeros((layout.pieces, width, width))
        blocks = np.einsum("ijk,de->ijdke", metric, np.eye(dim))
        whole[:, :ends, :ends] = blocks.reshape(layout.pieces, ends, ends)
        if self._pull.known[0]:
            forces = Forces(self._pull.ends, self._pull.own)
            bent = positive_curvature(layout, self._ends, self._scales, forces, self.lengths)
            size = ends + NEIGHBOURS
            whole[:, :size, :size] += CURVATURE_SHARE * bent
        return whole

    def _metric(self) -> FloatArray:
        """Squares of changes of the curve in units of the limits, (pieces, 2k, 2k) in ends."""
        degree, durations = self.layout.degree, self._state.durations
        total = PATH_METRIC * end_metric(degree, 1) / self.lengths[:, None, None] ** 2
        for order, size in largest_metrics(self.blocks, len(durations)).items():
            total = total + end_metric(degree, order) * ((size / durations**order) ** 2)[:, None, None]
        return np.asarray(total)

    def take_forces(self, solution: ConeSolution) -> None:
        """Keep what the multipliers of the last programme pull at, for the curvature of the next one."""
        layout = self.layout
        ends, own = np.zeros((layout.pieces, 2 * layout.half, layout.dim)), np.zeros(layout.pieces)
        for (piece, local, curvature), z in zip(self._gradients, solution.multipliers, strict=False):
            np.add.at(ends, piece, -np.einsum("nc,ncjd->njd", z, local))
            np.add.at(own, piece, -(z * curvature).sum(axis=1))
        self._pull = Pull(ends, own, [True])
