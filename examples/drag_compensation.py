"""A circle at 3 m/s with and without drag feed-forward, under three models of drag.

The simulated vehicle has the drag of its airframe and of its rotors. Offsetting exactly that takes nearly all of the
error of a geometric controller; offsetting the airframe alone takes little, since rotors make most of the drag at such
speeds; offsetting the published linear fit, which pushes forward below the speeds it was measured at, makes it worse.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import minsnap
from minsnap.flight import GeometricController, simulate
from minsnap.flight.thesis import consistent_parasitic_drag, published_drag
from minsnap.plot import save_figure, styled
from minsnap.vehicle import Quadrotor


@styled
def main(folder: Path) -> None:
    """Fly four times; draw the distance to the reference."""
    vehicle = Quadrotor.dji_f330()
    path = minsnap.circle(radius=3.0, speed=3.0, laps=3)
    models = {
        "no compensation": (None, "-"),
        "published, linear": (published_drag("linear"), ":"),
        "consistent airframe": (consistent_parasitic_drag(), "--"),
        "exact: airframe and rotors": (vehicle.drag, "-."),
    }
    figure = Figure(figsize=(8.0, 4.0), layout="constrained")
    ax = figure.add_subplot()
    for name, (model, line) in models.items():
        flight = simulate(vehicle, GeometricController(), path, compensation=model)
        distance = np.linalg.norm(flight.error, axis=1)
        ax.semilogy(flight.t, 1000 * np.maximum(distance, 1e-6), line, label=name)
        print(f"{name:<28}{1000 * np.sqrt(np.mean(distance**2)):8.2f} mm")
    ax.set(xlabel="time [s]", ylabel="distance to the reference [mm]", ylim=(0.01, 300))
    ax.grid(alpha=0.3)
    ax.legend(frameon=False, ncols=2)
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(figure, folder / "drag_compensation.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
