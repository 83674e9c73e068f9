"""The shortest time within limits, and what limits inside the programme are worth.

The rectangle is flown within 3 m/s and 6 m/s² three ways: durations in proportion to the sides, scaled until a limit is
touched; one search over curve and durations; and the same with three polynomials a side, which can cruise at the limit
as a trapezoid of speed does.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import minsnap
from minsnap import Limits
from minsnap.plot import save_figure, styled

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
LIMITS = Limits(speed=3.0, acceleration=6.0)
WAYS = {
    "by distance, scaled": {"search": minsnap.Search(split="distance")},
    "one polynomial a side": {"pieces": 1},
    "three polynomials a side": {"pieces": 3},
}
STYLES = [("#999999", ":"), ("#009e73", "--"), ("#0072b2", "-")]


@styled
def main(folder: Path) -> None:
    """Plan each way, say what binds, and draw the speeds and the last one's use of its limits."""
    figure = Figure(figsize=(7.0, 7.0), layout="constrained")
    top, bottom = figure.subplots(2, 1)
    for (name, options), (color, line) in zip(WAYS.items(), STYLES, strict=True):
        path = minsnap.plan(CORNERS, corridor=0.3, limits=LIMITS, **options)
        binding = path.report.binding
        print(f"{name}: {path.duration:.2f} s; {binding.name} binds on leg {binding.leg} at {binding.instant:.2f} s")
        t = np.linspace(0.0, path.duration, 1001)
        speed = np.linalg.norm(path(t, 1), axis=1)
        top.plot(t, speed, color=color, linestyle=line, label=f"{name}: {path.duration:.2f} s")
    top.axhline(LIMITS.speed, color="black", linewidth=1.0, linestyle=(0, (5, 3)))
    top.set(xlabel="time [s]", ylabel="speed [m/s]")
    top.legend(fontsize="small", loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
    top.grid(True, alpha=0.3)
    minsnap.plot.plot_utilisation(path, LIMITS, bottom)
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(figure, folder / "shortest_time.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
