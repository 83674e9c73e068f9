"""Polynomial surfaces of drag as measured in a wind tunnel: their coefficients, what they were measured on, values."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from minsnap.arrays import FloatArray
from minsnap.errors import FitError, OutsideRangeWarning

Range = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Surface:
    """A sum of products of powers of named variables, with the range it was measured in.

    Parameters
    ----------
    name : str
        What it is called.
    variables : tuple of str
        Names of the columns, with their unit: ``pitch_deg``, ``velocity`` [m/s], ``speed_rpm``.
    exponents : tuple of tuple of int
        One tuple a term, one power a variable.
    coefficients : array_like, shape (terms,)
        [N] over the units of the variables.
    measured : dict of str to (low, high)
        Range of each variable in the measurements.
    r_squared : float or None
        Part of the measurements' variance that the surface explains.
    """

    name: str
    variables: tuple[str, ...]
    exponents: tuple[tuple[int, ...], ...]
    coefficients: FloatArray
    measured: dict[str, Range] = field(default_factory=dict)
    r_squared: float | None = None

    def __post_init__(self) -> None:
        owned = np.array(self.coefficients, dtype=np.float64)
        owned.flags.writeable = False
        object.__setattr__(self, "coefficients", owned)

    def __call__(self, **values: npt.ArrayLike) -> FloatArray:
        """Drag where the variables, given by name, have these values; any shapes that broadcast [N].

        Raises
        ------
        FitError
            If a variable is missing or not one of the surface's.

        Warns
        -----
        OutsideRangeWarning
            If a value lies outside the measured range.
        """
        columns = self._columns(values)
        for name, column in zip(self.variables, columns, strict=True):
            warn_outside(self.name, name, column, self.measured.get(name))
        return np.asarray(self.terms(*columns) @ self.coefficients)

    def terms(self, *columns: npt.ArrayLike) -> FloatArray:
        """Return the value of every term without its coefficient, shape (..., terms); variables in order."""
        arrays = np.broadcast_arrays(*(np.asarray(column, dtype=np.float64) for column in columns))
        powers = [
            np.prod([array**power for array, power in zip(arrays, term, strict=True)], axis=0)
            for term in self.exponents
        ]
        return np.stack(powers, axis=-1)

    def _columns(self, values: dict[str, npt.ArrayLike]) -> list[FloatArray]:
        wrong = sorted(set(values) ^ set(self.variables))
        if wrong:
            raise FitError(f"{self.name} takes {', '.join(self.variables)}: check {', '.join(wrong)}")
        return [np.asarray(values[name], dtype=np.float64) for name in self.variables]


def warn_outside(model: str, name: str, values: FloatArray, measured: Range | None) -> None:
    """Warn if any value lies outside the measured range (low, high)."""
    if measured is None or values.size == 0:
        return
    low, high = float(np.min(values)), float(np.max(values))
    if low < measured[0] or high > measured[1]:
        seen = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        message = f"{model} was measured for {name} from {measured[0]:g} to {measured[1]:g}, not at {seen}"
        warnings.warn(message, OutsideRangeWarning, stacklevel=3)
