"""Components: groups of axes that no wall couples, each a QP of its own with a scaled Hessian."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.arrays import BoolArray, FloatArray, IntArray
from minsnap.optimisation.high_precision import is_extreme
from minsnap.optimisation.normalised_constraints import Compiled
from minsnap.optimisation.preconditioning import EXTENDED, Scaled, Space, Whitened, make_space
from minsnap.optimisation.qp import DENSE_SIZE, MIDDLE, solve_qp, solver_names
from minsnap.optimisation.reduced_qp import Problem

if TYPE_CHECKING:
    from minsnap.optimisation.rows import RowSet


def split_axes(compiled: Compiled, problem: Problem) -> list[BoolArray]:
    """Partition the axes into groups that no wall couples: masks of shape (dim,)."""
    coupled = np.eye(problem.dim, dtype=bool)
    for block in compiled.blocks:
        touched = block.touched().astype(np.float64)
        coupled |= touched.T @ touched > 0.0
    for _ in range(problem.dim):
        coupled = coupled.astype(np.float64) @ coupled > 0.0
    return [np.asarray(mask) for mask in np.unique(coupled, axis=0)]


class Component:
    """One group of axes: its unknowns, their scaled Hessian, and how to solve over given rows.

    The unknowns are written in coordinates where the Hessian is the identity (small problems) or has a unit diagonal,
    and divided by the largest violation; rows are normalised.  A small QP is then a least-distance problem.
    """

    def __init__(
        self, problem: Problem, base: FloatArray, axes: BoolArray, solver: str, dense: int = DENSE_SIZE
    ) -> None:
        self.problem, self.base, self.axes, self.dense = problem, base, axes, dense
        mine = problem.columns[:, :, axes]
        self.columns = np.flatnonzero(np.bincount(mine[mine >= 0], minlength=problem.size))
        self.names = solver_names(solver, len(self.columns))
        self.asked, self.solver = solver, ""
        self.failed: tuple[str, ...] = ()
        self.gain = 0.0
        self.careful = False
        self.active: BoolArray | None = None
        self.x, self.size, self.shrink = np.zeros(len(self.columns)), 1.0, np.nan
        self.held = False
        self._kept = (np.zeros((0, len(self.columns))), np.zeros(0))

    @cached_property
    def local(self) -> IntArray:
        """Position of every unknown in ``columns``, their number for those of other components."""
        local = np.full(self.problem.size + 1, len(self.columns), dtype=np.intp)
        local[self.columns] = np.arange(len(self.columns))
        return local

    @cached_property
    def space(self) -> Space:
        """Coordinates in which the Hessian is the identity, or has at least a unit diagonal."""
        n = len(self.columns)
        if self._floating:
            self.names = tuple(name for name in self.names if name != "daqp")
            return self._space(False)
        return self._space(n <= self.dense or (n <= EXTENDED and is_extreme(self.problem)))

    @property
    def _floating(self) -> bool:
        """Whether the whole curve may move along an axis at no cost, so that the Hessian is singular."""
        return bool((self.problem.free[:, 0].all(axis=0) & self.axes).any())

    def _space(self, dense: bool) -> Space:
        columns = self.local[self.problem.piece_columns[:, self.axes]]
        return make_space(self.problem, columns, len(self.columns), dense)

    @cached_property
    def slope(self) -> FloatArray:
        """Half the gradient at the base, in the coordinates of ``space``."""
        return self.space.gradient(_slope(self.problem, self.base, self.columns))

    @cached_property
    def _steepness(self) -> float:
        return float(np.abs(self.slope).max(initial=0.0))

    @cached_property
    def equalities(self) -> tuple[Any, FloatArray] | None:
        """Rows of the continuity above k - 1 and of gates' planes, normalised."""
        jumps = _jump_rows(self.problem, self.base, self.axes, self.local) if self.problem.jumps else None
        found = [part for part in (jumps, self._plane_rows()) if part is not None]
        if not found:
            return None
        width = max(part[0].shape[1] for part in found)
        columns = [np.pad(c, ((0, 0), (0, width - c.shape[1])), constant_values=len(self.columns)) for c, _, _ in found]
        values = [np.pad(v, ((0, 0), (0, width - v.shape[1]))) for _, v, _ in found]
        rows, norms = self.space.rows(np.concatenate(columns), np.concatenate(values))
        return rows, np.concatenate([part[2] for part in found]) / norms

    def _plane_rows(self) -> tuple[IntArray, FloatArray, FloatArray] | None:
        """Columns, values and right-hand sides of the planes that knots must lie in."""
        mine = [(knot, normal) for knot, normal in self.problem.planes if normal[self.axes].any()]
        if not mine:
            return None
        knots, normals = np.array([knot for knot, _ in mine]), np.array([normal for _, normal in mine])
        columns = self.local[self.problem.columns[knots, 0]]
        free = columns < len(self.columns)
        values = np.where(free, normals, 0.0)
        return columns, values, -(normals * self.base[knots, 0]).sum(axis=1)

    def _onto_planes(self, unknowns: FloatArray) -> FloatArray:
        """Move positions into their planes by what a solver left open."""
        found = self._plane_rows()
        if found is None:
            return unknowns
        padded = np.append(unknowns, 0.0)
        for columns, values, side in zip(*found, strict=True):
            padded[columns] += values * (side - values @ padded[columns]) / (values @ values)
        return padded[:-1]

    @property
    def sparse(self) -> bool:
        """Whether its last QP was sparse."""
        return isinstance(self.__dict__.get("space"), Scaled)

    @property
    def local_solves(self) -> bool:
        """Whether it may be solved for a part of its unknowns: sparse, no equalities, a regular Hessian."""
        return self.sparse and self.equalities is None and not self._floating

    @property
    def always(self) -> bool:
        """Whether it needs a solve even without rows."""
        return len(self.columns) > 0 and (bool(self.problem.jumps) or bool(self.problem.held.any()))

    def solve(self, rows: RowSet | None, chosen: IntArray, shrink: float) -> tuple[FloatArray, FloatArray] | None:
        """Solve over the chosen rows, walls moved inwards by ``shrink`` widths: unknowns and multipliers.

        When no solver answers in sparse coordinates, the problem is tried once more in whitened ones.
        """
        found = self._attempt(rows, chosen, shrink)
        if found is None and isinstance(self.space, Scaled) and not self._floating and len(self.columns) <= MIDDLE:
            self.whiten()
            found = self._attempt(rows, chosen, shrink)
        return found

    def whiten(self) -> None:
        """Change to coordinates in which the Hessian is the identity, and to dense solvers first."""
        for name in ("slope", "_steepness", "equalities"):
            self.__dict__.pop(name, None)
        self._kept, self.active = (np.zeros((0, len(self.columns))), np.zeros(0)), None
        self.space, self.names = self._space(True), ("daqp", *self.names)

    def mistrust(self, costly: bool) -> bool:
        """Take the most accurate solver first from now on; whether that is a change.

        A solver that was asked for is kept as long as what it leaves open is not costly.
        """
        replaceable = costly or self.asked == "auto"
        changed = replaceable and isinstance(self.space, Whitened) and self.solver != "nnls"
        if changed:
            self.careful, self.failed = True, tuple(dict.fromkeys((*self.failed, self.solver)))
        return changed

    @property
    def _solvers(self) -> tuple[str, ...]:
        """Solvers to try: a least-distance problem has one more, after the one that is asked for or quickest."""
        if not isinstance(self.space, Whitened):
            return self.names
        return ("nnls", *self.names) if self.careful else (self.names[0], "nnls", *self.names[1:])

    def _attempt(self, rows: RowSet | None, chosen: IntArray, shrink: float) -> tuple[FloatArray, FloatArray] | None:
        G, h, norms = None, None, np.ones(0)
        if rows is not None and len(chosen):
            G, h, norms = self.matrix(rows, chosen, shrink)
        A, b = self.equalities if self.equalities is not None else (None, None)
        size = max(self._steepness, _largest(h, -1.0), _largest(b, -1.0), _largest(b, 1.0)) or 1.0
        h, b = (None if side is None else side / size for side in (h, b))
        hessian, slope = self.space.hessian, self.slope / size
        found, failed = solve_qp(hessian, slope, G, h, A, b, self._solvers, active=self.active)
        self.failed = tuple(dict.fromkeys(self.failed + failed)) if found is not None else failed
        if found is None:
            return None
        self.solver = found.solver
        self.active = found.multipliers > 0.0 if isinstance(self.space, Whitened) else None
        self.size, self.shrink = size, shrink
        return self.take(size * found.x), 2.0 * size * found.multipliers / norms

    def take(self, x: FloatArray, held: bool = False) -> FloatArray:
        """Take a solution, found with some unknowns held or not, in the coordinates of ``space``: the unknowns."""
        self.x, self.held = x, held
        self.gain = float(x @ (self.space.hessian @ x) + 2.0 * self.slope @ x)
        return self._onto_planes(self.space.unknowns(x))

    def matrix(self, rows: RowSet, chosen: IntArray, shrink: float) -> tuple[Any, FloatArray, FloatArray]:
        """Normalised rows (r, n), their bounds, and the norms they were divided by."""
        matrix, norms = self._known(rows, chosen) if isinstance(self.space, Whitened) else self._rows(rows, chosen)
        return matrix, (rows.bound[chosen] - shrink * rows.width[chosen]) / norms, norms

    def _rows(self, rows: RowSet, chosen: IntArray) -> tuple[Any, FloatArray]:
        return self.space.rows(self.local[rows.columns[chosen]], rows.values[chosen])

    def _known(self, rows: RowSet, chosen: IntArray) -> tuple[FloatArray, FloatArray]:
        """Rows in whitened coordinates; rows are only ever added, so those of the last solve are kept."""
        matrix, norms = self._kept
        fresh = chosen[len(norms) :]
        if len(fresh):
            more, sizes = self._rows(rows, fresh)
            self._kept = np.concatenate((matrix, more)), np.concatenate((norms, sizes))
        return self._kept


