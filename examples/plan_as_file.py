"""A plan is a file: polynomials, corridor, limits and certificate, read back and certified again.

Setpoints are samples of a plan; a ``.json`` keeps the plan itself, to the last bit. On the command line:

    minsnap rect --corridor 0.3 -o rect.json
    minsnap plan rect.json -o rect.csv
"""

import sys
from pathlib import Path

import minsnap
from minsnap import Limits
from minsnap.files import read_polynomials, write_polynomials
from minsnap.plot import save_figure

CORNERS = [(0, 0, 1), (6, 0, 1), (6, 4, 1), (0, 4, 1), (0, 0, 1)]


def main(folder: Path) -> None:
    """Write a plan, read it, certify what was read, draw it."""
    folder.mkdir(parents=True, exist_ok=True)
    limits = Limits(speed=3.0, acceleration=6.0)
    path = minsnap.plan(CORNERS, limits=limits, corridor=0.3)
    write_polynomials(path, folder / "rect.json", waypoints=CORNERS, corridor=0.3, limits=limits)
    stored = read_polynomials(folder / "rect.json")
    same = bool((stored.trajectory.control_points == path.control_points).all())
    found = minsnap.certify(stored.trajectory, stored.waypoints, stored.corridor, stored.limits)
    print(f"equal to the last bit: {same}; certified again: {found.ok}, {found.corridor_margin:.2g} m from its walls")
    figure = minsnap.plot.plot_overview(
        stored.trajectory, corridor=stored.corridor, waypoints=stored.waypoints, limits=stored.limits, title="rect.json"
    )
    save_figure(figure, folder / "plan_as_file.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
