"""From a map to a flight: a map_server file, a start, a goal, and setpoints that keep away from every wall.

The map is a picture with a YAML file beside it, as ROS's map_server writes it. The way is found on the grid, boxes of
free cells are inflated along it, and the fastest curve through them is planned within the limits. Its distance to the
nearest occupied cell is that of the polynomials, over all time. On the command line:

    minsnap route office.yaml --start 1 1 1.2 --goal 14 9 1.2 --clearance 0.35 -o route.csv --plot route.png
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.image import imsave

import minsnap
from minsnap.errors import InfeasibleError
from minsnap.plot import save_figure


def draw_office(folder: Path) -> Path:
    """Write the picture of an office, dark where occupied, and the YAML file that describes it."""
    free = np.ones((110, 160))
    free[[0, -1]] = free[:, [0, -1]] = 0.0
    free[30:34, :120] = free[70:74, 45:] = 0.0
    for x in (30, 75, 110):
        free[45:58, x : x + 12] = 0.0
    imsave(folder / "office.png", free[::-1], cmap="gray", vmin=0.0, vmax=1.0)
    file = folder / "office.yaml"
    file.write_text("image: office.png\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n")
    return file


def main(folder: Path) -> None:
    """Plan with a clearance, and learn which one would be too much."""
    folder.mkdir(parents=True, exist_ok=True)
    office = draw_office(folder)
    route = minsnap.routes.plan_through(office, (1, 1, 1.2), (14, 9, 1.2), clearance=0.35)
    print(f"{route.duration:.2f} s, never nearer than {route.distance:.3f} m to what is occupied")
    try:
        minsnap.routes.plan_through(office, (1.5, 1.5, 1.2), (14, 9, 1.2), clearance=1.4)
    except InfeasibleError as error:
        print(error)
    minsnap.write_csv(route, folder / "route.csv")
    save_figure(minsnap.plot.plot_route(route, title="office"), folder / "map_to_flight.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
