"""How good the durations are, and how long it takes to find them: splits of a total, and the shortest within limits.

Beside stop-and-go, beside the time-optimal profile of the same path by TOPP-RA (H. Pham and Q.-C. Pham, "A new approach
to time-optimal path parameterization based on reachability analysis", IEEE T-RO 2018; package toppra), which ignores
jerk and snap and bounds the time of that path from below, and beside searches on polygons in place of the Euclidean
norm.
Run it by hand: ``python benchmarks/bench_timing.py``. It prints tables in Markdown.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

import minsnap
from minsnap.corridors.constraint import Walls
from minsnap.limits.limits import Limits
from minsnap.polynomials.bernstein import differentiate
from minsnap.polynomials.extrema import maximum
from minsnap.time_allocation.least_cost import trapezoid_times
from minsnap.trajectory.report import Utilisation

CORNERS = np.array([(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)], dtype=float)
SPEED, ACCELERATION, WIDTH = 3.0, 6.0, 0.3
LIMITS = Limits(speed=SPEED, acceleration=ACCELERATION)
TEN_LEGS = np.round(np.cumsum(np.random.default_rng(10).normal(scale=2.0, size=(11, 3)), axis=0), 3)
GRID = 2001
REPEATS = 5


def walk(legs: int) -> np.ndarray:
    """Points of a random walk with steps of about 3 m."""
    return np.cumsum(np.random.default_rng(legs).normal(scale=2.0, size=(legs + 1, 3)), axis=0)


class TimeSplit:
    """What asv calls: the best split of a total time."""

    params = ("rectangle", "rectangle in its corridor", "10 legs", "1000 legs")

    def setup(self, case):
        points = {"10 legs": TEN_LEGS, "1000 legs": walk(1000)}.get(case, CORNERS)
        total = 12.0 if points is CORNERS else 2.0 * len(points)
        self.asked = {"waypoints": points, "total_time": total}
        if "corridor" in case:
            self.asked["corridor"] = WIDTH

    def time_optimal(self, case):
        return minsnap.plan(**self.asked)

    def track_gain(self, case):
        """Cost of the split by distance over that of the best."""
        return (
            minsnap.plan(search=minsnap.Search(split="distance"), **self.asked).cost()
            / minsnap.plan(**self.asked).cost()
        )


class TimeShortest:
    """What asv calls: the shortest time within limits, in the corridor of the rectangle."""

    params = ("one piece", "three pieces", "scaling", "distance", "trapezoid")
    options = {
        "one piece": {},
        "three pieces": {"pieces": 3},
        "scaling": {"enforce": "scaling"},
        "distance": {"split": "distance"},
        "trapezoid": {"split": "trapezoid"},
    }

    def setup(self, case):
        self.asked = {"waypoints": CORNERS, "limits": LIMITS, "corridor": WIDTH, **self.options[case]}

    def time_shortest(self, case):
        return minsnap.plan(**self.asked)


@dataclass(frozen=True)
class PolygonLimits(Limits):
    """Speed and acceleration within a regular polygon around the circle, in the plane: its corners reach beyond."""

    corners: int = 16

    def given(self):
        return {"speed": self.speed, "acceleration": self.acceleration}

    def normals(self):
        angles = 2.0 * np.pi * np.arange(self.corners // 2) / self.corners
        return np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])

    def walls(self, waypoints):
        legs = len(waypoints) - 1
        zeros = np.zeros((legs, 3))
        return [
            Walls.planes(np.arange(legs), zeros + normal, zeros, *_bounds(limit, legs), order, name)
            for order, (name, limit) in enumerate(self.given().items(), start=1)
            for normal in self.normals()
        ]

    def utilisation(self, traj):
        return tuple(self._used(traj, order, *given) for order, given in enumerate(self.given().items(), start=1))

    def _used(self, traj, order, name, limit):
        points = differentiate(traj.control_points, order) / traj.durations[:, None, None] ** order
        along = np.einsum("pnd,fd->pfn", points, np.vstack([self.normals(), -self.normals()]))
        value, row, s = maximum(along.reshape(-1, points.shape[1]))
        piece = row // self.corners
        instant = float(traj.breaks[piece] + s * traj.durations[piece])
        return Utilisation(name, value, limit, value / limit, piece // traj.pieces, instant)


def _bounds(limit, legs):
    return np.full(legs, -limit), np.full(legs, limit), np.full(legs, limit)


def topp_ra(path) -> float:
    """Least time along a path's curve within the norms, from rest to rest, without regard to jerk and snap."""
    import toppra
    from toppra.algorithm import TOPPRA
    from toppra.constraint import DiscretizationType, LinearConstraint, SecondOrderConstraint

    toppra.setup_logging("ERROR")

    class NormVelocity(LinearConstraint):
        def compute_constraint_params(self, curve, gridpoints, *args):
            length = np.linalg.norm(curve(gridpoints, 1), axis=1)
            bound = np.column_stack([np.zeros(len(gridpoints)), (SPEED / length) ** 2])
            return None, None, None, None, None, None, bound

    t = np.linspace(0.0, path.duration, 20 * GRID)
    points = path(t)
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    arc = np.linspace(0.0, travelled[-1], GRID)
    curve = toppra.SplineInterpolator(arc, path(np.interp(arc, travelled, t)))
    angles = 2.0 * np.pi * np.arange(128) / 128
    normals = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    acceleration = SecondOrderConstraint(
        lambda q, qd, qdd: qdd,
        lambda q: normals,
        lambda q: np.full(len(normals), ACCELERATION),
        3,
        discretization_scheme=DiscretizationType.Collocation,
    )
    solver = TOPPRA([NormVelocity(), acceleration], curve, gridpoints=arc, parametrizer="ParametrizeConstAccel")
    return float(solver.compute_trajectory(0.0, 0.0).duration)


