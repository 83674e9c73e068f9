"""A flight beside the tube of its control loop: whether it stayed in it, and how much of it it filled."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, OwnsArrays
from minsnap.files.formats import through
from minsnap.flight.tracking.comparison import position_at
from minsnap.flight.tracking.log_comparison import ComparedFlight
from minsnap.vehicle import Loop
from minsnap.vehicle_tube import VehicleTube, check_tracking, vehicle_tube


@dataclass(frozen=True, eq=False)
class FlownTube(OwnsArrays):
    """A flight and the tube of its loop.

    Parameters
    ----------
    tube : VehicleTube
        Of the setpoints that were flown, with the wind that was asked for.
    t : ndarray, shape (m,)
        Instants of the comparison, from the start of the plan [s].
    expected : ndarray, shape (m, dim)
        Where the loop flies without wind [m].
    away : ndarray, shape (m,)
        Distance of the vehicle from there [m].
    error : float
        Largest distance from the plan at the same instant [m].
    allowed : float
        The largest that the tube allows [m].
    """

    tube: VehicleTube
    t: FloatArray
    expected: FloatArray
    away: FloatArray
    error: float
    allowed: float

    @property
    def reach(self) -> float:
        """How far from the expected place the vehicle may be [m]."""
        return self.tube.widths.error + self.tube.flight.position_error

    @property
    def inside(self) -> bool:
        """Whether the vehicle stayed in the tube at all instants of the comparison."""
        return not self.tube.saturated and bool(self.away.max() <= self.reach)

    @property
    def sentence(self) -> str:
        """The result in words."""
        worst = float(self.away.max())
        if self.tube.saturated:
            return f"its loop saturates ({', '.join(self.tube.saturated)}): there is no tube to hold it against"
        where = f"{worst:.3f} m from where its loop flies in still air, at {self.t[self.away.argmax()]:.2f} s"
        allowed = f"the tube allows {self.reach:.3f} m in a wind that changes by {self.tube.wind:g} m/s"
        verdict = "it stayed in its tube" if self.inside else "it left its tube"
        return f"{verdict}: at most {where}, and {allowed}; {self.error:.3f} m of {self.allowed:.3f} m from the plan"

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain numbers, for JSON."""
        known = {"inside": self.inside, "away": float(self.away.max()), "reach": self.reach}
        return known | {"error": self.error, "tube": self.allowed, "wind": self.tube.wind}


def hold_in_tube(one: ComparedFlight, loop: Loop, wind: float) -> FlownTube:
    """Hold a compared flight against the tube of a loop.

    Parameters
    ----------
    one : ComparedFlight
        Its reference, with velocities and accelerations where the file has them, is taken as the curve through its
        samples; how much earlier it was sent is the lead of the loop.
    loop : Loop
    wind : float
        Largest change of the wind [m/s].

    Raises
    ------
    VehicleError
        If the wind is malformed, or the reference is neither in the plane nor in space.
    """
    own = _led(one, loop)
    tube = vehicle_tube(own, check_tracking(own, wind), through(one.sent or one.reference))
    t, flown, planned = _flown(one)
    expected = tube.flight.at(t)
    error = float(np.linalg.norm(one.comparison.error, axis=1).max())
    away, reach = np.linalg.norm(flown - expected, axis=1), tube.widths.error + tube.flight.position_error
    off = reach + float(np.linalg.norm(expected - planned, axis=1).max())
    return FlownTube(tube, t, expected, away, error, tube.error if one.sent is None else off)


def _led(one: ComparedFlight, loop: Loop) -> Loop:
    """Return the loop with the lead of the flight's setpoints."""
    lead = one.reference.lead if one.place is None else one.place.lead
    return replace(loop, lead=lead) if lead else loop


def _flown(one: ComparedFlight) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return instants from the start of the plan, where the vehicle was and where it was to be."""
    planned = position_at(one.reference, one.comparison.t)
    return one.comparison.t - one.reference.t[0], planned + one.comparison.error, planned


@dataclass(frozen=True)
class LoopFitSettings:
    """How a loop is fitted to a flight.

    Parameters
    ----------
    lags : tuple of 2 floats
        Between which the horizontal lag is looked for [s].
    precise : float
        To within which it is found [s].
    margin : float
        How many times as much as this flight others may differ from the model: those of ArduCopter did up to 2.5 times.
    """

    lags: tuple[float, float] = (0.02, 0.6)
    precise: float = 4e-3
    margin: float = 3.0


LOOP_FIT = LoopFitSettings()


def fit_loop(one: ComparedFlight, loop: Loop) -> Loop:
    """Return a loop with the horizontal lag with which it flies nearest to where the vehicle was, and its model error.

    An autopilot that feeds the rates of its attitude forward follows sooner than its gain says: ArduCopter by a lag of
    0.1 s with a gain of 4.5 1/s. What is left is what the model does not know of the vehicle; the model error, a share
    of the lag, is three times that.

    Parameters
    ----------
    one : ComparedFlight
        In still air, complete.
    loop : Loop
        Where all else is from.

    Returns
    -------
    Loop
    """
    from scipy.optimize import minimize_scalar

    led, curve, (t, flown, _) = _led(one, loop), through(one.sent or one.reference), _flown(one)

    def with_lag(lag: float) -> Loop:
        return replace(led, lag=(float(lag), led.lag[1]))

    def missed(lag: float) -> float:
        return float(((vehicle_tube(with_lag(lag), 0.0, curve).flight.at(t) - flown) ** 2).sum())

    best = with_lag(
        minimize_scalar(missed, bounds=LOOP_FIT.lags, method="bounded", options={"xatol": LOOP_FIT.precise}).x
    )
    flight = vehicle_tube(replace(best, model_error=0.0), 0.0, curve).flight
    left = float(np.linalg.norm(flight.at(t) - flown, axis=1).max())
    doubt = LOOP_FIT.margin * left / max(flight.lag, 1e-9)
    return replace(best, lead=loop.lead, model_error=min(1.0, max(loop.model_error, doubt)))
