"""Thrust and torque coefficient of a rotor from bench measurements by least squares, with standard errors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, OwnsArrays, owned
from minsnap.basics.checks import check_kind, check_number
from minsnap.errors import FitError
from minsnap.vehicle.drag import Range, warn_outside


@dataclass(frozen=True, eq=False)
class CoefficientFit(OwnsArrays):
    """A coefficient ``k`` of ``y = k speed^2``, fitted by least squares.

    Parameters
    ----------
    name : str
        What was fitted.
    value : float
        [N/(rad/s)^2] or [N m/(rad/s)^2].
    standard_error : float
        Of the value, from the scatter of the residuals.
    r_squared : float
        Part of the variance of ``y`` that is explained.
    residuals : ndarray, shape (m,)
        Measured minus fitted.
    measured : (float, float)
        Least and greatest speed measured [rad/s].
    """

    name: str
    value: float
    standard_error: float
    r_squared: float
    residuals: FloatArray
    measured: Range

    def __call__(self, speed: ArrayLike) -> FloatArray:
        """Evaluate the fit at speeds of any shape [rad/s].

        Warns
        -----
        OutsideRangeWarning
            If a speed lies outside the measured range.
        """
        values = owned(speed)
        warn_outside(self.name, "rotor speed [rad/s]", values, self.measured)
        return np.asarray(self.value * values**2)


def fit_thrust_coefficient(speed: ArrayLike, thrust: ArrayLike) -> CoefficientFit:
    """Fit ``thrust = k speed^2``.

    Parameters
    ----------
    speed : array_like, shape (m,)
        Rotor speeds [rad/s], m >= 2.
    thrust : array_like, shape (m,)
        [N].

    Returns
    -------
    CoefficientFit

    Raises
    ------
    FitError
        If the columns differ in length, hold fewer than 2 points, a value that is not finite, or no rotation at all.
    """
    return _fit_square("the fitted thrust", speed, thrust)


def fit_torque_coefficient(speed: ArrayLike, torque: ArrayLike) -> CoefficientFit:
    """Fit ``torque = k speed^2``, torque in N m; otherwise as :func:`fit_thrust_coefficient`."""
    return _fit_square("the fitted torque", speed, torque)


def _fit_square(name: str, speed: ArrayLike, values: ArrayLike) -> CoefficientFit:
    speeds, measured = fit_columns(name, {"speed": speed, "value": values}, least=2).values()
    squares = speeds**2
    if not squares.any():
        raise FitError(f"{name}: every speed is 0, so the coefficient cannot be determined")
    value = float(squares @ measured / (squares @ squares))
    residuals = measured - value * squares
    scatter = float(residuals @ residuals) / (len(speeds) - 1)
    error = math.sqrt(scatter / float(squares @ squares))
    span = (float(speeds.min()), float(speeds.max()))
    return CoefficientFit(name, value, error, explained(measured, residuals), residuals, span)


def fit_columns(name: str, table: dict[str, ArrayLike], least: int) -> dict[str, FloatArray]:
    """Return equally long finite columns as arrays of shape (m,), or raise FitError.

    Parameters
    ----------
    name : str
        What is fitted, for the message.
    table : dict
        The columns.
    least : int
        Fewest points that determine the fit and its uncertainty.
    """
    check_kind("the table", table, dict, "a dict of columns")
    check_number("the fewest points", least, 1, 1e9, "give a whole number", FitError, whole=True)
    arrays = {key: owned(value).reshape(-1) for key, value in table.items()}
    lengths = {key: len(array) for key, array in arrays.items()}
    if len(set(lengths.values())) > 1:
        raise FitError(f"{name}: the columns differ in length ({lengths}): give one value per measurement in each")
    for key, array in arrays.items():
        bad = np.flatnonzero(~np.isfinite(array))
        if bad.size:
            raise FitError(f"{name}: {key} holds {array[bad[0]]} in row {bad[0]}, counted from 0")
    count = next(iter(lengths.values()))
    if count < least:
        raise FitError(f"{name}: {count} points are too few, it takes {least} or more")
    return arrays


def explained(values: FloatArray, residuals: FloatArray) -> float:
    """Return R^2: the share of the variance of ``values`` that the fit explains."""
    spread = float(np.sum((values - values.mean()) ** 2))
    return 1.0 - float(residuals @ residuals) / spread if spread > 0 else float(not residuals.any())
