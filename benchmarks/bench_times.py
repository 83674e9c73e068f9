"""How fast the shortest times found are, and what processor time they take, on the courses of ``benchmarks/courses``.

Every plan is certified: within all limits, walls, balls and gates, over all time. Beside each stand the least time
known for the course (who found it how is in its file), figures as published by others, and the time-optimal profile of
the plan's own curve by TOPP-RA (H. Pham and Q.-C. Pham, "A new approach to time-optimal path parameterization based on
reachability analysis", IEEE T-RO 2018; package toppra) for its speed, acceleration and thrust: that ignores jerk, snap,
tilt, body rates and single rotors, and so bounds the time along the curve from below.
Run it by hand: ``python benchmarks/bench_times.py [course ...] [--pieces 1 2 3]``. It prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator

import numpy as np
from courses import Course, names, read_course
from measure import machine

import minsnap

GRID = 2001
DIRECTIONS = 400
"""Half-spaces in place of a ball of accelerations or thrusts: they hold more than the ball, by less than 1 %."""


def profile(course: Course, path: minsnap.Trajectory) -> float:
    """Least time along a path's curve within speed, acceleration and thrust alone, by TOPP-RA; nan where it fails."""
    import toppra
    from toppra.algorithm import TOPPRA
    from toppra.constraint import DiscretizationType, LinearConstraint, SecondOrderConstraint

    toppra.setup_logging("CRITICAL")
    speed, (center, radius) = course.limits.speed, _ball(course, path.dim)

    class NormVelocity(LinearConstraint):
        def compute_constraint_params(self, curve, gridpoints, *args):
            length = np.linalg.norm(curve(gridpoints, 1), axis=1)
            top = np.inf if speed is None else speed
            bound = np.column_stack([np.zeros(len(gridpoints)), np.minimum((top / length) ** 2, 1e4)])
            return None, None, None, None, None, None, bound

    t = np.linspace(0.0, path.duration, 20 * GRID)
    points = path(t)
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    arc = np.linspace(0.0, travelled[-1], GRID)
    curve = toppra.SplineInterpolator(arc, path(np.interp(arc, travelled, t)))
    normals = _directions(path.dim)
    scheme = DiscretizationType.Collocation
    force = SecondOrderConstraint(
        lambda q, qd, qdd: qdd - center,
        lambda q: normals,
        lambda q: np.full(len(normals), radius),
        path.dim,
        discretization_scheme=scheme,
    )
    solver = TOPPRA([NormVelocity(), force], curve, gridpoints=arc, parametrizer="ParametrizeConstAccel")
    ends = (float(np.linalg.norm(path(instant, 1))) for instant in (0.0, path.duration))
    found = solver.compute_trajectory(*(0.999 * end for end in ends))
    return float("nan") if found is None else float(found.duration)


def _ball(course: Course, dim: int) -> tuple[np.ndarray, float]:
    """Accelerations that acceleration or thrust allow: center and radius of the smaller ball."""
    limits, down = course.limits, np.zeros(dim)
    balls = [(down, np.inf if limits.acceleration is None else limits.acceleration)]
    if limits.max_thrust is not None:
        balls.append((np.array([0.0, 0.0, -limits.gravity]), limits.max_thrust * limits.gravity))
    return min(balls, key=lambda ball: ball[1])


def _directions(dim: int) -> np.ndarray:
    """Unit vectors spread over the circle or, by the golden angle, over the sphere."""
    if dim == 2:
        angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        return np.column_stack([np.cos(angles), np.sin(angles)])
    height = 1.0 - 2.0 * (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
    angles, ring = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(DIRECTIONS), np.sqrt(1.0 - height**2)
    return np.column_stack([ring * np.cos(angles), ring * np.sin(angles), height])


def row(name: str, pieces: int) -> str:
    """One line of the table."""
    course = read_course(name)
    began = time.process_time()
    path = minsnap.plan(**course.arguments, pieces=pieces)
    spent = time.process_time() - began
    certified = minsnap.certify(path, **course.checks).ok
    over = "" if course.best is None else f"{path.duration / course.best.seconds:.4f} ({course.best.seconds:g} s)"
    bound = profile(course, path)
    curve = f"{path.duration / bound:.3f} ({bound:.3f} s)"
    others = "; ".join(f"{figure.seconds:g} s: {figure.what}" for figure in course.published)
    kept = "yes" if certified else "NO"
    return f"| {course.name} | {pieces} | {path.duration:.4f} | {kept} | {spent:.2f} | {over} | {curve} | {others} |"


def table(chosen: list[str], pieces: list[int]) -> Iterator[str]:
    """Lines of the table."""
    head = "course | pieces | flown [s] | certified | processor [s] | over the best known | over TOPP-RA | published"
    yield f"| {head} |\n|" + "---|" * 8
    for name in chosen:
        for count in pieces:
            try:
                yield row(name, count)
            except minsnap.MinsnapError as error:
                yield f"| {name} | {count} | {type(error).__name__}: {error} | | | | | |"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("courses", nargs="*", default=names(), help="names of files in benchmarks/courses")
    parser.add_argument("--pieces", nargs="+", type=int, default=[1, 2])
    asked = parser.parse_args()
    for line in (*machine(), ""):
        print(line)
    for line in table(asked.courses, asked.pieces):
        print(line, flush=True)


if __name__ == "__main__":
    main()
