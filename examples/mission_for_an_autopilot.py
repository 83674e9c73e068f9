"""A planned inspection as missions of QGroundControl, ArduPilot, Google Earth, DJI and Litchi, and one of these read.

A mission is straight lines between few waypoints with a speed for each. How far its lines are from the path is proved.
On the command line:

    minsnap plan points.csv -o inspection.plan --origin 47.3977 8.5456 488 --within 0.5
    minsnap plan inspection.kmz -o path.csv
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

import minsnap
from minsnap.files.convert import write_any
from minsnap.files.geodetic_missions import read_mission
from minsnap.plot import save_figure

ORIGIN = (47.3977, 8.5456, 488.0)
POINTS = [(0, 0, 10), (60, 0, 12), (60, 40, 15), (0, 40, 10), (-20, 20, 20)]


def main(folder: Path) -> None:
    """Write the path in five formats, and read each of them back."""
    folder.mkdir(parents=True, exist_ok=True)
    path = minsnap.plan(POINTS, limits=minsnap.Limits(speed=8, acceleration=4, jerk=30))
    for name, to in (("plan", None), ("waypoints", None), ("kml", None), ("kmz", None), ("csv", "litchi")):
        file = folder / f"inspection.{name}"
        print(file.name, *write_any(path, file, to, origin=ORIGIN, within=0.5), sep=": ")
        assert abs(read_mission(file, ORIGIN).points[0] - POINTS[0]).max() < 0.01
    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    minsnap.plot.plot_path(path, ax=axes)
    for within, style in ((3.0, "o--"), (0.5, "s-")):
        write_any(path, folder / "inspection.plan", origin=ORIGIN, within=within)
        points = read_mission(folder / "inspection.plan", ORIGIN).points
        axes.plot(*points[:, :2].T, style, linewidth=1, label=f"{len(points)} waypoints within {within:g} m")
    axes.legend()
    save_figure(figure, folder / "mission_for_an_autopilot.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
