"""Regions of the knots: where waypoints, gates, balls or overlapping sets place them, and whether a curve passes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from minsnap.basics.arrays import FloatArray, OwnsArrays
from minsnap.basics.checks import point_text
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.boxes import Room
from minsnap.corridors.constraint import Constraint
from minsnap.corridors.gates import Gate
from minsnap.corridors.given_waypoints import Knots
from minsnap.errors import CorridorError, WaypointError
from minsnap.polynomials.enclosures import UNIT
from minsnap.trajectory.trajectory import Trajectory

STORED = 8.0 * UNIT
"""Error of a stored position, relative to the largest."""


@dataclass(frozen=True, eq=False)
class KnotRegion(OwnsArrays):
    """The set in which a knot must lie, as offsets from its nominal position; all parts hold together.

    Parameters
    ----------
    lower, upper : ndarray, shape (dim,)
        Corners of a box around the region; the region itself by default [m].
    radius : float
        Of a ball around the nominal position [m]; infinite where there is none.
    normals : ndarray, shape (m, dim)
        Of half-spaces ``normal . offset <= bound``, of unit length.
    bounds : ndarray, shape (m,)
        [m].
    plane : ndarray, shape (dim,), or None
        Unit normal of the plane through the nominal position that holds the region; None for a solid region, and where
        the box alone is flat.
    crossing : ndarray, shape (dim,), or None
        Direction along which the velocity at the knot is not negative.
    what : str
        What messages call it.
    """

    lower: FloatArray
    upper: FloatArray
    radius: float
    normals: FloatArray
    bounds: FloatArray
    plane: FloatArray | None = None
    crossing: FloatArray | None = None
    what: str = "region"

    def excess(self, offset: FloatArray) -> float:
        """Largest violation by an offset (dim,) [m]; 0 or less inside."""
        parts = [float((offset - self.upper).max()), float((self.lower - offset).max())]
        parts += [float(np.linalg.norm(offset)) - self.radius]
        parts += [float((self.normals @ offset - self.bounds).max())] if len(self.bounds) else []
        parts += [] if self.plane is None else [abs(float(self.plane @ offset))]
        return max(parts)


def ball_region(radius: float, dim: int) -> KnotRegion:
    """Return the ball of that radius [m]."""
    side = np.full(dim, radius)
    return KnotRegion(-side, side, radius, np.zeros((0, dim)), np.zeros(0), what="ball")


def gate_region(gate: Gate) -> KnotRegion:
    """Return the opening of a gate; sides and planes along the axes are part of the box."""
    offsets = gate.corners - gate.center
    normals, bounds = gate.edges()
    slanted = np.flatnonzero((np.abs(normals) < 1.0).all(axis=1))
    flat = np.abs(gate.normal) == 1.0
    lower, upper = (np.where(flat, 0.0, side) for side in (offsets.min(axis=0), offsets.max(axis=0)))
    if gate.margin:
        for normal, bound in zip(normals, bounds, strict=True):
            lower = np.where(normal == -1.0, -bound, lower)
            upper = np.where(normal == 1.0, bound, upper)
    plane = None if flat.any() else gate.normal
    crossing = gate.crossing * gate.normal if gate.crossing else None
    return KnotRegion(lower, upper, np.inf, normals[slanted], bounds[slanted], plane, crossing, "gate")


@dataclass(frozen=True, eq=False)
class Placement:
    """Regions and nominal positions of the knots.

    Parameters
    ----------
    points : ndarray, shape (n, dim)
        Nominal positions [m].
    lower, upper : ndarray, shape (n, dim)
        Offsets within which each may lie [m]; zero where pinned.
    by_waypoints : bool
        Whether there were waypoints; else these are the ends and the overlaps.
    regions : mapping of int to KnotRegion
        Waypoints whose regions are no boxes; ``lower`` and ``upper`` are boxes around them.
    """

    points: FloatArray
    lower: FloatArray
    upper: FloatArray
    by_waypoints: bool = True
    regions: Mapping[int, KnotRegion] = field(default_factory=dict)

    def outside(self, positions: FloatArray) -> FloatArray:
        """Distance by which positions (n, dim) are outside their regions, (n,) [m]; 0 inside."""
        offset = positions - self.points
        beyond = np.maximum(np.maximum(offset - self.upper, self.lower - offset), 0.0)
        excess = np.sqrt((beyond * beyond).sum(axis=1))
        for knot, region in self.regions.items():
            excess[knot] = max(region.excess(offset[knot]), 0.0)
        return np.asarray(excess)

    @property
    def rounding(self) -> float:
        """Distance outside that counts as none [m].

        It is measured from the first waypoint, so that it does not depend on where the origin is, but for the rounding
        of stored positions.
        """
        points = self.points
        return float(EXACT * np.abs(points - points[0]).max() + STORED * np.abs(points).max())

    def name(self, knot: int) -> str:
        """Return the name of the point, box, ball or gate for a message."""
        at = point_text(self.points[knot])
        if knot in self.regions:
            return f"the {self.regions[knot].what} of waypoint {knot} at {at}"
        free = (self.upper[knot] > self.lower[knot]).any()
        if self.by_waypoints:
            return f"the box around waypoint {knot} at {at}" if free else f"waypoint {knot} at {at}"
        if not free:
            return f"the position of {'end' if knot else 'start'}, {at},"
        return f"the overlap that leg {knot} starts in, around {at},"


def place(
    knots: Knots | None,
    constraints: Sequence[Constraint],
    first: FloatArray | None = None,
    last: FloatArray | None = None,
    closed: bool = False,
) -> Placement:
    """Return the placement of the knots, from waypoints or from the sequence of convex sets.

    Parameters
    ----------
    knots : Knots, optional
        Waypoints; None where the curve finds its way through sets.
    constraints : sequence of Constraint
    first, last : ndarray, shape (dim,), optional
        Where the curve begins and ends [m]; without waypoints both are needed, but for a closed lap.
    closed : bool

    Raises
    ------
    WaypointError
        If an end's position contradicts the waypoints, or is missing without them.
    CorridorError
        If there are neither waypoints nor sets that tell where the curve passes.
    """
    if knots is None:
        return Placement(*_from_sets(constraints, first, last, closed), by_waypoints=False)
    points = knots.points
    for position, index, where in ((first, 0, "start"), (last, -1, "end")):
        if position is not None and (position.shape != points[index].shape or (position != points[index]).any()):
            raise WaypointError(
                f"{where} is at {point_text(position)} but its waypoint at {point_text(points[index])}: leave one out"
            )
    if closed:
        knots = _with_equal_ends(knots)
    regions = {int(k): ball_region(float(knots.radii[k]), points.shape[1]) for k in np.flatnonzero(knots.radii)}
    if closed and knots.gates.get(0) is not knots.gates.get(len(points) - 1):
        raise WaypointError("a closed lap that begins in a gate ends in it: give the same gate first and last")
    regions |= {waypoint: gate_region(gate) for waypoint, gate in knots.gates.items()}
    lower, upper = -knots.widths, knots.widths.copy()
    for waypoint, region in regions.items():
        lower[waypoint], upper[waypoint] = region.lower, region.upper
    return Placement(points, lower, upper, regions=regions)


def _with_equal_ends(knots: Knots) -> Knots:
    """Return knots whose first and last, which a closed lap passes at once, have what both tolerances allow."""
    widths, radii, ends = knots.widths.copy(), knots.radii.copy(), [0, -1]
    widths[ends], radii[ends] = widths[ends].min(axis=0), radii[ends].min()
    return knots._replace(widths=widths, radii=radii)


def _from_sets(
    constraints: Sequence[Constraint], first: FloatArray | None, last: FloatArray | None, closed: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nominal points and offsets, from the overlaps of the first constraint that provides them."""
    sets = next((entry for entry in constraints if hasattr(entry, "passages")), None)
    if sets is None:
        raise CorridorError("waypoints=None needs a corridor of Boxes or Polytopes, whose overlaps the curve passes")
    inside, lower, upper = sets.passages(closed)
    if not closed:
        ends = _end(first, "start", inside.shape[1]), _end(last, "end", inside.shape[1])
        inside, lower, upper = (np.vstack((ends[0], part, ends[1])) for part in (inside, lower, upper))
    elif first is not None or last is not None:
        raise WaypointError("closed=True leaves the state at start and end free: give neither start= nor end=")
    for room in constraints:
        if isinstance(room, Room):
            inside, lower, upper = _within(room, inside, lower, upper)
    if closed:
        inside, lower, upper = (np.concatenate((part, part[:1])) for part in (inside, lower, upper))
    inside = _apart(inside, upper)
    inside.setflags(write=False)
    return inside, lower - inside, upper - inside


