"""Options of simulated vehicles: which one, its controller, and the wind."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.flight.simulation.controllers.controller import Controller
    from minsnap.flight.simulation.wind import Wind
    from minsnap.vehicle.quadrotor import Quadrotor

Triple = tuple[float, float, float]

VEHICLE_HELP = "f330, crazyflie, px4-sih, or a YAML file."
CONTROLLER_HELP = "cascade (PX4's), lee or mellinger."


def vehicle_of(name: str) -> Quadrotor:
    """Return a preset by its name, here or in Python and files, or the vehicle of a YAML file.

    Raises
    ------
    InputError
        If it is neither.
    """
    from minsnap.files.plan_request import SHORT_NAMES, VEHICLES, named_vehicle
    from minsnap.vehicle.quadrotor import Quadrotor

    preset = SHORT_NAMES.get(name, name)
    if preset in VEHICLES:
        return named_vehicle(preset)
    if not Path(name).suffix and not Path(name).exists():
        raise InputError(f"--vehicle is {name!r}: give {VEHICLE_HELP.rstrip('.')}")
    return Quadrotor.from_yaml(name)


def controller_of(name: str, references: str) -> Controller:
    """Return a controller by its name; ``references`` is what the cascade follows."""
    from minsnap.flight.simulation.controllers.cascade import CascadeController
    from minsnap.flight.simulation.controllers.geometric import GeometricController

    if name == "cascade":
        return CascadeController(references=references)
    if name in ("lee", "mellinger"):
        return GeometricController(feed_forward=name == "lee")
    raise InputError(f"--controller is {name!r}: it must be one of cascade, lee, mellinger")


def wind_of(mean: Triple, gust: float, seed: int) -> Wind:
    """Return a constant wind, or one with Dryden gusts of an intensity [m/s]."""
    from minsnap.flight.simulation.wind import ConstantWind, DrydenWind

    return DrydenWind(mean, (gust, gust, 0.5 * gust), seed=seed) if gust else ConstantWind(mean)
