"""The page of compared flights: maps, error against time, each leg, and what the logs tell of vehicle and wind."""

from __future__ import annotations

import os
from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray
from minsnap.errors import MinsnapError
from minsnap.flight.tracking.flight_fit import FlightFit, fit_flight
from minsnap.flight.tracking.log_comparison import ComparedFlight
from minsnap.flight.tracking.reference_curve import position_at
from minsnap.flight.tracking.tracking_plot import plot_comparison
from minsnap.plot.page import picture, table, verdict, write_page
from minsnap.plot.style import styled
from minsnap.trajectory.samples import Samples

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SLOWS = 0.15
"""A corner is where the plan slows down by this share of its top speed and speeds up again."""

PARTS = 8
"""Parts of equal time of a plan without corners."""


def write_flight_page(
    flights: Mapping[str, ComparedFlight],
    path: str | os.PathLike[str],
    *,
    title: str = "Flights compared",
    logs: Mapping[str, str | os.PathLike[str]] | None = None,
    waypoints: npt.ArrayLike | None = None,
    clobber: bool = True,
) -> None:
    """Write the page in one atomic step.

    Parameters
    ----------
    flights : mapping of str to ComparedFlight
        In the order of time, with one plan.
    path : str or path
        An HTML file.
    title : str
    logs : mapping of str to path, optional
        Of which drag, wind and delay are fitted.
    waypoints : array_like, shape (n, dim), optional
        Where legs begin and end; by default where the plan slows down.
    clobber : bool
        False: a file that is there is an error.
    """
    import matplotlib.pyplot as plt

    drawn = [plot_comparison(flights), plot_misses(flights)]
    pictures = [picture(figure) for figure in drawn]
    for figure in drawn:
        plt.close(figure)
    fits, untold = _fitted(logs or {})
    remarks = [*untold, *(f"{name}: {remark}" for name, one in flights.items() for remark in one.remarks())]
    notes = "".join(f"<p>{escape(sentence)}.</p>" for sentence in remarks)
    legs = leg_instants(next(iter(flights.values())).reference, waypoints)
    parts = [_verdict(flights), notes, _flights(flights), *pictures, _legs(flights, legs), _fits(fits)]
    write_page(path, title, parts, clobber=clobber)


def _fitted(logs: Mapping[str, str | os.PathLike[str]]) -> tuple[dict[str, FlightFit], list[str]]:
    """Return the fits of the logs, and the reason for each log without one."""
    fits, untold = {}, []
    for name, log in logs.items():
        try:
            fits[name] = fit_flight(log)
        except MinsnapError as error:
            untold.append(f"{name} tells nothing of drag, wind and delay: {error}")
    return fits, untold


def leg_instants(plan: Samples, waypoints: npt.ArrayLike | None = None) -> FloatArray:
    """Return the instants at which legs of a plan begin and end, shape (legs + 1,) [s].

    With waypoints, where it passes nearest to each, in their order; else where it slows down, or parts of equal time.
    """
    if waypoints is not None:
        return _passages(plan, np.asarray(waypoints, dtype=np.float64))
    from scipy.signal import find_peaks

    speed = np.linalg.norm(np.gradient(plan.position, plan.t, axis=0), axis=1)
    inner = plan.t[find_peaks(-speed, prominence=SLOWS * speed.max())[0]]
    if not len(inner):
        return np.linspace(plan.t[0], plan.t[-1], PARTS + 1)
    return np.concatenate((plan.t[:1], inner, plan.t[-1:]))


def _passages(plan: Samples, waypoints: FloatArray) -> FloatArray:
    """Return the rising instants at which a plan is nearest to its waypoints in sum of squares."""
    away = ((plan.position[:, None] - waypoints[None]) ** 2).sum(axis=2)
    least, came = away[:, 0], []
    for column in away.T[1:]:
        best = np.minimum.accumulate(least)
        came.append(np.maximum.accumulate(np.where(least == best, np.arange(len(least)), 0)))
        least = best + column
    rows = [int(np.argmin(least))]
    for origin in reversed(came):
        rows.append(int(origin[rows[-1]]))
    return plan.t[rows[::-1]]


