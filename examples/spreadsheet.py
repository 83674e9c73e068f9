"""Waypoints of a spreadsheet: capitals, semicolons, units, comments, times, and a heading in degrees.

Files are read as people and programs write them, tables by the names of their columns. What could mean two things is
refused in one sentence. On the command line:

    minsnap plan points.csv --corridor 0.5 -o flight.csv --plot flight.png
"""

import sys
from pathlib import Path

import numpy as np

import minsnap
from minsnap.errors import FileError
from minsnap.plot import save_figure

POINTS = """# measured on the field
t [s];X [m];Y [m];Z [m];Yaw [deg]
0;0;0;1;0
3;4;0;1;45

5.5;6;2.5;1.5;90
9;2;5;1;180
"""


def main(folder: Path) -> None:
    """Read the file, plan through it, and show what is refused."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "points.csv").write_text(POINTS)
    found = minsnap.read_waypoints(folder / "points.csv")
    flight = minsnap.plan(found.points, durations=found.durations, yaw=found.yaw, corridor=0.5)
    np.savetxt(folder / "by_numpy.txt", found.points, header="x y z")
    assert np.array_equal(minsnap.read_waypoints(folder / "by_numpy.txt").points, found.points)
    (folder / "decimal_commas.csv").write_text("x;y\n0,5;1\n2;3\n")
    assert minsnap.read_waypoints(folder / "decimal_commas.csv").points[0, 0] == 0.5
    (folder / "ambiguous.csv").write_text("x;y\n0,5;1.5\n2;3\n")
    try:
        minsnap.read_waypoints(folder / "ambiguous.csv")
    except FileError as error:
        print(error)
    print(flight.sample(2.0).to_dataframe()[["t", "x", "y", "z", "yaw"]].head().to_string(index=False))
    minsnap.write_csv(flight, folder / "spreadsheet.csv")
    figure = minsnap.plot.plot_overview(flight, corridor=0.5, title="waypoints of a spreadsheet")
    save_figure(figure, folder / "spreadsheet.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
