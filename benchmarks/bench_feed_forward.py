"""Drag compensation in simulation beside what was recorded on PX4: four courses, with and without, and with a lead."""

import numpy as np

import minsnap
from minsnap.flight import CascadeController, simulate
from minsnap.trajectory.samples import Samples
from minsnap.vehicle import Quadrotor

DELAY = 0.1
"""Of the setpoint path [s]: with it the errors without compensation are those recorded, to within 10 %."""

RECORDED = {
    "rectangle 8 m x 4 m, 24 s": (0.607, 0.228),
    "rectangle 8 m x 4 m, 12 s": (1.127, 0.459),
    "rectangle 6 m x 4 m, 3 m/s, 6 m/s^2": (1.102, 0.624),
    "circle of 3 m, 9 s": (1.055, 0.653),
}
"""3-D RMSE against the logged setpoints [m]: as planned, and with drag added to the acceleration (settled start)."""


def rectangle(width, length, **timing):
    corners = [(0, 0, 2), (width, 0, 2), (width, length, 2), (0, length, 2), (0, 0, 2)]
    return minsnap.plan(corners, corridor=0.3, **timing)


def courses():
    limits = minsnap.Limits(speed=3.0, acceleration=6.0)
    paths = (
        rectangle(8, 4, total_time=24.0),
        rectangle(8, 4, total_time=12.0),
        rectangle(6, 4, limits=limits),
        minsnap.circle(radius=3.0, period=6.0),
    )
    return dict(zip(RECORDED, paths, strict=True))


def led(path, lead):
    """Samples at 20 Hz of what is to be flown ``lead`` seconds later, held at the end."""
    t = np.arange(int(np.ceil(path.duration * 20.0)) + 1) / 20.0
    ahead = np.minimum(t + lead, path.duration)
    inside = (t + lead <= path.duration)[:, None]
    return Samples(t, path(ahead), inside * path(ahead, 1), inside * path(ahead, 2))


def error(path, compensated, lead=0.0):
    """3-D RMSE of a simulated flight against the setpoints that hold [m]."""
    vehicle = Quadrotor.px4_sih()
    drag = vehicle.drag if compensated else None
    flight = simulate(vehicle, CascadeController(), led(path, lead), setpoint_delay=DELAY, compensation=drag)
    held = path(np.minimum(np.floor(flight.t * 20.0 + 1e-6) / 20.0, path.duration))
    return float(np.sqrt(np.mean(np.sum((flight.position - held) ** 2, axis=1))))


def main():
    print(f"{'course':38}{'recorded':>18}{'simulated':>18}{'with lead 0.2 s':>18}")
    for name, path in courses().items():
        without, compensated, ahead = error(path, False), error(path, True), error(path, True, 0.2)
        recorded = "{:.3f} -> {:.3f}".format(*RECORDED[name])
        print(f"{name:38}{recorded:>18}{without:>9.3f} -> {compensated:.3f}{ahead:>18.3f}")


if __name__ == "__main__":
    main()
