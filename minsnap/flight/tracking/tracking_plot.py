"""Figures and a page of flights beside their reference, and of what a flight tells of drag."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.basics.storage.text import FileName
from minsnap.corridors import Avoided, without_gates
from minsnap.errors import InputError, MinsnapError
from minsnap.files import PlanFile, find_flown_margins
from minsnap.flight.tracking.comparison import position_at
from minsnap.flight.tracking.flight_fit import FELT, FlightFit, fit_flight, told
from minsnap.flight.tracking.flown_tube import FlownTube
from minsnap.flight.tracking.log_comparison import ComparedFlight
from minsnap.plot.figures import picture, table, verdict, write_page
from minsnap.plot.geometry import draw_surroundings, finish_place, view_coordinates
from minsnap.plot.style import AXIS_STYLES, Axes, Figure, coordinate_name, legend_beside, styled, unit_of
from minsnap.trajectory import Samples, gaps

Pairs = Mapping[str, tuple[Samples, Samples]]
"""What was to be flown and what was, by the name of the flight."""


@styled
def plot_tracking(reference: Samples, flights: Mapping[str, Samples], title: str = "", view: str = "xy") -> Figure:
    """Draw flights and their reference: from above, and x and y of position and velocity against time.

    All panels are in one figure.

    Parameters
    ----------
    reference : Samples
        What was to be flown.
    flights : mapping of str to Samples
        What was flown, by the name that the legend shows.
    title : str
        Above the figure.
    view : str
        ``"xy"``, ``"xz"``, ``"yz"`` or ``"3d"``.

    Returns
    -------
    matplotlib.figure.Figure
    """
    pairs = {name: (reference, flight) for name, flight in flights.items()}
    figure, rows = _panels(pairs, view, 4, (11.0, 6.5), "reference")
    for row, ax in enumerate(rows):
        order, axis = divmod(row, 2)
        _draw(ax, pairs, _against_time(order, axis))
        ax.set_ylabel(f"${'v_' * order}{coordinate_name(axis, reference.dim)}$ [{unit_of(order)}]")
    if title:
        figure.suptitle(title)
    return figure


@styled
def plot_comparison(
    flights: Mapping[str, ComparedFlight],
    view: str = "xy",
    *,
    corridor: Any = None,
    waypoints: Any = None,
    avoid: Sequence[Avoided] = (),
    tubes: Mapping[str, FlownTube] | None = None,
) -> Figure:
    """Draw flights and their reference, with the tracking errors against time.

    Parameters
    ----------
    flights : mapping of str to ComparedFlight
        By the name that the legend shows.
    view : str
        ``"xy"``, ``"xz"``, ``"yz"`` or ``"3d"``.
    corridor, waypoints, avoid
        Of the plan that was to be flown, as :func:`minsnap.plot.plot_path` takes them; a corridor needs waypoints.
    tubes : mapping of str to FlownTube, optional
        Of the flights of these names: where the vehicle could be, drawn around where its loop flies in still air.

    Returns
    -------
    matplotlib.figure.Figure
    """
    pairs = {name: (one.reference, one.flight) for name, one in flights.items()}
    reference = next(iter(flights.values())).reference
    dim = reference.dim
    points, gates = (None, {}) if waypoints is None else without_gates(waypoints)
    kept = corridor, None if points is None else np.asarray(points, dtype=np.float64), gates, avoid
    chosen = view_coordinates(view, dim)

    def around(ax: Axes) -> None:
        draw_surroundings(ax, places=reference.position, chosen=chosen, kept=kept)
        for index, tube in enumerate((tubes or {}).values()):
            if len(chosen) == 2 and np.isfinite(tube.reach):
                _draw_tube(ax, tube.expected[:, chosen], tube.reach, None if index else "tube")

    figure, rows = _panels(pairs, view, dim + 1, (11.5, 2.0 + 1.8 * dim), "to be flown", around, below=True)
    for axis, ax in enumerate(rows[:-1]):
        _draw(ax, pairs, _against_time(0, axis))
        ax.set_ylabel(f"{coordinate_name(axis, dim)} [m]")
    _draw_error(rows[-1], flights)
    for index, tube in enumerate((tubes or {}).values()):
        if np.isfinite(tube.tube.error):
            for side in (-1.0, 1.0):
                rows[-1].axhline(side * tube.tube.error, color=_style(index)["color"], linestyle="--", linewidth=0.8)
    return figure


def _draw_tube(ax: Axes, places: FloatArray, reach: float, label: str | None) -> None:
    """Draw a band of half-width ``reach`` around places (m, 2): a disk around each of some of them."""
    from matplotlib.collections import EllipseCollection

    step = np.linalg.norm(np.diff(places, axis=0, prepend=places[:1]), axis=1).cumsum()
    some = places[np.unique(np.searchsorted(step, np.arange(0.0, step[-1] + 1e-9, 0.1 * reach + 1e-9)))[:-1]]
    size = np.full(len(some), 2.0 * reach)
    disks = EllipseCollection(size, size, np.zeros(len(some)), offsets=some, units="xy", transOffset=ax.transData)
    disks.set(facecolor="#d9e6d3", edgecolor="none", zorder=0.5)
    ax.add_collection(disks)
    ax.update_datalim(np.concatenate((some - reach, some + reach)))
    ax.plot([], [], color="#d9e6d3", linewidth=8.0, label=label)  # legends know no disks


def _panels(
    pairs: Pairs,
    view: str,
    rows: int,
    size: tuple[float, float],
    wanted: str,
    around: Callable[[Axes], None] = lambda ax: None,
    below: bool = False,
) -> tuple[Figure, list[Axes]]:
    """Draw the curves in a view, at equal scales, and return the figure with panels against time to the right.

    ``around`` draws first what is around them; with ``below`` the last panel is below the view.
    """
    from minsnap.plot.shown_figure import ShownFigure

    if not pairs:
        raise InputError("there are no flights to draw: give at least one")
    dim = next(iter(pairs.values()))[0].dim
    chosen = view_coordinates(view, dim)
    figure = ShownFigure(figsize=size, layout="constrained")
    beside = rows - 1 if below else rows
    grid = figure.add_gridspec(beside, 2, width_ratios=(1.0, 1.3))
    place = grid[:-1, 0] if below else grid[:, 0]
    plane = figure.add_subplot(place, projection="3d" if len(chosen) == 3 else None)
    around(plane)
    _draw(plane, pairs, lambda samples: tuple(samples.position[:, chosen].T), wanted)
    finish_place(plane, chosen, dim)
    panels = [figure.add_subplot(grid[row, 1]) for row in range(beside)]
    lowest = panels[-1:]
    if below:
        panels.append(figure.add_subplot(grid[-1, 0]))
        lowest.append(panels[-1])
    for ax in panels:
        ax.sharex(panels[-1])
        ax.tick_params(labelbottom=ax in lowest)
    for ax in lowest:
        ax.set_xlabel("time [s]")
    figure.legend(*plane.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure, panels


def _draw(ax: Axes, pairs: Pairs, line: Callable[[Samples], tuple[FloatArray, ...]], wanted: str = "") -> None:
    """Draw the flights, then each of their references once."""
    for index, (name, (_, flight)) in enumerate(pairs.items()):
        ax.plot(*_parted(flight.t, line(flight)), label=name, **_style(index))
    for index, reference in enumerate({id(reference): reference for reference, _ in pairs.values()}.values()):
        parts = _parted(reference.t, line(reference))
        ax.plot(*parts, label=None if index else wanted, color="#000000", linewidth=1.0)


def _parted(t: FloatArray, line: Iterable[FloatArray]) -> list[FloatArray]:
    """Break a line where samples are missing between instants (m,)."""
    after = np.searchsorted(t, gaps(t)[:, 1])
    return [np.insert(values, after, np.nan) for values in line]


def _style(index: int) -> dict[str, Any]:
    return dict(AXIS_STYLES[index % len(AXIS_STYLES)])


def _against_time(order: int, axis: int) -> Callable[[Samples], tuple[FloatArray, ...]]:
    """Return position or velocity along an axis with its instants; no line where there is no velocity."""

    def line(samples: Samples) -> tuple[FloatArray, ...]:
        values = samples.velocity if order else samples.position
        if values is None and len(samples) > 1:
            values = np.gradient(samples.position, samples.t, axis=0)
        return () if values is None else (samples.t, values[:, axis])

    return line


def _draw_error(ax: Axes, flights: Mapping[str, ComparedFlight]) -> None:
    """Draw the error along the path (full lines) and across it (dotted), where the reference moves."""
    for index, one in enumerate(flights.values()):
        comparison, colour = one.comparison, _style(index)["color"]
        rests = ~comparison.direction.any(axis=1)
        for name, error, dash in (("along", comparison.along, "-"), ("across", comparison.across, ":")):
            shown = _parted(comparison.t, (comparison.t, np.where(rests, np.nan, error)))
            ax.plot(*shown, color=colour, linestyle=dash, label=None if index else name)
    ax.set_ylabel("error [m]")
    legend_beside(ax)


MOST_POINTS = 4000
"""Points that are drawn for each axis."""


def plot_flight_fit(fit: FlightFit) -> Figure:
    """Draw what acted on the vehicle against its speed, and the fit through it.

    Parameters
    ----------
    fit : FlightFit

    Returns
    -------
    matplotlib.figure.Figure
        One panel per axis.
    """
    from matplotlib import pyplot

    count = fit.speed.shape[1]
    figure, panels = pyplot.subplots(1, count, figsize=(1.0 + 3.6 * count, 3.6), layout="constrained", squeeze=False)
    where = "body" if fit.source == FELT else "world"
    step = max(1, len(fit.speed) // MOST_POINTS)
    for k, (ax, colours) in enumerate(zip(panels[0], AXIS_STYLES, strict=False)):
        order = np.argsort(fit.speed[:, k])
        known = fit.axes[k].linear is not None
        ax.plot(fit.speed[::step, k], fit.force[::step, k], ".", markersize=2, color=colours["color"], alpha=0.3)
        if known:
            ax.plot(fit.speed[order, k], fit.model[order, k], color="#000000", linewidth=1.2)
        ax.set(xlabel=f"speed along {coordinate_name(k, 3)} of the {where} [m/s]", title="" if known else "not told")
        ax.grid(alpha=0.3)
    panels[0][0].set_ylabel("drag per mass [m/s²]")
    return figure


SLOWS = 0.15
"""A corner is where the plan slows down by this share of its top speed and speeds up again."""

PARTS = 8
"""Parts of equal time of a plan without corners."""


def write_flight_page(
    flights: Mapping[str, ComparedFlight],
    path: FileName,
    *,
    title: str = "Flights compared",
    logs: Mapping[str, FileName] | None = None,
    waypoints: ArrayLike | None = None,
    tubes: Mapping[str, FlownTube] | None = None,
    plan: PlanFile | None = None,
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
        Where legs begin and end; by default where those of ``plan`` do, or where it slows down.
    tubes : mapping of str to FlownTube, optional
        Of the flights of these names, for the figure and the remarks.
    plan : PlanFile, optional
        What was to be flown, with its laps, gates, corridor and obstacles.
    clobber : bool
        False: a file that is there is an error.
    """
    around = {} if plan is None else {name: part for name, part in plan.drawn.items() if name != "tolerance"}
    pictures = [picture(plot_comparison(flights, tubes=tubes, **around)), picture(plot_misses(flights))]
    fits, untold = _fitted(logs or {})
    remarks = [*untold, *(f"{name}: {remark}" for name, one in flights.items() for remark in one.remarks())]
    remarks += [f"{name}: {tube.sentence}" for name, tube in (tubes or {}).items()]
    notes = "".join(f"<p>{escape(sentence)}.</p>" for sentence in remarks)
    if plan is not None and waypoints is None:
        legs = plan.trajectory.leg_breaks
    else:
        legs = leg_instants(next(iter(flights.values())).reference, waypoints)
    laps = [] if plan is None else [_legs(flights, lap_instants(plan), "Laps", "lap"), gate_table(plan, flights)]
    parts = [_verdict(flights), notes, _flights(flights), *pictures, *laps, _legs(flights, legs), _fits(fits)]
    write_page(path, title, parts, clobber=clobber)