def quickest(run: Callable[[], object], repeats: int = REPEATS) -> tuple[object, float]:
    """Result, and the least milliseconds of some repetitions."""
    spent = []
    for _ in range(repeats):
        began = time.perf_counter()
        result = run()
        spent.append(1e3 * (time.perf_counter() - began))
    return result, min(spent)


def split_table() -> Iterator[str]:
    yield "| best split of a total time | cost | cost by distance over it | plans tried | ms |\n|---|---|---|---|---|"
    for case in TimeSplit.params:
        bench = TimeSplit()
        bench.setup(case)
        path, spent = quickest(partial(bench.time_optimal, case), 2 if "1000" in case else REPEATS)
        gain, tried = bench.track_gain(case), len(path.report.steps)
        yield f"| {case} | {path.cost():.7g} | {gain:.3f} | {tried} | {spent:.1f} |"


def shortest_table() -> Iterator[str]:
    yield "| 3 m/s, 6 m/s², corridor 0.3 m | s | over TOPP-RA of its curve | ms |\n|---|---|---|---|"
    for case in ("distance", "trapezoid", "scaling", "one piece", "three pieces"):
        bench = TimeShortest()
        bench.setup(case)
        path, spent = quickest(partial(bench.time_shortest, case), 2)
        bound = topp_ra(path)
        yield f"| {case} | {path.duration:.4f} | {path.duration / bound:.3f} ({bound:.4f} s) | {spent:.0f} |"
    lengths = np.linalg.norm(np.diff(CORNERS, axis=0), axis=1)
    yield f"| stop-and-go, acceleration jumps | {trapezoid_times(lengths, SPEED, ACCELERATION).sum():.4f} | | |"
    for pieces in (1, 3):
        legs = [minsnap.plan(CORNERS[i : i + 2], limits=LIMITS, pieces=pieces).duration for i in range(4)]
        yield f"| stop-and-go, jerk continuous, {pieces} piece(s) a leg | {sum(legs):.4f} | | |"


def polygon_table() -> Iterator[str]:
    yield "| norm | one piece a leg [s] | three [s] | greatest speed [m/s] |\n|---|---|---|---|"
    for corners in (16, 24, 64):
        limits = PolygonLimits(speed=SPEED, acceleration=ACCELERATION, corners=corners)
        paths = [minsnap.plan(CORNERS, limits=limits, corridor=WIDTH, pieces=n) for n in (1, 3)]
        top = max(path.max_norm(1)[0] for path in paths)
        yield f"| {corners}-gon | {paths[0].duration:.4f} | {paths[1].duration:.4f} | {top:.4f} |"
    paths = [minsnap.plan(CORNERS, limits=LIMITS, corridor=WIDTH, pieces=n) for n in (1, 3)]
    top = max(path.max_norm(1)[0] for path in paths)
    yield f"| Euclidean | {paths[0].duration:.4f} | {paths[1].duration:.4f} | {top:.4f} |"


def main() -> None:
    """Measure and print."""
    print(
        f"{platform.platform()}, Python {platform.python_version()}, {os.cpu_count()} cores, load {os.getloadavg()}\n"
    )
    for table in (split_table, shortest_table, polygon_table):
        for line in table():
            print(line, flush=True)
        print()


if __name__ == "__main__":
    main()
