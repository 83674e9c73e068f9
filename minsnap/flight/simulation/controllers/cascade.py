"""The cascade of PX4: position, velocity, attitude and rate loops, one inside the other."""

from __future__ import annotations

from dataclasses import dataclass

from minsnap.flight.simulation.controllers.cascade_pilot import CascadePilot
from minsnap.flight.simulation.controllers.cascade_settings import CascadeSettings
from minsnap.vehicle.quadrotor import Quadrotor


@dataclass(frozen=True)
class CascadeController(CascadeSettings):
    """Position P, velocity PID, attitude P and rate PID with saturations: the structure of PX4's multicopter control.

    Its parameters are those of ``CascadeSettings``.
    """

    def pilot(self, vehicle: Quadrotor, step: float) -> CascadePilot:
        """Return the running controller for a vehicle, to be called every ``step`` seconds."""
        return CascadePilot(self, vehicle, step)
