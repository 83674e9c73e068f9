"""A fit of any form to a table, with its figures."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, OwnsArrays
from minsnap.errors import FitError
from minsnap.flight.thesis.drag_fits import (
    FORMS,
    DragFit,
    consistent_terms,
    drag_columns,
    fit_consistent_drag,
    fit_drag,
    read_columns,
)
from minsnap.plot.style import AXIS_STYLES, new_axes
from minsnap.vehicle.rotor_fit import CoefficientFit, fit_thrust_coefficient, fit_torque_coefficient
from minsnap.vehicle.surface import RPM, Range, Surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LABELS = {"pitch_deg": "pitch [°]", "velocity": "velocity [m/s]", "speed_rpm": "rotor speed [RPM]"}
_POINTS: dict[str, Any] = {"color": AXIS_STYLES[0]["color"], "marker": "o", "markersize": 4, "linestyle": "none"}


def plot_coefficient_fit(
    fit: CoefficientFit,
    speed: npt.ArrayLike,
    values: npt.ArrayLike,
    ax: Axes | None = None,
    *,
    quantity: str = "thrust [N]",
) -> Axes:
    """Draw measurements and the fitted parabola over rotor speed, with its 95 % band (Figures 15 and 18 of the thesis).

    Parameters
    ----------
    fit : CoefficientFit
    speed, values : array_like, shape (m,)
        What was fitted [rad/s], [N] or [N m].
    ax : matplotlib.axes.Axes or None
        Where to draw; by default a new figure.
    quantity : str
        What the values are, for the axis.

    Returns
    -------
    matplotlib.axes.Axes
    """
    axes = new_axes() if ax is None else ax
    measured = np.asarray(speed, dtype=np.float64)
    dense = np.linspace(*fit.measured, 200)
    line = fit(dense)
    band = 1.96 * fit.standard_error * dense**2
    axes.fill_between(dense / RPM, line - band, line + band, color=AXIS_STYLES[1]["color"], alpha=0.25, linewidth=0)
    axes.plot(dense / RPM, line, color=AXIS_STYLES[1]["color"], label="fit")
    axes.plot(measured / RPM, np.asarray(values), label="measured", **_POINTS)
    axes.set(xlabel="rotor speed [RPM]", ylabel=quantity)
    axes.set_title(
        f"k = {fit.value * RPM**2:.4g} ± {fit.standard_error * RPM**2:.1g} per RPM², R² = {fit.r_squared:.4f}"
    )
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return axes


def plot_surface(surface: Surface, table: dict[str, FloatArray] | None = None, ax: Any = None, **held: float) -> Any:
    """Draw a drag surface over two of its variables, with measurements (Figures 6 and 8 of the thesis).

    Parameters
    ----------
    surface : Surface
        Of two variables, or of more with all but two held.
    table : dict of columns or None
        Measurements to draw: the variables and ``drag``; those near the held values count.
    ax : matplotlib 3-D axes or None
        Where to draw; by default a new figure.
    **held
        Values of the other variables, such as ``velocity=10``.

    Returns
    -------
    mpl_toolkits.mplot3d.axes3d.Axes3D

    Raises
    ------
    FitError
        If not exactly two variables are left.
    """
    free = [name for name in surface.variables if name not in held]
    if len(free) != 2 or not set(held) < set(surface.variables):
        raise FitError(f"{surface.name} varies with {', '.join(surface.variables)}: hold all but two of them")
    axes: Any = new_axes("3d") if ax is None else ax
    spans = {name: surface.measured.get(name, (3000.0, 8000.0)) for name in free}
    first, second = np.meshgrid(*(np.linspace(*spans[name], 40) for name in free))
    values = surface(**dict(zip(free, (first, second), strict=True)), **held)
    axes.plot_surface(first, second, values, cmap="cividis", alpha=0.75, linewidth=0)
    if table is not None:
        axes.plot(*(table[name] for name in (*free, "drag")), **(_POINTS | {"color": "#000000", "markersize": 2}))
    axes.set(xlabel=_LABELS[free[0]], ylabel=_LABELS[free[1]], zlabel="drag [N]")
    return axes


_BENCH = {"thrust": fit_thrust_coefficient, "torque": fit_torque_coefficient}


@dataclass(frozen=True)
class Term:
    """A coefficient: its name with unit, value, and standard error where the fit has one."""

    name: str
    value: float
    standard_error: float | None


@dataclass(frozen=True, eq=False)
class TableFit(OwnsArrays):
    """A fit and the data to which it was fitted.

    Parameters
    ----------
    form : str
        ``thrust``, ``torque``, ``consistent``, or one of the drag forms of the thesis.
    terms : tuple of Term
        The coefficients.
    r_squared : float
        Part of the variance that is explained.
    residuals : ndarray, shape (m,)
        Measured minus fitted [N] or [N m].
    measured : dict of str to (low, high)
        Range of each column.
    table : dict of str to ndarray, shape (m,)
        What was fitted.
    fitted : CoefficientFit, DragFit or None
        The fit itself; None for the consistent form.
    """

    form: str
    terms: tuple[Term, ...]
    r_squared: float
    residuals: FloatArray
    measured: dict[str, Range]
    table: dict[str, FloatArray]
    fitted: CoefficientFit | DragFit | None = None

    def __str__(self) -> str:
        facts = self.as_dict()
        lines = [f"{self.form}: {facts['points']} points, R² = {self.r_squared:.4f}, residual {facts['rms']:.3g}"]
        for term in self.terms:
            error = "" if term.standard_error is None else f" ± {term.standard_error:.2g}"
            lines.append(f"  {term.name:<28}{term.value: .6g}{error}")
        ranges = self.measured.items()
        return "\n".join([*lines, *(f"  measured for {name} from {low:g} to {high:g}" for name, (low, high) in ranges)])

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain numbers, for JSON."""
        return {
            "form": self.form,
            "points": len(self.residuals),
            "r_squared": self.r_squared,
            "rms": float(np.sqrt(np.mean(self.residuals**2))),
            "terms": [vars(term) for term in self.terms],
            "measured": self.measured,
        }


