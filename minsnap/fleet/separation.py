"""Separation of the vehicles of a fleet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, ReadOnly, bounded, numbers, set_fields
from minsnap.basics.checks import is_number
from minsnap.basics.messages import shown
from minsnap.errors import FleetError


@dataclass(frozen=True, eq=False)
class Separation(ReadOnly):
    r"""Least distance of any two vehicles at every instant.

    The distance of two vehicles is :math:`\sqrt{\Delta x^2 + \Delta y^2 + (\Delta z / w)^2}` with the downwash w:
    vehicles above each other are to be w times as far apart as vehicles side by side.

    Parameters
    ----------
    distance : float, optional
        Of any pair [m].
    downwash : float
        At least 1.
    radii : array_like, shape (vehicles,), optional
        Of each vehicle [m], in place of ``distance``: a pair is to be apart by the sum of its two.

    Raises
    ------
    FleetError
        If a distance is not positive, the downwash is below 1, or distance and radii are both set, or neither.
    """

    distance: float | None
    downwash: float
    radii: FloatArray | None

    def __init__(
        self, distance: float | None = None, downwash: float = 1.0, *, radii: npt.ArrayLike | None = None
    ) -> None:
        if (distance is None) == (radii is None):
            raise FleetError("a separation needs either one distance for all pairs or the radii of the vehicles [m]")
        if distance is not None and not (is_number(distance) and distance > 0.0):
            raise FleetError(f"the separation is {shown(distance)}: give a positive distance [m]")
        if not (is_number(downwash) and downwash >= 1.0):
            raise FleetError(f"the downwash is {shown(downwash)}: it must be at least 1, as heights are divided by it")
        between, each = None if distance is None else float(distance), None if radii is None else _checked_radii(radii)
        set_fields(self, distance=between, downwash=float(downwash), radii=each)

    def radii_of(self, vehicles: int) -> FloatArray:
        """Return half the separation of each vehicle, shape (vehicles,) [m].

        Raises
        ------
        FleetError
            If there are radii for another number of vehicles.
        """
        if self.radii is None:
            return np.full(vehicles, 0.5 * (self.distance or 0.0))
        if len(self.radii) != vehicles:
            raise FleetError(f"the separation has {len(self.radii)} radii for {vehicles} vehicles: give one for each")
        return self.radii

    def scaled(self, share: float) -> Separation:
        """Return the separation with its distance multiplied by a factor."""
        if self.radii is None:
            return Separation((self.distance or 0.0) * share, self.downwash)
        return Separation(downwash=self.downwash, radii=self.radii * share)

    def between(self, one: int, two: int) -> float:
        """Return how far two vehicles are to be apart [m]."""
        return self.distance if self.radii is None else float(self.radii[one] + self.radii[two])  # type: ignore[return-value]


def as_separation(value: Any) -> Separation:
    """Return a Separation; a number is one without downwash."""
    return value if isinstance(value, Separation) else Separation(value)


def _checked_radii(radii: npt.ArrayLike) -> FloatArray:
    values = numbers(radii)
    if values is None or values.ndim != 1 or not len(values) or not (bounded(values) & (values > 0.0)).all():
        raise FleetError(f"the radii are {shown(radii)}: give a positive number for each vehicle [m]")
    return values
