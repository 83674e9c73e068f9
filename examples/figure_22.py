"""A rectangle inside its corridor, certified at every instant.

Four legs from corner to corner, at rest at the start and at the end, and nowhere further than 0.3 m from the straight
sides: the blue boxes. Figure 22 of the thesis that this library began with shows such a rectangle, whose curve was held
inside at 20 instants per leg; this one is inside in between as well, and its certificate says by how much.
"""

import sys
from pathlib import Path

import minsnap
from minsnap.plot import save_figure

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]


def main(folder: Path) -> None:
    """Plan, certify, draw."""
    traj = minsnap.plan(CORNERS, durations=[4, 2, 4, 2], corridor=0.3)
    certificate = minsnap.certify(traj, waypoints=CORNERS, corridor=0.3)
    print(f"cost {traj.cost():.3f} m²/s⁷, margin {certificate.corridor_margin:.1e} m, ok: {certificate.ok}")

    figure = minsnap.plot.plot_overview(traj, corridor=0.3, title="8 m × 4 m in 12 s, inside ±0.3 m at every instant")
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(figure, folder / "figure_22.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