def _fitted(logs: Mapping[str, FileName]) -> tuple[dict[str, FlightFit], list[str]]:
    """Return the fits of the logs, and the reason for each log without one."""
    fits, untold = {}, []
    for name, log in logs.items():
        try:
            fits[name] = fit_flight(log)
        except MinsnapError as error:
            untold.append(f"{name} tells nothing of drag, wind and delay: {error}")
    return fits, untold


def leg_instants(plan: Samples, waypoints: ArrayLike | None = None) -> FloatArray:
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
    from minsnap.plot.shown_figure import ShownFigure

    most = max(one.comparison.max_error for one in flights.values())
    columns = min(2, len(flights))
    rows = -(-len(flights) // columns)
    figure = ShownFigure(figsize=(9.5, 3.8 * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
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
    less = f"{missed[1]:.3f} m"  # which is no share of a first flight without any error
    if missed[0] > 0.0:
        less = f"{abs(1.0 - missed[1] / missed[0]):.0%} {'less' if missed[1] <= missed[0] else 'more'}"
    words = f"from {missed[0]:.3f} m ({escape(first)}) to {missed[1]:.3f} m ({escape(last)})"
    return verdict(missed[1] <= missed[0], f"<b>{less}</b> from the plan (root mean square): {words}.")


def _flights(flights: Mapping[str, ComparedFlight]) -> str:
    columns = ["flight", "error [m]", "greatest [m]", "at [s]", "along [m]", "across [m]", "lag [s]", "less lag [m]"]
    keys = ("rmse_3d", "max_error", "worst_instant", "along_rmse", "across_rmse", "delay", "rmse_3d_without_delay")
    rows = []
    for name, one in flights.items():
        figures = one.comparison.as_dict()
        rows.append([name, *(f"{figures[key]:.3f}" for key in keys)])
    return table("Flights", columns, rows)


def lap_instants(plan: PlanFile) -> FloatArray:
    """Return when a plan begins each lap, and ends the last, (laps + 1,) [s]; none of a plan without two.

    A lap begins at the first gate, or stop, of a course.
    """
    if plan.gates:
        first = min(plan.gates)
        instants = np.array([passed.instant for passed in plan.passages if passed.gate == first])
    else:
        breaks = plan.trajectory.leg_breaks
        place = plan.stops[0].position if plan.stops else plan.points[0]
        away = np.linalg.norm(plan.trajectory(breaks) - place, axis=1)
        instants = breaks[away <= max(1e-6, plan.stops[0].ball if plan.stops else 0.0)]
    return instants if len(instants) > 2 else np.zeros(0)


def gate_table(plan: PlanFile, flights: Mapping[str, ComparedFlight]) -> str:
    """Return when, how late and how far from its edges each flight crossed each gate; nothing without gates."""
    rows = []
    columns = ["gate", "planned at [s]", "from its edge [m]"]
    flown = {name: find_flown_margins(plan, one.flight).gates for name, one in flights.items()}
    for index, planned in enumerate(plan.passages):
        cells = [str(planned.gate), f"{planned.instant:.2f}", f"{planned.clearance:.3f}"]
        for name, one in flights.items():
            passed, start = flown[name][index], float(one.flight.t[0])
            off = np.interp(planned.instant, one.comparison.t, np.linalg.norm(one.comparison.error, axis=1))
            missed = "missed by " if passed.clearance < 0.0 else ""
            cells += [f"{passed.instant + start - planned.instant:+.2f}", f"{missed}{abs(passed.clearance):.3f}"]
            cells.append(f"{off:.3f}")
        rows.append(cells)
    columns += [f"{name}, {what}" for name in flights for what in ("late [s]", "from its edge [m]", "error then [m]")]
    return table("Gates", columns, rows) if rows else ""


def _legs(flights: Mapping[str, ComparedFlight], instants: FloatArray, title: str = "Legs", what: str = "leg") -> str:
    """Return root mean square and greatest distance of each leg that a flight has; nothing without legs."""
    if not len(instants):
        return ""
    rows = []
    for leg, (start, end) in enumerate(zip(instants[:-1], instants[1:], strict=True)):
        cells = []
        for one in flights.values():
            inside = (one.comparison.t >= start) & (one.comparison.t <= end)
            away = np.linalg.norm(one.comparison.error[inside], axis=1)
            cells += [f"{np.sqrt(np.mean(away**2)):.3f}", f"{away.max():.3f}"] if len(away) else ["–", "–"]
        rows.append([f"{leg}: {start:.2f} to {end:.2f} s", *cells])
    columns = [f"{name}, {figure} [m]" for name in flights for figure in ("rms", "greatest")]
    return table(title, [what, *columns], rows)


def _fits(fits: Mapping[str, FlightFit]) -> str:
    rows = []
    for name, fit in fits.items():
        drag = [axis.linear for axis in fit.axes[:2] if axis.linear is not None]
        wind = "not told" if fit.wind is None else " and ".join(str(each) for each in fit.wind)
        rows.append([name, told(drag[0] if drag else None), wind, told(fit.delay)])
    columns = ["flight", "drag over mass [1/s]", "wind along x and y [m/s]", "delay [s]"]
    return table("What the logs tell", columns, rows)
