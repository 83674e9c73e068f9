"""The vehicles that come with the library, by the names that files and commands have for them."""

from __future__ import annotations

from minsnap.errors import VehicleError
from minsnap.vehicle.quadrotor import Quadrotor
from minsnap.vehicle.yaml import description_of

VEHICLES = ("crazyflie", "dji_f330", "px4_sih")
"""Presets of :class:`~minsnap.vehicle.Quadrotor` by name."""

SHORT_NAMES = {"f330": "dji_f330", "px4-sih": "px4_sih"}
"""Names of presets on the command line, which files may use too."""


def named_vehicle(name: str) -> Quadrotor:
    """Return the preset of that name.

    Raises
    ------
    VehicleError
        If there is none.
    """
    name = SHORT_NAMES.get(name, name)
    if name not in VEHICLES:
        raise VehicleError(f"no vehicle is called {name!r}: choose one of {', '.join(VEHICLES)}")
    made: Quadrotor = getattr(Quadrotor, name)()
    return made


def preset_of(vehicle: Quadrotor) -> str | None:
    """Return the name of the preset that is the same vehicle, or None."""
    description = description_of(vehicle)
    return next((name for name in VEHICLES if description_of(named_vehicle(name)) == description), None)