def fit_table(path: str | os.PathLike[str], form: str) -> TableFit:
    """Fit a form to the measurements in a CSV file.

    Parameters
    ----------
    path : str or path
        With a header: ``speed_rpm`` and ``thrust`` [N] or ``torque`` [N m] for those forms, and the columns of
        :func:`minsnap.flight.thesis.fit_drag` for the others.
    form : str
        ``thrust``, ``torque``, ``consistent`` or one of the drag forms of the thesis.

    Returns
    -------
    TableFit

    Raises
    ------
    FitError
        If the form is not known or the measurements do not determine it.
    FileError
        If a column is missing or the file damaged.
    """
    if form in _BENCH:
        return _bench(path, form)
    if form == "consistent":
        return _consistent(path)
    if form in FORMS:
        return _surface(path, form)
    raise FitError(f"no form is called {form!r}: choose from {', '.join([*_BENCH, *FORMS, 'consistent'])}")


def _bench(path: str | os.PathLike[str], form: str) -> TableFit:
    table = read_columns(path, ("speed_rpm", form))
    fit = _BENCH[form](table["speed_rpm"] * RPM, table[form])
    unit = "N" if form == "thrust" else "N m"
    terms = (
        Term(f"[{unit}/(rad/s)^2]", fit.value, fit.standard_error),
        Term(f"[{unit}/RPM^2]", fit.value * RPM**2, fit.standard_error * RPM**2),
    )
    return TableFit(form, terms, fit.r_squared, fit.residuals, _ranges(table, ("speed_rpm",)), table, fit)


def _surface(path: str | os.PathLike[str], form: str) -> TableFit:
    variables = FORMS[form].variables
    table = read_columns(path, (*variables, "drag"))
    fit = fit_drag(table, form)
    named = zip(_term_names(fit.surface), fit.coefficients, fit.standard_errors, strict=True)
    terms = tuple(Term(name, float(value), float(error)) for name, value, error in named)
    return TableFit(form, terms, fit.r_squared, fit.residuals, fit.surface.measured, table, fit)


def _consistent(path: str | os.PathLike[str]) -> TableFit:
    variables = ("pitch_deg", "velocity")
    table = drag_columns(path, "the consistent drag", variables, least=5)
    model, quality = fit_consistent_drag(table)
    values = (model.linear[0], model.linear[2], model.quadratic[0], model.quadratic[2])
    names = ("linear x, y [N s/m]", "linear z [N s/m]", "quadratic x, y [N s^2/m^2]", "quadratic z [N s^2/m^2]")
    terms = tuple(Term(name, float(value), None) for name, value in zip(names, values, strict=True))
    residuals = table["drag"] - consistent_terms(table["pitch_deg"], table["velocity"]) @ np.array(values)
    return TableFit("consistent", terms, quality, residuals, _ranges(table, variables), table)


def _ranges(table: dict[str, FloatArray], names: tuple[str, ...]) -> dict[str, Range]:
    return {name: (float(table[name].min()), float(table[name].max())) for name in names}


def _term_names(surface: Surface) -> list[str]:
    """Return each term as a product of powers, such as ``pitch_deg velocity^2``, and 1 for the constant."""
    words = []
    for term in surface.exponents:
        factors = [
            f"{name}^{power}" if power > 1 else name
            for name, power in zip(surface.variables, term, strict=True)
            if power
        ]
        words.append(" ".join(factors) or "1")
    return words


def plot_table_fit(table_fit: TableFit) -> Any:
    """Draw a fit with its measurements and return the axes: a parabola, a surface, or the residuals."""
    if isinstance(table_fit.fitted, CoefficientFit):
        quantity = "thrust [N]" if table_fit.form == "thrust" else "torque [N m]"
        return plot_coefficient_fit(
            table_fit.fitted, table_fit.table["speed_rpm"] * RPM, table_fit.table[table_fit.form], quantity=quantity
        )
    if isinstance(table_fit.fitted, DragFit) and len(table_fit.fitted.surface.variables) == 2:
        return plot_surface(table_fit.fitted.surface, table_fit.table)
    axes = new_axes()
    axes.plot(table_fit.table["velocity"], table_fit.residuals, "o", color="#0072b2")
    axes.axhline(0.0, color="#000000", linewidth=1.0)
    axes.set(xlabel="velocity [m/s]", ylabel="measured minus fitted [N]")
    return axes
