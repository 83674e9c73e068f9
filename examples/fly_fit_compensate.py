"""Fly, fit, compensate, fly again: the drag and the delay of a simulated vehicle, found from its logs and offset.

A quadrotor with the parameters of PX4's simulation in hardware flies four courses under PX4's cascade of controllers,
with setpoints at 20 Hz. The log of the first flight gives its drag, that of the second, flown with the drag offset, the
delay that is left, and the third flight has both offset. The vehicle's own parameters are never looked at.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import minsnap
from minsnap.flight import CascadeController, FeedForward, fit_flight, simulate, simulated_log
from minsnap.plot import save_figure, styled
from minsnap.vehicle import Quadrotor

VEHICLE = Quadrotor.px4_sih()
DELAY = 0.1
"""From the instant of a setpoint until the controller reads it [s]."""


def rectangle(width, length, **timing):
    """Return a rectangle at 2 m, inside a corridor."""
    corners = [(0, 0, 2), (width, 0, 2), (width, length, 2), (0, length, 2), (0, 0, 2)]
    return minsnap.plan(corners, corridor=0.3, **timing)


def courses():
    """Return the four courses that were also flown on PX4."""
    return {
        "rectangle, 24 s": rectangle(8, 4, total_time=24.0),
        "rectangle, 12 s": rectangle(8, 4, total_time=12.0),
        "rectangle, 3 m/s": rectangle(6, 4, limits=minsnap.Limits(speed=3.0, acceleration=6.0), pieces=1),
        "circle, 9 s": minsnap.circle(radius=3.0, period=6.0),
    }


def fly(path, added):
    """Fly a path with feed-forward; return the error in three dimensions over time [m], and the fit to the log."""
    plain = path.sample(20.0)
    sent = added.stated(plain)
    flight = simulate(VEHICLE, CascadeController(), sent, setpoint_delay=DELAY)
    wanted = plain.position[np.clip(((flight.t - sent.lead) * 20.0 + 1e-6).astype(int), 0, len(plain) - 1)]
    error = np.linalg.norm(flight.position - wanted, axis=1)
    return flight.t, error, fit_flight(simulated_log(VEHICLE, flight, plain))


def loop(path):
    """Fly three times; return what was fitted and the three errors over time."""
    first = fly(path, FeedForward())
    fitted = first[2].vehicle(name="fitted")
    second = fly(path, FeedForward(vehicle=fitted))
    lead = min(second[2].delay.value, 1.0)
    third = fly(path, FeedForward(vehicle=fitted, lead=lead))
    return fitted, first[2], lead, (first, second, third)


@styled
def main(folder: Path) -> None:
    """Print the errors of each course and draw them."""
    folder.mkdir(parents=True, exist_ok=True)
    names = ("as planned", "drag offset", "drag and delay offset")
    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    for axes, (name, path) in zip(figure.subplots(2, 2).flat, courses().items(), strict=True):
        fitted, found, lead, flights = loop(path)
        rmse = [float(np.sqrt(np.mean(error**2))) for _, error, _ in flights]
        drag = found.axes[0].linear
        print(
            f"{name:18} drag {drag.value:.3f} ± {drag.error:.3f} 1/s, lead {lead:.2f} s: "
            + " -> ".join(f"{value:.3f}" for value in rmse)
            + f" m ({1 - rmse[2] / rmse[0]:.0%} less)"
        )
        for (t, error, _), label, style in zip(flights, names, ("-", "--", ":"), strict=True):
            axes.plot(t, error, style, linewidth=1.0, label=label)
        axes.set(title=name, xlabel="time [s]", ylabel="error [m]")
        fitted.to_yaml(folder / "fitted.yaml")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    save_figure(figure, folder / "fly_fit_compensate.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
