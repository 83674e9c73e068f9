"""Inspection of a mast: three turns around it on a helix, the camera on it at every instant.

``LookAt`` turns the nose to a point; the yaw, its rate and the largest rate over all time are exact. A helix has
polynomials within a micrometre, so that it is certified and joined with a plan like any other trajectory.
"""

import sys
from pathlib import Path

import numpy as np

import minsnap
from minsnap import Limits, LookAt
from minsnap.plot import save_figure

MAST = (3.0, 2.0)


def main(folder: Path) -> None:
    """Fly there, turn around the mast while climbing, and say how fast the nose turns."""
    turns = minsnap.helix(radius=2.0, pitch=1.0, laps=3, period=8.0, center=MAST, altitude=1.0, yaw=LookAt(MAST))
    helix = minsnap.as_polynomials(turns)
    limits = Limits(speed=2.0, acceleration=3.0, jerk=15.0)
    there = minsnap.plan([(7, -1, 1), helix(0.0)], limits=limits, yaw=LookAt(MAST))
    flight = there.then(helix)
    used = minsnap.certify(flight, limits=Limits(speed=2.0, yaw_rate=3.0)).utilisation
    for one in used:
        print(f"{one.name}: {one.value:.3f} of {one.limit:g}, at {one.instant:.2f} s")
    folder.mkdir(parents=True, exist_ok=True)
    minsnap.write_csv(flight, folder / "inspection.csv")
    figure = minsnap.plot.plot_overview(flight, title="the nose points at the mast")
    plane = figure.subfigs[0].axes[0]
    plane.plot(*MAST, marker="*", color="black", markersize=14, linestyle="none")
    for t in np.linspace(0.0, flight.duration, 40):
        nose = 0.5 * np.array([np.cos(flight.yaw(t)), np.sin(flight.yaw(t))])
        plane.plot(*np.stack((flight(t)[:2], flight(t)[:2] + nose)).T, color="#0072b2", linewidth=1.0)
    save_figure(figure, folder / "inspection.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
