"""The frames of reference, drawn: which way each axis points, and which way yaw is counted.

The same vehicle over the same floor in the axes of five frames; the arrows are mapped by the library itself.
"""

import sys
from pathlib import Path

import numpy as np

from minsnap.files.frames import FRAMES, get_frame, map_vectors, map_yaw
from minsnap.plot import save_figure, styled

COLOURS = ("#d55e00", "#0072b2", "#009e73")
TITLES = {
    "enu": "enu: east, north, up",
    "ned": "ned: north, east, down",
    "flu": "flu: a room's, z up",
    "frd": "frd: a room's, z down",
    "optitrack": "optitrack: a room's, y up",
}
HEADING = 0.6


def draw_axes(axes, name):
    """Draw the three axes of a frame where they point in the world."""
    for column, label, colour, dashes in zip(np.eye(3), "xyz", COLOURS, ("-", "--", ":"), strict=True):
        tip = map_vectors(column, name, "enu")
        axes.quiver(0, 0, 0, *tip, color=colour, linewidth=2.2, linestyle=dashes, arrow_length_ratio=0.16)
        axes.text(*(1.18 * tip), label, color=colour, ha="center", va="center", fontsize=13, weight="bold")


def draw_yaw(axes, name):
    """Draw the nose of a vehicle, and the angle that the frame calls its yaw, from where it counts."""
    nose = 0.75 * np.array([np.cos(HEADING), np.sin(HEADING), 0.0])
    axes.plot(*np.stack([np.zeros(3), nose]).T, color="black", linewidth=1.5)
    axes.text(*(1.3 * nose), "nose", ha="center", fontsize=8)
    frame = get_frame(name)
    zero = float(map_yaw(0.0, name, "enu"))
    arc = np.linspace(zero, HEADING, 40)
    axes.plot(0.45 * np.cos(arc), 0.45 * np.sin(arc), 0.0, color="0.35", linewidth=1.5)
    value = float(map_yaw(HEADING, "enu", frame))
    axes.text2D(0.5, -0.04, f"yaw {value:+.2f} rad", transform=axes.transAxes, ha="center", fontsize=9)


@styled
def main(folder: Path) -> None:
    """Draw the five frames side by side."""
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(11, 2.9))
    for number, name in enumerate(FRAMES, 1):
        axes = figure.add_subplot(1, len(FRAMES), number, projection="3d")
        floor = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
        axes.plot(floor[:, 0], floor[:, 1], 0.0, color="0.8", linewidth=1)
        draw_axes(axes, name)
        draw_yaw(axes, name)
        axes.set(title=TITLES[name], xlim=(-0.8, 0.8), ylim=(-0.8, 0.8), zlim=(-0.8, 0.8), aspect="equal")
        axes.title.set_fontsize(10)
        axes.set_axis_off()
        axes.view_init(elev=26, azim=-62)
    figure.subplots_adjust(left=0, right=1, bottom=0.06, top=0.9, wspace=0)
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(figure, folder / "frames.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
