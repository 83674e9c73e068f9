"""Figure of a race: the path coloured by its speed, and the thrust of every rotor below."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import InputError
from minsnap.plot.geometry import plot_path
from minsnap.plot.marks import Waypoints
from minsnap.plot.outlines import Corridor
from minsnap.plot.style import LIMIT_STYLE, POINTS, draw_curves, legend_beside, new_axes, styled
from minsnap.trajectory.path import Path

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from minsnap.vehicle import Quadrotor


@styled
def plot_rotors(path: Path, vehicle: Quadrotor, ax: Axes | None = None) -> Axes:
    """Draw the thrust of every rotor along a path against time, and its limits.

    Parameters
    ----------
    path : Path
        dim 2 or 3; with its heading; with the drag that ``Limits.of`` includes.
    vehicle : Quadrotor
    ax : matplotlib axes, optional
        Where to draw; by default a new figure.

    Returns
    -------
    matplotlib axes
    """
    axes = new_axes() if ax is None else ax
    t, thrusts = _rotor_thrusts(path, vehicle)
    draw_curves(axes, t, thrusts, [f"rotor {number}" for number in (1, 2, 3, 4)], linewidth=1.1)
    for number, limit in enumerate(vehicle.rotor_thrust_limits):
        axes.axhline(limit, label=None if number else "limits", **LIMIT_STYLE)
    axes.set(xlabel="time [s]", ylabel="thrust [N]", xlim=(0.0, path.duration))
    legend_beside(axes)
    return axes


@styled
def plot_race(
    path: Path,
    vehicle: Quadrotor,
    figure: Figure | None = None,
    *,
    view: str = "xy",
    corridor: Corridor | None = None,
    waypoints: Waypoints | None = None,
    tolerance: Any = None,
    title: str | None = None,
) -> Figure:
    """Draw a path coloured by its speed, and the thrust of every rotor below.

    Parameters
    ----------
    path : Path
        dim 2 or 3.
    vehicle : Quadrotor
    figure : matplotlib Figure, optional
        Where to draw; by default a new one, that no window shows.
    view, corridor, waypoints, tolerance
        As :func:`plot_path` takes them.
    title : str, optional
        Written above.

    Returns
    -------
    matplotlib Figure
    """
    from minsnap.plot.shown_figure import ShownFigure

    drawn = ShownFigure(figsize=(9.0, 9.0), layout="constrained") if figure is None else figure
    above, below = np.asarray(drawn.subfigures(2, 1, height_ratios=(2.4, 1.0)))
    plane = above.add_subplot(projection="3d" if view == "3d" else None)
    plot_path(path, plane, view=view, corridor=corridor, waypoints=waypoints, tolerance=tolerance, colour_by="speed")
    plot_rotors(path, vehicle, below.add_subplot())
    if title:
        drawn.suptitle(title)
    return drawn


def _rotor_thrusts(path: Path, vehicle: Quadrotor) -> tuple[FloatArray, FloatArray]:
    """Instants (m,) [s] and thrusts (m, 4) [N]."""
    from minsnap.limits.vehicle_use import flat_drag
    from minsnap.vehicle import flatness_of

    if path.dim not in (2, 3):
        raise InputError(f"rotors need a path of two or three coordinates, this one has {path.dim}")
    t = np.linspace(0.0, path.duration, 3 * POINTS)
    speed = flatness_of(vehicle, path, t, drag=flat_drag(vehicle)).rotor_speed
    return t, np.asarray(vehicle.thrust_coefficient * speed * np.abs(speed))
