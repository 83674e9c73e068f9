"""The constraints of the library by name: those that a file can hold, and that gradients take."""

from __future__ import annotations

from minsnap.corridors.boxes import Boxes, Room
from minsnap.corridors.constraint import Constraint
from minsnap.corridors.half_spaces import HalfSpaces, Polytopes
from minsnap.corridors.tubes import LegTube, RoundTube, Tube

TUBES: tuple[type[LegTube], ...] = (Tube, RoundTube)
"""Constraints whose walls follow the waypoints."""

FIXED: tuple[type[Constraint], ...] = (Boxes, Polytopes, Room, HalfSpaces)
"""Constraints whose walls do not."""

CONSTRAINTS: dict[str, type[Constraint]] = {kind.__name__: kind for kind in (*TUBES, *FIXED)}
"""A file holds the name and the fields of each, from which it is made again."""
