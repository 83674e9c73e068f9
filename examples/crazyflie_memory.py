"""A plan in the memory of a Crazyflie: 31 polynomials fit as they are, 90 in the compressed form.

The compressed form rounds control points to millimetres and durations to milliseconds; knots stay shared, and the
distance to the plan is bounded. On the command line:

    minsnap plan points.csv -o flight.traj
"""

import sys
from pathlib import Path

import numpy as np

import minsnap
from minsnap.errors import FileError
from minsnap.files.convert import read_any, write_any
from minsnap.plot import save_figure


def main(folder: Path) -> None:
    """Write 60 pieces, which the raw form has no room for, and measure what the rounding does."""
    folder.mkdir(parents=True, exist_ok=True)
    angle = np.linspace(0.0, 6.0 * np.pi, 61)
    points = np.stack((np.cos(angle), np.sin(2.0 * angle), 1.0 + 0.02 * angle), axis=-1)
    path = minsnap.plan(points, durations=np.full(60, 0.5))
    try:
        write_any(path, folder / "raw.csv", to="crazyflie")
    except FileError as error:
        print(error)
    write_any(path, folder / "flight.traj")
    stored = read_any(folder / "flight.traj")
    t = np.linspace(0.0, min(path.duration, stored.duration), 5000)
    apart = np.linalg.norm(path(t) - stored(t), axis=1)
    print(f"{(folder / 'flight.traj').stat().st_size} of 4096 bytes, {1000 * apart.max():.2f} mm from the plan at most")
    save_figure(minsnap.plot.plot_overview(stored, title="60 pieces in the memory"), folder / "crazyflie_memory.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
