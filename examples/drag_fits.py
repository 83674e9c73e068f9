"""Bench and wind tunnel data, fitted: rotor coefficients and drag surfaces with their uncertainty.

Measurements are made up from the published models with the noise that a strain gauge and a force balance have, then
fitted: the coefficients come back within their standard errors. The last picture holds the two models of a slow flight
side by side: the published one pushes forward below 4.7 m/s, where nothing was measured, the consistent one does not.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from minsnap.flight.thesis import (
    PUBLISHED_PARASITIC,
    PUBLISHED_PROPELLER,
    consistent_parasitic_drag,
    fit_drag,
    published_drag,
)
from minsnap.flight.thesis.drag_fits import plot_coefficient_fit, plot_surface
from minsnap.plot import save_figure, styled
from minsnap.vehicle import RPM, Quadrotor, fit_thrust_coefficient

NOISE = np.random.default_rng(2020)


def bench() -> tuple[np.ndarray, np.ndarray]:
    """Return rotor speeds [rad/s] and thrusts [N] as a test stand gives them."""
    speed = np.linspace(1500.0, 5800.0, 25) * RPM
    return speed, Quadrotor.dji_f330().thrust_coefficient * speed**2 + NOISE.normal(0.0, 0.03, 25)


def tunnel() -> dict[str, np.ndarray]:
    """Return drag of the airframe over pitch and velocity."""
    pitch, velocity = (axis.ravel() for axis in np.meshgrid(np.linspace(-20, 20, 17), np.linspace(7, 28, 8)))
    drag = PUBLISHED_PARASITIC(pitch_deg=pitch, velocity=velocity) + NOISE.normal(0.0, 0.12, pitch.size)
    return {"pitch_deg": pitch, "velocity": velocity, "drag": drag}


def propeller() -> dict[str, np.ndarray]:
    """Return drag of one propeller over pitch, velocity and rotor speed."""
    grid = np.meshgrid(np.linspace(0, 90, 10), np.linspace(0, 15, 6), np.linspace(3000, 7000, 5))
    pitch, velocity, speed = (axis.ravel() for axis in grid)
    drag = PUBLISHED_PROPELLER(pitch_deg=pitch, velocity=velocity, speed_rpm=speed) + NOISE.normal(0, 0.1, pitch.size)
    return {"pitch_deg": pitch, "velocity": velocity, "speed_rpm": speed, "drag": drag}


@styled
def main(folder: Path) -> None:
    """Fit all three and draw them, with the two models at the speeds that were flown."""
    figure = Figure(figsize=(11.0, 8.5), layout="constrained")
    speed, thrust = bench()
    plot_coefficient_fit(fit_thrust_coefficient(speed, thrust), speed, thrust, figure.add_subplot(2, 2, 1))
    table = tunnel()
    fit = fit_drag(table, "parasitic")
    plot_surface(fit.surface, table, figure.add_subplot(2, 2, 2, projection="3d"))
    blown = propeller()
    near = {name: column[np.isclose(blown["velocity"], 9.0)] for name, column in blown.items()}
    plot_surface(fit_drag(blown, "propeller").surface, near, figure.add_subplot(2, 2, 3, projection="3d"), velocity=9.0)
    ax, velocity = figure.add_subplot(2, 2, 4), np.linspace(0.0, 10.0, 200)
    air = np.stack([velocity, 0 * velocity, 0 * velocity], axis=-1)
    models = {"reduced, published": (published_drag("reduced"), "--"), "consistent": (consistent_parasitic_drag(), "-")}
    for name, (model, line) in models.items():
        ax.plot(velocity, -model.force(air)[:, 0], line, label=name)
    ax.axvspan(0.0, 7.0, color="0.9", label="not measured")
    ax.axhline(0.0, color="k", linewidth=0.8)
    ax.set(xlabel="velocity [m/s]", ylabel="drag [N]")
    ax.legend(frameon=False)
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(figure, folder / "drag_fits.png")
    for term, value, error in zip(fit.surface.exponents, fit.coefficients, fit.standard_errors, strict=True):
        print(f"pitch^{term[0]} velocity^{term[1]}: {value: .6f} ± {error:.6f}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
