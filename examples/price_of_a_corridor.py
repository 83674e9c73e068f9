"""How the cost grows as the corridor gets narrower.

Any half-width has a solution: in the limit, stopping at every corner. What a narrow corridor costs in snap is what a
planner trades against room.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import minsnap
from minsnap.plot import save_figure, styled

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
WIDTHS = np.geomspace(0.003, 3.0, 25)


@styled
def main(folder: Path) -> None:
    """Plan for each width and draw the cost."""
    costs = [minsnap.plan(CORNERS, durations=[4, 2, 4, 2], corridor=width).cost() for width in WIDTHS]
    free = minsnap.plan(CORNERS, durations=[4, 2, 4, 2]).cost()
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    ax = figure.add_subplot(xscale="log", yscale="log", xlabel="half-width [m]", ylabel="cost [m²/s⁷]")
    ax.plot(WIDTHS, costs, "o-", color="#0072b2", markersize=3, label="inside at every instant")
    ax.axhline(free, color="#d55e00", linestyle="--", label="without a corridor")
    ax.grid(True, which="both", alpha=0.3)
    ax.legend()
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(figure, folder / "price_of_a_corridor.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
