"""Position and its derivatives against time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.errors import InputError
from minsnap.limits.kinds import KINDS
from minsnap.plot.style import (
    AXIS_STYLES,
    LIMIT_COLOUR,
    NORM_STYLE,
    QUANTITIES,
    coordinate_name,
    dense_samples,
    unit_of,
)
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.axes import Axes

LIMIT_NAMES = {kind.order: kind.name for kind in KINDS if kind.measure == "norm"}
"""Limits that are lines beside a norm, by the order of the derivative."""


def plot_profiles(
    path: Path | Samples,
    axes: npt.ArrayLike | None = None,
    *,
    orders: Sequence[int] = (0, 1, 2, 3, 4),
    limits: Any = None,
) -> npt.NDArray[Any]:
    """Draw each coordinate of position, velocity, acceleration, jerk and snap against time.

    Parameters
    ----------
    path : Path or Samples
        Samples are drawn with the derivatives that they have.
    axes : sequence of matplotlib axes, optional
        One an order drawn; a new figure of stacked axes unless given.
    orders : sequence of int
        Which derivatives, 0 to 4.
    limits : Limits, optional
        Its speed, acceleration, jerk and snap are drawn as lines, with the Euclidean norm that they bound.

    Returns
    -------
    ndarray of matplotlib axes

    Raises
    ------
    InputError
        If an order is not one of 0 to 4, the samples have none of those asked for, or the axes are too few.
    """
    samples = dense_samples(path)
    drawn = available_orders(samples, orders)
    stack = _stack(len(drawn)) if axes is None else np.atleast_1d(np.asarray(axes, dtype=object))
    if len(stack) < len(drawn):
        raise InputError(f"{len(drawn)} derivatives need as many axes, got {len(stack)}")
    for ax, order in zip(stack, drawn, strict=False):
        _draw(ax, samples, order)
        _draw_limit(ax, samples, order, getattr(limits, LIMIT_NAMES.get(order, ""), None))
        _mark_knots(ax, path)
        ax.label_outer()
    above: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.1, "frameon": False}
    stack[0].legend(ncols=samples.dim, fontsize="small", **above)
    stack[len(drawn) - 1].set_xlabel("time [s]")
    return stack


def available_orders(samples: Samples, orders: Sequence[int] = (0, 1, 2, 3, 4)) -> list[int]:
    """Return the requested orders that the samples have.

    Raises
    ------
    InputError
        If an order is not one of 0 to 4, or there is none.
    """
    if any(order not in range(len(QUANTITIES)) for order in orders):
        raise InputError(f"the orders are {tuple(orders)}: choose from 0 (position) to 4 (snap)")
    found = [order for order in orders if getattr(samples, QUANTITIES[order]) is not None]
    if not found:
        raise InputError("the samples have none of the derivatives asked for")
    return found


def _stack(rows: int) -> npt.NDArray[Any]:
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(rows, 1, sharex=True, layout="constrained", figsize=(7.0, 1.8 * rows), squeeze=False)
    return np.asarray(axes[:, 0])


def _draw(ax: Axes, samples: Samples, order: int) -> None:
    values: FloatArray = getattr(samples, QUANTITIES[order])
    for i in range(samples.dim):
        style: dict[str, Any] = AXIS_STYLES[i % len(AXIS_STYLES)]
        ax.plot(samples.t, values[:, i], label=coordinate_name(i, samples.dim), linewidth=1.4, **style)
    ax.set_ylabel(f"{QUANTITIES[order]} [{unit_of(order)}]")
    ax.grid(True, alpha=0.3)


def _draw_limit(ax: Axes, samples: Samples, order: int, limit: Any) -> None:
    """Draw the norm and its limit, if there is a limit."""
    if not isinstance(limit, (int, float)) or not np.isfinite(limit):
        return
    norm = np.linalg.norm(getattr(samples, QUANTITIES[order]), axis=1)
    lines = ax.plot(samples.t, norm, label="norm", **NORM_STYLE)
    lines.append(ax.axhline(limit, color=LIMIT_COLOUR, linewidth=1.0, linestyle=(0, (5, 3)), label="limit"))
    if order:
        ax.legend(handles=lines, loc="lower right", ncols=2, fontsize="x-small", framealpha=0.9)


def _mark_knots(ax: Axes, path: Path | Samples) -> None:
    breaks = getattr(path, "leg_breaks", ())
    if len(breaks) <= 50:
        for instant in breaks:
            ax.axvline(instant, color="#999999", linewidth=0.6, zorder=0)
