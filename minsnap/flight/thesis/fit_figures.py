"""Figures of fits: coefficients over rotor speed, and drag surfaces over two of their variables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.errors import FitError
from minsnap.plot.style import AXIS_STYLES, new_axes
from minsnap.vehicle.rotor_fit import CoefficientFit
from minsnap.vehicle.surface import RPM, Surface

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
