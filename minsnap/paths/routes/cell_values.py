"""What the values of cells mean: booleans, percentages and probabilities, and what is unknown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, NDArray
from minsnap.basics.checks import is_number
from minsnap.basics.messages import shown
from minsnap.basics.storage.text import LARGEST, FileName, reading
from minsnap.errors import CorridorError

UNKNOWN = ("occupied", "free")
"""What unknown cells may count as."""


@dataclass(frozen=True)
class Reading:
    """How the values of cells are read.

    Parameters
    ----------
    threshold : float or None
        Probability from which a cell is occupied, in (0, 1]; 0.5, or what the map says, by default.
    unknown : {"occupied", "free"}
        What cells count as of which nothing is known.

    Raises
    ------
    CorridorError
        If the threshold is no probability above 0, or the choice is none of the two.
    """

    threshold: float | None = None
    unknown: str = "occupied"

    def __post_init__(self) -> None:
        if self.threshold is not None and not (is_number(self.threshold) and 0.0 < self.threshold <= 1.0):
            raise CorridorError(f"the threshold is {self.threshold!r}: it is a probability, above 0 and at most 1")
        if not isinstance(self.unknown, str) or self.unknown not in UNKNOWN:
            raise CorridorError(f"unknown cells count as 'occupied' or 'free', not as {shown(self.unknown)}")

    def occupied(self, values: NDArray[Any], name: str = "the map") -> BoolArray:
        """Return which cells are occupied.

        Parameters
        ----------
        values : ndarray of bool, integers or floats
            Booleans: True where occupied. Integers: 0 and 1; or percentages up to 100; with unknown cells below 0.
            One integer above 100 beside 0, such as 255, means occupied. Floats: probabilities up to 1, with unknown
            cells below 0 or not a number.
        name : str
            What messages call the map.

        Raises
        ------
        CorridorError
            If values are of another kind, or beyond their range.
        """
        if values.dtype.kind == "b":
            return np.asarray(values, dtype=np.bool_)
        if values.dtype.kind not in "iuf":
            raise CorridorError(f"{name} holds {values.dtype}: cells are booleans, integers or probabilities")
        whole = values.dtype.kind in "iu" or bool((values == np.round(values)).all())
        scale = _scale(values, whole, name)
        return self.by_probability(np.asarray(values, dtype=np.float32) / np.float32(scale))

    def by_probability(self, probability: NDArray[np.float32]) -> BoolArray:
        """Return which cells are occupied, from probabilities; below 0 and not a number are unknown."""
        with np.errstate(invalid="ignore"):
            known = probability >= 0.0
            taken = probability >= np.float32(0.5 if self.threshold is None else self.threshold)
        return np.asarray(np.where(known, taken, self.unknown == "occupied"))

    def counted_unknown(self, values: NDArray[Any]) -> BoolArray | None:
        """Return which cells count as occupied because nothing is known of them; None where there are none."""
        if self.unknown == "free" or values.dtype.kind not in "if":
            return None
        with np.errstate(invalid="ignore"):
            return some(~(values >= 0))


def some(cells: BoolArray) -> BoolArray | None:
    """Return cells, or None where there are none."""
    return np.asarray(cells) if cells.any() else None


def _scale(values: NDArray[Any], whole: bool, name: str) -> float:
    """Return the value that means certainly occupied."""
    largest = float(np.nanmax(values)) if np.isfinite(values).any() else 0.0
    if largest <= 1.0:
        return 1.0
    if whole and largest <= 100.0:
        return 100.0
    if whole and ((values == 0) | (values == largest) | (values < 0)).all() and np.isfinite(largest):
        return largest
    points = "; points of a cloud are floating-point numbers" if values.ndim == 2 and values.shape[1] in (2, 3) else ""
    raise CorridorError(
        f"{name} has values up to {largest:g}: cells are 0 and 1, probabilities up to 1, or whole percentages up to "
        f"100{points}"
    )


def read_array(path: FileName) -> NDArray[Any]:
    """Return the array of an ``.npy`` file; objects are never loaded."""
    with reading(path, "an array of numbers", LARGEST):
        cells = np.load(path, allow_pickle=False, mmap_mode="r")
        if not isinstance(cells, np.ndarray):
            raise ValueError("an archive")
        return cells
