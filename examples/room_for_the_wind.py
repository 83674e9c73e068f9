"""A plan that leaves room for the wind: the vehicle in its loop, not only the plan, stays in the corridor.

The worst gust of the control loop blows while a simulated vehicle flies both plans. On the command line:

    minsnap plan points.csv --corridor 1 --tracking px4 --wind 2 -o plan.json
    minsnap check plan.json --tracking px4 --wind 2
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import minsnap
from minsnap.flight import CascadeController, simulate
from minsnap.vehicle import BodyDrag, Quadrotor

POINTS = [(0, 0, 2), (12, 0, 2), (12, 6, 2), (0, 6, 2)]
CORRIDOR, WIND, DRAG = 1.0, 2.0, 0.3
LIMITS = minsnap.Limits(speed=3.0, acceleration=4.0, jerk=20.0)


@dataclass(frozen=True)
class WorstGust:
    """Blows from the side so that the error is largest at an instant."""

    loop: minsnap.Loop
    end: float

    def sample(self, count: int, step: float) -> np.ndarray:
        """Return the wind at every step, shape (count, 3) [m/s]."""
        known, gust = self.loop.worst_gust(self.end, 1.0 / step)
        along = np.interp(step * np.arange(count), known, gust, right=0.0)
        return WIND * along[:, None] * np.array([0.0, -1.0, 0.0])


def main(folder: Path) -> None:
    """Plan with and without room for the wind, fly both, draw."""
    folder.mkdir(parents=True, exist_ok=True)
    loop = minsnap.Loop.px4(drag=DRAG)
    asked = {"waypoints": POINTS, "corridor": CORRIDOR, "limits": LIMITS}
    plans = {"plan alone": minsnap.plan(**asked), "with room": minsnap.plan(**asked, tracking=loop, wind=WIND)}
    vehicle = Quadrotor.px4_sih()
    vehicle = replace(vehicle, drag=BodyDrag(np.full(3, DRAG) * vehicle.mass))
    figure, axes = plt.subplots(figsize=(8.0, 4.8))
    for (name, path), colour in zip(plans.items(), ("tab:red", "tab:blue"), strict=True):
        cert = minsnap.certify(path, **asked, tracking=loop, wind=WIND)
        flight = simulate(vehicle, CascadeController(), path, wind=WorstGust(loop, 0.3 * path.duration))
        worst = np.linalg.norm(flight.error, axis=1).max()
        verdict = "stays inside" if cert.ok else "may leave"
        print(f"{name}: {path.duration:.2f} s, {verdict}; error up to {cert.tube:.2f} m, in this gust {worst:.2f} m")
        if name == "with room":
            minsnap.plot.plot_path(path, ax=axes, corridor=CORRIDOR, waypoints=POINTS)
        else:
            axes.plot(*path(np.linspace(0.0, path.duration, 500))[:, :2].T, "--", color=colour, label=name)
        axes.plot(*flight.position[:, :2].T, color=colour, label=f"flown, {name}")
    axes.set_ylim(-1.5, 7.5)
    axes.legend(loc="center")
    figure.savefig(folder / "room_for_the_wind.png", dpi=120)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
