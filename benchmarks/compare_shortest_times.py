"""Shortest times beside those of IPOPT from random starts: how much longer plans take than the best curve known.

    pip install 'minsnap[bench]'
    python benchmarks/compare_shortest_times.py [COURSES [STARTS]]

Both have one polynomial of degree 7 per leg with three continuous derivatives, from rest to rest within a speed and an
acceleration, every other course in a tube. IPOPT (A. Waechter and L. T. Biegler, "On the implementation of an
interior-point filter line-search algorithm for large-scale nonlinear programming", Mathematical Programming 106, 2006;
through CasADi) has durations and derivatives at the knots as unknowns, and limits and walls at instants. What it finds
is slowed down until the certificate finds its limits kept. Where it leaves its tube between instants, the plan gets a
tube that is as much wider.
"""

from __future__ import annotations

import sys
import warnings
from math import factorial
from time import perf_counter

import casadi
import numpy as np
from measure import machine

import minsnap
from minsnap import Limits
from minsnap.certificate import certify
from minsnap.limits.compliance import largest_use
from minsnap.polynomials.bernstein import powers_to_points

DEGREE, HALF, INSTANTS = 7, 4, 48


def course(seed):
    """Return waypoints (n, 3) [m], limits and the half-width of a tube [m], or None."""
    draw = np.random.default_rng(seed)
    legs = int(draw.integers(2, 8))
    steps = draw.normal(size=(legs, 3)) * [2.5, 2.5, 0.6]
    limits = Limits(speed=float(draw.uniform(1.5, 6.0)), acceleration=float(draw.uniform(2.0, 10.0)))
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    return points, limits, float(draw.uniform(0.1, 0.8)) if seed % 2 else None


def hermite():
    """Return the map (2k, 2k) from derivatives at both ends of [0, 1] to the coefficients of powers."""
    rows = np.zeros((2 * HALF, 2 * HALF))
    for order in range(HALF):
        for power in range(order, 2 * HALF):
            share = factorial(power) / factorial(power - order)
            rows[HALF + order, power] = share
            rows[order, power] = share if power == order else 0.0
    return np.linalg.inv(rows)


def powers_at(s, order):
    """Return derivatives of the powers at instants, shape (m, 2k)."""
    found = np.zeros((len(s), 2 * HALF))
    for power in range(order, 2 * HALF):
        found[:, power] = factorial(power) / factorial(power - order) * s ** (power - order)
    return found