def _end(position: FloatArray | None, where: str, dim: int) -> FloatArray:
    if position is None:
        raise WaypointError(f"waypoints=None needs to know where to {where}: give {where}={{'position': (x, y, z)}}")
    if position.shape != (dim,):
        raise WaypointError(f"the position of {where} has {len(position)} coordinates and the corridor {dim}")
    return position


def _within(
    room: Room, inside: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cut overlaps to a room; pinned ends and overlaps outside stay, and the check of all walls refuses them."""
    if len(room.lower) != inside.shape[1]:
        return inside, lower, upper
    low, high = np.maximum(lower, room.lower), np.minimum(upper, room.upper)
    cut = (low < high).all(axis=1, keepdims=True)
    outside = (inside < low) | (inside > high)
    inside = np.where(cut & outside, (low + high) / 2.0, inside)
    return inside, np.where(cut, low, lower), np.where(cut, high, upper)


def _apart(inside: FloatArray, upper: FloatArray) -> FloatArray:
    """Move nominal points that coincide with the next one, so that every leg has a positive length.

    From the end on every second point of several that coincide is moved; the first one, which is pinned, or the last
    one too, never is: the second one is moved in its place, by another share of its room than the third.
    """
    moved = inside.copy()
    for leg in reversed(np.flatnonzero((inside[1:] == inside[:-1]).all(axis=1)).tolist()):
        if (moved[leg] == moved[leg + 1]).all():
            free, share = (leg, 4.0) if leg and (upper[leg] > inside[leg]).any() else (leg + 1, 3.0)
            moved[free] += (upper[free] - inside[free]) / share
    return moved


def knot_positions(traj: Trajectory) -> FloatArray:
    """Positions at the waypoints' instants where a leg ends and where one starts: (2, legs + 1, dim) [m]."""
    starts, ends = traj.control_points[:: traj.pieces, 0], traj.control_points[traj.pieces - 1 :: traj.pieces, -1]
    return np.stack((np.concatenate((starts[:1], ends)), np.concatenate((starts, ends[-1:]))))


def passing(traj: Trajectory, placement: Placement) -> tuple[float, bool]:
    """Measure how far a curve passes from its waypoints, beyond their tolerance, and whether it passes all.

    Returns
    -------
    excess : float
        Largest distance, on either side of a knot [m].
    passes : bool
        Whether that is 0, and gates are passed in their direction, to rounding: ``Placement.rounding`` of a
        distance, ``EXACT`` of the largest speed.
    """
    excess = max(float(placement.outside(side).max()) for side in knot_positions(traj))
    return excess, excess <= placement.rounding and _crossed(traj, placement)


def _crossed(traj: Trajectory, placement: Placement) -> bool:
    crossings = [(k, region.crossing) for k, region in placement.regions.items() if region.crossing is not None]
    if not crossings:
        return True
    velocity, size = traj(traj.leg_breaks, 1), traj.max_norm(1)[0]
    return all(float(velocity[k] @ crossing) >= -EXACT * size for k, crossing in crossings)
