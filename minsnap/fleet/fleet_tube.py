"""Where the vehicles of a fleet can be in their control loops, and whether they keep apart, the room and obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf, isinf
from typing import Any

import numpy as np

from minsnap.basics.cached import cached_property
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.constraint import Constraint, walls_of
from minsnap.corridors.keep_out import Obstacle
from minsnap.errors import FleetError
from minsnap.fleet.common_clock import Fleet, Separation
from minsnap.limits.limits import Limits
from minsnap.native.fleet_border import near_pairs
from minsnap.vehicle_tube import VehicleTube, check_dimensions, check_tracking, strongest_wind, vehicle_tube


@dataclass(frozen=True, eq=False)
class FleetTube:
    """The tubes of a fleet's vehicles, and their distances in still air.

    Parameters
    ----------
    tubes : tuple of VehicleTube
    wind : float
        Largest change of the wind that was asked for [m/s].
    flown : Fleet
        The vehicles in still air.
    separation : Separation or None
    threads : int
    names : tuple of str
    """

    tubes: tuple[VehicleTube, ...]
    wind: float
    flown: Fleet = field(repr=False)
    separation: Separation | None
    threads: int
    names: tuple[str, ...] = field(repr=False)

    @property
    def each(self) -> tuple[VehicleTube, ...]:
        """The tubes of all vehicles."""
        return self.tubes

    @property
    def error(self) -> float:
        """Largest tracking error of a vehicle [m]; infinite where a loop saturates."""
        return max(tube.error for tube in self.tubes)

    @cached_property
    def fault(self) -> str | None:
        """The first condition that does not hold, in words; None where all do."""
        for name, tube in zip(self.names, self.tubes, strict=True):
            if tube.fault is not None:
                return f"{name}: {tube.fault}"
        pair, left = self._nearest(self.wind)
        if not left >= -EXACT:
            one, two = (self.names[vehicle] for vehicle in pair)
            wind = f"in a wind that changes by {self.wind:g} m/s"
            return f"{wind} {one} and {two} may come {-left:.3g} m nearer than their separation"
        return None

    @cached_property
    def strongest(self) -> float:
        """Largest change of the wind with which all conditions hold [m/s]; 0 where they do not in still air."""
        return strongest_wind(self._holds)

    def _holds(self, wind: float) -> bool:
        return all(tube.holds(wind) for tube in self.tubes) and self._nearest(wind)[1] >= -EXACT

    def _nearest(self, wind: float) -> tuple[tuple[int, int], float]:
        """Return the pair that may come nearest to its separation, and what is left of it, heights scaled [m]."""
        if self.separation is None or len(self.tubes) < 2:
            return (0, 0), inf
        own = [tube.loop.widths(wind, tube.flight.speed).error + tube.flight.position_error for tube in self.tubes]
        if isinf(max(own)):
            return (0, 1), -inf
        radii = self.separation.radii_of(len(self.tubes)) + np.array(own)
        found = near_pairs(self.flown.arrays, radii, self.separation.downwash, 1.0, True, self.threads)
        required = radii[found.pairs].sum(axis=1)
        which = int((found.least / required).argmin())
        one, two = sorted(found.pairs[which].tolist())
        return (one, two), float(found.least[which] - required[which])


def fleet_tube(
    fleet: Fleet,
    tracking: Any,
    wind: float,
    separation: Separation | None,
    room: Constraint | None,
    obstacles: Sequence[Obstacle],
    limits: Sequence[Limits] | None,
    threads: int,
) -> FleetTube:
    """Return the tubes of a fleet's vehicles with the conditions that they must keep.

    Raises
    ------
    VehicleError
        If ``tracking`` is no loop, or there is a wind without one.
    FleetError
        If there are loops for another number of vehicles.
    """
    loops = list(tracking) if isinstance(tracking, (list, tuple)) else [tracking] * len(fleet)
    if len(loops) != len(fleet):
        raise FleetError(f"there are {len(loops)} loops for {len(fleet)} vehicles: give one, or one for each")
    change = max(check_tracking(loop, wind) for loop in loops)
    span = min(0.0, *(loop.latency - loop.lead for loop in loops)), fleet.duration
    tubes = []
    for index, (loop, curve) in enumerate(zip(loops, fleet, strict=True)):
        check_dimensions(curve)
        walls = walls_of([room], curve(curve.leg_breaks)) if room else []
        own = limits[index] if limits else None
        tubes.append(vehicle_tube(loop, change, curve, walls, {}, obstacles, own, span))
    flown = Fleet(tuple(tube.flight.curve for tube in tubes))
    names = tuple(fleet.name(vehicle) for vehicle in range(len(fleet)))
    return FleetTube(tuple(tubes), change, flown, separation, threads, names)
