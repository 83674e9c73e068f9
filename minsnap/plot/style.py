"""Common parts of all figures: colours distinguishable in grey and for colour-blind readers, and dense sampling."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PATH_COLOUR = "#8a1c3b"
CORRIDOR_COLOUR = "#56b4e9"
CORRIDOR_EDGE = "#0072b2"
LIMIT_COLOUR = "#000000"

AXIS_STYLES: tuple[dict[str, str], ...] = (
    {"color": "#0072b2", "linestyle": "-"},
    {"color": "#d55e00", "linestyle": "--"},
    {"color": "#009e73", "linestyle": "-."},
    {"color": "#cc79a7", "linestyle": ":"},
)
"""Colour and dash of each coordinate: from the palette of Okabe and Ito (Color Universal Design, 2008)."""

NORM_STYLE: dict[str, Any] = {"color": "#555555", "linestyle": ":", "linewidth": 1.2}

QUANTITIES = ("position", "velocity", "acceleration", "jerk", "snap")
"""Names of the derivatives, by order."""

POINTS = 1200
"""Instants at which a path is evaluated to draw it."""


def coordinate_name(index: int, dim: int) -> str:
    """Return x, y or z, or the number of the coordinate beyond three."""
    return "xyz"[index] if dim <= 3 else f"{index}"


def unit_of(order: int) -> str:
    """Return the unit of a derivative of position, as an axis label shows it."""
    return ("m", "m/s", "m/s²", "m/s³", "m/s⁴")[order]


def dense_samples(source: Path | Samples) -> Samples:
    """Return samples unchanged, or a path evaluated densely enough to draw it."""
    if isinstance(source, Samples):
        return source
    t = np.linspace(0.0, source.duration, POINTS)
    motion = {quantity: source(t, order) for order, quantity in enumerate(QUANTITIES)}
    return Samples(t, **motion, yaw=source.yaw(t), yaw_rate=source.yaw(t, 1))


def new_axes(projection: str | None = None) -> Axes:
    """Return the axes of a new figure."""
    from matplotlib import pyplot

    axes: Axes = pyplot.figure(layout="constrained").add_subplot(projection=projection)
    return axes
