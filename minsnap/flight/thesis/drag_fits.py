"""Drag surfaces of the thesis: as printed, and least-squares fits of their forms and of a drag that vanishes at rest.

Source: *Effect of Incorporating Aerodynamic Drag Model on Trajectory Tracking Performance of DJI F330 Quadcopter*
(Arizona State University), sections 3.3 and 3.4. Its angles are in degrees, its rotor speeds in revolutions per minute.
The parasitic fit starts at 7 m/s: below 4.7 m/s its reduced forms are negative, that is, they push forward, and no form
is zero at rest. They are kept as printed for comparison; use :func:`minsnap.flight.thesis.consistent_parasitic_drag`
for compensation.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, OwnsArrays
from minsnap.errors import FitError, VehicleError
from minsnap.vehicle.drag import BodyDrag, linear_rotor_drag
from minsnap.vehicle.rotor_fit import columns, explained
from minsnap.vehicle.surface import Surface, SurfaceDrag

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

PUBLISHED_PARASITIC_REDUCED = Surface(
    "the published parasitic curve",
    ("velocity",),
    ((0,), (1,), (2,)),
    np.array([-0.1069, -0.01856, 0.008744]),
    {"velocity": (7.0, 28.0)},
)
"""The same without its pitch terms (section 3.3.3)."""

PUBLISHED_PARASITIC_LINEAR = Surface(
    "the published linear parasitic model",
    ("velocity",),
    ((0,), (1,)),
    np.array([-0.1069, -0.01856]),
    {"velocity": (7.0, 28.0)},
)
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


def published_drag(name: str = "linear") -> SurfaceDrag:
    """Return a published model as a force: ``surface``, ``reduced``, ``linear`` or ``propeller``."""
    models = {
        "surface": SurfaceDrag(PUBLISHED_PARASITIC),
        "reduced": SurfaceDrag(PUBLISHED_PARASITIC_REDUCED),
        "linear": SurfaceDrag(PUBLISHED_PARASITIC_LINEAR),
        "propeller": SurfaceDrag(PUBLISHED_PROPELLER, count=4),
    }
    if name not in models:
        raise VehicleError(f"no published drag model is called {name!r}: choose from {', '.join(models)}")
    return models[name]


Table = str | os.PathLike[str] | Mapping[str, npt.ArrayLike]

FORMS = {
    "parasitic": PUBLISHED_PARASITIC,
    "reduced": PUBLISHED_PARASITIC_REDUCED,
    "linear": PUBLISHED_PARASITIC_LINEAR,
    "propeller": PUBLISHED_PROPELLER,
}
"""The forms of the thesis that :func:`fit_drag` fits, by name."""


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
    measured = {name: (float(data[name].min()), float(data[name].max())) for name in like.variables}
    name = like.name.replace("published", "fitted")
    quality = explained(data["drag"], residuals)
    surface = replace(like, name=name, coefficients=values, measured=measured, r_squared=quality)
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
    from scipy.optimize import nnls

    data = drag_columns(table, "the consistent drag", ("pitch_deg", "velocity"), least=5)
    design = consistent_terms(data["pitch_deg"], data["velocity"])
    (linear_x, linear_z, quadratic_x, quadratic_z), _ = nnls(design, data["drag"])
    model = BodyDrag((linear_x, linear_x, linear_z), (quadratic_x, quadratic_x, quadratic_z))
    residuals = data["drag"] - design @ np.array([linear_x, linear_z, quadratic_x, quadratic_z])
    return model, explained(data["drag"], residuals)


def consistent_terms(pitch_deg: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return the regressors of the linear x, linear z, quadratic x, quadratic z coefficients along the wind, (m, 4)."""
    along, up = np.cos(np.radians(pitch_deg)) ** 2, np.sin(np.radians(pitch_deg)) ** 2
    return np.stack([velocity * along, velocity * up, velocity**2 * along, velocity**2 * up], axis=-1)


def drag_columns(table: Table, name: str, variables: tuple[str, ...], least: int) -> dict[str, FloatArray]:
    """Return the columns that a fit needs from a CSV file or a mapping, or raise an error that names a missing one."""
    wanted = (*variables, "drag")
    held: Mapping[str, npt.ArrayLike] = table if isinstance(table, Mapping) else read_columns(table, wanted)
    missing = [key for key in wanted if key not in held]
    if missing:
        raise FitError(f"{name} needs the columns {', '.join(wanted)}: {', '.join(missing)} is missing")
    return columns(name, {key: held[key] for key in wanted}, least)


def read_columns(path: str | os.PathLike[str], wanted: tuple[str, ...]) -> dict[str, FloatArray]:
    """Return named columns of a CSV file; other columns are ignored."""
    from minsnap.basics.storage.table import read_table
    from minsnap.basics.storage.text import read_text

    header = read_text(path).partition("\n")[0]
    others = [name.strip() for name in header.split(",") if name.strip() not in wanted]
    return read_table(path, wanted, others)


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

    Returns
    -------
    BodyDrag
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

    Returns
    -------
    BodyDrag
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
