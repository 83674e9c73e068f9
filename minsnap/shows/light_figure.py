"""The figure of lights: a row for each vehicle, in the colours that its lamp has by the second."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from minsnap.files.formats import Lights
from minsnap.plot.shown_figure import ShownFigure
from minsnap.plot.style import styled
from minsnap.shows.preview import at_once

COLUMNS = 900
"""Instants at which colours are drawn."""

ROW, LEAST, MOST = 0.12, 1.6, 4.5
"""Height of the row of one vehicle, and of the figure at least and at most [in]."""

NAMED = 0.02
"""Acts that follow within this share of the show have their names beside each other."""


@styled
def light_figure(lights: Sequence[Lights | None], duration: float, cues: Sequence[tuple[float, str]]) -> ShownFigure:
    """Draw the colours of each vehicle against time, with a line where an act is reached.

    Parameters
    ----------
    lights : sequence of Lights or None
        Of each vehicle; None is dark.
    duration : float
        [s].
    cues : sequence of (float, str)
        When each act is reached [s], and its name.
    """
    from matplotlib.ticker import MaxNLocator

    t = (np.arange(COLUMNS) + 0.5) * duration / COLUMNS
    colours = np.stack([np.zeros((COLUMNS, 3)) if lamp is None else lamp(t) for lamp in lights])
    figure = ShownFigure(figsize=(9.5, float(np.clip(ROW * len(lights) + 1.0, LEAST, MOST))), layout="constrained")
    axes = figure.subplots()
    edges = (0.0, duration, len(lights) - 0.5, -0.5)
    axes.imshow(np.round(colours).astype(np.uint8), aspect="auto", interpolation="nearest", extent=edges)
    for instant, _ in cues:
        axes.axvline(instant, color="0.6", linewidth=0.6, linestyle=":")
    for instant, name in at_once(cues, NAMED * duration):
        axes.text(instant, -0.6, name, fontsize=7, rotation=20, rotation_mode="anchor")
    axes.grid(False)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="time [s]", ylabel="vehicle")
    return figure
