r"""What a flight tells of its vehicle: drag per mass, wind, hover throttle and delay.

What the position and velocity loops of PX4 ask for is computed from the logged setpoints and states,

.. math:: a^* = a_s + K_v\,(v_s + K_p (p_s - p) - v) + K_i \int (v_s + K_p (p_s - p) - v)\,dt - K_d\,\dot v,

where the setpoints act after a delay :math:`\sigma` of the link and the attitude follows after another one,
:math:`\tau`; drag is what is missing, :math:`\dot v(t) = a^*(t - \tau) - k\,v(t) + b`. Both sides are integrated over
a window, so that velocities need not be differentiated. The gains are assumed: those of PX4's defaults unless others
are given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, interpolated
from minsnap.basics.storage.text import FileName
from minsnap.errors import FitError
from minsnap.files import FlightLog, joined_logs
from minsnap.flight.simulation.controllers import CascadeController
from minsnap.flight.tracking.body_drag_fit import (
    AXES,
    FIT,
    AxisDrag,
    BodyDragFit,
    FittedNumber,
    body_motion,
    fit_drag_of,
    fitted,
    flown_span,
    is_physical,
    read_flight_log,
)
from minsnap.flight.tracking.comparison import estimate_delay, jump_remarks, position_at
from minsnap.trajectory import Samples, between_gaps, gap_remarks, in_gaps
from minsnap.vehicle import BodyDrag, Quadrotor


@dataclass(frozen=True)
class ResponseSettings:
    """How drag and delay are fitted to setpoints and velocities.

    Parameters
    ----------
    rate : float
        Steps a second of the integrals [Hz].
    window : float
        Length of the intervals over which the motion is integrated [s].
    delays : range
        Delays that are tried, of the link and of the attitude, in steps.
    model_error : float
        Error by taking a delay for the attitude's response, from simulated flights [1/s].
    longest : float
        Longest delay of a position response [s].
    """

    rate: float = 50.0
    window: float = 0.2
    delays: range = range(0, 19)
    model_error: float = 0.1
    longest: float = 1.5


RESPONSE = ResponseSettings()


def fit_setpoint_drag(
    reference: Samples, flight: Samples
) -> tuple[FittedNumber, FloatArray, FloatArray, tuple[str, ...]]:
    """Fit one linear drag per mass along all horizontal directions.

    Parameters
    ----------
    reference : Samples
        Setpoints with velocities, each held until the next.
    flight : Samples
        Positions and velocities of the vehicle, on the same clock.

    Returns
    -------
    drag : FittedNumber
        Per mass [1/s].
    speed, force : ndarray, shape (m, 2)
        Velocity [m/s] and drag per mass [m/s^2] along x and y of the world, for figures.
    notes : tuple of str
        On gaps, where there are any.

    Raises
    ------
    FitError
        If setpoints have no velocities, or the flight is too short.
    """
    if reference.velocity is None:
        raise FitError("the setpoints of the log have no velocities, so the goal of the controller is not known")
    series = _Series(reference, flight, CascadeController())
    rest = {pair: series.rest(*pair) for pair in product(RESPONSE.delays, RESPONSE.delays)}
    best = min(rest, key=lambda pair: series.squares(rest[pair]))
    numbers, _ = fitted(lambda values: series.residuals(rest[best], values), np.zeros(3), RESPONSE.rate)
    drag = FittedNumber(numbers[0].value, float(np.hypot(numbers[0].error, RESPONSE.model_error)))
    force = rest[best] / RESPONSE.window - [each.value for each in numbers[1:]]
    return drag, np.asarray(series.moved / RESPONSE.window), np.asarray(force), series.notes


class _Series:
    """Both sides of the equation of motion, at equal steps between two gaps, horizontal axes only."""

    def __init__(self, reference: Samples, flight: Samples, settings: CascadeController) -> None:
        first, last = flown_span(flight)
        assert flight.velocity is not None
        t = np.arange(max(first, reference.t[0]), min(last, reference.t[-1], flight.t[-1]), 1.0 / RESPONSE.rate)
        t = t[~(in_gaps(t, flight.t) | in_gaps(t, reference.t))]
        self.notes = tuple(f"{each}; drag was fitted to the longest part between gaps" for each in gap_remarks(t))
        t = max(between_gaps(t, t), key=len)
        if len(t) <= FIT.least * RESPONSE.rate:
            raise FitError(f"setpoints and velocity were logged together, without gaps, for less than {FIT.least:g} s")
        place, self._velocity = (interpolated(t, flight.t, each[:, :2]) for each in (flight.position, flight.velocity))
        row = np.clip(np.searchsorted(reference.t, t, side="right") - 1, 0, len(reference) - 1)
        gains = {name: np.array(getattr(settings, name)[:2]) for name in _GAINS}
        assert reference.velocity is not None
        ahead = reference.velocity[row, :2] + gains["position_gain"] * reference.position[row, :2]
        pushed = 0.0 if reference.acceleration is None else reference.acceleration[row, :2]
        self._commanded = pushed + _controlled(ahead, gains)
        change = gains["velocity_derivative"] * np.gradient(self._velocity, 1.0 / RESPONSE.rate, axis=0)
        self._felt = _controlled(gains["position_gain"] * place + self._velocity, gains) + change
        self._step, self._longest = round(RESPONSE.window * RESPONSE.rate), 2 * RESPONSE.delays[-1]
        self.moved = _integrals(self._velocity[self._longest :], self._step)

    def rest(self, link: int, attitude: int) -> FloatArray:
        """Return the change of velocity left to drag and a constant, for delays in steps: (m, 2), a row a window."""
        velocity, end = self._velocity[self._longest :], len(self._commanded)
        setpoints = self._commanded[self._longest - link - attitude : end - link - attitude]
        pulled = setpoints - self._felt[self._longest - attitude : end - attitude]
        return np.asarray(velocity[self._step :] - velocity[: -self._step] - _integrals(pulled, self._step))

    def residuals(self, rest: FloatArray, values: FloatArray) -> FloatArray:
        """Return residuals for drag and the two constants."""
        return np.asarray(rest + values[0] * self.moved - RESPONSE.window * values[1:])

    def squares(self, rest: FloatArray) -> float:
        """Return the least sum of squares for one pair of delays."""
        rest, moved = rest - rest.mean(axis=0), self.moved - self.moved.mean(axis=0)
        return float((rest**2).sum() - (rest * moved).sum() ** 2 / (moved**2).sum())


_GAINS = ("position_gain", "velocity_gain", "velocity_integral", "velocity_derivative")


def _controlled(values: FloatArray, gains: dict[str, FloatArray]) -> FloatArray:
    """Proportional and integral part of the velocity loop."""
    total = np.cumsum(values, axis=0) / RESPONSE.rate
    return np.asarray(gains["velocity_gain"] * values + gains["velocity_integral"] * total)


def _integrals(values: FloatArray, steps: int) -> FloatArray:
    """Integrate over ``steps`` steps from each row on, by the trapezoidal rule."""
    total = np.vstack([np.zeros(values.shape[1]), np.cumsum(0.5 * (values[1:] + values[:-1]), axis=0)]) / RESPONSE.rate
    return np.asarray(total[steps:] - total[:-steps])


FELT, COMMANDED = "accelerometer, attitude and velocity", "setpoints and velocity"


@dataclass(frozen=True, eq=False)
class FlightFit(BodyDragFit):
    """What a log tells of the vehicle; drag is per mass, so that no mass need be known.

    Parameters
    ----------
    axes : tuple of 3 AxisDrag
        Along x (forward), y (left) and z (up) of the body.
    wind : tuple of 2 FittedNumber, or None
        Along x and y of the world [m/s].
    hover : FittedNumber or None
        Throttle in hover, 0 to 1.
    notes : tuple of str
        What the flight does not tell, and what was assumed.
    speed, force, model : ndarray, shape (m, axes)
        Velocity [m/s], force per mass and the fit's [m/s^2], for figures.
    source : str
        What the drag was fitted to.
    delay : FittedNumber or None
        Of the vehicle's position after its setpoint [s].
    lead : float
        How much earlier than planned the setpoints of this flight were sent [s]: so much of the delay is offset.
    autopilot : str or None
        ``px4`` or ``ardupilot``, by the kind of log.
    """

    source: str = FELT
    delay: FittedNumber | None = None
    lead: float = 0.0
    autopilot: str | None = None

    def __str__(self) -> str:
        lines = [f"fitted to {self.source}"]
        for name, axis in zip("xyz", self.axes, strict=True):
            linear, quadratic = told(axis.linear, "1/s"), told(axis.quadratic, "1/m")
            lines.append(f"  drag along {name:<12}{linear}, quadratic {quadratic}")
        if self.wind is not None:
            lines.append(f"  wind {told(self.wind[0], 'm/s')} along x, {told(self.wind[1], 'm/s')} along y")
        lines.append(f"  hover throttle        {told(self.hover)}")
        lines.append(f"  delay of the position {told(self.delay, 's')} after its setpoint{self._offset()}")
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def _offset(self) -> str:
        """Say how much of the delay the lead of the flight offset, and which lead offsets all of it."""
        if self.delay is None or not self.lead:
            return ""
        left, whole = self.delay.value - self.lead, self.delay.value
        return f", of which its lead offset {self.lead:g} s: {left:.3f} s are left, and --lead {whole:.2f} offsets all"

    def drag(self, mass: float) -> BodyDrag:
        """Return the drag of a vehicle of that mass [kg].

        A horizontal axis that the flight does not tell takes the value of the other; along z it is then zero, and so is
        what comes out negative by no more than twice its error.

        Raises
        ------
        FitError
            If neither horizontal axis is told, or a coefficient is negative by more.
        """
        self.check_physical()
        known = [axis for axis in self.axes[:2] if axis.linear is not None]
        if not known:
            advice = "fly along the body's x or y at several speeds"
            raise FitError(f"this flight does not determine the horizontal drag: {advice}")
        sides = [axis if axis.linear is not None else known[0] for axis in self.axes[:2]]
        parts = [(_value(axis.linear), _value(axis.quadratic)) for axis in (*sides, self.axes[2])]
        linear, quadratic = np.maximum(np.array(parts).T, 0.0) * mass
        return BodyDrag(linear, quadratic)

    def check_physical(self) -> None:
        """Raise FitError where a coefficient is one that no vehicle has."""
        for name, axis in zip(AXES, self.axes, strict=True):
            for part, number, unit in (("linear", axis.linear, "1/s"), ("quadratic", axis.quadratic, "1/m")):
                if number is not None and not is_physical(number):
                    raise FitError(
                        f"the {part} drag along {name} of the body comes out as {number} {unit}, and no vehicle has a "
                        "negative one: fly longer, with several speeds and headings, or in less wind"
                    )

    def of_loop(self) -> dict[str, Any]:
        """Return what the flight tells of a control loop, by the fields of :class:`~minsnap.Loop`.

        Linear drag of the horizontal axes, which a loop takes as one; their difference and their errors, twice, are the
        error of it. A vertical one that is not told is the same.

        Raises
        ------
        FitError
            If no horizontal axis is told, or a coefficient is not physical.
        """
        drag = self.drag(1.0).linear
        across, error = float(drag[:2].mean()), 0.5 * float(np.ptp(drag[:2]))
        error += 2.0 * max(axis.linear.error for axis in self.axes[:2] if axis.linear is not None)
        upright = self.axes[2].linear
        vertical = (across, error) if upright is None else (float(drag[2]), 2.0 * upright.error)
        return {"drag": (across, vertical[0]), "drag_error": (error, vertical[1]), "lead": self.lead}

    def vehicle(self, base: Quadrotor | None = None, mass: float | None = None, name: str | None = None) -> Quadrotor:
        """Return a vehicle with this drag and delay; all else is that of a base, or of PX4's simulated one of 1 kg.

        Raises
        ------
        FitError
            If no horizontal axis is told, or a coefficient is not physical.
        VehicleError
            If the mass is not positive.
        """
        base = base or Quadrotor.px4_sih()
        weighed = base if mass is None else replace(base, mass=mass)
        delay = base.delay if self.delay is None else max(0.0, self.delay.value)
        return replace(weighed, drag=self.drag(weighed.mass), delay=delay, name=name or base.name)

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain numbers, for JSON."""
        axes = {
            axis: {"speed": drag.speed, "linear": _plain(drag.linear), "quadratic": _plain(drag.quadratic)}
            for axis, drag in zip(AXES, self.axes, strict=True)
        }
        return {
            "source": self.source,
            "drag per mass": axes,
            "wind": None if self.wind is None else [_plain(each) for each in self.wind],
            "hover throttle": _plain(self.hover),
            "delay": _plain(self.delay),
            "lead": self.lead,
            "notes": list(self.notes),
        }


