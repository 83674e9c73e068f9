"""The prisms before and behind gates: a path that stays in them passes the gates straight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from minsnap.arrays import FloatArray, IntArray, ReadOnly, own_arrays
from minsnap.corridors.constraint import Faces, Walls
from minsnap.corridors.gates import Gate


@dataclass(frozen=True, eq=False)
class GatePassages(ReadOnly):
    """Half-spaces on single legs: those of the prism over a gate's opening.

    Parameters
    ----------
    leg : ndarray of int, shape (m,)
        Leg of each.
    normal : ndarray, shape (m, dim)
        Unit vectors.
    upper : ndarray, shape (m,)
        Bound of the position along them [m].
    width : ndarray, shape (m,)
        Half the width of the opening [m].
    """

    leg: IntArray
    normal: FloatArray
    upper: FloatArray
    width: FloatArray

    def __post_init__(self) -> None:
        own_arrays(self)

    @classmethod
    def of(cls, gates: Sequence[tuple[int, Gate]]) -> GatePassages | None:
        """Return the prisms of gates by the knot before each, whose two next legs stay in them; None without gates."""
        if not gates:
            return None
        legs, normals, bounds, widths = [], [], [], []
        for knot, gate in gates:
            sides, offsets = gate.edges()
            for leg in (knot, knot + 1):
                legs += [leg] * len(sides)
                normals.append(sides)
                bounds.append(offsets + sides @ gate.centre)
                widths.append(np.maximum(np.abs(offsets), 1e-9))
        return cls(np.array(legs), np.concatenate(normals), np.concatenate(bounds), np.concatenate(widths))

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return one plane for each side of each prism."""
        below = np.full(len(self.leg), -np.inf)
        anchor = np.zeros(self.normal.shape)
        return [Faces(self.leg, self.normal, anchor, below, self.upper, self.width, name="gate")]
