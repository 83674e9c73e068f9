"""Checks of a vehicle's parameters; each raises an error that names the parameter and the value."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import SMALLEST, FloatArray, bounded, numbers
from minsnap.basics.messages import shown
from minsnap.errors import VehicleError

_SLACK = 1e-9
"""Relative rounding allowed in the symmetry and the triangle inequality of an inertia."""


def positive(name: str, value: Any) -> float:
    """Return a finite number above 0, or raise VehicleError."""
    number = _number(name, value)
    if not number >= SMALLEST:
        raise VehicleError(f"{name} is {shown(value)}: it must be a number above 0")
    return number


def non_negative(name: str, value: Any) -> float:
    """Return a finite number not below 0, or raise VehicleError."""
    number = _number(name, value)
    if number < 0:
        raise VehicleError(f"{name} is {shown(value)}: it must be 0 or more")
    return number


def _number(name: str, value: Any) -> float:
    number = numbers(value)
    if number is None or number.ndim or not bounded(number):
        raise VehicleError(f"{name} is {shown(value)}: it must be a finite number")
    return float(number)


def checked_inertia(value: npt.ArrayLike) -> FloatArray:
    """Return an inertia as a read-only matrix, shape (3, 3), or raise VehicleError.

    A rigid body's matrix is symmetric and positive definite, and none of its principal moments exceeds the sum of the
    other two.
    """
    values = numbers(value)
    if values is None or values.shape not in ((3,), (3, 3)) or not bounded(values).all():
        raise VehicleError(f"inertia is {shown(value)}: give 3 finite moments or a finite 3 x 3 matrix")
    matrix = np.diag(values) if values.ndim == 1 else values
    _check_body(matrix)
    matrix = 0.5 * (matrix + matrix.T)
    matrix.flags.writeable = False
    return matrix


def _check_body(matrix: FloatArray) -> None:
    if np.abs(matrix - matrix.T).max() > _SLACK * np.abs(matrix).max():
        raise VehicleError("the inertia matrix is not symmetric: check its off-diagonal entries")
    least, middle, most = np.linalg.eigvalsh(matrix)
    if least <= 0:
        raise VehicleError(f"the inertia is not positive definite: its smallest principal moment is {least:g} kg m^2")
    if most > (least + middle) * (1 + _SLACK):
        raise VehicleError(
            f"the principal moments {least:g}, {middle:g} and {most:g} kg m^2 cannot be those of a rigid body: "
            "the largest must not exceed the sum of the others"
        )
