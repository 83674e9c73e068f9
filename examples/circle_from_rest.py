"""A circle that starts at full speed, and one that a vehicle at rest can follow.

A circle sampled from 0 to 2 pi starts at 3 m/s: the first setpoint asks a hovering vehicle for a step in velocity, and
much of the tracking error is made there. The default circle spins up over a quarter turn, with velocity, acceleration,
jerk and snap all from zero, and down again at the end.
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import minsnap
from minsnap.plot import save_figure, styled


@styled
def main(folder: Path) -> None:
    """Write both as setpoints, and draw their velocities and accelerations."""
    folder.mkdir(parents=True, exist_ok=True)
    circles = {"literal": minsnap.circle(3.0, period=6.0, ramp=0.0), "from rest": minsnap.circle(3.0, period=6.0)}
    figure = Figure(figsize=(10.0, 5.0), layout="constrained")
    columns = figure.subplots(2, 2, sharex="col", sharey="row").T
    for axes, (name, path) in zip(columns, circles.items(), strict=True):
        minsnap.write_csv(path, folder / f"circle_{name.replace(' ', '_')}.csv", rate=20.0)
        minsnap.plot.plot_profiles(path, axes, orders=(1, 2))
        axes[0].set_title(f"{name}: {path.duration:g} s", loc="left")
    save_figure(figure, folder / "circle_from_rest.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
