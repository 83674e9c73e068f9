"""Drag surfaces of the thesis: as printed, and least-squares fits of their forms and of a drag that vanishes at rest.

Source: *Effect of Incorporating Aerodynamic Drag Model on Trajectory Tracking Performance of DJI F330 Quadcopter*
(Arizona State University), sections 3.3 and 3.4. Its angles are in degrees, its rotor speeds in revolutions per minute.
The parasitic fit starts at 7 m/s: below 4.7 m/s its reduced forms are negative, that is, they push forward, and no form
is zero at rest. They are kept as printed for comparison; use :func:`minsnap.flight.thesis.consistent_parasitic_drag`
for compensation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, OwnsArrays
from minsnap.basics.storage.table import read_table
from minsnap.basics.storage.text import FileName
from minsnap.errors import FitError, VehicleError
from minsnap.plot.style import AXIS_STYLES, Axes, new_axes
from minsnap.vehicle import (
    RPM,
    BodyDrag,
    CoefficientFit,
    Range,
    Surface,
    SurfaceDrag,
    explained,
    fit_columns,
    fit_thrust_coefficient,
    fit_torque_coefficient,
    linear_rotor_drag,
)

_TUNNEL = {"pitch_deg": (-20.0, 20.0), "velocity": (7.0, 28.0)}

PUBLISHED_PARASITIC = Surface(
    "the published parasitic surface",
    ("pitch_deg", "velocity"),
    ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)),
    np.array([-0.1069, -0.01293, -0.01856, 0.001505, 0.001185, 0.008744]),
    _TUNNEL,
    0.9915,
)
"""Drag of the bare airframe from pitch and velocity (section 3.3.2)."""


def _along(name: str, *coefficients: float) -> Surface:
    """Return a polynomial in the velocity alone, from its constant on."""
    powers = tuple((power,) for power in range(len(coefficients)))
    return Surface(name, ("velocity",), powers, np.array(coefficients), {"velocity": _TUNNEL["velocity"]})


PUBLISHED_PARASITIC_REDUCED = _along("the published parasitic curve", -0.1069, -0.01856, 0.008744)
"""The same without its pitch terms (section 3.3.3)."""

PUBLISHED_PARASITIC_LINEAR = _along("the published linear parasitic model", -0.1069, -0.01856)
"""The same without the square of velocity: what the thesis compensated with (section 3.3.3)."""

PUBLISHED_PROPELLER = Surface(
    "the published propeller surface",
    ("pitch_deg", "velocity", "speed_rpm"),
    ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 0, 2)),
    np.array([0.36891, -0.041098, 0.041432, -0.00024171, 1.8526e-5, -1.1287e-11]),
    {"pitch_deg": (0.0, 90.0), "velocity": (0.0, 15.0)},
    0.976,
)
"""Drag of one propeller from pitch, velocity and rotor speed (section 3.4.2)."""


FORMS = {"parasitic": PUBLISHED_PARASITIC, "reduced": PUBLISHED_PARASITIC_REDUCED}
FORMS |= {"linear": PUBLISHED_PARASITIC_LINEAR, "propeller": PUBLISHED_PROPELLER}
"""The forms of the thesis that :func:`fit_drag` fits, by name."""


def published_drag(name: str = "linear") -> SurfaceDrag:
    """Return a published model as a force: ``surface``, ``reduced``, ``linear`` or ``propeller``."""
    models = {"surface" if form == "parasitic" else form: surface for form, surface in FORMS.items()}
    if name not in models:
        raise VehicleError(f"no published drag model is called {name!r}: choose from {', '.join(models)}")
    return SurfaceDrag(models[name], count=4 if name == "propeller" else 1)


Table = FileName | Mapping[str, ArrayLike]


@dataclass(frozen=True, eq=False)
class DragFit(OwnsArrays):
    """A fitted drag surface with its standard errors.

    Parameters
    ----------
    surface : Surface
        Callable; carries the measured range and R squared, and warns when evaluated outside that range.
    standard_errors : ndarray, shape (terms,)
        Of the coefficients; zero for one held at its bound.
    covariance : ndarray, shape (terms, terms)
        Of the coefficients.
    residuals : ndarray, shape (m,)
        Measured minus fitted [N].
    """

    surface: Surface
    standard_errors: FloatArray
    covariance: FloatArray
    residuals: FloatArray

    @property
    def coefficients(self) -> FloatArray:
        """Coefficients of the surface's terms, shape (terms,)."""
        return self.surface.coefficients

    @property
    def r_squared(self) -> float:
        """Share of the variance of the measurements that the fit explains."""
        return float(self.surface.r_squared or 0.0)


