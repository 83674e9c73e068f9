"""A course in space whose gates and boxes move while it is flown: the vehicle follows the plan, else the stop.

Every fifth of a second the gates ahead have moved, and the boxes around them with them. Each replan starts from where
the vehicle will be when the answer is there. A gate holds still once the vehicle is near it. The clock is simulated, so
that a slow machine flies the same course with fewer changes.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import minsnap
from minsnap.plot import save_figure, styled
from minsnap.replanning.splice import splice_of

BUDGET, WIDE, NEAR, MOST = 0.2, 1.2, 1.5, 60
LIMITS = minsnap.Limits(speed=3.0, acceleration=6.0)
GATES = np.array([(0, 0, 1), (3, 1, 1.5), (6, -1, 2.0), (9, 1, 1.5), (12, 0, 1)], dtype=float)


def gates_at(t: float) -> np.ndarray:
    """Where the gates are: the inner ones sway by half a metre."""
    sway = 0.5 * np.sin(0.9 * t + np.arange(len(GATES)))
    moved = GATES.copy()
    moved[1:-1, 1] += sway[1:-1]
    moved[1:-1, 2] += 0.4 * sway[1:-1]
    return moved


def gates_seen(before: np.ndarray, t: float, position: np.ndarray) -> np.ndarray:
    """Where the gates are when the vehicle is at `position`: those near it are where they were before."""
    is_near = np.linalg.norm(before - position, axis=1) < NEAR
    return np.where(is_near[:, None], before, gates_at(t))


def boxes_at(gates: np.ndarray) -> minsnap.Boxes:
    """Boxes around the legs between the gates as they are now."""
    return minsnap.Boxes(np.minimum(gates[:-1], gates[1:]) - WIDE, np.maximum(gates[:-1], gates[1:]) + WIDE)


def fly() -> tuple[list[np.ndarray], list[minsnap.replanning.Change]]:
    """Fly until the last gate is reached: the pieces of path flown, and every change."""
    replanner = minsnap.Replanner(LIMITS, clock=lambda: 0.0, recover=0.3, clearance=0.1)
    gates = gates_at(0.0)
    flown = minsnap.plan(gates, limits=LIMITS, corridor=boxes_at(gates), pieces=1)
    passed, paths, changes = 0, [], []
    while flown.duration > BUDGET and len(changes) < MOST:
        gates = gates_seen(gates, BUDGET * len(changes), flown(0.0))
        passed += splice_of(flown, 0.0, BUDGET, 4).passed
        boxes = boxes_at(gates)
        boxes = minsnap.Boxes(boxes.lower[passed:], boxes.upper[passed:])
        change = replanner.replan(flown, 0.0, gates[passed + 1 :], BUDGET, boxes=boxes)
        paths.append(flown(np.linspace(0.0, change.splice, 20)))
        changes.append(change)
        flown = change.trajectory if change.certified or change.stop is None else change.stop
    paths.append(flown(np.linspace(0.0, flown.duration, 100)))
    return paths, changes


@styled
def draw(paths: list[np.ndarray], changes: list[minsnap.replanning.Change]) -> Figure:
    """Draw the path flown from above, every plan on the way, and the stops that were ready."""
    figure = Figure(figsize=(10, 3.2), layout="constrained")
    title = "flown (blue), plans (grey), ends of stops (orange)"
    ax = figure.add_subplot(xlabel="x [m]", ylabel="y [m]", title=title, aspect="equal")
    for change in changes:
        plan = change.trajectory(np.linspace(0.0, change.trajectory.duration, 200))
        ax.plot(plan[:, 0], plan[:, 1], color="0.8", linewidth=0.7)
        if change.stop is not None:
            end = change.stop(change.stop.duration)
            ax.plot(end[0], end[1], ".", color="#d55e00", markersize=4)
    flown = np.concatenate(paths)
    ax.plot(flown[:, 0], flown[:, 1], color="#0072b2", linewidth=2)
    return figure


def main(folder: Path) -> None:
    """Fly, tell how often the plan changed, and write the figure."""
    paths, changes = fly()
    new, stops = sum(not change.kept for change in changes), sum(change.stop is not None for change in changes)
    print(f"{len(changes)} replans: {new} new plans, {stops} with a stop ready; ends at {paths[-1][-1].round(2)}")
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(draw(paths, changes), folder / "replanning_in_flight.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
