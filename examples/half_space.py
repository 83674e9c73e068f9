"""A constraint of one's own: a half-space that the curve may not leave, such as one side of a leaning wall.

Anything with a method ``walls(waypoints)`` is a constraint. Rows of the programme at any instant and the exact margin
over all instants follow from the walls it returns.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import minsnap
from minsnap.corridors.constraint import Walls
from minsnap.plot import save_figure, styled


@dataclass(frozen=True)
class BeforeWall:
    """Stay where normal . r <= offset, on every leg."""

    normal: tuple[float, float, float]
    offset: float

    def walls(self, waypoints):
        """One plane a leg; an excess is judged by the leg's length."""
        legs = np.arange(len(waypoints) - 1)
        normal = np.tile(self.normal, (len(legs), 1))
        length = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
        below, offset = np.full(len(legs), -np.inf), np.full(len(legs), self.offset)
        return [Walls.planes(legs, normal, np.zeros(normal.shape), below, offset, length, name="leaning wall")]


WAYPOINTS = [(0, 0, 1), (3, 2.5, 1), (5, 2.5, 1), (8, 0, 1)]
WALL = BeforeWall((0.0, 0.8, 0.6), 2.65)


@styled
def main(folder: Path) -> None:
    """Plan with and without the wall and draw both from the side."""
    free = minsnap.plan(WAYPOINTS, total_time=8)
    kept = minsnap.plan(WAYPOINTS, total_time=8, corridor=WALL)
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    ax = figure.add_subplot(xlabel="x [m]", ylabel="distance beyond the wall [m]")
    for trajectory, label, color in ((free, "free", "#d55e00"), (kept, "kept before the wall", "#0072b2")):
        position = trajectory.sample(rate=100).position
        margin = minsnap.certify(trajectory, waypoints=WAYPOINTS, corridor=WALL).corridor_margin
        ax.plot(position[:, 0], position @ WALL.normal - WALL.offset, color=color, label=f"{label}: {margin:+.3f} m")
    ax.axhline(0.0, color="black", linewidth=0.8)
    ax.legend(title="exact margin")
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(figure, folder / "half_space.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
