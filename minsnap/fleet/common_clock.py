"""Several trajectories on one clock."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, ReadOnly, set_fields
from minsnap.errors import FleetError
from minsnap.fleet.separation import Separation
from minsnap.native.fleet_border import FleetArrays
from minsnap.polynomials.enclosures import UNIT
from minsnap.trajectory.path import Path
from minsnap.trajectory.trajectory import Trajectory

if TYPE_CHECKING:
    from minsnap.fleet.fleet_report import FleetReport


@dataclass(frozen=True, eq=False, repr=False)
class Fleet(ReadOnly, Sequence[Trajectory]):
    """Trajectories of several vehicles that start at one instant; who ends before the others stays at its end.

    Parameters
    ----------
    trajectories : sequence of Trajectory or Path
        One a vehicle, all with three coordinates or all with two.
    names : sequence of str, optional
        Of the vehicles, each once.
    separation : Separation, optional
        What they keep, or were planned to keep.
    report : FleetReport, optional
        How the fleet was planned; None for one made otherwise.

    Raises
    ------
    FleetError
        If there is none, or they do not fit together.
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
                raise FleetError(
                    f"trajectory {i} has {curve.dim} coordinates: give all vehicles three, or all two", vehicle=i
                )
        set_fields(self, trajectories=curves, names=_checked_names(self.names, len(curves)))
        if self.separation is not None:
            self.separation.radii_of(len(curves))

    def __len__(self) -> int:
        return len(self.trajectories)

    def __getitem__(self, index: Any) -> Any:
        return self.trajectories[index]

    def __iter__(self) -> Iterator[Trajectory]:
        return iter(self.trajectories)

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

    def __call__(self, t: npt.ArrayLike, order: int = 0) -> FloatArray:
        """Return positions or derivatives of all vehicles at instants of any shape: (vehicles,) + t.shape + (dim,)."""
        instants = np.asarray(t, dtype=np.float64)
        return np.stack([_at(curve, instants, order) for curve in self.trajectories])

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


def _checked_names(names: Any, count: int) -> tuple[str, ...] | None:
    if names is None:
        return None
    entries = tuple(names) if isinstance(names, Sequence) and not isinstance(names, str) else ()
    if len(entries) != count or not all(isinstance(name, str) for name in entries) or len(set(entries)) != count:
        raise FleetError(f"a fleet of {count} needs {count} different names, or none")
    return entries


def _at(curve: Trajectory, instants: FloatArray, order: int) -> FloatArray:
    over = instants > curve.duration
    values = curve(np.minimum(instants, curve.duration), order)
    return np.where(over[..., None], 0.0, values) if order > 0 else values


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
