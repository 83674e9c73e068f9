"""Curves coloured by their speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.messages import shown
from minsnap.errors import InputError
from minsnap.trajectory.samples import Samples

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PALETTE = "viridis"
"""Even in lightness, so that it reads in grey and for colour-blind eyes."""

SCALE = (1.02, 0.0, 0.03, 1.0)
"""Left, lower, width and height of the scale of colours, in shares of the axes: beside them whatever their shape."""


def draw_coloured(ax: Axes, samples: Samples, chosen: list[int], by: str) -> None:
    """Draw samples as segments, each in the colour of its speed, with a scale beside the axes.

    Raises
    ------
    InputError
        If it is to be coloured by anything but the speed, or the samples have no velocity.
    """
    if by != "speed":
        raise InputError(f"colour_by is {shown(by)}: a path can be coloured by 'speed'")
    if samples.velocity is None:
        raise InputError("the samples have no velocity to colour them by")
    speed = np.linalg.norm(samples.velocity, axis=1)
    points = samples.position[:, chosen]
    segments = np.stack([points[:-1], points[1:]], axis=1)
    lines = _collection(len(chosen), segments)
    lines.set_array((speed[:-1] + speed[1:]) / 2.0)
    lines.set_clim(0.0, float(speed.max()))
    space: Any = ax
    space.add_collection(lines) if len(chosen) == 2 else space.add_collection3d(lines)
    ax.update_datalim(points[:, :2])
    ax.autoscale_view()
    place: dict[str, Any] = (
        {"cax": ax.inset_axes(SCALE)} if len(chosen) == 2 else {"ax": ax, "shrink": 0.8, "pad": 0.12}
    )
    ax.figure.colorbar(lines, label="speed [m/s]", **place)


def _collection(dim: int, segments: Any) -> Any:
    how: dict[str, Any] = {"cmap": PALETTE, "linewidth": 2.6, "zorder": 3, "capstyle": "round"}
    if dim == 2:
        from matplotlib.collections import LineCollection

        return LineCollection(segments, **how)
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    return Line3DCollection(segments, **how)