class ShortestTime:
    """The programme of one course: unknowns are durations, then derivatives 1 ... k - 1 at the inner knots."""

    def __init__(self, points, limits, width):
        self.points, self.limits, self.width, legs = points, limits, width, len(points) - 1
        self.lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        inner = casadi.MX.sym("inner", (legs - 1) * (HALF - 1), 3)
        times = casadi.MX.sym("times", legs)
        s, kept, most = np.linspace(0.0, 1.0, INSTANTS + 1), [], []
        for leg in range(legs):
            for order, limit in ((1, limits.speed), (2, limits.acceleration)):
                value = powers_at(s, order) @ self.coefficients(inner, times, leg) / times[leg] ** order
                kept.append(casadi.sum2(value**2) / limit**2)
                most.append(np.ones(len(s)))
            if width is not None:
                along = np.diff(points, axis=0)[leg] / self.lengths[leg]
                offset = powers_at(s, 0) @ self.coefficients(inner, times, leg) - np.tile(points[leg], (len(s), 1))
                across = offset @ (np.eye(3) - np.outer(along, along)) / width
                kept += [casadi.reshape(sign * across, -1, 1) for sign in (1.0, -1.0)]
                most += [np.ones(3 * len(s))] * 2
        unknown = casadi.vertcat(times, casadi.reshape(inner, -1, 1))
        question = {"x": unknown, "f": casadi.sum1(times), "g": casadi.vertcat(*kept)}
        quiet = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "max_iter": 600, "tol": 1e-7}}
        self.solver = casadi.nlpsol("shortest", "ipopt", question, quiet)
        self.most = np.concatenate(most)
        self.legs = legs

    def coefficients(self, inner, times, leg):
        """Return the coefficients of powers of a leg, (2k, 3)."""
        ends = []
        for knot in (leg, leg + 1):
            ends.append(casadi.MX(self.points[knot]).T)
            for order in range(1, HALF):
                still = knot in (0, len(self.points) - 1)
                row = casadi.MX.zeros(1, 3) if still else inner[(knot - 1) * (HALF - 1) + order - 1, :]
                ends.append(row * times[leg] ** order)
        return hermite() @ casadi.vertcat(*ends)

    def found(self, draw):
        """Return the curve from one random start, slowed down until it keeps its limits; None where there is none."""
        speed, acceleration = self.limits.speed, self.limits.acceleration
        guess = (self.lengths / speed + 2.0 * np.sqrt(self.lengths / acceleration)) * np.exp(
            0.4 * draw.normal(size=self.legs)
        )
        inner = (
            draw.normal(size=(self.legs - 1, HALF - 1, 3)) * np.array([0.4 * speed, 0.3 * acceleration, 0.0])[:, None]
        )
        start = np.concatenate((guess, inner.reshape(-1, 3).ravel(order="F")))
        least = np.concatenate((np.full(self.legs, 0.02), np.full(inner.size, -np.inf)))
        result = self.solver(x0=start, lbx=least, ubg=self.most, lbg=-np.inf)
        if not self.solver.stats()["success"]:
            return None
        curve = self.curve(np.array(result["x"]).ravel())
        for _ in range(60):
            use = largest_use(self.limits, curve)
            if use <= 1.0 + 1e-9:
                break
            curve = curve.stretched(max(use ** (1.0 if use < 1.0 + 1e-7 else 0.5), 1.0 + 1e-10))
        return curve

    def outside(self, curve):
        """Return by how many widths a curve leaves its tube."""
        return (
            0.0
            if self.width is None
            else max(-certify(curve, self.points, self.width).corridor_margin / self.width, 0.0)
        )

    def curve(self, numbers):
        """Return unknowns as a trajectory."""
        times, rows = numbers[: self.legs], numbers[self.legs :].reshape(3, -1).T
        inner = rows.reshape(self.legs - 1, HALF - 1, 3)
        states = np.zeros((self.legs + 1, HALF, 3))
        states[:, 0], states[1:-1, 1:] = self.points, inner
        scale = times[:, None] ** np.arange(HALF)
        ends = np.concatenate((states[:-1] * scale[:, :, None], states[1:] * scale[:, :, None]), axis=1)
        return minsnap.Trajectory(powers_to_points(DEGREE) @ (hermite() @ ends), times)


def main() -> None:
    """Print one row a course, then the table."""
    courses = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    starts = int(sys.argv[2]) if len(sys.argv) > 2 else 8
    print(machine(), end="\n\n")
    losses, took, other, solved = [], [], [], 0
    for seed in range(courses):
        points, limits, width = course(seed)
        programme, draw, began = ShortestTime(points, limits, width), np.random.default_rng([seed, 1]), perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            curves = [programme.found(draw) for _ in range(starts)]
        other.append(perf_counter() - began)
        ended = [curve for curve in curves if curve is not None]
        solved += len(ended)
        if not ended:
            continue
        best = min(ended, key=lambda curve: curve.duration)
        wider, began = programme.outside(best), perf_counter()
        plan = minsnap.plan(points, limits=limits, corridor=None if width is None else (1.0 + wider) * width)
        took.append(perf_counter() - began)
        losses.append(plan.duration / best.duration - 1.0)
        longest = max(curve.duration for curve in ended)
        print(
            f"{seed}: {plan.duration:.4f} s, IPOPT {best.duration:.4f} to {longest:.4f} s, {losses[-1]:+.3%}; "
            f"tube {wider:.2%} wider",
            flush=True,
        )
    spread = 100.0 * np.percentile(losses, [0, 50, 95, 100])
    print("\n| courses | starts that end | loss least % | p50 % | p95 % | most % | plan ms, median | IPOPT s each |")
    print("|---|---|---|---|---|---|---|---|")
    print(
        f"| {len(losses)} | {solved} of {courses * starts} | {spread[0]:.3f} | {spread[1]:.3f} | {spread[2]:.3f} | "
        f"{spread[3]:.3f} | {1e3 * np.median(took):.1f} | {np.median(other):.1f} |"
    )


if __name__ == "__main__":
    main()
