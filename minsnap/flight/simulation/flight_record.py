"""Record of a simulated flight: states, references and rotor speeds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, own_arrays
from minsnap.trajectory.samples import Samples
from minsnap.vehicle.rotation import headings


@dataclass(frozen=True, eq=False)
class Flight:
    """State of a vehicle at increasing instants, the first at 0; SI units, world z up, read-only arrays.

    Parameters
    ----------
    t : ndarray, shape (m,)
        Instants [s].
    position, velocity : ndarray, shape (m, 3)
        [m], [m/s].
    quaternion : ndarray, shape (m, 4)
        Attitude w, x, y, z.
    body_rates : ndarray, shape (m, 3)
        About the body's axes [rad/s].
    rotor_speed : ndarray, shape (m, 4)
        [rad/s].
    wind : ndarray, shape (m, 3)
        In the world frame [m/s].
    saturated : ndarray of bool, shape (m,)
        Instants when the rotors could not do what the controller commanded.
    reference : Samples
        What was to be flown, at the same instants.
    """

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    quaternion: FloatArray
    body_rates: FloatArray
    rotor_speed: FloatArray
    wind: FloatArray
    saturated: npt.NDArray[np.bool_]
    reference: Samples

    def __post_init__(self) -> None:
        own_arrays(self)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def duration(self) -> float:
        """Last instant [s]."""
        return float(self.t[-1])

    @property
    def samples(self) -> Samples:
        """The flight as samples: position, velocity and heading, as files and comparisons take them."""
        return Samples(self.t, self.position, self.velocity, yaw=headings(self.quaternion))

    def at_rate(self, rate: float) -> Samples:
        """Return the flight as samples at a lower rate [Hz]: those instants that are nearest to its grid."""
        wanted = np.arange(int(self.duration * rate) + 1) / rate
        index = np.clip(np.round(np.interp(wanted, self.t, np.arange(len(self)))), 0, len(self) - 1).astype(np.intp)
        return self.samples[index]

    @property
    def error(self) -> FloatArray:
        """Position less reference, shape (m, 3) [m]."""
        return np.asarray(self.position - self.reference.position)
