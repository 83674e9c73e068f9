"""Waypoints in space, looking where it flies.

Five waypoints that climb and turn, a total time, and a heading along the velocity: continuous, never wrapped, with its
exact rate beside it in the file.
"""

import sys
from pathlib import Path

import minsnap
from minsnap.plot import save_figure

WAYPOINTS = [(0, 0, 1), (4, 1, 1.5), (5, 4, 2.5), (2, 5, 3), (0, 3, 2)]


def main(folder: Path) -> None:
    """Plan, write, draw in space."""
    traj = minsnap.plan(WAYPOINTS, durations=[3, 2.5, 2.5, 2.5], corridor=0.5, yaw="velocity")
    folder.mkdir(parents=True, exist_ok=True)
    minsnap.write_csv(traj, folder / "climbing.csv", rate=50.0)
    figure = minsnap.plot.plot_overview(traj, view="3d", corridor=0.5, title="five waypoints, ±0.5 m")
    save_figure(figure, folder / "climbing_with_yaw.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
