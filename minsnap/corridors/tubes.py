r"""Tubes around the legs, as constraints that give walls, and a corridor that is kept at samples only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, IntArray, ReadOnly, lengths_of, numbers, positive, set_fields
from minsnap.basics.checks import MOST_PER_PIECE, beyond, check_number, has_method
from minsnap.basics.messages import shown
from minsnap.basics.tolerances import ROUNDING
from minsnap.corridors.constraint import Constraint, Walls
from minsnap.errors import CorridorError


def leg_projections(waypoints: FloatArray) -> FloatArray:
    r"""Return :math:`I - u u^\top` of every leg, shape (legs, dim, dim); of a hold, which has no direction, I."""
    steps, lengths = waypoints[1:] - waypoints[:-1], lengths_of(waypoints)
    directions = steps / np.where(lengths > 0.0, lengths, 1.0)[:, None]
    projections = -directions[:, :, None] * directions[:, None, :]
    axes = np.arange(waypoints.shape[1])
    projections[:, axes, axes] += 1.0
    return np.asarray(projections)


class LegTube(Constraint, Protocol):
    """Protocol of a constraint whose walls turn with the legs, and which says how: gradients in waypoints need it."""

    def directions(self, waypoints: FloatArray, wall: IntArray, offset: FloatArray) -> FloatArray:
        r"""Return vectors e with :math:`(I - u u^\top) e` the outward normals of walls at points that touch them.

        Parameters
        ----------
        waypoints : ndarray, shape (n, dim)
        wall : ndarray of int, shape (k,)
            Which of the walls each point touches.
        offset : ndarray, shape (k, dim)
            Of each point from the line of its leg, across it [m].

        Returns
        -------
        e : ndarray, shape (k, dim)
            They stay as they are while the leg turns; their parts across it do not.
        """
        ...


def _half_widths(value: ArrayLike, name: str) -> FloatArray:
    widths = numbers(value)
    if widths is None:
        raise CorridorError(f"the {name} must be numbers [m], not {shown(value)}")
    unbounded = np.isposinf(widths)  # a leg beside others that has no corridor
    wrong = np.flatnonzero(~(positive(widths) | unbounded) | unbounded.all())
    if len(wrong) or not widths.size:
        where = f" (entry {wrong[0]})" if widths.ndim and len(wrong) else ""
        where += beyond(widths.flat[wrong[0]]) if len(wrong) else ""
        raise CorridorError(f"the {name} must be positive and finite [m], not {shown(value)}{where}")
    return widths


@dataclass(frozen=True, eq=False)
class Tube(ReadOnly):
    r"""A corridor around the legs: perpendicular offset from the leg's line, infinity norm in world axes.

    :math:`d(t) = (I - u u^\top)(r(t) - r_i)`, :math:`\|d(t)\|_\infty \le \delta`, u the leg's unit vector; zero for a
    leg without length, whose tube is the box around its waypoint.

    Parameters
    ----------
    half_width : float or array_like, shape (legs,) or (legs, dim)
        :math:`\delta` [m]: one for all, one per leg, or one per leg and world axis; infinite where a leg has none.

    Raises
    ------
    CorridorError
        If a half-width is not positive and finite; on use, if their number is not that of the legs.
    """

    half_width: FloatArray

    def __init__(self, half_width: ArrayLike) -> None:
        set_fields(self, half_width=_half_widths(half_width, "corridor half-width"))

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return two planes for each leg and world axis that is not along it."""
        projections = leg_projections(waypoints)
        leg, axis, width = self._pairs(projections)
        return [Walls.pairs(leg, projections[leg, axis], waypoints[leg], -width, width, width)]

    def directions(self, waypoints: FloatArray, wall: IntArray, offset: FloatArray) -> FloatArray:
        """Return the world axes of walls, outwards; see :class:`LegTube`."""
        axis = self._pairs(leg_projections(waypoints))[1]
        side, pair = np.divmod(wall, len(axis))  # upper walls first
        return np.asarray(np.eye(waypoints.shape[1])[axis[pair]] * np.where(side == 0, 1.0, -1.0)[:, None])

    def _pairs(self, projections: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
        """Return leg, world axis and half-width of each pair of planes: of axes not along the leg, where bounded."""
        legs, dim = projections.shape[:2]
        widths = self.half_width
        if widths.shape not in ((), (legs,), (legs, 1), (legs, dim)):
            raise CorridorError(
                f"the corridor has half-widths of shape {widths.shape} for {legs} legs of {dim} axes: "
                f"give one, one per leg, or one per leg and axis"
            )
        widths = (widths[:, None] if widths.ndim == 1 else widths) * np.ones((legs, dim))
        leg, axis = np.nonzero((np.abs(projections).max(axis=2) > ROUNDING) & np.isfinite(widths))
        return leg, axis, widths[leg, axis]


@dataclass(frozen=True, eq=False)
class RoundTube(ReadOnly):
    r"""A corridor around the legs: Euclidean distance to the leg's line.

    .. math:: \|(I - u u^\top)(r(t) - r_i)\|_2 \le \rho

    Parameters
    ----------
    radius : float or array_like, shape (legs,)
        :math:`\rho` [m]; infinite where a leg has none.

    Raises
    ------
    CorridorError
        If a radius is not positive and finite; on use, if their number is not that of the legs.
    """

    radius: FloatArray

    def __init__(self, radius: ArrayLike) -> None:
        set_fields(self, radius=_half_widths(radius, "corridor radius"))

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return one cylinder per leg."""
        projections = leg_projections(waypoints)
        legs = len(projections)
        if self.radius.shape not in ((), (legs,)):
            raise CorridorError(
                f"the corridor has radii of shape {self.radius.shape} for {legs} legs: give one, or one per leg"
            )
        radii = np.broadcast_to(self.radius, legs)
        leg = np.flatnonzero(np.isfinite(radii))
        return [Walls.balls(leg, projections[leg], waypoints[leg], radii[leg])]

    def directions(self, waypoints: FloatArray, wall: IntArray, offset: FloatArray) -> FloatArray:
        """Return the directions of the points from the lines of their legs; see :class:`LegTube`."""
        return np.asarray(offset / np.linalg.norm(offset, axis=1, keepdims=True))


def as_constraints(corridor: ArrayLike | Constraint | Sequence[object] | None) -> list[Constraint]:
    """Convert the argument ``corridor`` to constraints: half-widths become a ``Tube``."""
    if corridor is None:
        return []
    if has_method(corridor, "walls"):
        return [corridor]  # type: ignore[list-item]
    if isinstance(corridor, (list, tuple)) and any(has_method(entry, "walls") for entry in corridor):
        return [part for entry in corridor for part in as_constraints(entry)]
    return [Tube(corridor)]  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class Sampled:
    """A corridor that holds at equally spaced instants of every polynomial, and may be left between them.

    Parameters
    ----------
    corridor : float, array_like, Constraint or sequence of Constraint, optional
        As :func:`minsnap.plan` takes it.
    samples : int
        Instants per polynomial.

    Raises
    ------
    CorridorError
        If the number of samples is not a whole one from 1 to 100,000.
    """

    corridor: ArrayLike | Constraint | Sequence[object] | None
    samples: int = 20

    def __post_init__(self) -> None:
        give = f"give a whole number of instants per polynomial, at least 1 and at most {MOST_PER_PIECE}"
        samples = check_number("samples", self.samples, 1, MOST_PER_PIECE, give, CorridorError, whole=True)
        set_fields(self, samples=samples)


def unsampled(corridor: Any, limited: bool) -> tuple[Any, int | None]:
    """Return a corridor and its samples per polynomial; None where it holds at every instant.

    Raises
    ------
    CorridorError
        If a sampled corridor goes with limits, which hold at every instant.
    """
    if not isinstance(corridor, Sampled):
        return corridor, None
    if limited:
        raise CorridorError("a Sampled corridor does not go with limits, which hold at every instant: leave one out")
    return corridor.corridor, corridor.samples
