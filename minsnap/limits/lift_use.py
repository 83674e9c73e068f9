"""Utilisation of the limits on thrust, tilt and body rate of a vehicle with drag, certified over all time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.limits.kinds import KIND
from minsnap.limits.proved_bound import MARGIN, Lift, ProvedBound
from minsnap.limits.utilisation import used_at
from minsnap.polynomials.intervals import cross, dot, length
from minsnap.trajectory.report import Utilisation

if TYPE_CHECKING:
    from minsnap.trajectory.trajectory import Trajectory
    from minsnap.vehicle import Quadrotor
    from minsnap.vehicle.states import FlatStates

LIFTED = ("max_thrust", "min_thrust", "tilt", "body_rate")
"""Limits that depend on the thrust axis."""


def measure_lift(vehicle: Quadrotor, given: Mapping[str, float], traj: Trajectory) -> dict[str, Utilisation]:
    """Return the utilisation of those of ``LIFTED`` that are given, by name."""
    asked = {name: limit for name, limit in given.items() if name in LIFTED}
    found = LiftBound(vehicle, traj, asked).run() if asked else []
    return {
        name: used_at(traj, name, limit, -value if KIND[name].least else value, instant, method)
        for (name, limit), (value, instant, method) in zip(asked.items(), found, strict=True)
    }


class LiftBound(ProvedBound):
    """Largest thrust and minus the least one over weight, tilt [rad] and body rate [rad/s]."""

    def __init__(self, vehicle: Quadrotor, traj: Trajectory, limits: Mapping[str, float]) -> None:
        super().__init__(vehicle, traj)
        self.names, self.margins = list(limits), MARGIN * np.array(list(limits.values()))

    @property
    def _provable(self) -> bool:
        return True

    def _quantities(self, states: FlatStates) -> FloatArray:
        thrust, up = states.thrust / self.vehicle.weight, states.rotation[:, :, 2]
        found = {
            "max_thrust": thrust,
            "min_thrust": -thrust,
            "tilt": np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2]),
            "body_rate": np.hypot(states.body_rates[:, 0], states.body_rates[:, 1]),
        }
        return np.array([found[name] for name in self.names])

    def _bounds(self, motion: Lift, start: FloatArray, width: FloatArray) -> FloatArray:
        force, gravity = motion.force, self.medium.gravity
        thrust = motion.thrust(self.medium.more_linear, self.medium.more_quadratic)
        aside = np.hypot(*(np.maximum(-part.low, part.high) for part in force[:2]))
        rate = (length(cross(force, motion.change)) / dot(force, force)).high
        found = {
            "max_thrust": thrust.high / gravity,
            "min_thrust": -thrust.low / gravity,
            "tilt": np.where(force[2].low > 0.0, np.arctan2(aside, force[2].low), np.pi),
            "body_rate": np.minimum(rate, (length(motion.change) / length(force)).high),
        }
        return np.array([found[name] for name in self.names])