def fit_flight(source: FileName | FlightLog | Sequence[FileName | FlightLog], lead: float | None = None) -> FlightFit:
    """Fit drag, wind, hover throttle and delay to the log of a flight, or to several of one vehicle.

    With attitude and accelerometer in the log, drag along each axis of the body is fitted to what the accelerometer
    felt (:mod:`minsnap.flight.tracking.body_drag_fit`); without, one horizontal drag to setpoints and velocities, with
    PX4's default gains (:mod:`minsnap.flight.tracking.flight_fit`).

    Parameters
    ----------
    source : path or FlightLog, or several
        A ULog, a dataflash log, or the CSV that ``stream --log`` wrote. Several are read as one
        (:func:`minsnap.files.joined_logs`): parts of a flight, or flights in the same wind.
    lead : float, optional
        How much earlier than planned the setpoints of the flight were sent [s]; a CSV of ``stream --log`` says it.

    Returns
    -------
    FlightFit

    Raises
    ------
    FileError
        If the file is no log, or damaged beyond reading.
    FitError
        If the flight is too short, or the log has nothing to fit drag to.
    """
    sources = source if isinstance(source, Sequence) and not isinstance(source, str) else [source]
    log = joined_logs([each if isinstance(each, FlightLog) else read_flight_log(each) for each in sources])
    if log.flight is None:
        raise FitError("the log has no positions of the vehicle")
    damage = () if log.damage is None else (log.damage,)
    jumps = jump_remarks(log.flight)
    delay = None if log.reference is None or jumps else _delay(log.reference, log.flight)
    hover = None if log.inertial is None else log.inertial.hover_throttle
    if log.inertial is None:
        fit = _from_setpoints(log)
    else:
        fit = FlightFit(**vars(fit_drag_of(body_motion(log.flight, log.inertial))))
    if fit.hover is None and hover is not None:
        fit = replace(fit, notes=(*fit.notes, f"the autopilot's own estimate of the hover throttle is {hover:.3f}"))
    led = lead if lead is not None else 0.0 if log.reference is None else log.reference.lead
    return replace(fit, delay=delay, lead=led, autopilot=log.autopilot, notes=(*damage, *fit.notes, *jumps))


