"""A whole replanning loop, and a picture of the splice: the former plan is flown until the change takes over.

A goal moves every half second. The loop sends a setpoint every 20 ms; in between it asks for a change, which begins at
its splice, a budget after the question. Until then the former plan is flown, with its own clock.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import minsnap
from minsnap.plot import save_figure, styled

LIMITS = minsnap.Limits(speed=3.0, acceleration=6.0, jerk=60.0)
BUDGET, STEP, EVERY = 0.2, 0.02, 0.5
POINTS = np.array([(0, 0, 1), (4, 1, 1), (8, -1, 1), (12, 0, 1)], dtype=float)


def moved(clock: float) -> np.ndarray:
    """Return the waypoints as they are seen at an instant: the last two drift aside."""
    return POINTS + np.outer([0, 0, 0.5, 1], [0, 0.5 * min(clock, 4.0), 0])


def loop() -> tuple[np.ndarray, list[tuple[float, minsnap.Trajectory, float, minsnap.replanning.Change]]]:
    """Fly: return the setpoints that were sent, and of each change when it was asked, of which plan, begun when."""
    replanner = minsnap.Replanner(limits=LIMITS)
    flown, began, waiting, ahead = minsnap.plan(POINTS, limits=LIMITS, pieces=1), 0.0, None, len(POINTS) - 1
    sent, changes = [], []
    for clock in np.arange(0.0, 12.0, STEP):
        if waiting is not None and clock >= waiting[1]:  # the splice: the change takes over, with a clock of its own
            (flown, began), waiting = waiting, None
        now = clock - began
        sent.append(flown(min(now, flown.duration)))
        due = round(clock / STEP) % round(EVERY / STEP) == 0 and now + BUDGET < flown.duration - 0.5
        if waiting is None and due:
            left = int((flown.leg_breaks[1:] > now + BUDGET).sum())  # waypoints after the splice
            ahead = min(ahead, left)
            change = replanner.replan(flown, now, moved(clock)[-ahead:], budget=BUDGET)
            new = change.trajectory if change.certified or change.stop is None else change.stop
            waiting = (new, began + change.splice)  # until then the former plan is flown
            changes.append((clock, flown, began, change))
    return np.array(sent), changes


@styled
def splice_figure(clock: float, flown: minsnap.Trajectory, began: float, change: minsnap.replanning.Change) -> Figure:
    """Draw one change: the former plan, when it was asked, the splice, the new plan, and the stop beside it."""
    figure = Figure(figsize=(7.2, 3.4), layout="constrained")
    ax = figure.subplots()
    now, splice = clock - began, change.splice
    for start, end, style, label in (
        (0.0, splice, "-", "former plan, flown"),
        (splice, flown.duration, ":", "its rest"),
    ):
        ax.plot(*flown(np.linspace(start, end, 200))[:, :2].T, style, color="#555555", label=label)
    for curve, colour, label in ((change.trajectory, "#0072b2", "the change"), (change.stop, "#d55e00", "the stop")):
        if curve is not None:
            ax.plot(*curve(np.linspace(0.0, curve.duration, 200))[:, :2].T, color=colour, label=label)
    for instant, text, below in ((now, "now: asked", 12), (splice, "now + budget:\nthe splice", -30)):
        place = flown(instant)[:2]
        ax.plot(*place, "o", color="black", markersize=5)
        ax.annotate(text, place, (0, below), textcoords="offset points", ha="center", fontsize="small")
    ax.plot(*moved(clock)[1:, :2].T, "s", color="#009e73", markersize=5, label="waypoints as they are now")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    ax.margins(0.05, 0.15)
    figure.legend(loc="outside upper center", fontsize="small", ncols=3)
    return figure


def main(folder: Path) -> None:
    """Fly the loop, check that nothing jumps at any splice, and draw one."""
    folder.mkdir(parents=True, exist_ok=True)
    sent, changes = loop()
    steps = np.linalg.norm(np.diff(sent, axis=0), axis=1)
    assert steps.max() <= 3.0 * STEP * 1.001, steps.max()
    new = [each for each in changes if not each[3].kept]
    print(f"{len(changes)} questions, {len(new)} new plans; setpoints at most {1e3 * steps.max():.1f} mm apart")
    save_figure(splice_figure(*(new or changes)[min(1, len(new or changes) - 1)]), folder / "replanning_splice.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
