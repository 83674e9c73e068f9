"""The style of all figures: one sheet, colours distinguishable in grey and for colour-blind readers, dense sampling."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, wraps
from inspect import signature
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_able
from minsnap.trajectory import Path, Samples

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
else:  # matplotlib is imported when something is drawn
    Axes = Figure = Any

P = ParamSpec("P")
R = TypeVar("R")

PATH_COLOUR = "#8a1c3b"
CORRIDOR_COLOUR = "#56b4e9"
CORRIDOR_EDGE = "#0072b2"
LIMIT_COLOUR = "#000000"
HEADING_COLOUR = "#6a3d9a"

AXIS_STYLES: tuple[dict[str, str], ...] = (
    {"color": "#0072b2", "linestyle": "-"},
    {"color": "#d55e00", "linestyle": "--"},
    {"color": "#009e73", "linestyle": "-."},
    {"color": "#cc79a7", "linestyle": ":"},
)
"""Colour and dash of each coordinate: from the palette of Okabe and Ito (Color Universal Design, 2008)."""

LIMIT_STYLE: dict[str, Any] = {"color": LIMIT_COLOUR, "linewidth": 1.0, "linestyle": (0, (5, 3))}
NORM_STYLE: dict[str, Any] = {"color": "#555555", "linestyle": ":", "linewidth": 1.2}

QUANTITIES = ("position", "velocity", "acceleration", "jerk", "snap")
"""Names of the derivatives, by order."""

CANVASES = ("ax", "plot", "Axes"), ("figure", "subfigures", "a Figure")
"""What figures are drawn on: the name of the argument, a method that it has, and its kind."""

POINTS = 1200
"""Instants at which a path is evaluated to draw it."""


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Let a function draw with the sheet of this package; matplotlib's parameters are as before when it returns."""

    @wraps(draw)
    def drawn(*arguments: P.args, **options: P.kwargs) -> R:
        from matplotlib import rc_context

        given = dict(zip(signature(draw).parameters, arguments, strict=False)) | options
        for name, method, kind in CANVASES:
            if given.get(name) is not None:
                check_able(name, given[name], method, f"{kind} of matplotlib")
        with rc_context(_sheet()):
            return draw(*arguments, **options)

    return drawn


@cache
def _sheet() -> Any:
    from matplotlib import rc_params_from_file

    return rc_params_from_file(FilePath(__file__).with_name("minsnap.mplstyle"), use_default_template=False)


def draw_curves(ax: Axes, t: FloatArray, values: Any, names: Sequence[str | None], **line: Any) -> None:
    """Draw columns of values (m, n) against time, each in the colour and dash of its number."""
    for i, (column, name) in enumerate(zip(values.T, names, strict=True)):
        style: dict[str, Any] = AXIS_STYLES[i % len(AXIS_STYLES)]
        ax.plot(t, column, label=name, **line, **style)


def legend_beside(ax: Axes, handles: Sequence[Any] | None = None) -> None:
    """Put the legend to the right of the axes, where it covers no curve.

    Parameters
    ----------
    ax : matplotlib axes
    handles : sequence of artists, optional
        What the legend names; by default all that have a name. Nothing to name gives no legend.
    """
    named = ax.get_legend_handles_labels()[0] if handles is None else handles
    if named:
        place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0.0}
        ax.legend(handles=named, handlelength=1.8, **place)


def coordinate_name(index: int, dim: int) -> str:
    """Return x, y or z, or the number of the coordinate beyond three."""
    return "xyz"[index] if dim <= 3 else f"{index}"


def unit_of(order: int) -> str:
    """Return the unit of a derivative of position, as an axis label shows it."""
    return ("m", "m/s", "m/s²", "m/s³", "m/s⁴")[order]


def dense_samples(source: Path | Samples) -> Samples:
    """Return samples unchanged, or a path evaluated densely enough to draw it."""
    return source if isinstance(source, Samples) else source.sampled(np.linspace(0.0, source.duration, POINTS))


def new_axes(projection: str | None = None, size: tuple[float, float] = (7.0, 4.8)) -> Axes:
    """Return the axes of a new figure of a size [in]."""
    from matplotlib import pyplot

    axes: Axes = pyplot.figure(figsize=size, layout="constrained").add_subplot(projection=projection)
    return axes
