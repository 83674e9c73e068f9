"""Complete figures: the path with its profiles; atomic saving of a figure."""

from __future__ import annotations

import os
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from minsnap.errors import FileError
from minsnap.plot.geometry import plot_path
from minsnap.plot.outlines import Corridor
from minsnap.plot.profiles import available_orders, plot_profiles
from minsnap.plot.style import dense_samples
from minsnap.storage.atomic import atomic_write
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS: dict[str, dict[str, None]] = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
"""Endings of figures, with the metadata left out so that equal figures are equal files."""


def plot_overview(
    path: Path | Samples,
    figure: Figure | None = None,
    *,
    view: str = "xy",
    corridor: Corridor | None = None,
    waypoints: npt.ArrayLike | None = None,
    limits: Any = None,
    title: str | None = None,
) -> Figure:
    """Draw a path, and its position and derivatives against time.

    Parameters
    ----------
    path : Path or Samples
        dim 2 or 3.
    figure : matplotlib Figure, optional
        Where to draw; a new one, that no window shows, unless given.
    view, corridor, waypoints
        As :func:`plot_path` takes them.
    limits
        As :func:`plot_profiles` takes them.
    title : str, optional
        Written above.

    Returns
    -------
    matplotlib Figure
    """
    from minsnap.plot.shown_figure import ShownFigure

    samples = dense_samples(path)
    orders = available_orders(samples)
    drawn = ShownFigure(figsize=(13.0, max(4.5, 1.5 * len(orders))), layout="constrained") if figure is None else figure
    left, right = np.asarray(drawn.subfigures(1, 2, width_ratios=(1.15, 1.0)))
    plane = left.add_subplot(projection="3d" if view == "3d" else None)
    plot_path(path, plane, view=view, corridor=corridor, waypoints=waypoints)
    stack = right.subplots(len(orders), 1, sharex=True, squeeze=False)[:, 0]
    plot_profiles(path, stack, orders=orders, limits=limits)
    right.align_ylabels(stack)
    if title:
        drawn.suptitle(title)
    return drawn


def save_figure(figure: Figure, path: str | os.PathLike[str], *, clobber: bool = True) -> None:
    """Write a figure as PNG, SVG or PDF, by the ending of its name, in one atomic step.

    Raises
    ------
    FileError
        If the ending is another, or the destination cannot be written.
    """
    suffix = check_figure_name(path)
    with atomic_write(path, "wb", clobber=clobber) as file:
        figure.savefig(file, format=suffix[1:], dpi=150, metadata=FORMATS[suffix])


def check_figure_name(path: str | os.PathLike[str]) -> str:
    """Return the ending of a figure's name in lower case, or raise FileError if it is not supported."""
    suffix = FilePath(path).suffix.lower()
    if suffix not in FORMATS:
        raise FileError(f"{path} does not end in {', '.join(FORMATS)}: a figure is written as one of these")
    return suffix
