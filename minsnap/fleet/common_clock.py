"""A fleet: trajectories on one clock, the separation that they keep, and how they were planned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, ReadOnly, bounded, numbers, set_fields
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import is_number
from minsnap.basics.messages import shown
from minsnap.errors import FleetError
from minsnap.native.fleet_border import FleetArrays
from minsnap.polynomials.enclosures import UNIT
from minsnap.trajectory.instants import as_instants
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Separation(ReadOnly):
    r"""Least distance of any two vehicles at every instant.

    The distance of two vehicles is :math:`\sqrt{\Delta x^2 + \Delta y^2 + (\Delta z / w)^2}` with the downwash w:
    vehicles above each other must be w times as far apart as vehicles side by side.

    Parameters
    ----------
    distance : float, optional
        Of any pair [m].
    downwash : float
        At least 1.
    radii : array_like, shape (vehicles,), optional
        Radius of each vehicle [m], in place of ``distance``: the least distance of a pair is the sum of its radii.
    ground : float, optional
        Least distance of two while one of them still stands at its start, or stands at its end already [m]; by default
        the same as in flight.

    Raises
    ------
    FleetError
        If a distance is not positive, the downwash is below 1, or distance and radii are both set, or neither.
    """

    distance: float | None
    downwash: float
    radii: FloatArray | None
    ground: float | None

    def __init__(
        self,
        distance: float | None = None,
        downwash: float = 1.0,
        *,
        radii: ArrayLike | None = None,
        ground: float | None = None,
    ) -> None:
        if (distance is None) == (radii is None):
            raise FleetError("a separation needs either one distance for all pairs or the radii of the vehicles [m]")
        if distance is not None and not (is_number(distance) and distance > 0.0):
            raise FleetError(f"the separation is {shown(distance)}: give a positive distance [m]")
        if not (is_number(downwash) and downwash >= 1.0):
            raise FleetError(f"the downwash is {shown(downwash)}: it must be at least 1, as heights are divided by it")
        if ground is not None and not (is_number(ground) and ground > 0.0):
            raise FleetError(f"the separation on the ground is {shown(ground)}: give a positive distance [m]")
        between, each = None if distance is None else float(distance), None if radii is None else _checked_radii(radii)
        stands = None if ground is None else float(ground)
        set_fields(self, distance=between, downwash=float(downwash), radii=each, ground=stands)

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

    @property
    def plain(self) -> dict[str, Any]:
        """What makes it again, as plain numbers by name."""
        radii = None if self.radii is None else self.radii.tolist()
        stands = {} if self.ground is None else {"ground": self.ground}
        return {"distance": self.distance, "radii": radii, "downwash": self.downwash, **stands}

    @property
    def aloft(self) -> Separation:
        """The separation of vehicles that all fly."""
        return Separation(self.distance, self.downwash, radii=self.radii)

    @property
    def standing(self) -> float:
        """How far apart two are to be that stand on the ground, at most [m]."""
        return 2.0 * float(np.max(self.radii)) if self.radii is not None else self.ground or self.distance or 0.0

    def flat(self, places: FloatArray) -> FloatArray:
        """Return places (..., dim) with heights divided by the downwash: distances of these are to be kept."""
        return np.asarray(places * np.array([1.0, 1.0, 1.0 / self.downwash])[: places.shape[-1]])

    def scaled(self, share: float) -> Separation:
        """Return the separation with its distance multiplied by a factor."""
        stands = None if self.ground is None else self.ground * share
        if self.radii is None:
            return Separation((self.distance or 0.0) * share, self.downwash, ground=stands)
        return Separation(downwash=self.downwash, radii=self.radii * share, ground=stands)

    def between(self, one: int, two: int) -> float:
        """Return how far two vehicles are to be apart [m]."""
        return self.distance if self.radii is None else float(self.radii[one] + self.radii[two])  # type: ignore[return-value]


def as_separation(value: Any) -> Separation:
    """Return a Separation; a number is one without downwash."""
    return value if isinstance(value, Separation) else Separation(value)


def _checked_radii(radii: ArrayLike) -> FloatArray:
    values = numbers(radii)
    if values is None or values.ndim != 1 or not len(values) or not (bounded(values) & (values > 0.0)).all():
        raise FleetError(f"the radii are {shown(radii)}: give a positive number for each vehicle [m]")
    return values


@dataclass(frozen=True)
class FleetReport:
    """How a fleet was planned.

    Parameters
    ----------
    method : {"single", "straight", "joint"}
        The plan of the only vehicle, straight lines with one common profile, or all curves together.
    duration : float
        Common flight time [s].
    bound : float
        No fleet with these limits is faster: a time that every flight of the slowest vehicle takes, within speed,
        acceleration and jerk along one leg, or through all of its waypoints [s].
    slowest : int
        Which vehicle that is.
    alone : float
        The shortest time known for the slowest vehicle alone, with as many polynomials [s].
    pieces : int
        Polynomials per vehicle.
    tried : int
        How many times were tried.
    iterations : int
        Gauss-Newton steps in all.
    seconds : float
        Processor time [s].
    stopped : str
        Why the search ended early, such as ``"time_limit"``; empty if it ended by itself.
    """

    method: str
    duration: float
    bound: float
    slowest: int
    alone: float
    pieces: int
    tried: int
    iterations: int
    seconds: float
    stopped: str = ""

    @property
    def longer(self) -> float:
        """By which share the fleet flies longer than any flight of its slowest vehicle, at most."""
        return max(self.duration / self.bound - 1.0, 0.0) if self.bound > 0.0 else inf

    def __str__(self) -> str:
        """Say how long it flies, and how near that is to the least time."""
        near = f": at most {self.longer:.1%} longer than any flight of vehicle {self.slowest}" if self.bound else ""
        stopped = f" (ended by {self.stopped})" if self.stopped else ""
        return f"{self.duration:.3f} s, {self.method}{stopped}{near}"


@dataclass(frozen=True, eq=False, repr=False)
class Fleet(ReadOnly, Sequence[Trajectory]):
    """Trajectories of several vehicles that start at one instant; a vehicle that ends early stays at its end.

    Parameters
    ----------
    trajectories : sequence of Trajectory or Path
        One per vehicle, all with three coordinates or all with two.
    names : sequence of str, optional
        Of the vehicles, each once.
    separation : Separation, optional
        Their least distance, or the one that they were planned with.
    report : FleetReport, optional
        How the fleet was planned; None for one made otherwise.

    Raises
    ------
    FleetError
        If there is no trajectory, or they do not fit together.
    """

    trajectories: tuple[Trajectory, ...]
    names: tuple[str, ...] | None = None
    separation: Separation | None = None
    report: FleetReport | None = None

    def __post_init__(self) -> None:
        curves = tuple(_as_trajectory(curve, i) for i, curve in enumerate(self.trajectories))
        if not curves:
            raise FleetError("a fleet needs at least one trajectory, and there is none")
        for i, curve in enumerate(curves):
            if curve.dim not in (2, 3) or curve.dim != curves[0].dim:
                text = f"trajectory {i} has {curve.dim} coordinates: give all vehicles three, or all two"
                raise FleetError(text, vehicle=i)
        set_fields(self, trajectories=curves, names=checked_names(self.names, len(curves)))
        if self.separation is not None:
            self.separation.radii_of(len(curves))

    def __len__(self) -> int:
        return len(self.trajectories)

    def __getitem__(self, index: Any) -> Any:
        return self.trajectories[index]

    def __repr__(self) -> str:
        return f"Fleet(vehicles={len(self)}, duration={self.duration:g} s)"

    @cached_property
    def duration(self) -> float:
        """When the last vehicle ends [s]."""
        return max(curve.duration for curve in self.trajectories)

    @property
    def dim(self) -> int:
        """Number of coordinates."""
        return self.trajectories[0].dim

    def name(self, vehicle: int) -> str:
        """Return the name of a vehicle, its number where it has none."""
        return f"vehicle {vehicle}" if self.names is None else self.names[vehicle]

    def names_of(self, pair: Sequence[int]) -> str:
        """Return the names of two vehicles in one phrase."""
        return " and ".join(self.name(vehicle) for vehicle in pair)

    def __call__(self, t: ArrayLike, order: int = 0) -> FloatArray:
        """Return positions or derivatives of all vehicles at instants of any shape: (vehicles,) + t.shape + (dim,)."""
        instants = as_instants(t)
        return np.stack([at_rest_after(curve, instants, order) for curve in self.trajectories])

    @cached_property
    def arrays(self) -> FleetArrays:
        """What the native core takes: three coordinates, and pieces that hold the end where a vehicle ends early."""
        held = [_held(curve, self.duration) for curve in self.trajectories]
        return FleetArrays([points for points, _ in held], [breaks for _, breaks in held])


def _as_trajectory(curve: Any, index: int) -> Trajectory:
    if not isinstance(curve, Path):
        raise FleetError(f"entry {index} of the fleet is a {type(curve).__name__}: give a Trajectory", vehicle=index)
    polynomials: Trajectory = curve.as_trajectory()
    return polynomials


def checked_names(names: Any, count: int) -> tuple[str, ...] | None:
    """Return the names of so many vehicles, each once, or None; other than these raise FleetError."""
    if names is None:
        return None
    entries = tuple(names) if isinstance(names, Sequence | np.ndarray) and not isinstance(names, str) else ()
    if len(entries) != count or not all(isinstance(name, str) for name in entries) or len(set(entries)) != count:
        raise FleetError(f"a fleet of {count} needs {count} different names, or none")
    return entries


def at_rest_after(curve: Trajectory, instants: FloatArray, order: int) -> FloatArray:
    """Return positions or derivatives at instants of any shape; after its end the curve stays there."""
    over = instants > curve.duration
    values = curve(np.minimum(instants, curve.duration), order)
    return np.where(over[..., None], 0.0, values) if order > 0 else values


LIFTED = 0.05
"""A vehicle stands while it is no farther from its start, or its end, than this [m]."""


def arrays_in_flight(fleet: Fleet, away: float) -> FleetArrays:
    """Return the arrays of a fleet without vehicles that stand at their ends: then each is that far from all [m]."""
    held = [_held(curve, fleet.duration) for curve in fleet.trajectories]
    floor = min(float(points[..., 2].min()) for points, _ in held)
    points = [_in_flight(each, floor - (i + 1.0) * away) for i, (each, _) in enumerate(held)]
    return FleetArrays(points, [breaks for _, breaks in held])


def _in_flight(points: FloatArray, depth: float) -> FloatArray:
    """Return control points (pieces, degree + 1, 3), those of pieces that stand at an end put to a depth."""
    stands = np.zeros(len(points), dtype=bool)
    for end, step in ((points[0, 0], 1), (points[-1, -1], -1)):
        near = (np.linalg.norm(points - end, axis=2).max(axis=1) <= LIFTED)[::step]
        stands[::step] |= np.logical_and.accumulate(near)
    moved = points.copy()
    moved[stands] = (*points[0, 0, :2], depth)
    return moved


def _held(curve: Trajectory, end: float) -> tuple[FloatArray, FloatArray]:
    """Control points (pieces, degree + 1, 3) and breaks up to a common end, also where rounding alone is missing."""
    points, breaks = curve.control_points, curve.breaks.copy()
    if curve.dim == 2:
        points = np.concatenate((points, np.zeros((*points.shape[:2], 1))), axis=2)
    if end - breaks[-1] <= 2.0 * len(breaks) * UNIT * end:
        breaks[-1] = end
        return points, breaks
    hold = np.broadcast_to(points[-1, -1], (1, *points.shape[1:]))
    return np.concatenate((points, hold)), np.append(breaks, end)