def _largest(values: FloatArray | None, sign: float) -> float:
    """Largest positive value, of that sign; 0 if there is none."""
    if values is None or not len(values):
        return 0.0
    return max(0.0, float(values.max()) if sign > 0.0 else -float(values.min()))


def _slope(problem: Problem, base: FloatArray, columns: IntArray) -> FloatArray:
    """Half the gradient at the base where it does not vanish: at positions that the base holds."""
    if not problem.held.any():
        return np.zeros(len(columns))
    gradient = problem.gradient(base)
    if problem.closed:
        gradient[0] += gradient[-1]
    flat = np.zeros(problem.size)
    held = np.zeros(problem.free.shape, dtype=bool)
    held[problem.held, 0] = True
    place = held & (problem.columns >= 0)
    flat[problem.columns[place]] = gradient[place]
    return np.asarray(flat[columns])


def _jump_rows(
    problem: Problem, base: FloatArray, axes: BoolArray, local: IntArray
) -> tuple[IntArray, FloatArray, FloatArray] | None:
    """Equality rows that make higher derivatives continuous at the knots: columns, values, right-hand sides."""
    pieces = len(problem.durations)
    left = np.arange(pieces) if problem.closed else np.arange(pieces - 1)
    right = (left + 1) % pieces
    if not len(left):
        return None
    ends = problem.plain_ends(base)
    columns, values, sides = [], [], []
    for order in problem.jumps:
        before = problem.row_factors(left, np.ones(len(left)), order)
        after = problem.row_factors(right, np.zeros(len(right)), order)
        jump = np.einsum("rj,rjd->rd", before, ends[left]) - np.einsum("rj,rjd->rd", after, ends[right])
        for axis in np.flatnonzero(axes):
            both = (problem.piece_columns[left, axis], problem.piece_columns[right, axis])
            columns.append(local[np.concatenate(both, axis=1)])
            values.append(np.concatenate((before, -after), axis=1))
            sides.append(-jump[:, axis])
    return np.concatenate(columns), np.concatenate(values), np.concatenate(sides)
