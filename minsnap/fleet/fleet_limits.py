"""Use of limits and room by the vehicles of a fleet.

Pieces of all vehicles of one degree and one set of limits are measured as if they were one curve: limits are asked of
each piece alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.boxes import Room
from minsnap.errors import FleetError
from minsnap.fleet.common_clock import Fleet
from minsnap.limits.limits import Limits, check_limits
from minsnap.native import proved_extrema as native
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True)
class FleetUse:
    """Largest use of a limit by a vehicle of a fleet.

    Parameters
    ----------
    vehicle : int
    use : Utilisation
        Its leg and its instant are those of the vehicle.
    """

    vehicle: int
    use: Utilisation

    @property
    def kept(self) -> bool:
        """Whether the limit is kept."""
        return self.use.kept


def limits_of(limits: Any, vehicles: int) -> list[Limits]:
    """Return the limits of each vehicle, from one for all or one each."""
    if isinstance(limits, Sequence):
        if len(limits) != vehicles:
            raise FleetError(f"{len(limits)} limits for {vehicles} vehicles: give one for all, or one each")
        each = list(limits)
    else:
        each = [limits] * vehicles
    for one in {id(one): one for one in each}.values():
        check_limits(one)
    return each


def fleet_use(fleet: Fleet, limits: Limits | Sequence[Limits]) -> tuple[FleetUse, ...]:
    """Return how far each limit is used, by the vehicle that uses it most."""
    groups: dict[tuple[int, int], tuple[Limits, list[int]]] = {}
    for vehicle, own in enumerate(limits_of(limits, len(fleet))):
        alone = vehicle if own.yaw_rate is not None else -fleet[vehicle].degree - 1
        groups.setdefault((id(own), alone), (own, []))[1].append(vehicle)
    most: dict[str, FleetUse] = {}
    for own, vehicles in groups.values():
        for used in _group_use(fleet, own, vehicles):
            if used.use.name not in most or used.use.fraction > most[used.use.name].use.fraction:
                most[used.use.name] = used
    return tuple(most.values())


def _group_use(fleet: Fleet, limits: Limits, vehicles: list[int]) -> list[FleetUse]:
    curves = [fleet[vehicle] for vehicle in vehicles]
    if len(curves) == 1:
        return [FleetUse(vehicles[0], used) for used in limits.utilisation(curves[0])]
    joined = Trajectory(
        np.concatenate([curve.control_points for curve in curves]),
        np.concatenate([curve.durations for curve in curves]),
    )
    first = np.cumsum([0, *(len(curve.durations) for curve in curves)])
    return [_located(used, joined, first, vehicles, curves) for used in limits.utilisation(joined)]


def _located(
    used: Utilisation, joined: Trajectory, first: Any, vehicles: list[int], curves: list[Trajectory]
) -> FleetUse:
    """Return a use of joined curves as one of the vehicle whose piece it is."""
    which = int(np.searchsorted(first, used.leg, side="right")) - 1
    instant = min(max(0.0, used.instant - float(joined.breaks[first[which]])), curves[which].duration)
    leg = (used.leg - int(first[which])) // curves[which].pieces
    return FleetUse(vehicles[which], replace(used, leg=leg, instant=instant))


def room_margins(fleet: Fleet, room: Any) -> FloatArray:
    """Return the proved least distance of each vehicle to the walls of a room, shape (vehicles,) [m]."""
    if not isinstance(room, Room) or len(room.lower) != fleet.dim:
        raise FleetError(f"a fleet with {fleet.dim} coordinates needs a Room with as many, or two corners")
    low, high = (np.stack(ends) for ends in zip(*(extent_of(curve.control_points) for curve in fleet), strict=True))
    return np.asarray(np.minimum(low - room.lower, room.upper - high).min(axis=1))


def extent_of(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the proved least and greatest value of each coordinate over pieces (k, degree + 1, dim), shape (dim,)."""
    return _least(points), -_least(-points)


def _least(points: FloatArray) -> FloatArray:
    """Return the proved least value of each coordinate over all pieces, shape (dim,)."""
    rows = -np.moveaxis(points, 2, 0)
    largest = native.maxima(rows.reshape(-1, points.shape[1]), None, points.shape[2])
    if largest is None:
        return np.array([-native.maximum(each)[0] for each in rows])
    return -largest[1]
