"""A flight through a forest that nobody knows: a sensor of 8 m sees the trunks, and what is behind them stays hidden.

``python examples/unknown_forest.py [FOLDER [SEED]]`` prints the flight time, the replans, and the least distance to a
trunk, and writes the positions flown, and a film of what was known.
"""

import sys
import time
from pathlib import Path

import numpy as np

import minsnap
from minsnap.errors import MinsnapError

LIMITS = minsnap.Limits(speed=3.0, acceleration=6.0, jerk=30.0)
GOAL, RANGE, RAYS, STEP, BUDGET = np.array([24.0, 0.0]), 8.0, 360, 0.2, 0.1
PATIENCE = 5
"""Refusals at rest after which the flight is over."""


def forest(seed: int, count: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Return the axes (m, 2) and radii (m,) of trunks, none at the start or the goal [m]."""
    rng = np.random.default_rng(seed)
    axes, radii = rng.uniform((2.0, -6.0), (22.0, 6.0), (count, 2)), rng.uniform(0.2, 0.5, count)
    apart = np.minimum(np.linalg.norm(axes, axis=1), np.linalg.norm(axes - GOAL, axis=1))
    return axes[apart > 2.0], radii[apart > 2.0]


def seen_from(place: np.ndarray, axes: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cast rays all around: return the points where they meet a trunk, and the ends of those that meet none."""
    angle = np.linspace(0.0, 2.0 * np.pi, RAYS, endpoint=False)
    ray = np.stack((np.cos(angle), np.sin(angle)), axis=1)
    to = axes - place
    along = ray @ to.T
    inside = radii**2 - (to**2).sum(axis=1) + along**2
    entry = np.where((inside >= 0.0) & (along > 0.0), along - np.sqrt(np.maximum(inside, 0.0)), np.inf).min(axis=1)
    hit = entry <= RANGE
    return place + entry[hit, None] * ray[hit], place + RANGE * ray[~hit]


def fly(seed: int, film: list[minsnap.routes.SeenSoFar]) -> tuple[np.ndarray, float, str]:
    """Observe, replan and fly on, a fifth of a second at a time: return positions, the flight time, and a summary."""
    axes, radii = forest(seed)
    explorer = minsnap.routes.Explorer(GOAL, limits=LIMITS, clearance=0.3, sensing=RANGE, clock=time.process_time)
    explorer.observe((0.0, 0.0), *seen_from(np.zeros(2), axes, radii))
    flown, now, clock, replans, why = explorer.replan(None, 0.0).trajectory, 0.0, 0.0, 0, "nothing was refused"
    path, waited = [], 0
    while waited < PATIENCE and not (now >= flown.duration and ends_at_goal(flown)):
        place = flown(min(now, flown.duration))
        explorer.observe(place, *seen_from(place, axes, radii))
        until, change = now + STEP, None
        if ends_at_goal(flown):
            until = min(until, flown.duration)
        else:
            try:
                at_rest = now >= flown.duration
                change = explorer.replan(None if at_rest else flown, now, BUDGET)
                until = now if at_rest else change.splice
            except MinsnapError as error:  # what is flown ends at rest inside what was seen
                why = str(error)
        film.append(explorer.seen(flown if change is None else change.trajectory))
        waited = waited + 1 if change is None and now >= flown.duration else 0
        path.append(flown(np.minimum(np.linspace(now, until, 9), flown.duration)))
        clock, now = clock + until - now, until
        if change is not None:
            safe = change.certified or change.stop is None
            flown, now, replans = change.trajectory if safe else change.stop, 0.0, replans + 1
    return np.concatenate(path), clock, f"{replans} replans, the last refusal: {why}"


def ends_at_goal(flown: minsnap.Trajectory) -> bool:
    """Whether a flight leads to the goal."""
    return bool(np.linalg.norm(flown(flown.duration) - GOAL) < 1e-6)


def main(folder: Path, seed: int) -> None:
    """Fly, judge the flight by all trunks, and write it."""
    film: list[minsnap.routes.SeenSoFar] = []
    path, seconds, summary = fly(seed, film)
    left = np.linalg.norm(path[-1] - GOAL)
    print(f"{seconds:.2f} s, {left:.2f} m from the goal, {nearest(path, *forest(seed)):.3f} m from a trunk at least")
    print(summary)
    folder.mkdir(parents=True, exist_ok=True)
    np.savetxt(folder / "unknown_forest.csv", path, delimiter=",", header="x,y")
    minsnap.plot.animate_exploration(film[::2], folder / "unknown_forest.gif", title="a forest seen 8 m far")


def nearest(path: np.ndarray, axes: np.ndarray, radii: np.ndarray) -> float:
    """Return the least distance of points to the trunks [m]."""
    return float((np.linalg.norm(path[:, None] - axes, axis=2) - radii).min())


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"), int(sys.argv[2]) if len(sys.argv) > 2 else 1)
