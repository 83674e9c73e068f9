r"""Drag from setpoints, positions and velocities alone, where a log has neither attitude nor accelerometer.

What the position and velocity loops of PX4 ask for is computed from the logged setpoints and states,

.. math:: a^* = a_s + K_v\,(v_s + K_p (p_s - p) - v) + K_i \int (v_s + K_p (p_s - p) - v)\,dt - K_d\,\dot v,

where the setpoints act after a delay :math:`\sigma` of the link and the attitude follows after another one,
:math:`\tau`; drag is what is missing, :math:`\dot v(t) = a^*(t - \tau) - k\,v(t) + b`. Both sides are integrated over
:data:`WINDOW`, so that velocities need not be differentiated. The gains are assumed: those of PX4's defaults unless
others are given.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from minsnap.basics.arrays import FloatArray, interpolated
from minsnap.errors import FitError
from minsnap.flight.simulation.cascade import CascadeController
from minsnap.flight.tracking.body_drag_fit import FittedNumber, fitted, flown_span
from minsnap.trajectory.samples import Samples

RATE = 50.0
"""Steps a second of the integrals [Hz]."""

WINDOW = 0.2
"""Length of the intervals over which the motion is integrated [s]."""

DELAYS = range(0, 19)
"""Delays that are tried, of the link and of the attitude, in steps."""


MODEL_ERROR = 0.1
"""Error by taking a delay for the attitude's response, from simulated flights [1/s]."""


def fit_setpoint_drag(reference: Samples, flight: Samples) -> tuple[FittedNumber, FloatArray, FloatArray]:
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

    Raises
    ------
    FitError
        If setpoints have no velocities, or the flight is too short.
    """
    if reference.velocity is None:
        raise FitError("the setpoints of the log have no velocities, so the goal of the controller is not known")
    series = _Series(reference, flight, CascadeController())
    rest = {pair: series.rest(*pair) for pair in product(DELAYS, DELAYS)}
    best = min(rest, key=lambda pair: series.squares(rest[pair]))
    numbers, _ = fitted(lambda values: series.residuals(rest[best], values), np.zeros(3), RATE)
    drag = FittedNumber(numbers[0].value, float(np.hypot(numbers[0].error, MODEL_ERROR)))
    force = rest[best] / WINDOW - [each.value for each in numbers[1:]]
    return drag, np.asarray(series.moved / WINDOW), np.asarray(force)


class _Series:
    """Both sides of the equation of motion, at equal steps, horizontal axes only."""

    def __init__(self, reference: Samples, flight: Samples, settings: CascadeController) -> None:
        first, last = flown_span(flight)
        assert flight.velocity is not None
        t = np.arange(max(first, reference.t[0]), min(last, reference.t[-1], flight.t[-1]), 1.0 / RATE)
        place, self._velocity = (
            interpolated(t, flight.t, values[:, :2]) for values in (flight.position, flight.velocity)
        )
        row = np.clip(np.searchsorted(reference.t, t, side="right") - 1, 0, len(reference) - 1)
        gains = {name: np.array(getattr(settings, name)[:2]) for name in _GAINS}
        assert reference.velocity is not None
        ahead = reference.velocity[row, :2] + gains["position_gain"] * reference.position[row, :2]
        pushed = 0.0 if reference.acceleration is None else reference.acceleration[row, :2]
        self._commanded = pushed + _controlled(ahead, gains)
        change = gains["velocity_derivative"] * np.gradient(self._velocity, 1.0 / RATE, axis=0)
        self._felt = _controlled(gains["position_gain"] * place + self._velocity, gains) + change
        self._step, self._longest = round(WINDOW * RATE), 2 * DELAYS[-1]
        self.moved = _integrals(self._velocity[self._longest :], self._step)

    def rest(self, link: int, attitude: int) -> FloatArray:
        """Return the change of velocity left to drag and a constant, for delays in steps: (m, 2), a row a window."""
        velocity, end = self._velocity[self._longest :], len(self._commanded)
        setpoints = self._commanded[self._longest - link - attitude : end - link - attitude]
        pulled = setpoints - self._felt[self._longest - attitude : end - attitude]
        return np.asarray(velocity[self._step :] - velocity[: -self._step] - _integrals(pulled, self._step))

    def residuals(self, rest: FloatArray, values: FloatArray) -> FloatArray:
        """Return residuals for drag and the two constants."""
        return np.asarray(rest + values[0] * self.moved - WINDOW * values[1:])

    def squares(self, rest: FloatArray) -> float:
        """Return the least sum of squares for one pair of delays."""
        rest, moved = rest - rest.mean(axis=0), self.moved - self.moved.mean(axis=0)
        return float((rest**2).sum() - (rest * moved).sum() ** 2 / (moved**2).sum())


_GAINS = ("position_gain", "velocity_gain", "velocity_integral", "velocity_derivative")


def _controlled(values: FloatArray, gains: dict[str, FloatArray]) -> FloatArray:
    """Proportional and integral part of the velocity loop."""
    total = np.cumsum(values, axis=0) / RATE
    return np.asarray(gains["velocity_gain"] * values + gains["velocity_integral"] * total)


def _integrals(values: FloatArray, steps: int) -> FloatArray:
    """Integrate over ``steps`` steps from each row on, by the trapezoidal rule."""
    total = np.vstack([np.zeros(values.shape[1]), np.cumsum(0.5 * (values[1:] + values[:-1]), axis=0)]) / RATE
    return np.asarray(total[steps:] - total[:-steps])
