"""The rectangle in its corridor: the reference core against samples, the full problem and Bernstein hulls.

Run it by hand: ``python benchmarks/bench_corridor.py``.
"""

from __future__ import annotations

from functools import partial
from math import comb

import numpy as np
import qpsolvers
from measure import least_times, table, text
from problems import DURATIONS, RECTANGLE, walk
from scipy.sparse import csc_matrix

import minsnap
from minsnap.native.library import using
from minsnap.optimisation.textbook_qp import build_qp

WIDTHS = (1e-4, 1e-3, 1e-2, 0.05, 0.1, 0.3, 1.0, 2.0)
SAMPLES = 20


def solve_full(problem, solver):
    """Solve the full problem as it is."""
    solution = qpsolvers.solve_problem(problem.for_qpsolvers(dense=solver == "daqp"), solver)
    return solution.x if solution.found else None


def hull(points, durations, widths):
    """Cost of the same problem with every control point inside its tube, which is sufficient and cautious."""
    problem = build_qp(points, durations, samples=0)
    legs, dim, size = len(durations), problem.dim, problem.degree + 1
    to_points = np.array([[comb(j, i) / comb(size - 1, i) for i in range(size)] for j in range(size)])
    rows, bounds = [], []
    for leg, width in enumerate(np.broadcast_to(widths, legs)):
        unit = points[leg + 1] - points[leg]
        unit = unit / np.linalg.norm(unit)
        for normal in np.eye(dim) - np.outer(unit, unit):
            if np.abs(normal).max() < 1e-12:
                continue
            block = np.zeros((size, legs * dim * size))
            for axis in range(dim):
                begin = (leg * dim + axis) * size
                block[:, begin : begin + size] = normal[axis] * to_points
            rows += [block, -block]
            bounds += [np.full(size, width + normal @ points[leg]), np.full(size, width - normal @ points[leg])]
    solution = qpsolvers.solve_problem(
        qpsolvers.Problem(
            problem.P, problem.q, csc_matrix(np.concatenate(rows)), np.concatenate(bounds), problem.A, problem.b
        ),
        "clarabel",
    )
    return 0.5 * solution.x @ (problem.P @ solution.x) if solution.found else np.nan


def compare(width):
    sampled, problem = minsnap.Sampled(width, SAMPLES), partial(build_qp, RECTANGLE, DURATIONS, width, samples=SAMPLES)
    ready = problem()
    calls = (
        partial(minsnap.plan, RECTANGLE, DURATIONS, corridor=width),
        partial(minsnap.plan, RECTANGLE, DURATIONS, corridor=sampled),
        partial(solve_full, ready, "daqp"),
        lambda: solve_full(problem(), "daqp"),
    )
    with using("python"):
        (certified, loosely, full, built), (traj, loose, *_) = least_times(calls, seconds=3.0)
    certificate = minsnap.certify(traj, RECTANGLE, width)
    outside = -minsnap.certify(loose, RECTANGLE, width).corridor_margin
    cautious = hull(RECTANGLE, DURATIONS, width)
    return (
        f"{width:g} m",
        text(certified),
        f"{certified / loosely:.2f}",
        f"{certified / built:.2f}",
        f"{certified / full:.2f}",
        f"{traj.cost():.6g}",
        f"{certificate.corridor_margin:.1e} m",
        f"{max(outside, 0.0):.1e} m",
        f"{cautious / traj.cost():.4f}",
        traj.report.rounds,
    )


def hull_on_walks(seeds=10):
    """What hulls lose on random legs: ratios of costs."""
    ratios = []
    for seed in range(seeds):
        points, durations, widths = walk(8, seed)
        ratios.append(hull(points, durations, widths) / minsnap.plan(points, durations, corridor=widths).cost())
    return np.array(ratios)


def main():
    head = (
        "half-width",
        "certified",
        "/ sampled",
        "/ full problem, built and solved",
        "/ full problem, solver alone",
        "cost",
        "margin",
        f"{SAMPLES} samples stick out by",
        "hull's cost / ours",
        "rounds",
    )
    table(head, (compare(width) for width in WIDTHS))
    ratios = hull_on_walks()
    print(f"Hulls on {len(ratios)} walks of 8 legs cost {ratios.min():.3f} to {ratios.max():.3f} times ours.\n")
    rows = []
    for solver in ("daqp", "piqp", "clarabel", "osqp"):
        ask = partial(minsnap.plan, RECTANGLE, DURATIONS, corridor=0.3, solver=solver)
        (took,), (traj,) = least_times([ask])
        rows.append((solver, text(took), f"{traj.cost():.4f}", traj.report.rounds))
    table(("solver, at 0.3 m", "certified", "cost", "rounds"), rows)


if __name__ == "__main__":
    main()
