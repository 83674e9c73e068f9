"""Energy that the vehicles of a show take: momentum theory of their rotors in hover, at the thrust of each instant.

Rotors of disk area A that push with a thrust T through air of density rho take at least ``sqrt(T^3 / (2 rho A))``, and
more by their efficiency (J. G. Leishman, Principles of Helicopter Aerodynamics, 2nd edition, 2006, section 2.2). What a
vehicle saves in level flight and spends against the air is left out, as is what runs beside the rotors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import GRAVITY, FloatArray
from minsnap.errors import FleetError
from minsnap.fleet import Fleet
from minsnap.trajectory import Trajectory

AIR = 1.225
"""Density of air at sea level and 15 degrees [kg/m^3]."""

STEP = 0.1
"""Time between instants at which the power is taken [s]."""

WATT_HOUR = 3600.0
"""Joules of a watt hour."""


@dataclass(frozen=True)
class PowerModel:
    """What power a vehicle takes.

    Parameters
    ----------
    mass : float
        With its battery [kg].
    rotor_radius : float
        [m].
    rotors : int
    efficiency : float
        Power of the ideal rotor over that of the battery: rotor, motor and controller together.
    battery : float or None
        What the battery holds [Wh].

    Raises
    ------
    FleetError
        If one is not positive, or the efficiency is above 1.
    """

    mass: float
    rotor_radius: float
    rotors: int = 4
    efficiency: float = 0.5
    battery: float | None = None

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is not None and not 0.0 < value < np.inf:
                raise FleetError(f"the {name} of the energy is {value:g}: give a positive number")
        if self.efficiency > 1.0:
            raise FleetError(f"the efficiency of the energy is {self.efficiency:g}: give 1 at most, such as 0.5")

    @property
    def area(self) -> float:
        """Of all disks [m^2]."""
        return self.rotors * np.pi * self.rotor_radius**2

    @property
    def hover(self) -> float:
        """Power in hover [W]."""
        return float(self.power(np.zeros((1, 3)))[0])

    def power(self, accelerations: FloatArray) -> FloatArray:
        """Return the power at accelerations (n, 3), shape (n,) [W]."""
        thrusts = self.mass * np.linalg.norm(accelerations + (0.0, 0.0, GRAVITY), axis=1)
        return np.asarray(np.sqrt(thrusts**3 / (2.0 * AIR * self.area)) / self.efficiency)

    def energies(self, fleet: Fleet) -> FloatArray:
        """Return what each vehicle takes from its first to its last motion, shape (vehicles,) [Wh]."""
        return np.array([self._energy(curve) for curve in fleet]) / WATT_HOUR

    def _energy(self, curve: Trajectory) -> float:
        begins, ends = aloft(curve)
        instants = np.append(np.arange(begins, ends, STEP), ends)
        powers = self.power(curve(instants, 2))
        return float((0.5 * (powers[1:] + powers[:-1]) * np.diff(instants)).sum())


def aloft(curve: Trajectory) -> tuple[float, float]:
    """Return when a vehicle begins its first motion and ends its last [s]; the same instant where it stays."""
    moves = np.flatnonzero(np.ptp(curve.control_points, axis=1).any(axis=1))
    return (float(curve.breaks[moves[0]]), float(curve.breaks[moves[-1] + 1])) if len(moves) else (0.0, 0.0)
