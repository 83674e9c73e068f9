"""Figures of flights and their reference: in the x-y plane, and position and velocity against time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.plot.geometry import finish_place, view_coordinates
from minsnap.plot.style import AXIS_STYLES, coordinate_name, styled, unit_of
from minsnap.trajectory.samples import Samples

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_REFERENCE: dict[str, Any] = {"color": "#000000", "linewidth": 1.0}


@styled
def plot_tracking(reference: Samples, flights: Mapping[str, Samples], title: str = "", view: str = "xy") -> Figure:
    """Draw flights and their reference: from above, and x and y of position and velocity against time.

    All panels are in one figure.

    Parameters
    ----------
    reference : Samples
        What was to be flown.
    flights : mapping of str to Samples
        What was flown, by the name that the legend shows.
    title : str
        Above the figure.
    view : str
        ``"xy"``, ``"xz"``, ``"yz"`` or ``"3d"``.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from minsnap.plot.shown_figure import ShownFigure

    chosen = view_coordinates(view, reference.dim)
    figure = ShownFigure(figsize=(11.0, 6.5), layout="constrained")
    grid = figure.add_gridspec(4, 2, width_ratios=(1.1, 1.3))
    plane = figure.add_subplot(grid[:, 0], projection="3d" if len(chosen) == 3 else None)
    _draw_plane(plane, reference, flights, chosen)
    profiles = [figure.add_subplot(grid[row, 1]) for row in range(4)]
    for row, ax in enumerate(profiles):
        _draw_profile(ax, reference, flights, order=row // 2, axis=row % 2)
        ax.sharex(profiles[0])
        ax.tick_params(labelbottom=row == 3)
    profiles[-1].set_xlabel("time [s]")
    figure.legend(*plane.get_legend_handles_labels(), loc="outside lower center", ncols=len(flights) + 1)
    if title:
        figure.suptitle(title)
    return figure


def _draw_plane(ax: Axes, reference: Samples, flights: Mapping[str, Samples], chosen: list[int]) -> None:
    """Draw positions in a view, at equal scales."""
    for index, (name, flight) in enumerate(flights.items()):
        ax.plot(*flight.position[:, chosen].T, label=name, **_style(index))
    ax.plot(*reference.position[:, chosen].T, label="reference", **_REFERENCE)
    finish_place(ax, chosen, reference.dim)


def _draw_profile(ax: Axes, reference: Samples, flights: Mapping[str, Samples], order: int, axis: int) -> None:
    """Draw one coordinate of position or velocity against time."""
    for index, flight in enumerate(flights.values()):
        values = _values(flight, order)
        if values is not None:
            ax.plot(flight.t, values[:, axis], **_style(index))
    values = _values(reference, order)
    if values is not None:
        ax.plot(reference.t, values[:, axis], **_REFERENCE)
    symbol = coordinate_name(axis, reference.dim)
    ax.set_ylabel(f"${'v_' * order}{symbol}$ [{unit_of(order)}]")


def _values(samples: Samples, order: int) -> FloatArray | None:
    """Return position, or velocity: that of the samples, or the differences of position where they have none."""
    if order == 0:
        return samples.position
    if samples.velocity is not None or len(samples) < 2:
        return samples.velocity
    return np.asarray(np.gradient(samples.position, samples.t, axis=0))


def _style(index: int) -> dict[str, Any]:
    return AXIS_STYLES[index % len(AXIS_STYLES)] | {"linewidth": 1.3}
