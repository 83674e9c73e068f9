"""Polynomial drag surfaces from wind-tunnel measurements, their measured range, and their force in flight."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, owned, set_fields
from minsnap.errors import FitError, OutsideRangeWarning

Range = tuple[float, float]
"""Least and greatest value measured."""

RPM = 2.0 * math.pi / 60.0
"""One revolution a minute [rad/s]."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A polynomial in named variables, with the range in which it was measured.

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
        set_fields(self, coefficients=owned(self.coefficients))

    def __call__(self, **values: npt.ArrayLike) -> FloatArray:
        """Return the drag [N] at values of the variables, by name; their shapes must broadcast.

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


@dataclass(frozen=True, eq=False)
class SurfaceDrag:
    """A surface as a drag force: its negative value along the body's x and y axes, zero along z.

    A wind tunnel measures drag along x; along y it is assumed equal by symmetry. Velocities of either sign are inserted
    into the polynomial unchanged. Calling the surface outside its measured range warns; evaluating the force does not,
    since most of a flight is outside that range.

    Parameters
    ----------
    surface : Surface
        Of ``pitch_deg``, ``velocity`` and ``speed_rpm``, or some of them.
    count : int
        How many such bodies there are: 1 airframe, 4 propellers.
    """

    surface: Surface
    count: int = 1

    def force(
        self, velocity: npt.ArrayLike, *, pitch: npt.ArrayLike = 0.0, rotor_speed: npt.ArrayLike = 0.0
    ) -> FloatArray:
        """Return the force in the body frame, shape (..., 3) [N]; rotor speeds enter by their mean."""
        v = np.asarray(velocity, dtype=np.float64)
        speeds = np.asarray(rotor_speed, dtype=np.float64)
        mean = speeds if speeds.ndim == 0 else speeds.mean(axis=-1)
        force = np.zeros(v.shape)
        for axis in (0, 1):
            known = {"pitch_deg": np.degrees(pitch), "velocity": v[..., axis], "speed_rpm": mean / RPM}
            terms = self.surface.terms(*(known[name] for name in self.surface.variables))
            force[..., axis] = -self.count * (terms @ self.surface.coefficients)
        return force


def warn_outside(model: str, name: str, values: FloatArray, measured: Range | None) -> None:
    """Warn if any value lies outside the measured range (low, high)."""
    if measured is None or values.size == 0:
        return
    low, high = float(np.min(values)), float(np.max(values))
    if low < measured[0] or high > measured[1]:
        seen = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        message = f"{model} was measured for {name} from {measured[0]:g} to {measured[1]:g}, not at {seen}"
        warnings.warn(message, OutsideRangeWarning, stacklevel=3)
