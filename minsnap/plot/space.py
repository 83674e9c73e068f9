"""Arrowheads along a curve, and axes of equal scales that are never too flat for their labels."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.plot.style import PATH_COLOUR

FLATTEST = 0.3
"""Least side of the axes, of their longest: below it the labels of a short side would overlap."""

HEAD = 0.035
"""Length of an arrowhead, of the diagonal of the curve."""


def arrow_places(points: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return places at equal distances along a curve (m, dim), and the steps that lead there, m at most ``count``."""
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    places = np.searchsorted(travelled, travelled[-1] * (np.arange(count) + 0.5) / count)
    places = np.clip(places, 1, len(points) - 1)
    steps = points[places] - points[places - 1]
    moving = steps.any(axis=1)
    return points[places][moving], steps[moving]


def draw_heads(ax: Any, points: FloatArray, count: int) -> None:
    """Draw flat arrowheads on a curve in space."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    heads = arrow_heads(points, count)
    if len(heads):
        ax.add_collection3d(Poly3DCollection(heads, facecolor=PATH_COLOUR, edgecolor="none", zorder=4))


def arrow_heads(points: FloatArray, count: int) -> FloatArray:
    """Return triangles on a curve in space, a few hundredths of its extent long, shape (m, 3, 3)."""
    places, steps = arrow_places(points, count)
    along = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    across = np.cross(along, np.where(np.abs(along[:, 2:]) < 0.99, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]]))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    size = HEAD * float(np.linalg.norm(np.ptp(points, axis=0)))
    back, side = places - 0.5 * size * along, 0.38 * size * across
    return np.stack([places + 0.5 * size * along, back + side, back - side], axis=1)


def equal_space(ax: Any) -> None:
    """Scale all three axes equally in a box that fills the panel, with few ticks; draw the path on top."""
    from matplotlib.ticker import MaxNLocator

    ax.computed_zorder = False
    spans = widen_short_axes(ax, "xyz")
    for name, span in zip("xyz", spans, strict=True):
        axis, share = getattr(ax, f"{name}axis"), span / spans.max()
        axis.set_major_locator(MaxNLocator(2 + round(4 * share), min_n_ticks=2))
        axis.labelpad = 2.0 + 8.0 * share
        axis.pane.set_alpha(0.3)
    ax.view_init(elev=24.0 + 12.0 * (1.0 - spans[2] / spans.max()), azim=-58.0)
    ax.set_box_aspect(spans, zoom=1.0)


def widen_short_axes(ax: Any, names: str) -> FloatArray:
    """Widen the limits of short axes to a share of the longest, about their middle.

    Parameters
    ----------
    ax : matplotlib axes
    names : str
        "xy" or "xyz".

    Returns
    -------
    ndarray, shape (len(names),)
        What each axis spans.
    """
    limits = np.array([getattr(ax, f"get_{name}lim")() for name in names])
    spans = np.ptp(limits, axis=1)
    wanted = np.maximum(spans, FLATTEST * spans.max())
    for name, middle, span in zip(names, limits.mean(axis=1), wanted, strict=True):
        getattr(ax, f"set_{name}lim")(middle - span / 2.0, middle + span / 2.0)
    return np.asarray(wanted)
