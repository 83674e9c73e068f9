"""Regions: the convex sets in which knots must lie, and the distance of a point outside of one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray, own_arrays
from minsnap.corridors.gates import Gate


@dataclass(frozen=True, eq=False)
class KnotRegion:
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

    def __post_init__(self) -> None:
        own_arrays(self)

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
