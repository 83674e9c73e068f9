"""Round tubes: tangent planes where the curve sticks out (what the library does), or second-order cones there.

Both find the instants by the same exchange of rows and are certified by the same exact extrema; only the programme of a
round differs. Run it by hand: ``python benchmarks/bench_round.py``. It prints one row per problem.
"""

from __future__ import annotations

import time

import clarabel
import numpy as np
import scipy.sparse as sparse

import minsnap
from minsnap import RoundTube
from minsnap.optimisation import exchange
from minsnap.optimisation import master_qp as relaxation
from minsnap.optimisation.rows import Curve

SIZES = (2, 4, 10, 30, 100)
RECTANGLE = np.array([(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)], dtype=float)


class Cones(relaxation.Relaxation):
    """The same rounds, with a cone at each instant instead of a plane; one component, round walls alone."""

    def solve(self):
        if self.rows is None or len(self.components) > 1:
            return super().solve()
        self.solves += 1
        part, (A, b, size) = self.components[0], self._cones()
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
        P = sparse.triu(sparse.csc_matrix(part.space.hessian), format="csc")
        count = len(self.rows)
        cones = [clarabel.SecondOrderConeT(len(b) // count)] * count
        found = clarabel.DefaultSolver(P, part.slope / size, A, b, cones, settings).solve()
        x = size * np.array(found.x)
        self.gain = float(x @ (part.space.hessian @ x) + 2.0 * part.slope @ x)
        self.unknowns[part.columns] = part.space.unknowns(x)
        self.multipliers = 2.0 * size * np.array(found.z).reshape(count, -1)[:, 0] / self.rows.width
        part.solver = "clarabel cones"
        self.curve = Curve(self.problem, self.compiled, self.problem.add(self.base, self.unknowns))

    def _cones(self):
        """Rows (radius, offset) of every cone in units of its radius, and the size of the unknowns."""
        rows, problem, part, ball = self.rows.source, self.problem, self.components[0], self.compiled.blocks[0]
        matrix, radius = ball.matrix[rows.wall], ball.width[rows.wall][:, None]
        count, dim = matrix.shape[:2]
        factors = problem.row_factors(rows.piece, rows.s, 0)
        present = np.einsum("rqd,rj,rjd->rq", matrix, factors, self.ends[rows.piece])
        present = (present + ball.offset[rows.wall]) / radius
        values = (matrix[:, :, :, None] * factors[:, None, None, :] / radius[:, :, None, None]).reshape(count * dim, -1)
        columns = part.local[problem.piece_columns[rows.piece]].reshape(count, -1)
        normal, norms = part.space.rows(np.repeat(columns, dim, axis=0), values)
        lengths = np.linalg.norm(norms.reshape(count, dim), axis=1)
        size = float(((np.linalg.norm(present, axis=1) - 1.0) / lengths).max(initial=0.0)) or 1.0
        place = (np.arange(count)[:, None] * (dim + 1) + 1 + np.arange(dim)).reshape(-1)
        spread = sparse.csc_matrix((-norms, (place, np.arange(count * dim))), shape=(count * (dim + 1), count * dim))
        right = np.concatenate((np.full((count, 1), 1.0 - self.shrink), present), axis=1) / size
        return sparse.csc_matrix(spread @ sparse.csc_matrix(normal)), right.reshape(-1), size


def course(legs, seed=0):
    draw = np.random.default_rng(seed)
    steps = draw.normal(size=(legs, 3))
    steps *= draw.uniform(1.0, 6.0, (legs, 1)) / np.linalg.norm(steps, axis=1, keepdims=True)
    return np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])


def best_of(points, durations, radius, name, repeats=5):
    best, traj = np.inf, None
    for _ in range(repeats):
        began = time.perf_counter()
        traj = minsnap.plan(points, durations, corridor=RoundTube(radius), solver=name)
        best = min(best, time.perf_counter() - began)
    return best, traj


def with_cones(points, durations, radius):
    exchange.Relaxation = Cones
    try:
        return best_of(points, durations, radius, "auto")
    finally:
        exchange.Relaxation = relaxation.Relaxation


def main():
    print("| problem | planes, auto | planes, Clarabel | cones, Clarabel | rounds | rows | cost cones / planes |")
    print("|---|---|---|---|---|---|---|")
    problems = [(f"rectangle, {radius} m", RECTANGLE, [4, 2, 4, 2], radius) for radius in (0.3, 0.01)]
    for legs in SIZES:
        points = course(legs, legs)
        times = np.linalg.norm(np.diff(points, axis=0), axis=1) / 1.5
        problems.append((f"{legs} random legs, 0.3 m", points, times, 0.3))
    for name, points, durations, radius in problems:
        planes, first = best_of(points, durations, radius, "auto")
        same = best_of(points, durations, radius, "clarabel")[0]
        cones, second = with_cones(points, durations, radius)
        if min(first.report.corridor_margin, second.report.corridor_margin) < 0.0:
            raise RuntimeError(f"{name}: outside the tube")
        print(
            f"| {name} | {1e3 * planes:.1f} ms | {1e3 * same:.1f} ms | {1e3 * cones:.1f} ms | "
            f"{first.report.rounds}, {second.report.rounds} | {first.report.rows}, {second.report.rows} | "
            f"{second.cost() / first.cost():.7f} |"
        )


if __name__ == "__main__":
    main()
