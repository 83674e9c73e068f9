"""A race: the shortest time through the balls of the Split-S course, every rotor within its limits at every instant.

Course and vehicle are those published with the TOGT planner (C. Qin et al., ICRA 2024). A second argument gives the
polynomials per leg: more are faster in flight and slower to find; the picture in the documentation has three.
"""

import sys
from math import sqrt
from pathlib import Path

import minsnap
from minsnap import Ball, Limits
from minsnap.plot import plot_race, save_figure
from minsnap.vehicle import Quadrotor

LOOP = [
    (-1.1, -1.6, 3.6),
    (9.2, 6.6, 1.0),
    (9.2, -4.0, 1.2),
    (-4.5, -6.0, 3.5),
    (-4.5, -6.0, 0.8),
    (4.75, -0.9, 1.2),
    (-2.8, 6.8, 1.2),
]
COURSE = [(-5.0, 4.5, 1.2), *LOOP, *LOOP, *LOOP[:6]]
VEHICLE = Quadrotor(
    mass=0.85,
    inertia=(0.001, 0.001, 0.0017),
    arm_length=0.15,
    thrust_coefficient=1e-6,
    torque_coefficient=5e-8,
    rotor_speed_max=sqrt(6.879e6),
    name="racer",
)


def main(folder: Path, pieces: int = 1) -> None:
    """Plan, certify, and draw the path by its speed above the thrust of every rotor."""
    limits = Limits.of(VEHICLE, reserve=0.0, body_rate=15.0, yaw_rate=3.0)
    path = minsnap.plan(COURSE, limits=limits, yaw="tilt", waypoint_tolerance=Ball(0.3), pieces=pieces)
    found = minsnap.certify(path, COURSE, limits=limits, tolerance=Ball(0.3))
    for used in found.utilisation:
        print(f"{used.name}: {100.0 * used.fraction:.1f} %, {used.method}")
    print(f"{path.duration:.3f} s, {'certified' if found.ok else 'not certified'}")
    title = f"Split-S in {path.duration:.2f} s"
    figure = plot_race(path, VEHICLE, waypoints=COURSE, tolerance=Ball(0.3), title=title)
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(figure, folder / "race.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"), int(sys.argv[2]) if len(sys.argv) > 2 else 1)