def fit_drag(table: Table, form: str = "parasitic") -> DragFit:
    """Fit a drag surface to measurements.

    Parameters
    ----------
    table : path or mapping of columns
        A CSV file with a header, or the columns themselves: ``drag`` [N] and those of the form: ``pitch_deg`` and
        ``velocity`` [m/s] for ``parasitic``, ``velocity`` alone for ``reduced`` and ``linear``, and ``speed_rpm`` as
        well for ``propeller``.
    form : str
        One of :data:`FORMS`.

    Returns
    -------
    DragFit

    Raises
    ------
    FitError
        If the form is not known, points are too few, or they do not determine every coefficient.
    FileError
        If the file lacks a column (says which) or is damaged (says where).
    """
    if form not in FORMS:
        raise FitError(f"no form of drag is called {form!r}: choose from {', '.join(FORMS)}")
    like = FORMS[form]
    data = drag_columns(table, f"the {form} drag", like.variables, least=len(like.exponents) + 1)
    design = like.terms(*(data[name] for name in like.variables))
    values, covariance, residuals = least_squares(f"the {form} drag", design, data["drag"])
    name, quality = like.name.replace("published", "fitted"), explained(data["drag"], residuals)
    ranges = _ranges(data, like.variables)
    surface = replace(like, name=name, coefficients=values, measured=ranges, r_squared=quality)
    return DragFit(surface, np.sqrt(np.diag(covariance)), covariance, residuals)


def fit_consistent_drag(table: Table) -> tuple[BodyDrag, float]:
    """Fit the physically consistent model to measurements of an airframe.

    Parameters
    ----------
    table : path or mapping of columns
        ``pitch_deg``, ``velocity`` [m/s] and ``drag`` [N], as for :func:`fit_drag`.

    Returns
    -------
    model : BodyDrag
        Coefficients none of which is negative; along y those of x.
    r_squared : float
        Part of the measurements' variance that it explains.
    """
    (linear_x, linear_z, quadratic_x, quadratic_z), _, quality = consistent_fit(table)
    return BodyDrag((linear_x, linear_x, linear_z), (quadratic_x, quadratic_x, quadratic_z)), quality


def consistent_fit(table: Table) -> tuple[FloatArray, FloatArray, float]:
    """Return the coefficients linear x, linear z, quadratic x, quadratic z along the wind, residuals and R squared."""
    from scipy.optimize import nnls

    degrees, velocity, drag = drag_columns(table, "the consistent drag", ("pitch_deg", "velocity"), least=5).values()
    pitch = np.radians(degrees)
    along, up = np.cos(pitch) ** 2, np.sin(pitch) ** 2
    design = np.stack([velocity * along, velocity * up, velocity**2 * along, velocity**2 * up], axis=-1)
    coefficients, _ = nnls(design, drag)
    residuals = drag - design @ coefficients
    return coefficients, residuals, explained(drag, residuals)


def drag_columns(table: Table, name: str, variables: tuple[str, ...], least: int) -> dict[str, FloatArray]:
    """Return the columns that a fit needs from a CSV file or a mapping, or raise an error that names a missing one."""
    wanted = (*variables, "drag")
    held: Mapping[str, ArrayLike] = table if isinstance(table, Mapping) else read_table(table, wanted, None)
    missing = [key for key in wanted if key not in held]
    if missing:
        raise FitError(f"{name} needs the columns {', '.join(wanted)}: {', '.join(missing)} is missing")
    return fit_columns(name, {key: held[key] for key in wanted}, least)


