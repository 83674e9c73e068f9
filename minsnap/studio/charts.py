"""Plots against time beside the scene, with the limits and a cursor at the time of the vehicle; the scale of speeds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import degrees
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.planning.request import PlanRequest
from minsnap.studio.plan_drawing import SPEED_SCALE, Profiles
from minsnap.vehicle.quadrotor import Quadrotor

HEIGHT = 150
"""Of a plot [pixels]."""

LINES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
LIMIT, CURSOR = "#c92a2a", "#343a40"
"""Colours: of the curves, from the palette of Okabe and Ito; of limits; of the cursor."""


@dataclass(frozen=True)
class Chart:
    """One plot.

    Parameters
    ----------
    title : str
        With the unit.
    curves : callable
        Returns the curves of profiles, shape (n, m).
    names : tuple of str
        Of the curves.
    limits : callable
        Returns the lower and the upper limit of a request and a vehicle, None where there is none.
    """

    title: str
    curves: Callable[[Profiles], FloatArray]
    names: tuple[str, ...]
    limits: Callable[[PlanRequest, Quadrotor], tuple[float | None, float | None]]


def _limit(name: str, scale: float = 1.0) -> Callable[[PlanRequest, Quadrotor], tuple[None, float | None]]:
    def of(request: PlanRequest, vehicle: Quadrotor) -> tuple[None, float | None]:
        value = dict(request.limits).get(name)
        return None, None if value is None else scale * value

    return of


CHARTS = (
    Chart("speed [m/s]", lambda p: p.speed[None], ("speed",), _limit("speed")),
    Chart("acceleration [m/s²]", lambda p: p.acceleration[None], ("acceleration",), _limit("acceleration")),
    Chart("thrust [weights]", lambda p: p.thrust[None], ("thrust",), _limit("max_thrust")),
    Chart("tilt [degrees]", lambda p: p.tilt[None], ("tilt",), _limit("tilt", degrees(1.0))),
    Chart(
        "rotor thrusts [N]",
        lambda p: p.rotors.T,
        ("rotor 1", "rotor 2", "rotor 3", "rotor 4"),
        lambda request, vehicle: vehicle.rotor_thrust_limits,
    ),
)
"""From top to bottom."""


class Charts:
    """The plots of a page.

    Parameters
    ----------
    gui : viser.GuiApi
        Where they are added, in the present container.
    """

    def __init__(self, gui: Any) -> None:
        self._handles = [time_chart(gui, chart.title, chart.names) for chart in CHARTS]
        self._profiles: Profiles | None = None
        self._bounds: list[tuple[float, float, float, float]] = []

    def show(self, profiles: Profiles, request: PlanRequest, vehicle: Quadrotor, now: float) -> None:
        """Draw profiles with their limits, and the cursor at an instant [s]."""
        self._profiles = profiles
        self._bounds = [_bounds(chart, profiles, request, vehicle) for chart in CHARTS]
        for handle, (low, high, _, _) in zip(self._handles, self._bounds, strict=True):
            scales = {"x": {"time": False, "range": (0.0, float(profiles.t[-1]))}, "y": {"range": (low, high)}}
            if handle.scales != scales:
                handle.scales = scales
        self.point_at(now)

    def point_at(self, now: float) -> None:
        """Move the cursor to an instant [s]."""
        if self._profiles is None:
            return
        for chart, handle, bounds in zip(CHARTS, self._handles, self._bounds, strict=True):
            handle.data = data_with_cursor(self._profiles.t, chart.curves(self._profiles), bounds, now)


def time_chart(gui: Any, title: str, names: tuple[str, ...], height: int = HEIGHT) -> Any:
    """Add an empty plot against time: curves of these names, both limits and the cursor."""
    curves = [{"label": name, "stroke": LINES[i], "width": 2} for i, name in enumerate(names)]
    limits = [{"label": name, "stroke": LIMIT, "width": 1.5, "dash": (6, 4)} for name in ("least", "most")]
    series = ({"label": "t [s]"}, *curves, *limits, {"label": "now", "stroke": CURSOR, "width": 1.5})
    still: dict[str, Any] = {"legend": {"show": False}, "height": height, "title": title}
    return gui.add_uplot((np.linspace(0.0, 1.0, 8),) + (np.zeros(8),) * (len(series) - 1), series, **still)


def data_with_cursor(
    t: FloatArray, curves: FloatArray, bounds: tuple[float, float, float, float], now: float
) -> tuple[FloatArray, ...]:
    """Return the columns of a plot: time, curves, both limits, and the cursor.

    The cursor is a curve along the lower edge that rises to the upper one at its instant, which is there three times.

    Parameters
    ----------
    t : ndarray, shape (m,)
        [s].
    curves : ndarray, shape (n, m)
    bounds : tuple of 4 floats
        Lower and upper edge, lower and upper limit.
    now : float
        [s].

    Returns
    -------
    tuple of n + 4 ndarrays, shape (m + 3,)
    """
    low, high, least, most = bounds
    instant = min(max(now, float(t[0])), float(t[-1]))
    place = int(np.searchsorted(t, instant))
    times = np.insert(t, place, [instant] * 3)
    drawn = [np.insert(curve, place, [np.interp(instant, t, curve)] * 3) for curve in curves]
    cursor = np.full(len(times), low)
    cursor[place + 1] = high
    return times, *drawn, np.full(len(times), least), np.full(len(times), most), cursor


def _bounds(
    chart: Chart, profiles: Profiles, request: PlanRequest, vehicle: Quadrotor
) -> tuple[float, float, float, float]:
    """Return the edges of a plot and its limits; a limit that is not set lies outside."""
    curves, (least, most) = chart.curves(profiles), chart.limits(request, vehicle)
    high = round_up(1.05 * max(float(curves.max()), most or 0.0, 1e-3))
    low = -round_up(-1.05 * float(curves.min())) if curves.min() < 0.0 else 0.0
    outside = low - high
    return low, high, outside if least is None else least, outside if most is None else most


def round_up(value: float) -> float:
    """Return the next of 1, 1.25, 1.6, 2, 2.5, 3.2, 4, 5, 6.4, 8 times a power of ten, so that edges seldom move."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(
        power
        * next(step for step in (1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.4, 8.0, 10.0) if step * power >= value)
    )


class SpeedLegend:
    """A bar of the colours of the path, from rest to the greatest speed.

    Parameters
    ----------
    gui : viser.GuiApi
        Where it is added, in the present container.
    """

    def __init__(self, gui: Any) -> None:
        self._bar = gui.add_html(legend(0.0))

    def show(self, top: float) -> None:
        """Show the greatest speed [m/s]."""
        self._bar.content = legend(top)


def legend(top: float) -> str:
    """Return the bar with its numbers as HTML; ``top`` is the greatest speed [m/s]."""
    stops = ",".join(f"rgb({','.join(str(int(c)) for c in colour)})" for colour in SPEED_SCALE)
    numbers = "".join(f"<span>{share * top:.2f}</span>" for share in (0.0, 0.5, 1.0))
    bar = f'<div style="height:10px;border-radius:3px;background:linear-gradient(to right,{stops})"></div>'
    row = f'<div style="display:flex;justify-content:space-between;font-size:0.8em">{numbers}</div>'
    return f'<div style="padding:0.3em 0.8em"><span style="font-size:0.85em">speed [m/s]</span>{bar}{row}</div>'
