"""The constraints of the library by name: those that a file can hold, and that gradients take."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.boxes import Boxes, Room
from minsnap.corridors.constraint import Constraint
from minsnap.corridors.half_spaces import HalfSpaces, Polytopes
from minsnap.corridors.tubes import LegTube, RoundTube, Sampled, Tube, as_constraints

TUBES: tuple[type[LegTube], ...] = (Tube, RoundTube)
"""Constraints whose walls follow the waypoints."""

FIXED: tuple[type[Constraint], ...] = (Boxes, Polytopes, Room, HalfSpaces)
"""Constraints whose walls do not."""

CONSTRAINTS: dict[str, type[Constraint]] = {kind.__name__: kind for kind in (*TUBES, *FIXED)}
"""A file holds the name and the fields of each, from which it is made again."""


def widths_of(corridor: Any) -> FloatArray | None:
    """Return all half-widths and radii of the tubes of a corridor [m], shape (n,); None where it has no tube."""
    parts = as_constraints(corridor.corridor if isinstance(corridor, Sampled) else corridor)
    found = [
        part.half_width if isinstance(part, Tube) else part.radius
        for part in parts
        if isinstance(part, Tube | RoundTube)
    ]
    return np.concatenate([np.ravel(widths) for widths in found]) if found else None
