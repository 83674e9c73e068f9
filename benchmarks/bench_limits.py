"""Random problems with random limits: is any exceeded, by the certificate or on a dense grid; how long does it take.

One to six legs of 0.3 to 10 m in any direction, one to four of fifteen limits over wide ranges, a corridor or none, one
or two pieces per leg, every way to choose durations. Run it by hand: ``python benchmarks/bench_limits.py [COUNT
[FIRST]]``. It prints one row a way, and every problem that failed.
"""

from __future__ import annotations

import sys
import time
from collections import defaultdict

import numpy as np

import minsnap
from minsnap.limits.limits import Limits
from minsnap.vehicle.attitude import specific_thrust, tilt, tilt_rate

SPANS = {
    "speed": (0.5, 10.0),
    "acceleration": (0.5, 16.0),
    "jerk": (2.0, 100.0),
    "snap": (5.0, 1000.0),
    "horizontal_speed": (0.5, 6.0),
    "horizontal_acceleration": (0.5, 10.0),
    "climb_speed": (0.3, 4.0),
    "descent_speed": (0.3, 4.0),
    "vertical_speed": (0.3, 4.0),
    "vertical_acceleration": (0.5, 10.0),
    "max_thrust": (1.1, 3.0),
    "min_thrust": (0.2, 0.9),
    "tilt": (0.1, 1.2),
    "body_rate": (0.5, 6.0),
    "yaw_rate": (0.3, 3.0),
}
WAYS = {
    "limits": {},
    "distance": {"search": minsnap.Search(split="distance")},
    "time_weight": {"search": minsnap.Search(time_weight=100.0)},
}
GRID = 20001


def problem(seed: int) -> tuple[str, dict]:
    """Name of the way and arguments of ``plan``."""
    draw = np.random.default_rng(seed)
    legs = int(draw.integers(1, 7))
    steps = draw.normal(size=(legs, 3))
    steps *= 10.0 ** draw.uniform(-0.5, 1.0, (legs, 1)) / np.linalg.norm(steps, axis=1)[:, None]
    names = [str(name) for name in draw.choice(list(SPANS), int(draw.integers(1, 5)), replace=False)]
    if names == ["yaw_rate"]:
        names.append("speed")
    values = {name: float(np.exp(draw.uniform(*np.log(SPANS[name])))) for name in names}
    norm = "axis" if draw.random() < 0.3 else "euclidean"
    asked = {"waypoints": np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))}
    asked["limits"] = Limits(**values, norm=norm)
    if draw.random() < 0.6:
        asked["corridor"] = float(10.0 ** draw.uniform(-1.3, 0.2))
    if draw.random() < 0.2:
        asked["pieces"] = 2
    if "yaw_rate" in names:
        asked["yaw"] = draw.uniform(-3.0, 3.0, legs + 1) if draw.random() < 0.7 else "velocity"
    way = str(draw.choice(list(WAYS), p=[0.75, 0.1, 0.15]))
    return way, asked | WAYS[way]


def sampled(path, limits: Limits) -> dict[str, float]:
    """Largest value of what each limit bounds on a dense grid, by other formulas; of ``min_thrust`` the least."""
    t = np.linspace(0.0, path.duration, GRID)
    v, a, j, s = (path(t, order) for order in (1, 2, 3, 4))
    size = (lambda x: np.abs(x).max()) if limits.norm == "axis" else (lambda x: np.linalg.norm(x, axis=1).max())
    return {
        "speed": size(v),
        "acceleration": size(a),
        "jerk": size(j),
        "snap": size(s),
        "horizontal_speed": np.hypot(v[:, 0], v[:, 1]).max(),
        "horizontal_acceleration": np.hypot(a[:, 0], a[:, 1]).max(),
        "climb_speed": v[:, 2].max(),
        "descent_speed": -v[:, 2].min(),
        "vertical_speed": np.abs(v[:, 2]).max(),
        "vertical_acceleration": np.abs(a[:, 2]).max(),
        "max_thrust": specific_thrust(a).max() / limits.gravity,
        "min_thrust": specific_thrust(a).min() / limits.gravity,
        "tilt": tilt(a).max(),
        "body_rate": tilt_rate(a, j).max(),
        "yaw_rate": np.abs(path.yaw(t, 1)).max(),
    }


def excess(path, limits: Limits) -> float:
    """By how much a limit is exceeded on a dense grid, as a share of it."""
    values, given = sampled(path, limits), limits.given()
    return max(given[n] / values[n] if n == "min_thrust" else values[n] / given[n] for n in given) - 1.0


def judged(seed: int) -> tuple[str, float, str]:
    """Way, seconds, and what was wrong."""
    way, asked = problem(seed)
    began = time.perf_counter()
    try:
        path = minsnap.plan(**asked)
    except Exception as error:
        return way, time.perf_counter() - began, f"{type(error).__name__}: {error}"
    spent = time.perf_counter() - began
    certificate = minsnap.certify(path, asked["waypoints"], corridor=asked.get("corridor"), limits=asked["limits"])
    wrong = [] if certificate.ok else ["certificate"]
    wrong += ["grid"] if excess(path, asked["limits"]) > 1e-9 else []
    top = max(used.fraction for used in certificate.utilisation)
    wrong += [f"used to {top:.4f} only"] if way != "time_weight" and top < 0.999 else []
    return way, spent, ", ".join(wrong)


def main() -> None:
    """Plan them and print."""
    count, first = (int(given) for given in (*sys.argv[1:3], *("200", "0")[len(sys.argv) - 1 :]))
    found = defaultdict(list)
    for seed in range(first, first + count):
        way, spent, wrong = judged(seed)
        found[way].append((spent, bool(wrong)))
        if wrong:
            print(f"seed {seed} ({way}): {wrong}", flush=True)
    print("\n| way | problems | failed | median s | most s |\n|---|---|---|---|---|")
    for way, rows in found.items():
        spent, failed = np.array([row[0] for row in rows]), sum(row[1] for row in rows)
        print(f"| {way} | {len(rows)} | {failed} | {np.median(spent):.2f} | {spent.max():.1f} |")


if __name__ == "__main__":
    main()