def _from_setpoints(log: FlightLog) -> FlightFit:
    if log.reference is None or log.flight is None:
        raise FitError("the log has neither attitude and accelerometer nor setpoints: log them")
    drag, speed, force, missing = fit_setpoint_drag(log.reference, log.flight)
    notes = (
        "the log has no attitude and accelerometer: one horizontal drag was fitted to setpoints and velocities, and it "
        "holds for PX4's default gains alone",
        "drag along z, quadratic drag, wind and hover throttle are not told without them",
        *missing,
    )
    x, y = (AxisDrag(float(each), drag) for each in speed.std(axis=0))
    return FlightFit((x, y, AxisDrag(0.0)), None, None, notes, speed, force, -drag.value * speed, COMMANDED)


def _delay(reference: Samples, flight: Samples) -> FittedNumber | None:
    """Return the delay of positions after setpoints; None where setpoints do not move while the vehicle flies."""
    first, last = flown_span(flight)
    setpoints = reference[(reference.t >= first - RESPONSE.longest) & (reference.t <= last)]
    flown = flight[(flight.t >= first) & (flight.t <= last)]
    if len(setpoints) < 10 or len(flown) < 10 or np.ptp(setpoints.position, axis=0).max() < 0.5:
        return None
    inside = (flown.t >= setpoints.t[0] + RESPONSE.longest) & (flown.t <= setpoints.t[-1])
    inside &= ~in_gaps(flown.t - 0.5 * RESPONSE.longest, setpoints.t, 0.5 * RESPONSE.longest)
    if inside.sum() < 10:
        return None
    start = max(estimate_delay(setpoints, flown, RESPONSE.longest), 0.0)
    t, place = flown.t[inside], flown.position[inside]

    def away(values: FloatArray) -> FloatArray:
        sent = np.clip(t - values[0], setpoints.t[0], setpoints.t[-1])
        return np.asarray(place - position_at(setpoints, sent) - values[1:])

    return fitted(away, np.array([start, *np.zeros(flown.dim)]), len(t) / (t[-1] - t[0]))[0][0]


def _value(number: FittedNumber | None) -> float:
    return 0.0 if number is None else number.value


def told(number: FittedNumber | None, unit: str = "") -> str:
    """Return a number with its unit in words."""
    return "not told" if number is None else f"{number} {unit}".rstrip()


def _plain(number: FittedNumber | None) -> dict[str, float] | None:
    return None if number is None else {"value": number.value, "standard error": number.error}


def default_name(path: FileName) -> str:
    """Return the name of a vehicle fitted to a file."""
    return f"fitted to {Path(path).name}"
