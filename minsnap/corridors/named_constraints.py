"""The constraints of the library by name: those that a file can hold, and that gradients take."""

from __future__ import annotations

from minsnap.corridors.boxes import Boxes, Room
from minsnap.corridors.half_spaces import HalfSpaces, Polytopes
from minsnap.corridors.tubes import RoundTube, Tube

TUBES, FIXED = (Tube, RoundTube), (Boxes, Polytopes, Room, HalfSpaces)
"""Constraints whose walls follow the waypoints, and those whose walls do not."""

CONSTRAINTS = {kind.__name__: kind for kind in TUBES + FIXED}
"""A file holds the name and the fields of each, from which it is made again."""
