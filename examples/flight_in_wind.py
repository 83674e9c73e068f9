"""A flight in wind: the same plan in still air and in gusts, by a simulated vehicle.

The simulation has the vehicle's motors, drag and controller; its seed repeats the same gusts. On the command line:

    minsnap simulate plan.json --wind 3 0 0 --gust 1 --plot wind.png --animate wind.gif
"""

import sys
from pathlib import Path

import minsnap
from minsnap.flight.simulation import DrydenWind, GeometricController, simulate
from minsnap.flight.tracking.simulated_flights import compare_simulated, flight_figures
from minsnap.flight.tracking.tracking_plot import plot_comparison
from minsnap.plot import save_figure
from minsnap.vehicle import Quadrotor

CORNERS = [(0, 0, 1), (3, 0, 1), (3, 2, 1.5), (0, 2, 1.5)]


def main(folder: Path) -> None:
    """Plan, fly twice, compare."""
    folder.mkdir(parents=True, exist_ok=True)
    path = minsnap.plan(CORNERS, limits=minsnap.Limits(speed=2.0, acceleration=3.0, jerk=15.0))
    vehicle, controller = Quadrotor.dji_f330(), GeometricController()
    winds = {"still air": None, "gusts": DrydenWind((3.0, 0.0, 0.0), (1.0, 1.0, 0.5), seed=1)}
    flights = {name: simulate(vehicle, controller, path, wind=wind) for name, wind in winds.items()}
    for name, flight in flights.items():
        found = flight_figures(flight, vehicle)
        print(f"{name}: {100 * found['rmse']:.1f} cm off on average, {100 * found['max_error']:.1f} cm at most")
    figure = plot_comparison({name: compare_simulated(flight) for name, flight in flights.items()})
    save_figure(figure, folder / "flight_in_wind.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