def least_squares(name: str, design: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return coefficients, their covariance, and residuals of a linear fit; columns are first scaled to unit length."""
    scale = np.sqrt(np.einsum("ij,ij->j", design, design))
    scaled = design / np.where(scale > 0, scale, 1.0)
    coefficients, _, rank, _ = np.linalg.lstsq(scaled, values, rcond=1e-10)
    if rank < design.shape[1]:
        raise FitError(f"{name}: the points fix {rank} of {design.shape[1]} coefficients: vary every column more")
    residuals = values - scaled @ coefficients
    scatter = float(residuals @ residuals) / (len(values) - design.shape[1])
    covariance = scatter * np.linalg.inv(scaled.T @ scaled) / np.outer(scale, scale)
    return coefficients / scale, np.asarray(covariance), residuals


_PITCHES, _VELOCITIES = 41, 43
"""Grid of the refit: whole degrees and half metres per second."""


def consistent_parasitic_drag() -> BodyDrag:
    """Return the airframe's drag: odd in velocity, zero at rest, opposing motion.

    A body at pitch ``p`` in a wind of speed ``v`` meets it along x with ``v cos p`` and along z with ``v sin p``; the
    drag of :class:`BodyDrag` along the wind is then linear in its four coefficients. They are the non-negative least
    squares fit to the published surface on its whole measured range, 7 to 28 m/s and -20 to 20 degrees; along y the
    coefficients of x are used, as in the source.
    """
    return _refit()[0]


def consistent_r_squared() -> float:
    """Return R^2 of the consistent model with respect to the published surface over its measured range."""
    return _refit()[1]


def consistent_rotor_drag() -> BodyDrag:
    """Return the linear drag of four rotors: the slope of the published propeller surface in velocity.

    The surface is negative at rest and at flown rotor speeds, where it contains a part of the thrust; its slope in
    velocity, 0.041432 N s/m per propeller at any pitch and rotor speed, is the part that opposes motion. It is
    used along x and y; along z, which the tests do not separate from thrust, there is none, as in Faessler 2018.
    """
    slope = float(PUBLISHED_PROPELLER.coefficients[PUBLISHED_PROPELLER.exponents.index((0, 1, 0))])
    return linear_rotor_drag(4.0 * slope, 4.0 * slope)


@cache
def _refit() -> tuple[BodyDrag, float]:
    """Fit the consistent model to the published surface on a grid over its measured range."""
    low, high = PUBLISHED_PARASITIC.measured["pitch_deg"]
    slow, fast = PUBLISHED_PARASITIC.measured["velocity"]
    pitch, speed = np.meshgrid(np.linspace(low, high, _PITCHES), np.linspace(slow, fast, _VELOCITIES))
    drag = PUBLISHED_PARASITIC(pitch_deg=pitch, velocity=speed)
    return fit_consistent_drag({"pitch_deg": pitch, "velocity": speed, "drag": drag})


_LABELS = {"pitch_deg": "pitch [°]", "velocity": "velocity [m/s]", "speed_rpm": "rotor speed [RPM]"}
_POINTS: dict[str, Any] = {"color": AXIS_STYLES[0]["color"], "marker": "o", "markersize": 4, "linestyle": "none"}


def plot_coefficient_fit(
    fit: CoefficientFit, speed: ArrayLike, values: ArrayLike, ax: Axes | None = None, *, quantity: str = "thrust [N]"
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
    value, error = fit.value * RPM**2, fit.standard_error * RPM**2
    axes.set_title(f"k = {value:.4g} ± {error:.1g} per RPM², R² = {fit.r_squared:.4f}")
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


def fit_table(path: FileName, form: str) -> TableFit:
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


def _bench(path: FileName, form: str) -> TableFit:
    table = read_table(path, ("speed_rpm", form), None)
    fit = _BENCH[form](table["speed_rpm"] * RPM, table[form])
    unit = "N" if form == "thrust" else "N m"
    terms = (
        Term(f"[{unit}/(rad/s)^2]", fit.value, fit.standard_error),
        Term(f"[{unit}/RPM^2]", fit.value * RPM**2, fit.standard_error * RPM**2),
    )
    return TableFit(form, terms, fit.r_squared, fit.residuals, _ranges(table, ("speed_rpm",)), table, fit)


def _surface(path: FileName, form: str) -> TableFit:
    table = read_table(path, (*FORMS[form].variables, "drag"), None)
    fit = fit_drag(table, form)
    named = zip(_term_names(fit.surface), fit.coefficients, fit.standard_errors, strict=True)
    terms = tuple(Term(name, float(value), float(error)) for name, value, error in named)
    return TableFit(form, terms, fit.r_squared, fit.residuals, fit.surface.measured, table, fit)


def _consistent(path: FileName) -> TableFit:
    table = read_table(path, ("pitch_deg", "velocity", "drag"), None)
    values, residuals, quality = consistent_fit(table)
    names = ("linear x, y [N s/m]", "linear z [N s/m]", "quadratic x, y [N s^2/m^2]", "quadratic z [N s^2/m^2]")
    terms = tuple(Term(name, float(value), None) for name, value in zip(names, values, strict=True))
    return TableFit("consistent", terms, quality, residuals, _ranges(table, ("pitch_deg", "velocity")), table)


def _ranges(table: dict[str, FloatArray], names: tuple[str, ...]) -> dict[str, Range]:
    return {name: (float(table[name].min()), float(table[name].max())) for name in names}


def _term_names(surface: Surface) -> list[str]:
    """Return each term as a product of powers, such as ``pitch_deg velocity^2``, and 1 for the constant."""
    products = [zip(surface.variables, term, strict=True) for term in surface.exponents]
    words = [[f"{name}^{power}" if power > 1 else name for name, power in each if power] for each in products]
    return [" ".join(factors) or "1" for factors in words]


def plot_table_fit(table_fit: TableFit) -> Any:
    """Draw a fit with its measurements and return the axes: a parabola, a surface, or the residuals."""
    fit, table = table_fit.fitted, table_fit.table
    if isinstance(fit, CoefficientFit):
        quantity = "thrust [N]" if table_fit.form == "thrust" else "torque [N m]"
        return plot_coefficient_fit(fit, table["speed_rpm"] * RPM, table[table_fit.form], quantity=quantity)
    if isinstance(fit, DragFit) and len(fit.surface.variables) == 2:
        return plot_surface(fit.surface, table)
    axes = new_axes()
    axes.plot(table["velocity"], table_fit.residuals, "o", color="#0072b2")
    axes.axhline(0.0, color="#000000", linewidth=1.0)
    axes.set(xlabel="velocity [m/s]", ylabel="measured minus fitted [N]")
    return axes
