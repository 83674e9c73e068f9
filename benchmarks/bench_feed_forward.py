"""Drag compensation in simulation beside what was recorded on PX4: four courses, with and without, and with a lead."""

import numpy as np

import minsnap
from minsnap.flight import CascadeController, simulate
from minsnap.trajectory.samples import Samples
from minsnap.vehicle import Quadrotor

DELAY = 0.1
"""Of the setpoint path [s]: with it simulated errors are those recorded, to within 20 %."""

RECORDED = {
    "rectangle 8 m x 4 m, 24 s": (0.607, 0.228, None),
    "rectangle 8 m x 4 m, 12 s": (1.127, 0.535, 0.459),
    "rectangle 6 m x 4 m, 3 m/s, 6 m/s^2": (1.102, 0.700, 0.624),
    "circle of 3 m, 9 s": (1.055, 0.707, 0.653),
}
"""3-D RMSE against the logged setpoints [m]: as planned, with drag added to the acceleration, and that when settled."""

BELOW, CLIMBING = 1.0, 0.7
"""Where the recorded flights began that had no settled start: this far below the first setpoint [m], climbing [m/s]."""


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


def led(path, lead, settled):
    """Samples at 20 Hz of what is to be flown ``lead`` seconds later, held at the end; the first is where it begins."""
    t = np.arange(int(np.ceil(path.duration * 20.0)) + 1) / 20.0
    ahead = np.minimum(t + lead, path.duration)
    inside = (t + lead <= path.duration)[:, None]
    place, velocity = path(ahead), inside * path(ahead, 1)
    if not settled:
        place[0, 2] -= BELOW
        velocity[0, 2] = CLIMBING
    return Samples(t, place, velocity, inside * path(ahead, 2))


def error(path, compensated, lead=0.0, settled=True):
    """3-D RMSE of a simulated flight against the setpoints that hold [m]."""
    vehicle = Quadrotor.px4_sih()
    drag = vehicle.drag if compensated else None
    sent = led(path, lead, settled)
    flight = simulate(vehicle, CascadeController(), sent, setpoint_delay=DELAY, compensation=drag)
    held = path(np.minimum(np.floor(flight.t * 20.0 + 1e-6) / 20.0, path.duration))
    return float(np.sqrt(np.mean(np.sum((flight.position - held) ** 2, axis=1))))


def main():
    print(f"{'':38}{'as recorded, climbing at the start':^38}{'settled start':^38}")
    print(f"{'course':38}{'recorded':>19}{'simulated':>19}{'recorded':>12}{'simulated':>17}{'lead 0.2 s':>12}")
    for name, path in courses().items():
        without, compensated = (error(path, drag, settled=False) for drag in (False, True))
        settled = (error(path, False), error(path, True), error(path, True, 0.2))
        known = RECORDED[name]
        still = "-" if known[2] is None else f"{known[2]:.3f}"
        print(
            f"{name:38}{known[0]:>9.3f} -> {known[1]:.3f}{without:>10.3f} -> {compensated:.3f}"
            f"{still:>12}{settled[0]:>8.3f} -> {settled[1]:.3f}{settled[2]:>12.3f}"
        )


if __name__ == "__main__":
    main()
