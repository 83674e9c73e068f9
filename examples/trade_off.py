"""What a second costs: total time against snap, for those who have no time to keep.

Who has neither a total time nor limits can say what a second is worth. For each price the plan is the one of least snap
cost plus price times duration; together the plans trace the curve of best trade-offs. The point of a total time that is
split by distance lies above it.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import minsnap
from minsnap.plot import save_figure, styled

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
PRICES = np.geomspace(0.3, 3e4, 11)


@styled
def main(folder: Path) -> None:
    """Plan for each price, and draw cost against duration and the search for one of them."""
    figure = Figure(figsize=(10.0, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    for corridor, color, marker in ((0.3, "#0072b2", "o"), (None, "#d55e00", "s")):
        paths = [minsnap.plan(CORNERS, corridor=corridor, search=minsnap.Search(time_weight=price)) for price in PRICES]
        name = "no corridor" if corridor is None else f"corridor of {corridor} m"
        times = [path.duration for path in paths]
        left.plot(times, [p.cost() for p in paths], color=color, marker=marker, markersize=4, label=name)
        print(f"{name}: " + ", ".join(f"{p:.3g} a second: {t:.2f} s" for p, t in zip(PRICES, times, strict=True)))
    naive = minsnap.plan(CORNERS, total_time=12.0, corridor=0.3, search=minsnap.Search(split="distance"))
    left.plot(12.0, naive.cost(), "x", color="black", label="12 s split by distance")
    left.set(xscale="log", yscale="log", xlabel="duration [s]", ylabel="cost [m²/s⁷]")
    left.set_xticks([6, 8, 10, 15, 20, 30], ["6", "8", "10", "15", "20", "30"])
    left.minorticks_off()
    left.grid(True, alpha=0.3)
    left.legend(fontsize="small")
    minsnap.plot.plot_convergence(minsnap.plan(CORNERS, total_time=12.0, corridor=0.3), right)
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(figure, folder / "trade_off.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
