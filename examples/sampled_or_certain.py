"""What a corridor kept only at sampled instants lets through.

The usual quadratic programme holds the curve inside at some instants of each leg. Between them nothing holds it. Here
is by how much it gets out of a corridor of 0.3 m, and what the certified plan costs more.
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import minsnap
from minsnap.plot import save_figure, styled

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
INSTANTS = [2, 3, 5, 8, 12, 20, 30, 50]


@styled
def main(folder: Path) -> None:
    """Plan with more and more instants, and once for all of them."""
    durations = [4, 2, 4, 2]
    sampled = [minsnap.plan(CORNERS, durations, corridor=minsnap.Sampled(0.3, n)) for n in INSTANTS]
    outside = [-1000.0 * minsnap.certify(traj, corridor=0.3).corridor_margin for traj in sampled]
    certain = minsnap.plan(CORNERS, durations, corridor=0.3)
    for n, traj, millimetres in zip(INSTANTS, sampled, outside, strict=True):
        print(f"{n:3} instants per leg: cost {traj.cost():7.2f}, outside by {millimetres:7.2f} mm")
    print(f"every instant:      cost {certain.cost():7.2f}, outside by nothing")

    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    ax = figure.add_subplot(xscale="log", yscale="log", xlabel="instants per leg", ylabel="outside by [mm]")
    ax.plot(INSTANTS, outside, "o-", color="#0072b2", label="sampled")
    ax.axhline(min(outside) / 10.0, color="#8a1c3b", linestyle="--", label="every instant: 0")
    ax.set_xticks(INSTANTS, [f"{n}" for n in INSTANTS])
    ax.minorticks_off()
    ax.grid(True, alpha=0.3)
    ax.legend()
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(figure, folder / "sampled_or_certain.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
