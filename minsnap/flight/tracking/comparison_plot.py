"""The figure of a comparison: the path from above, each coordinate against time, and the error along and across."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.flight.tracking.log_comparison import ComparedFlight
from minsnap.plot.geometry import finish_place, view_coordinates
from minsnap.plot.style import AXIS_STYLES, coordinate_name, legend_beside, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_STYLES: tuple[dict[str, Any], ...] = AXIS_STYLES
_WANTED: dict[str, Any] = {"color": "#000000", "linewidth": 1.0}


@styled
def plot_comparison(flights: Mapping[str, ComparedFlight], view: str = "xy") -> Figure:
    """Draw flights and their reference, with the tracking errors against time.

    Parameters
    ----------
    flights : mapping of str to ComparedFlight
        By the name that the legend shows.
    view : str
        ``"xy"``, ``"xz"``, ``"yz"`` or ``"3d"``.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from minsnap.plot.shown_figure import ShownFigure

    dim = next(iter(flights.values())).reference.dim
    chosen = view_coordinates(view, dim)
    figure = ShownFigure(figsize=(11.5, 2.0 + 1.6 * (dim + 1)), layout="constrained")
    grid = figure.add_gridspec(dim + 1, 2, width_ratios=(1.0, 1.3))
    plane = figure.add_subplot(grid[:, 0], projection="3d" if len(chosen) == 3 else None)
    _draw_plane(plane, flights, chosen)
    rows = [figure.add_subplot(grid[row, 1]) for row in range(dim + 1)]
    for axis, ax in enumerate(rows[:-1]):
        _draw_coordinate(ax, flights, axis, dim)
    _draw_error(rows[-1], flights)
    for ax in rows:
        ax.sharex(rows[-1])
        ax.tick_params(labelbottom=ax is rows[-1])
    rows[-1].set_xlabel("time [s]")
    figure.legend(*plane.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _draw_plane(ax: Axes, flights: Mapping[str, ComparedFlight], chosen: list[int]) -> None:
    for index, (name, one) in enumerate(flights.items()):
        wanted = one.reference.position[:, chosen]
        ax.plot(*wanted.T, label="to be flown" if index == 0 else None, **_WANTED)
        ax.plot(*one.flight.position[:, chosen].T, label=name, **_STYLES[index % len(_STYLES)])
    finish_place(ax, chosen, next(iter(flights.values())).reference.dim)


def _draw_coordinate(ax: Axes, flights: Mapping[str, ComparedFlight], axis: int, dim: int) -> None:
    for index, one in enumerate(flights.values()):
        ax.plot(one.reference.t, one.reference.position[:, axis], **_WANTED)
        ax.plot(one.flight.t, one.flight.position[:, axis], **_STYLES[index % len(_STYLES)])
    ax.set_ylabel(f"{coordinate_name(axis, dim)} [m]")


def _draw_error(ax: Axes, flights: Mapping[str, ComparedFlight]) -> None:
    """Draw the error along the path (full lines) and across it (dotted), where the reference moves."""
    for index, one in enumerate(flights.values()):
        comparison, colour = one.comparison, _STYLES[index % len(_STYLES)]["color"]
        rests = ~comparison.direction.any(axis=1)
        for name, error, dash in (("along", comparison.along, "-"), ("across", comparison.across, ":")):
            shown = np.where(rests, np.nan, error)
            ax.plot(comparison.t, shown, color=colour, linestyle=dash, label=None if index else name)
    ax.set_ylabel("error [m]")
    legend_beside(ax)
