"""The figure of a fit to a flight: force per mass against the speed along each axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from minsnap.flight.tracking.flight_fit import FELT, FlightFit
from minsnap.plot.style import AXIS_STYLES, coordinate_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_POINTS = 4000
"""Points that are drawn for each axis."""


def plot_flight_fit(fit: FlightFit) -> Figure:
    """Draw what acted on the vehicle against its speed, and the fit through it.

    Parameters
    ----------
    found : FlightFit

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
