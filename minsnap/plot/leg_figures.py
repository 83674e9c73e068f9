"""The use of limits leg by leg: where each binds, and how fast the flight is."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, NDArray
from minsnap.basics.checks import check_kind
from minsnap.basics.limit_kinds import KIND
from minsnap.errors import InputError
from minsnap.limits import Limits, uses_at
from minsnap.plot import style
from minsnap.trajectory import BINDING, Trajectory

MOST_NUMBERED = 30
"""Legs up to which they are numbered."""


@style.styled
def plot_limits(path: Trajectory, limits: Limits, axes: ArrayLike | None = None) -> NDArray[Any]:
    """Draw the use of each limit against time, a bar for each where it binds, and the speed; legs are numbered.

    Parameters
    ----------
    path : Trajectory
    limits : Limits
        Those that are set are drawn, and the rotors of a vehicle.
    axes : sequence of matplotlib axes, optional
        Three, one above the other; by default a new figure.

    Returns
    -------
    ndarray of matplotlib axes

    Raises
    ------
    InputError
        If the path has no legs, no limit is set, or the axes are too few.
    """
    check_kind("the path", path, Trajectory, "a Trajectory")
    if not limits.given():
        raise InputError("no limit is set: there is nothing to draw")
    t = np.linspace(0.0, path.duration, 2 * style.POINTS)
    uses = uses_at(path, limits, t)
    stack = _three(axes, len(uses))
    for number, (name, share) in enumerate(uses.items()):
        line: dict[str, Any] = style.AXIS_STYLES[number % len(style.AXIS_STYLES)]
        stack[0].plot(t, 100.0 * share, label=KIND[name].label, linewidth=1.3, **line)
        stack[1].broken_barh(_spans(t, share >= BINDING), (number - 0.36, 0.72), facecolors=line["color"])
    stack[0].axhline(100.0, **style.LIMIT_STYLE)
    stack[0].set(ylabel="share of\nthe limit [%]", ylim=(0.0, None))
    style.legend_beside(stack[0])
    stack[1].set_yticks(range(len(uses)), [KIND[name].label for name in uses])
    stack[1].set(ylabel="binds", ylim=(len(uses) - 0.5, -0.5))
    stack[2].plot(t, np.sqrt((path(t, 1) ** 2).sum(axis=1)), **style.NORM_STYLE)
    stack[2].set(xlabel="time [s]", ylabel="speed\n[m/s]", ylim=(0.0, None), xlim=(0.0, path.duration))
    _mark_legs(stack, path.leg_breaks)
    return stack


def _three(axes: ArrayLike | None, bars: int) -> NDArray[Any]:
    """Return three axes, new ones where none are given."""
    if axes is None:
        from matplotlib import pyplot

        ratios, height = [2.2, 0.25 + 0.25 * bars, 1.3], 4.2 + 0.25 * bars
        how: dict[str, Any] = {"sharex": True, "height_ratios": ratios}
        return np.asarray(pyplot.subplots(3, 1, layout="constrained", figsize=(7.4, height), **how)[1])
    stack = np.atleast_1d(np.asarray(axes, dtype=object))
    if len(stack) < 3:
        raise InputError(f"the use of limits needs 3 axes, got {len(stack)}")
    return stack


def _spans(t: FloatArray, held: NDArray[Any]) -> list[tuple[float, float]]:
    """Return beginnings and widths of the stretches of time in which something holds [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], held, [False])).astype(int))).reshape(-1, 2)
    middles = np.concatenate((t[:1], 0.5 * (t[1:] + t[:-1]), t[-1:]))
    return [(float(middles[first]), float(middles[last] - middles[first])) for first, last in edges.tolist()]


def _mark_legs(stack: NDArray[Any], breaks: FloatArray) -> None:
    """Draw a thin line at each waypoint, and number the legs above."""
    if len(breaks) - 1 > MOST_NUMBERED:
        return
    for ax in stack[:3]:
        for instant in breaks:
            ax.axvline(instant, color="#999999", linewidth=0.6, zorder=0)
    for leg, (first, last) in enumerate(zip(breaks[:-1], breaks[1:], strict=True)):
        place: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "ha": "center", "va": "bottom", "fontsize": 7}
        stack[0].annotate(str(leg), (0.5 * (first + last), 1.01), **place)
