"""Curves against time: position and derivatives, heading, use of limits, thrust of rotors, convergence of a search."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, NDArray
from minsnap.basics.checks import check_able
from minsnap.basics.limit_kinds import KIND, KINDS
from minsnap.errors import InputError
from minsnap.limits import Limits, utilisation_curves
from minsnap.plot import style
from minsnap.plot.geometry import plot_path
from minsnap.plot.style import Axes, Figure
from minsnap.trajectory import Path, Samples, Trajectory
from minsnap.vehicle import Quadrotor, flatness_of

LIMIT_NAMES = {kind.order: kind.name for kind in KINDS if kind.measure == "norm"}
"""Limits that are lines beside a norm, by the order of the derivative."""


@style.styled
def plot_profiles(
    path: Path | Samples, axes: ArrayLike | None = None, *, orders: Sequence[int] = (0, 1, 2, 3, 4), limits: Any = None
) -> NDArray[Any]:
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
    samples = style.dense_samples(path)
    drawn = available_orders(samples, orders)
    stack = _stack(axes, path, len(drawn), f"{len(drawn)} derivatives need as many axes")
    for ax, order in zip(stack, drawn, strict=False):
        _draw(ax, samples, order)
        limited = _draw_limit(ax, samples, order, getattr(limits, LIMIT_NAMES.get(order, ""), None))
        style.legend_beside(ax, handles=None if ax is stack[0] else limited)
    return stack


@style.styled
def plot_heading(path: Path | Samples, axes: ArrayLike | None = None) -> NDArray[Any]:
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
    samples = style.dense_samples(path)
    drawn = heading_rows(samples)
    if not drawn:
        raise InputError("the samples have no yaw: there is nothing to draw")
    stack = _stack(axes, path, len(drawn), f"yaw and yaw rate need {len(drawn)} axes")
    for ax, (name, unit, values) in zip(stack, drawn, strict=False):
        ax.plot(samples.t, values, color=style.HEADING_COLOUR, linewidth=1.4)
        ax.set_ylabel(f"{name}\n[{unit}]")
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
    if any(order not in range(len(style.QUANTITIES)) for order in orders):
        raise InputError(f"the orders are {tuple(orders)}: choose from 0 (position) to 4 (snap)")
    available = [order for order in orders if getattr(samples, style.QUANTITIES[order]) is not None]
    if not available:
        raise InputError("the samples have none of these derivatives")
    return available


def _stack(axes: ArrayLike | None, path: Path | Samples, rows: int, needed: str) -> NDArray[Any]:
    """Return axes for rows of curves against time, new ones where there are none, with a thin line at each waypoint.

    What is needed is said where they are fewer; of more than 50 waypoints there are no lines.
    """
    if axes is None:
        from matplotlib import pyplot

        new = pyplot.subplots(rows, 1, sharex=True, layout="constrained", figsize=(7.0, 1.8 * rows), squeeze=False)
        stack = np.asarray(new[1][:, 0])
    else:
        flat = getattr(axes, "flat", axes)
        given = list(flat) if isinstance(flat, Iterable) else [flat]
        for ax in given:
            check_able("axes", ax, "plot", "Axes of matplotlib")
        stack = np.array(given, dtype=object)
    if len(stack) < rows:
        raise InputError(f"{needed}, got {len(stack)}")
    breaks = getattr(path, "leg_breaks", ())
    for ax in stack[:rows]:
        for instant in breaks if len(breaks) <= 50 else ():
            ax.axvline(instant, color="#999999", linewidth=0.6, zorder=0)
        ax.label_outer()
    stack[rows - 1].set_xlabel("time [s]")
    return stack


def _draw(ax: Axes, samples: Samples, order: int) -> None:
    """Draw each coordinate; then a commanded acceleration, with its feed-forward, thin and without a name."""
    names = [style.coordinate_name(i, samples.dim) for i in range(samples.dim)]
    style.draw_curves(ax, samples.t, getattr(samples, style.QUANTITIES[order]), names, linewidth=1.4)
    if order == 2 and samples.feed_forward is not None:
        pushed = samples.commanded().acceleration
        style.draw_curves(ax, samples.t, pushed, [None] * samples.dim, linewidth=0.7, alpha=0.6)
    ax.set_ylabel(f"{style.QUANTITIES[order]}\n[{style.unit_of(order)}]")


def _draw_limit(ax: Axes, samples: Samples, order: int, limit: Any) -> list[Any]:
    """Draw the norm and its limit, and return both lines, if there is a limit."""
    if not isinstance(limit, (int, float)) or not np.isfinite(limit):
        return []
    norm = np.linalg.norm(getattr(samples, style.QUANTITIES[order]), axis=1)
    line = ax.axhline(limit, label="limit", **style.LIMIT_STYLE)
    return [*ax.plot(samples.t, norm, label="norm", **style.NORM_STYLE), line]


WIDTHS = (1.6, 1.6, 1.6, 1.6, 0.9, 0.9, 0.9, 0.9)


@style.styled
def plot_utilisation(path: Path | Samples, limits: Limits, ax: Axes | None = None) -> Axes:
    """Draw the utilisation of each limit, value over limit, against time, in percent.

    Parameters
    ----------
    path : Path or Samples
        With the derivatives that the limits bound; three coordinates for vertical and vehicle limits.
    limits : Limits
        Those that are set are drawn.
    ax : matplotlib axes, optional
        Where to draw; by default a new figure.


    Raises
    ------
    InputError
        If no limit is set, or the samples lack a derivative that one bounds.
    """
    samples = style.dense_samples(path)
    if isinstance(path, Path) and path.yaw.medium is not None:
        samples = replace(samples, yaw_rate=np.zeros(len(samples)))  # the spin about the thrust axis, which is limited
    curves = utilisation_curves(samples, limits)
    axes = style.new_axes() if ax is None else ax
    for i, (name, share) in enumerate(curves.items()):
        line: dict[str, Any] = style.AXIS_STYLES[i % len(style.AXIS_STYLES)]
        axes.plot(samples.t, 100.0 * share, label=KIND[name].label, linewidth=WIDTHS[i % len(WIDTHS)], **line)
    axes.axhline(100.0, **style.LIMIT_STYLE)
    axes.set(xlabel="time [s]", ylabel="share of\nthe limit [%]", ylim=(0.0, None))
    style.legend_beside(axes)
    return axes


@style.styled
def plot_convergence(trajectory: Trajectory, ax: Axes | None = None) -> Axes:
    """Draw the convergence of the search for durations: the best value so far after every evaluated plan.

    Values far worse than the first guess are outside the figure.

    Parameters
    ----------
    trajectory : Trajectory
        With a report of a search: planned with limits, a total time split optimally, or a price of time.
    ax : matplotlib axes, optional
        Where to draw; by default a new figure.


    Raises
    ------
    InputError
        If the trajectory was planned without a search.
    """
    steps = trajectory.report.steps if trajectory.report else ()
    if not steps:
        raise InputError("the durations of this trajectory were not searched: there is nothing to draw")
    axes = style.new_axes() if ax is None else ax
    tried = [step.evaluation for step in steps]
    first_colour, second_colour = (style.AXIS_STYLES[k]["color"] for k in (0, 1))
    axes.plot(tried, [step.value for step in steps], ".", color=second_colour, markersize=4, label="tried")
    axes.plot(tried, [step.best for step in steps], color=first_colour, label="best so far")
    least, first = min(step.best for step in steps), steps[0].best
    shown = (least - 0.05 * (first - least) - 1e-3 * least, first + 0.3 * (first - least) + 1e-3 * least)
    what = "total time [s]" if any(step.value == step.total_time for step in steps) else "cost [m²/s⁷]"
    axes.set(xlabel="plans tried", ylabel=what, ylim=shown)
    style.legend_beside(axes)
    return axes


@style.styled
def plot_rotors(path: Path, vehicle: Quadrotor, ax: Axes | None = None) -> Axes:
    """Draw the thrust of every rotor along a path against time, and its limits.

    Parameters
    ----------
    path : Path
        dim 2 or 3; with its heading; with the drag that ``Limits.of`` includes.
    vehicle : Quadrotor
    ax : matplotlib axes, optional
        Where to draw; by default a new figure.
    """
    if path.dim not in (2, 3):
        raise InputError(f"rotors need a path of two or three coordinates, this one has {path.dim}")
    axes = style.new_axes() if ax is None else ax
    t = np.linspace(0.0, path.duration, 3 * style.POINTS)
    thrusts = vehicle.thrusts(flatness_of(vehicle, path, t, drag=vehicle.flat_drag).rotor_speed)
    style.draw_curves(axes, t, thrusts, [f"rotor {number}" for number in (1, 2, 3, 4)], linewidth=1.1)
    for number, limit in enumerate(vehicle.rotor_thrust_limits):
        axes.axhline(limit, label=None if number else "limits", **style.LIMIT_STYLE)
    axes.set(xlabel="time [s]", ylabel="thrust [N]", xlim=(0.0, path.duration))
    style.legend_beside(axes)
    return axes


@style.styled
def plot_race(
    path: Path, vehicle: Quadrotor, figure: Figure | None = None, *, view: str = "xy", title: str = "", **drawn: Any
) -> Figure:
    """Draw a path coloured by its speed, and the thrust of every rotor below.

    Parameters
    ----------
    path : Path
        dim 2 or 3.
    vehicle : Quadrotor
    figure : matplotlib Figure, optional
        Where to draw; by default a new one, that no window shows.
    view : str
        As :func:`plot_path` takes it.
    title : str, optional
        Written above.
    **drawn
        What else :func:`plot_path` takes.
    """
    from minsnap.plot.shown_figure import ShownFigure

    whole = ShownFigure(figsize=(9.0, 9.0), layout="constrained") if figure is None else figure
    above, below = np.asarray(whole.subfigures(2, 1, height_ratios=(2.4, 1.0)))
    plane = above.add_subplot(projection="3d" if view == "3d" else None)
    plot_path(path, plane, view=view, colour_by="speed", **drawn)
    plot_rotors(path, vehicle, below.add_subplot())
    if title:
        whole.suptitle(title)
    return whole
