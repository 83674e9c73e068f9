"""The course of a bound: regions that every flight passes in their order, and its velocities at both ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray, OwnsArrays
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.gates import Gate
from minsnap.corridors.knot_regions import Placement


@dataclass(frozen=True, eq=False)
class PassedCourse(OwnsArrays):
    """Regions in their order, in three coordinates, of which those above ``dim`` are zero.

    Parameters
    ----------
    dim : int
        Coordinates, at most three.
    centers : ndarray, shape (n, 3)
        [m].
    rounds, sides : ndarray, shape (n, 3, 3)
        A region is the sum of its center, of ``rounds.T @ u`` with ``|u| <= 1``, and of each row of ``sides`` times a
        number in [-1, 1] [m].
    ends : ndarray, shape (2, 3)
        Velocities at start and end [m/s].
    closed : bool
        Whether the flight is a lap, with any velocity at its start and the same at its end; ``ends`` is zero then.
    calm : tuple of int
        Order up to which all derivatives of the flight are zero at start and end; 0 where nothing is known.
    """

    dim: int
    centers: FloatArray
    rounds: FloatArray
    sides: FloatArray
    ends: FloatArray
    closed: bool = False
    calm: tuple[int, int] = (0, 0)

    @property
    def legs(self) -> int:
        """Number of steps from region to region."""
        return len(self.centers) - 1

    @property
    def steps(self) -> FloatArray:
        """Steps from center to center, (legs, 3) [m]."""
        return np.diff(self.centers, axis=0)

    def reach(self, directions: FloatArray) -> FloatArray:
        """Return how far regions reach from their centers along directions (n, 3), one each: (n,)."""
        along = directions[:, None]
        round_part = np.sqrt(((self.rounds * along).sum(axis=2) ** 2).sum(axis=1))
        return np.asarray(round_part + np.abs((self.sides * along).sum(axis=2)).sum(axis=1))

    def apart(self) -> PassedCourse:
        """Return the course without inner regions that the way between centers does not leave for the next one."""
        keep, last = [0], self.legs
        for knot in range(1, last + 1):
            if self._leaves(keep[-1], knot):
                keep.append(knot)
        while keep[-1] != last:
            if len(keep) == 1 or self._leaves(keep[-1], last):
                keep.append(last)
            else:
                keep.pop()
        return replace(self, **{name: getattr(self, name)[keep] for name in ("centers", "rounds", "sides")})

    @property
    def advances(self) -> bool:
        """Whether each region is left for the next one."""
        return self.legs > int(self.closed) and all(self._leaves(knot, knot + 1) for knot in range(self.legs))

    def _leaves(self, one: int, other: int) -> bool:
        """Whether two regions are apart along the way between their centers."""
        step = self.centers[other] - self.centers[one]
        own = replace(self, **{name: getattr(self, name)[[one, other]] for name in ("centers", "rounds", "sides")})
        return float(step @ step) > (1.0 + EXACT) * float(own.reach(np.stack((step, step))).sum())


def passed_course(
    placement: Placement, gates: Mapping[int, Gate], ends: FloatArray | None, calm: tuple[int, int]
) -> PassedCourse:
    """Return the course of a placement and of the gates among its waypoints; others count as the boxes around them.

    Parameters
    ----------
    ends : ndarray, shape (2, dim), or None
        Velocities at start and end [m/s]; None for a lap.
    calm : tuple of int
        That of the course, of which a lap keeps nothing.
    """
    count, dim = placement.points.shape
    centers, rounds, sides = np.zeros((count, 3)), np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
    centers[:, :dim] = placement.points + 0.5 * (placement.lower + placement.upper)
    half = 0.5 * (placement.upper - placement.lower) * (1.0 + EXACT)
    sides[:, range(dim), range(dim)] = half
    for knot, region in placement.regions.items():
        if knot in gates:
            centers[knot, :dim], rounds[knot, :, :dim], sides[knot, :, :dim] = _opening(gates[knot])
        elif region.radius < np.inf:
            centers[knot, :dim], sides[knot] = placement.points[knot], 0.0
            rounds[knot, range(dim), range(dim)] = region.radius
    velocities = np.zeros((2, 3))
    if ends is not None:
        velocities[:, :dim] = ends
    return PassedCourse(dim, centers, rounds, sides, velocities, ends is None, (0, 0) if ends is None else calm)


def _opening(gate: Gate) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return center, round part and half sides of a rectangle or a disk around an opening, the smaller one."""
    dim = len(gate.center)
    axes = _in_plane(gate)
    reach = (gate.corners - gate.center) @ axes.T
    low, high = reach.min(axis=0) + gate.margin, reach.max(axis=0) - gate.margin
    half = 0.5 * (high - low) * (1.0 + EXACT)
    radius = float(np.sqrt((reach**2).sum(axis=1)).max()) * (1.0 + EXACT)
    none = np.zeros((3, dim))
    if dim == 3 and np.pi * radius**2 < 4.0 * half.prod():
        return gate.center, _rows(radius * axes), none
    return gate.center + 0.5 * (low + high) @ axes, none, _rows(half[:, None] * axes)


def _in_plane(gate: Gate) -> FloatArray:
    """Return unit vectors in the plane of an opening, the first along one of its sides."""
    side = gate.corners[1] - gate.corners[0]
    first = side / np.sqrt((side * side).sum())
    return first[None] if len(side) == 2 else np.stack((first, np.cross(gate.normal, first)))


def _rows(vectors: FloatArray) -> FloatArray:
    """Return vectors with rows of zeros up to three."""
    return np.concatenate((vectors, np.zeros((3 - len(vectors), vectors.shape[1]))))
