"""Position and its derivatives against time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.limit_kinds import KINDS
from minsnap.errors import InputError
from minsnap.plot.style import (
    HEADING_COLOUR,
    LIMIT_STYLE,
    NORM_STYLE,
    QUANTITIES,
    coordinate_name,
    dense_samples,
    draw_curves,
    legend_beside,
    styled,
    unit_of,
)
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.axes import Axes

LIMIT_NAMES = {kind.order: kind.name for kind in KINDS if kind.measure == "norm"}
"""Limits that are lines beside a norm, by the order of the derivative."""


@styled
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
        Samples are drawn with the derivatives that they have; the acceleration with their feed-forward is drawn thin
        beside the acceleration.
    axes : sequence of matplotlib axes, optional
        One an order drawn; by default a new figure of stacked axes.
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
        If an order is not one of 0 to 4, the samples have none of them, or the axes are too few.
    """
    samples = dense_samples(path)
    drawn = available_orders(samples, orders)
    stack = _stack(axes, len(drawn), f"{len(drawn)} derivatives need as many axes")
    for ax, order in zip(stack, drawn, strict=False):
        _draw(ax, samples, order)
        limited = _draw_limit(ax, samples, order, getattr(limits, LIMIT_NAMES.get(order, ""), None))
        mark_knots(ax, path)
        legend_beside(ax, handles=None if ax is stack[0] else limited)
        ax.label_outer()
    stack[len(drawn) - 1].set_xlabel("time [s]")
    return stack


@styled
def plot_heading(path: Path | Samples, axes: npt.ArrayLike | None = None) -> npt.NDArray[Any]:
    """Draw yaw and yaw rate against time.

    Parameters
    ----------
    path : Path or Samples
        Samples without a yaw rate are drawn with their yaw alone.
    axes : sequence of matplotlib axes, optional
        One for the yaw, one for its rate; by default a new figure of stacked axes.

    Returns
    -------
    ndarray of matplotlib axes

    Raises
    ------
    InputError
        If the samples have no yaw, or the axes are too few.
    """
    samples = dense_samples(path)
    drawn = heading_rows(samples)
    if not drawn:
        raise InputError("the samples have no yaw: there is nothing to draw")
    stack = _stack(axes, len(drawn), f"yaw and yaw rate need {len(drawn)} axes")
    for ax, (name, unit, values) in zip(stack, drawn, strict=False):
        ax.plot(samples.t, values, color=HEADING_COLOUR, linewidth=1.4)
        ax.set_ylabel(f"{name}\n[{unit}]")
        mark_knots(ax, path)
        ax.label_outer()
    stack[len(drawn) - 1].set_xlabel("time [s]")
    return stack


def heading_rows(samples: Samples) -> list[tuple[str, str, FloatArray]]:
    """Return name, unit and values (m,) of yaw and yaw rate, as far as they are known."""
    known = (("yaw", "rad", samples.yaw), ("yaw rate", "rad/s", samples.yaw_rate))
    return [(name, unit, values) for name, unit, values in known if values is not None]


def available_orders(samples: Samples, orders: Sequence[int] = (0, 1, 2, 3, 4)) -> list[int]:
    """Return the requested orders that the samples have.

    Raises
    ------
    InputError
        If an order is not one of 0 to 4, or there is none.
    """
    if any(order not in range(len(QUANTITIES)) for order in orders):
        raise InputError(f"the orders are {tuple(orders)}: choose from 0 (position) to 4 (snap)")
    available = [order for order in orders if getattr(samples, QUANTITIES[order]) is not None]
    if not available:
        raise InputError("the samples have none of these derivatives")
    return available


def _stack(axes: npt.ArrayLike | None, rows: int, needed: str) -> npt.NDArray[Any]:
    """Return axes for rows of curves, new ones where there are none; what is needed is said where there are fewer."""
    if axes is None:
        from matplotlib import pyplot

        new = pyplot.subplots(rows, 1, sharex=True, layout="constrained", figsize=(7.0, 1.8 * rows), squeeze=False)
        return np.asarray(new[1][:, 0])
    stack = np.atleast_1d(np.asarray(axes, dtype=object))
    if len(stack) < rows:
        raise InputError(f"{needed}, got {len(stack)}")
    return stack


def _draw(ax: Axes, samples: Samples, order: int) -> None:
    """Draw each coordinate; then a commanded acceleration, with its feed-forward, thin and without a name."""
    names = [coordinate_name(i, samples.dim) for i in range(samples.dim)]
    draw_curves(ax, samples.t, getattr(samples, QUANTITIES[order]), names, linewidth=1.4)
    if order == 2 and samples.feed_forward is not None:
        draw_curves(ax, samples.t, samples.commanded().acceleration, [None] * samples.dim, linewidth=0.7, alpha=0.6)
    ax.set_ylabel(f"{QUANTITIES[order]}\n[{unit_of(order)}]")


def _draw_limit(ax: Axes, samples: Samples, order: int, limit: Any) -> list[Any]:
    """Draw the norm and its limit, and return both lines, if there is a limit."""
    if not isinstance(limit, (int, float)) or not np.isfinite(limit):
        return []
    norm = np.linalg.norm(getattr(samples, QUANTITIES[order]), axis=1)
    line = ax.axhline(limit, label="limit", **LIMIT_STYLE)
    return [*ax.plot(samples.t, norm, label="norm", **NORM_STYLE), line]


def mark_knots(ax: Axes, path: Path | Samples) -> None:
    """Draw a thin line at every waypoint's instant, unless there are many."""
    breaks = getattr(path, "leg_breaks", ())
    if len(breaks) <= 50:
        for instant in breaks:
            ax.axvline(instant, color="#999999", linewidth=0.6, zorder=0)