@styled
def plot_misses(flights: Mapping[str, ComparedFlight]) -> Figure:
    """Draw flights side by side from above, coloured by their distance to the plan at the same instant.

    Parameters
    ----------
    flights : mapping of str to ComparedFlight
        By the title of each.
    """
    import matplotlib.pyplot as plt

    most = max(one.comparison.max_error for one in flights.values())
    columns = min(2, len(flights))
    rows = -(-len(flights) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(9.5, 3.8 * rows), layout="constrained", squeeze=False)
    used, spare = axes.flat[: len(flights)], axes.flat[len(flights) :]
    for ax, (name, one) in zip(used, flights.items(), strict=True):
        place = position_at(one.flight, one.comparison.t)
        away = np.linalg.norm(one.comparison.error, axis=1)
        ax.plot(*one.reference.position[:, :2].T, color="0.6", linewidth=1.0)
        shown = ax.scatter(place[:, 0], place[:, 1], c=away, s=6, cmap="viridis", vmin=0.0, vmax=most)
        ax.set(title=f"{name}: {one.comparison.rmse_3d:.3f} m", xlabel="x [m]", ylabel="y [m]", aspect="equal")
    for ax in spare:
        ax.remove()
    figure.colorbar(shown, ax=list(used), label="distance to the plan [m]", shrink=0.8)
    return figure


def _verdict(flights: Mapping[str, ComparedFlight]) -> str:
    (first, before), (last, after) = (list(flights.items())[k] for k in (0, -1))
    missed = [one.comparison.rmse_3d for one in (before, after)]
    if len(flights) == 1:
        return verdict(True, f"<b>{missed[0]:.3f} m</b> from the plan (root mean square).")
    less = f"{abs(1.0 - missed[1] / missed[0]):.0%} {'less' if missed[1] <= missed[0] else 'more'}"
    words = f"from {missed[0]:.3f} m ({escape(first)}) to {missed[1]:.3f} m ({escape(last)})"
    return verdict(missed[1] <= missed[0], f"<b>{less}</b> from the plan (root mean square): {words}.")


def _flights(flights: Mapping[str, ComparedFlight]) -> str:
    columns = ["flight", "error [m]", "greatest [m]", "at [s]", "along [m]", "across [m]", "lag [s]", "less lag [m]"]
    rows = []
    for name, one in flights.items():
        comparison = one.comparison
        figures = (
            comparison.rmse_3d,
            comparison.max_error,
            comparison.worst_instant,
            comparison.along_rmse,
            comparison.across_rmse,
        )
        rows.append([name, *(f"{x:.3f}" for x in (*figures, comparison.delay, comparison.late_rmse_3d))])
    return table("Flights", columns, rows)


def _legs(flights: Mapping[str, ComparedFlight], instants: FloatArray) -> str:
    """Return root mean square and greatest distance of each leg that a flight has."""
    rows = []
    for leg, (start, end) in enumerate(zip(instants[:-1], instants[1:], strict=True)):
        cells = []
        for one in flights.values():
            inside = (one.comparison.t >= start) & (one.comparison.t <= end)
            away = np.linalg.norm(one.comparison.error[inside], axis=1)
            cells += [f"{np.sqrt(np.mean(away**2)):.3f}", f"{away.max():.3f}"] if len(away) else ["–", "–"]
        rows.append([f"{leg}: {start:.2f} to {end:.2f} s", *cells])
    columns = [f"{name}, {what} [m]" for name in flights for what in ("rms", "greatest")]
    return table("Legs", ["leg", *columns], rows)


def _fits(fits: Mapping[str, FlightFit]) -> str:
    rows = []
    for name, fit in fits.items():
        drag = [axis.linear for axis in fit.axes[:2] if axis.linear is not None]
        wind = "not told" if fit.wind is None else " and ".join(str(each) for each in fit.wind)
        delay = "not told" if fit.delay is None else str(fit.delay)
        rows.append([name, str(drag[0]) if drag else "not told", wind, delay])
    return table(
        "What the logs tell", ["flight", "drag over mass [1/s]", "wind along x and y [m/s]", "delay [s]"], rows
    )
