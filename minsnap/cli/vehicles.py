"""Options of simulated vehicles: which one, its controller, and the wind."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.flight.simulation.controllers import Controller
    from minsnap.flight.simulation.disturbances import Wind
    from minsnap.vehicle.quadrotor import Quadrotor

Triple = tuple[float, float, float]

VEHICLE_HELP = "f330, crazyflie, px4-sih, or a YAML file."


def vehicle_of(name: str) -> Quadrotor:
    """Return a preset by its name, here or in Python and files, or the vehicle of a YAML file.

    Raises
    ------
    InputError
        If it is neither.
    """
    from minsnap.vehicle.named import SHORT_NAMES, VEHICLES, named_vehicle
    from minsnap.vehicle.quadrotor import Quadrotor

    preset = SHORT_NAMES.get(name, name)
    if preset in VEHICLES:
        return named_vehicle(preset)
    if not Path(name).suffix and not Path(name).exists():
        raise InputError(f"--vehicle is {name!r}: give {VEHICLE_HELP.rstrip('.')}")
    return Quadrotor.from_yaml(name)


@dataclass(frozen=True)
class SimulatedVehicle:
    """Options of a simulated flight: the vehicle, its controller, the noise of its poses, and the wind."""

    vehicle: Annotated[str, VEHICLE_HELP] = "f330"
    controller: Annotated[str, "cascade (PX4's), lee or mellinger."] = "cascade"
    noise: Annotated[float, "M", "Standard deviation of a pose [m]."] = 0.0
    wind: Annotated[Triple, "X Y Z", "Mean wind [m/s]."] = (0.0, 0.0, 0.0)
    gust: Annotated[float, "M/S", "Intensity of Dryden gusts [m/s]."] = 0.0
    seed: Annotated[int, "Seed: the same number gives the same noise and gusts."] = 0

    @property
    def craft(self) -> Quadrotor:
        """The vehicle."""
        return vehicle_of(self.vehicle)

    @property
    def air(self) -> Wind:
        """A constant wind, or one with Dryden gusts."""
        from minsnap.flight.simulation.disturbances import ConstantWind, DrydenWind

        gusts = (self.gust, self.gust, 0.5 * self.gust)
        return DrydenWind(self.wind, gusts, seed=self.seed) if self.gust else ConstantWind(self.wind)

    def pilot(self, references: str) -> Controller:
        """Return the controller; ``references`` is what the cascade follows."""
        from minsnap.flight.simulation.controllers import CascadeController, GeometricController

        if self.controller == "cascade":
            return CascadeController(references=references)
        if self.controller in ("lee", "mellinger"):
            return GeometricController(feed_forward=self.controller == "lee")
        raise InputError(f"--controller is {self.controller!r}: it must be one of cascade, lee, mellinger")
