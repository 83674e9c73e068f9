"""Gates whose frames are obstacles: four openings in bars, poles between them, all kept clear of at every instant."""

import sys
from pathlib import Path

import numpy as np

import minsnap
import minsnap.plot

RADIUS, THROUGH = 0.08, 0.1
"""Of the vehicle; how far behind a gate it turns at the earliest [m]."""

PLACES = [((0.5, 0.25, 0.7), -0.78), ((1.05, 0.75, 1.2), 2.35), ((-1.0, -0.25, 0.7), 3.14), ((0.0, -0.75, 1.2), 0.0)]
"""Center [m] and heading [rad] of each gate."""


def main(folder: Path) -> None:
    """Plan a flight through the gates, certify it and draw it into a folder."""
    gates = [
        minsnap.Gate(center, (np.cos(yaw), np.sin(yaw), 0.0), 0.4, crossing=1, margin=RADIUS) for center, yaw in PLACES
    ]
    bars = [bar for gate in gates for bar in gate.frame(0.16, 0.04, clearance=RADIUS)]
    poles = [minsnap.Cylinder(place, 0.015 + RADIUS, high=1.65) for place in ((0, 0.75), (1, 0.25), (-1.5, -0.25))]
    through = [opening for gate in gates for opening in (gate, gate.moved(THROUGH * gate.normal))]
    waypoints, avoid = [(-1.5, 0.75, 0.5), *through, (0.5, -0.75, 1.2)], [*bars, *poles]

    limits = minsnap.Limits(speed=3.0, acceleration=6.0, jerk=30.0)
    flight = minsnap.plan(waypoints, limits=limits, avoid=avoid)
    found = minsnap.certify(flight, waypoints, limits=limits, avoid=avoid)
    spare = found.obstacle_margin
    print(f"{flight.duration:.2f} s through {len(gates)} gates, certified: {found.ok}; {spare:.4f} m to spare")
    folder.mkdir(parents=True, exist_ok=True)
    figure = minsnap.plot.plot_overview(flight, waypoints=waypoints, avoid=avoid, limits=limits)
    figure.savefig(folder / "gates_with_frames.png", dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
