"""A route through a map: occupied cells, free boxes, the path, and where it comes nearest."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.arrays import BoolArray, FloatArray
from minsnap.plot.geometry import plot_path
from minsnap.plot.profiles import available_orders, plot_profiles
from minsnap.plot.style import LIMIT_COLOUR, dense_samples
from minsnap.routes.plan_route import Route

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

OCCUPIED = "#4d4d4d"
"""Colour of occupied cells."""


def plot_route(route: Route, figure: Figure | None = None, *, title: str | None = None) -> Figure:
    """Draw a route from above on its map, with position and derivatives against time.

    Of a map in space, the cells are drawn that are occupied at an altitude at which the path passes, or nearer to it
    than the clearance.

    Parameters
    ----------
    route : Route
    figure : matplotlib Figure, optional
        Where to draw; a new one, that no window shows, unless given.
    title : str, optional
        Written above, with the least distance to an occupied cell.

    Returns
    -------
    matplotlib Figure
    """
    from matplotlib.figure import Figure

    samples = dense_samples(route.trajectory)
    orders = available_orders(samples)
    drawn = Figure(figsize=(13.0, max(4.5, 1.5 * len(orders))), layout="constrained") if figure is None else figure
    left, right = np.asarray(drawn.subfigures(1, 2, width_ratios=(1.15, 1.0)))
    plane = left.add_subplot()
    draw_cells(plane, route, samples.position)
    plot_path(route.trajectory, plane, corridor=route.corridor)
    _draw_nearest(plane, route)
    plane.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=6, fontsize="small")
    stack = right.subplots(len(orders), 1, sharex=True, squeeze=False)[:, 0]
    plot_profiles(route.trajectory, stack, orders=orders, limits=route.limits)
    right.align_ylabels(stack)
    nearest = f"{route.distance:.3f} m from what is occupied" if np.isfinite(route.distance) else "nothing occupied"
    drawn.suptitle(nearest if title is None else f"{title}: {nearest}")
    return drawn


def draw_cells(ax: Axes, route: Route, position: FloatArray) -> None:
    """Draw the occupied cells of a route's map from above, as a picture."""
    from matplotlib.colors import ListedColormap

    grid = route.grid
    cells = grid.occupied if grid.dim == 2 else _passed(route, position).any(axis=2)
    (left, bottom), (right, top) = grid.lower[:2], grid.upper[:2]
    style: dict[str, Any] = {"cmap": ListedColormap([OCCUPIED]), "interpolation": "nearest", "zorder": 0.5}
    shown = np.ma.masked_where(~cells.T, np.ones(cells.T.shape))
    ax.imshow(shown, origin="lower", extent=(left, right, bottom, top), **style)


def _passed(route: Route, position: FloatArray) -> BoolArray:
    """Return the layers of a map in space that the path passes, and those within the clearance."""
    grid, low, high = route.grid, position[:, 2].min() - route.clearance, position[:, 2].max() + route.clearance
    edges = grid.lower[2] + grid.resolution[2] * np.arange(grid.occupied.shape[2] + 1)
    return np.asarray(grid.occupied[:, :, (edges[1:] > low) & (edges[:-1] < high)])


def _draw_nearest(ax: Axes, route: Route) -> None:
    """Draw a line from the path to the occupied cell that it comes nearest to."""
    found, grid = route.approach, route.grid
    if found.instant is None or found.cell is None:
        return
    place = route.trajectory(found.instant)[:2]
    low = grid.lower[:2] + grid.resolution[:2] * np.array(found.cell[:2])
    there = np.clip(place, low, low + grid.resolution[:2])
    line = np.stack((place, there), axis=1)
    ax.plot(*line, color=LIMIT_COLOUR, linewidth=1.5, label="nearest", zorder=7)
