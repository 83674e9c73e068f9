"""Utilisation of the limits against time, and convergence of the search for durations."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.limit_kinds import KIND, Kind
from minsnap.errors import InputError
from minsnap.limits.limits import Limits
from minsnap.limits.measures import MEASURES, Motion, sampled_motion
from minsnap.plot.style import AXIS_STYLES, LIMIT_STYLE, dense_samples, legend_beside, new_axes, styled
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from minsnap.trajectory.trajectory import Trajectory

WIDTHS = (1.6, 1.6, 1.6, 1.6, 0.9, 0.9, 0.9, 0.9)


@styled
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

    Returns
    -------
    matplotlib axes

    Raises
    ------
    InputError
        If no limit is set, or the samples lack a derivative that one bounds.
    """
    samples = dense_samples(path)
    if isinstance(path, Path) and path.yaw.medium is not None:
        samples = replace(samples, yaw_rate=np.zeros(len(samples)))  # the spin about the thrust axis, which is limited
    curves = utilisation_curves(samples, limits)
    axes = new_axes() if ax is None else ax
    for i, (name, share) in enumerate(curves.items()):
        style: dict[str, Any] = AXIS_STYLES[i % len(AXIS_STYLES)]
        axes.plot(samples.t, 100.0 * share, label=KIND[name].label, linewidth=WIDTHS[i % len(WIDTHS)], **style)
    axes.axhline(100.0, **LIMIT_STYLE)
    axes.set(xlabel="time [s]", ylabel="share of\nthe limit [%]", ylim=(0.0, None))
    legend_beside(axes)
    return axes


def utilisation_curves(samples: Samples, limits: Limits) -> dict[str, FloatArray]:
    """Return the utilisation of each limit at every sample, shape (m,), 1 at the limit; by the limit's name.

    Raises
    ------
    InputError
        If no limit is set, or the samples lack what one bounds.
    """
    bounds = limits.given()
    if not bounds:
        raise InputError("no limit is set: there is nothing to draw")
    motion = sampled_motion(samples, limits.norm, limits.medium)
    try:
        values = {name: _values(KIND[name], samples, motion) for name in bounds}
    except (TypeError, IndexError):
        raise InputError(f"the samples lack a derivative or a coordinate that {', '.join(bounds)} need") from None
    return {name: bounds[name] / value if KIND[name].least else value / bounds[name] for name, value in values.items()}


def _values(kind: Kind, samples: Samples, motion: Motion) -> FloatArray:
    """Return the quantity that a limit bounds at every sample, shape (m,)."""
    if kind.measure != "yaw_rate":
        return MEASURES[kind.measure].sampled(motion, kind.order)
    if samples.yaw_rate is None:
        raise TypeError("samples without a yaw rate")
    return np.abs(samples.yaw_rate)


@styled
def plot_convergence(trajectory: Trajectory, ax: Axes | None = None) -> Axes:
    """Draw the convergence of the search for durations: the best value so far after every evaluated plan.

    Values far worse than the first guess are outside the figure.

    Parameters
    ----------
    trajectory : Trajectory
        With a report of a search: planned with limits, a total time split optimally, or a price of time.
    ax : matplotlib axes, optional
        Where to draw; by default a new figure.

    Returns
    -------
    matplotlib axes

    Raises
    ------
    InputError
        If the trajectory was planned without a search.
    """
    steps = trajectory.report.steps if trajectory.report else ()
    if not steps:
        raise InputError("the durations of this trajectory were not searched: there is nothing to draw")
    axes = new_axes() if ax is None else ax
    tried = [step.evaluation for step in steps]
    axes.plot(tried, [step.value for step in steps], ".", color=AXIS_STYLES[1]["color"], markersize=4, label="tried")
    axes.plot(tried, [step.best for step in steps], color=AXIS_STYLES[0]["color"], label="best so far")
    least, first = min(step.best for step in steps), steps[0].best
    shown = (least - 0.05 * (first - least) - 1e-3 * least, first + 0.3 * (first - least) + 1e-3 * least)
    what = "total time [s]" if any(step.value == step.total_time for step in steps) else "cost [m²/s⁷]"
    axes.set(xlabel="plans tried", ylabel=what, ylim=shown)
    legend_beside(axes)
    return axes
