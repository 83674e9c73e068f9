"""Figures of flights beside their reference, and of what a flight tells of drag."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.flight.tracking.flight_fit import FELT, FlightFit
from minsnap.flight.tracking.log_comparison import ComparedFlight
from minsnap.plot.geometry import finish_place, view_coordinates
from minsnap.plot.style import AXIS_STYLES, coordinate_name, legend_beside, styled, unit_of
from minsnap.trajectory.samples import Samples

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Pairs = Mapping[str, tuple[Samples, Samples]]
"""What was to be flown and what was, by the name of the flight."""


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
    pairs = {name: (reference, flight) for name, flight in flights.items()}
    figure, rows = _panels(pairs, view, 4, (11.0, 6.5), "reference")
    for row, ax in enumerate(rows):
        order, axis = divmod(row, 2)
        _draw(ax, pairs, _against_time(order, axis))
        ax.set_ylabel(f"${'v_' * order}{coordinate_name(axis, reference.dim)}$ [{unit_of(order)}]")
    if title:
        figure.suptitle(title)
    return figure


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
    pairs = {name: (one.reference, one.flight) for name, one in flights.items()}
    dim = next(iter(flights.values())).reference.dim
    figure, rows = _panels(pairs, view, dim + 1, (11.5, 2.0 + 1.6 * (dim + 1)), "to be flown")
    for axis, ax in enumerate(rows[:-1]):
        _draw(ax, pairs, _against_time(0, axis))
        ax.set_ylabel(f"{coordinate_name(axis, dim)} [m]")
    _draw_error(rows[-1], flights)
    return figure


def _panels(pairs: Pairs, view: str, rows: int, size: tuple[float, float], wanted: str) -> tuple[Figure, list[Axes]]:
    """Draw the curves in a view, at equal scales, and return the figure with panels against time to the right."""
    from minsnap.plot.shown_figure import ShownFigure

    dim = next(iter(pairs.values()))[0].dim
    chosen = view_coordinates(view, dim)
    figure = ShownFigure(figsize=size, layout="constrained")
    grid = figure.add_gridspec(rows, 2, width_ratios=(1.0, 1.3))
    plane = figure.add_subplot(grid[:, 0], projection="3d" if len(chosen) == 3 else None)
    _draw(plane, pairs, lambda samples: tuple(samples.position[:, chosen].T), wanted)
    finish_place(plane, chosen, dim)
    panels = [figure.add_subplot(grid[row, 1]) for row in range(rows)]
    for ax in panels:
        ax.sharex(panels[-1])
        ax.tick_params(labelbottom=ax is panels[-1])
    panels[-1].set_xlabel("time [s]")
    figure.legend(*plane.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure, panels


def _draw(ax: Axes, pairs: Pairs, line: Callable[[Samples], tuple[FloatArray, ...]], wanted: str = "") -> None:
    """Draw the flights, then each of their references once."""
    for index, (name, (_, flight)) in enumerate(pairs.items()):
        ax.plot(*line(flight), label=name, **_style(index))
    for index, reference in enumerate({id(reference): reference for reference, _ in pairs.values()}.values()):
        ax.plot(*line(reference), label=None if index else wanted, color="#000000", linewidth=1.0)


def _style(index: int) -> dict[str, Any]:
    return dict(AXIS_STYLES[index % len(AXIS_STYLES)])


def _against_time(order: int, axis: int) -> Callable[[Samples], tuple[FloatArray, ...]]:
    """Return position or velocity along an axis with its instants; no line where there is no velocity."""

    def line(samples: Samples) -> tuple[FloatArray, ...]:
        values = samples.velocity if order else samples.position
        if values is None and len(samples) > 1:
            values = np.gradient(samples.position, samples.t, axis=0)
        return () if values is None else (samples.t, values[:, axis])

    return line


def _draw_error(ax: Axes, flights: Mapping[str, ComparedFlight]) -> None:
    """Draw the error along the path (full lines) and across it (dotted), where the reference moves."""
    for index, one in enumerate(flights.values()):
        comparison, colour = one.comparison, _style(index)["color"]
        rests = ~comparison.direction.any(axis=1)
        for name, error, dash in (("along", comparison.along, "-"), ("across", comparison.across, ":")):
            shown = np.where(rests, np.nan, error)
            ax.plot(comparison.t, shown, color=colour, linestyle=dash, label=None if index else name)
    ax.set_ylabel("error [m]")
    legend_beside(ax)


MOST_POINTS = 4000
"""Points that are drawn for each axis."""


def plot_flight_fit(fit: FlightFit) -> Figure:
    """Draw what acted on the vehicle against its speed, and the fit through it.

    Parameters
    ----------
    fit : FlightFit

    Returns
    -------
    matplotlib.figure.Figure
        One panel per axis.
    """
    from matplotlib import pyplot

    count = fit.speed.shape[1]
    figure, panels = pyplot.subplots(1, count, figsize=(1.0 + 3.6 * count, 3.6), layout="constrained", squeeze=False)
    where = "body" if fit.source == FELT else "world"
    step = max(1, len(fit.speed) // MOST_POINTS)
    for k, (ax, colours) in enumerate(zip(panels[0], AXIS_STYLES, strict=False)):
        order = np.argsort(fit.speed[:, k])
        known = fit.axes[k].linear is not None
        ax.plot(fit.speed[::step, k], fit.force[::step, k], ".", markersize=2, color=colours["color"], alpha=0.3)
        if known:
            ax.plot(fit.speed[order, k], fit.model[order, k], color="#000000", linewidth=1.2)
        ax.set(xlabel=f"speed along {coordinate_name(k, 3)} of the {where} [m/s]", title="" if known else "not told")
        ax.grid(alpha=0.3)
    panels[0][0].set_ylabel("drag per mass [m/s²]")
    return figure
