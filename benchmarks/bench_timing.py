"""How good the durations are, and how long it takes to find them: splits of a total, and the shortest within limits.

Beside stop-and-go, beside the time-optimal profile of the same path by TOPP-RA (H. Pham and Q.-C. Pham, "A new approach
to time-optimal path parameterization based on reachability analysis", IEEE T-RO 2018; package toppra), which ignores
jerk and snap and bounds the time of that path from below, and beside searches on polygons in place of the Euclidean
norm.
Run it by hand: ``python benchmarks/bench_timing.py``. It prints tables in Markdown.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from bench_times import profile
from courses import read_course
from measure import least_times, machine

import minsnap
from minsnap.corridors.constraint import Walls
from minsnap.limits.limits import Limits
from minsnap.polynomials.bernstein import differentiate
from minsnap.polynomials.extrema import maximum
from minsnap.trajectory.report import Utilisation

RECTANGLE = read_course("rectangle")
ASKED = RECTANGLE.arguments
CORNERS, WIDTH, LIMITS = np.array(ASKED["waypoints"]), ASKED["corridor"], ASKED["limits"]
TEN_LEGS = np.round(np.cumsum(np.random.default_rng(10).normal(scale=2.0, size=(11, 3)), axis=0), 3)
REPEATS = 5


def walk(legs: int) -> np.ndarray:
    """Points of a random walk with steps of about 3 m."""
    return np.cumsum(np.random.default_rng(legs).normal(scale=2.0, size=(legs + 1, 3)), axis=0)


SPLITS = {
    "rectangle 8 m by 4 m, 12 s": {"waypoints": CORNERS, "total_time": 12.0},
    "the same in a corridor of 0.3 m": {"waypoints": CORNERS, "total_time": 12.0, "corridor": WIDTH},
    "10 random legs, 22 s": {"waypoints": TEN_LEGS, "total_time": 22.0},
    "1,000 random legs": {"waypoints": walk(1000), "total_time": 2002.0},
}
SHORTEST = {
    "by distance, scaled": {"search": minsnap.Search(split="distance")},
    "joint search of curve and durations": {"pieces": 1},
    "the same, two pieces per leg": {"pieces": 2},
    "the same, three pieces per leg": {"pieces": 3},
    "the same, five pieces per leg": {"pieces": 5},
}


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


def split_table() -> Iterator[str]:
    yield "| best split of a total time | cost | cost by distance over it | plans tried | ms |\n|---|---|---|---|---|"
    for name, asked in SPLITS.items():
        (spent,), (path,) = least_times([partial(minsnap.plan, **asked)], 0.0, REPEATS)
        gain = minsnap.plan(search=minsnap.Search(split="distance"), **asked).cost() / path.cost()
        yield f"| {name} | {path.cost():.7g} | {gain:.4g} | {len(path.report.steps)} | {1e3 * spent:.2f} |"


def shortest_table() -> Iterator[str]:
    yield "| way | s | TOPP-RA of its curve | ratio | ms to find |\n|---|---|---|---|---|"
    for name, way in SHORTEST.items():
        (spent,), (path,) = least_times([partial(minsnap.plan, **ASKED, **way)], 0.0, REPEATS)
        bound = profile(RECTANGLE, path)
        yield f"| {name} | {path.duration:.3f} | {bound:.3f} | {path.duration / bound:.3f} | {1e3 * spent:.1f} |"
    lengths = np.linalg.norm(np.diff(CORNERS, axis=0), axis=1)
    stops = (lengths / LIMITS.speed + LIMITS.speed / LIMITS.acceleration).sum()  # each side is long enough to cruise
    yield f"| stop-and-go, acceleration jumps | {stops:.3f} | | | |"
    for pieces in (1, 3):
        legs = [minsnap.plan(CORNERS[i : i + 2], limits=LIMITS, pieces=pieces).duration for i in range(4)]
        yield f"| stop-and-go, jerk continuous, {pieces} piece(s) per leg | {sum(legs):.3f} | | | |"


def polygon_table() -> Iterator[str]:
    yield "| norm | one piece a leg [s] | three [s] | greatest speed [m/s] |\n|---|---|---|---|"
    for corners in (16, 24):
        limits = PolygonLimits(speed=LIMITS.speed, acceleration=LIMITS.acceleration, corners=corners)
        paths = [minsnap.plan(**ASKED | {"limits": limits, "pieces": n}) for n in (1, 3)]
        top = max(path.max_norm(1)[0] for path in paths)
        yield f"| {corners}-gon | {paths[0].duration:.4f} | {paths[1].duration:.4f} | {top:.4f} |"
    paths = [minsnap.plan(**ASKED, pieces=n) for n in (1, 3)]
    top = max(path.max_norm(1)[0] for path in paths)
    yield f"| Euclidean | {paths[0].duration:.4f} | {paths[1].duration:.4f} | {top:.4f} |"


def main() -> None:
    """Measure and print."""
    for line in (*machine(), ""):
        print(line)
    for table in (split_table, shortest_table, polygon_table):
        for line in table():
            print(line, flush=True)
        print()


if __name__ == "__main__":
    main()
