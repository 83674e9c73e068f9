"""Shortest times of random problems: seconds of flight and of search, and whether every limit is kept.

Each problem has 5 to 15 legs of 1 to 5 m in random directions, and by turns a tube, boxes around its legs, tolerances
of its waypoints, or none of them; and limits on speed and acceleration, by turns also on jerk, thrust, tilt or body
rate.
Run it by hand: ``python benchmarks/random_times.py [--problems 200] [--pieces auto]`` prints one line per problem as
JSON, then a summary; ``--against FILE`` compares with the lines of another run, such as that of another version, and
``--yaw-rate 1.5`` lets the yaw follow the velocity within that rate.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import minsnap
from minsnap import Boxes, Limits

EXTRA: tuple[dict[str, float], ...] = (
    {},
    {"jerk": 60.0},
    {"max_thrust": 1.8},
    {"tilt": 0.6},
    {"body_rate": 4.0},
    {"horizontal_speed": 2.5, "climb_speed": 1.5},
)


def problem(number: int, yaw_rate: float | None = None) -> dict[str, Any]:
    """Arguments of ``minsnap.plan``, without pieces; with a rate [rad/s] the yaw follows the velocity within it."""
    random = np.random.default_rng(number)
    steps = random.normal(size=(random.integers(5, 16), 3)) * (1.0, 1.0, 0.4)
    steps *= random.uniform(1.0, 5.0, len(steps))[:, None] / np.linalg.norm(steps, axis=1)[:, None]
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    limits = Limits(
        speed=random.uniform(2.0, 6.0), acceleration=random.uniform(3.0, 10.0), **EXTRA[number % len(EXTRA)]
    )
    asked: dict[str, Any] = {"waypoints": points, "limits": limits}
    kind = number % 4
    if kind == 0:
        asked["corridor"] = random.uniform(0.1, 0.6)
    elif kind == 1:
        low, high = np.minimum(points[:-1], points[1:]) - 0.5, np.maximum(points[:-1], points[1:]) + 0.5
        asked |= {"corridor": Boxes(low, high), "waypoint_tolerance": 0.3}
    elif kind == 2:
        asked["waypoint_tolerance"] = random.uniform(0.05, 0.4)
    return asked if yaw_rate is None else asked | {"limits": replace(limits, yaw_rate=yaw_rate), "yaw": "velocity"}


def line(number: int, pieces: int | str, yaw_rate: float | None) -> dict[str, Any]:
    """Plan one problem: seconds of flight and of the search, and the largest use of a limit."""
    asked = problem(number, yaw_rate)
    began = time.perf_counter(), time.process_time()
    try:
        path = minsnap.plan(**asked, pieces=pieces)
    except minsnap.MinsnapError as error:
        return {"problem": number, "error": str(error)}
    spent = time.perf_counter() - began[0], time.process_time() - began[1]
    use = max(used.fraction for used in asked["limits"].utilisation(path))
    found = minsnap.certify(path, corridor=asked.get("corridor"), limits=asked["limits"])
    legs = len(asked["waypoints"]) - 1
    return {
        **{"problem": number, "legs": legs, "flown": path.duration, "searched": spent[0], "processor": spent[1]},
        **{"use": use, "certified": bool(found.ok)},
    }


def summary(lines: list[dict[str, Any]]) -> str:
    """Medians and exceptions of a run."""
    kept = [entry for entry in lines if "flown" in entry]
    spent = np.array([entry["searched"] for entry in kept])
    used = np.array([entry["processor"] for entry in kept])
    exceeded = sum(not entry["certified"] or entry["use"] > 1.0 + 1e-8 for entry in kept)
    return (
        f"{len(kept)} of {len(lines)} planned, {exceeded} beyond a limit; searched: median {np.median(spent):.3f} s, "
        f"most {spent.max():.3f} s (processor: median {np.median(used):.3f} s, most {used.max():.3f} s)"
    )


def compared(lines: list[dict[str, Any]], others: list[dict[str, Any]]) -> str:
    """Ratios of the times flown to those of another run."""
    before = {entry["problem"]: entry["flown"] for entry in others if "flown" in entry}
    both = [entry for entry in lines if "flown" in entry and entry["problem"] in before]
    ratios = np.array([entry["flown"] / before[entry["problem"]] for entry in both])
    longer = [entry["problem"] for entry, ratio in zip(both, ratios, strict=True) if ratio > 1.002]
    return (
        f"{len(both)} problems in both runs: median ratio {np.median(ratios):.4f}, mean {ratios.mean():.4f}, from "
        f"{ratios.min():.4f} to {ratios.max():.4f}; longer by more than 0.2 %: {longer}"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--pieces", default="auto", type=lambda text: text if text == "auto" else int(text))
    parser.add_argument("--yaw-rate", type=float)
    parser.add_argument("--against", type=Path)
    asked = parser.parse_args()
    lines = []
    for number in range(asked.first, asked.first + asked.problems):
        lines.append(line(number, asked.pieces, asked.yaw_rate))
        print(json.dumps(lines[-1]), flush=True)
    print(summary(lines))
    if asked.against is not None:
        text = asked.against.read_text(encoding="utf-8").splitlines()
        print(compared(lines, [json.loads(row) for row in text if row.startswith("{")]))


if __name__ == "__main__":
    main()
