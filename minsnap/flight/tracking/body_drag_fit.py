r"""Drag, wind and hover throttle from what the body felt.

Along each axis i of the body the accelerometer measures, per mass, what acts on the body besides gravity. With the
velocity through the air :math:`u = R^T (v - w)`,

.. math:: f_i = -(k_i + c_i |u|)\, u_i + b_i, \qquad i = x, y, \qquad
          f_z = \alpha\,\theta - (k_z + c_z |u|)\, u_z,

where b is the bias of the accelerometer and :math:`\alpha\theta` the thrust at the throttle :math:`\theta`; at hover it
is g. The linear part is rotor drag (M. Faessler, A. Franchi, D. Scaramuzza, RA-L 2018), the quadratic one that of a
blunt body. A wind w is told from a bias only by turning in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import GRAVITY, BoolArray, FloatArray, own_arrays
from minsnap.flight.tracking.flight_motion import FlightMotion
from minsnap.flight.tracking.regression import FittedNumber, fitted

EXCITED = 0.1
"""Standard deviation of the speed along an axis that a flight needs to tell its drag [m/s]."""

VARIED = 0.3
"""The same for telling a quadratic part from a linear one [m/s]."""

TOLD_APART = 2.0
"""Standard errors by which a quadratic part must differ from zero to be kept."""

TURNED = 0.9
"""Mean length of the headings' unit vectors below which a wind is told from a bias."""

LAGS = (0.0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2)
"""Time constants of the motors that are tried [s]."""

AXES = "xyz"


@dataclass(frozen=True)
class AxisDrag:
    """Drag along one axis of the body, per mass.

    Parameters
    ----------
    speed : float
        Standard deviation of the speed along the axis [m/s].
    linear : FittedNumber or None
        [1/s]; None where the flight does not tell.
    quadratic : FittedNumber or None
        [1/m]; None where it is not told from zero.
    """

    speed: float
    linear: FittedNumber | None = None
    quadratic: FittedNumber | None = None


@dataclass(frozen=True, eq=False)
class BodyDragFit:
    """Drag from a flight.

    Parameters
    ----------
    axes : tuple of 3 AxisDrag
    wind : tuple of 2 FittedNumber, or None
        Along x and y of the world [m/s]; None where no turning told it from a bias.
    hover : FittedNumber or None
        Throttle in hover.
    notes : tuple of str
        What the flight does not tell, and why.
    speed, force, model : ndarray, shape (m, 3)
        Along each axis of the body, for figures: velocity through the air [m/s]; force per mass without thrust and
        bias, and what the fit makes of it [m/s^2].
    """

    axes: tuple[AxisDrag, AxisDrag, AxisDrag]
    wind: tuple[FittedNumber, FittedNumber] | None
    hover: FittedNumber | None
    notes: tuple[str, ...]
    speed: FloatArray
    force: FloatArray
    model: FloatArray

    def __post_init__(self) -> None:
        own_arrays(self)


class _AcrossThrust:
    """The two equations along x and y, whose unknowns are linear, quadratic (each where kept), biases and wind."""

    def __init__(self, motion: FlightMotion, linear: BoolArray, quadratic: BoolArray, windy: bool) -> None:
        self._motion = motion
        self.slots = np.concatenate([linear, quadratic, [True, True], [windy, windy]])

    def unpacked(self, values: FloatArray) -> FloatArray:
        """Return all 8 unknowns as (4, 2): linear, quadratic, bias, wind; those left out are zero."""
        full = np.zeros(8)
        full[self.slots] = values
        return full.reshape(4, 2)

    def air(self, wind: FloatArray) -> FloatArray:
        """Velocity through the air in the body, (m, 3)."""
        moved = self._motion.velocity - np.array([*wind, 0.0])
        return np.asarray(np.einsum("mji,mj->mi", self._motion.rotation, moved))

    def residuals(self, values: FloatArray) -> FloatArray:
        linear, quadratic, bias, wind = self.unpacked(values)
        u = self.air(wind)
        speed = np.linalg.norm(u, axis=1)[:, None]
        drag = (linear + quadratic * speed) * u[:, :2]
        return np.asarray(self._motion.specific_force[:, :2] + drag - bias)

    def solve(self) -> tuple[list[list[FittedNumber | None]], FloatArray]:
        """Return the estimates as rows of linear, quadratic, bias, wind, None for those left out; and the values."""
        first = np.zeros(int(self.slots.sum()))
        numbers, _ = fitted(self.residuals, first, self._motion.rate)
        remaining = iter(numbers)
        listed = [next(remaining) if kept else None for kept in self.slots]
        return [listed[2 * k : 2 * k + 2] for k in range(4)], self.unpacked(np.array([each.value for each in numbers]))


def fit_drag_of(motion: FlightMotion) -> BodyDragFit:
    """Fit drag per mass, and wind and hover throttle where the flight tells them."""
    notes: list[str] = []
    still = np.einsum("mji,mj->mi", motion.rotation, motion.velocity)
    speeds = still.std(axis=0)
    excited = speeds >= EXCITED
    notes += [_unexcited(axis, speeds[k]) for k, axis in enumerate(AXES[:2]) if not excited[k]]
    estimates, values, lateral = _lateral_fit(motion, excited[:2], speeds[:2] >= VARIED, _turns(motion, notes), notes)
    vertical = _AlongThrust(motion, lateral.air(values[3]))
    third, hover = vertical.solve(bool(excited[2]), notes)
    axes = tuple(AxisDrag(float(speeds[k]), estimates[0][k], estimates[1][k]) for k in range(2))
    wind = estimates[3][0], estimates[3][1]
    horizontal = (wind[0], wind[1]) if wind[0] is not None and wind[1] is not None else None
    u = lateral.air(values[3])
    sizes = np.linalg.norm(u, axis=1)[:, None]
    sides = motion.specific_force[:, :2] - values[2], -(values[0] + values[1] * sizes) * u[:, :2]
    force, model = (np.column_stack(pair) for pair in zip(sides, vertical.sides(third), strict=True))
    return BodyDragFit((*axes, third), horizontal, hover, tuple(notes), u, force, model)  # type: ignore[arg-type]


def _lateral_fit(
    motion: FlightMotion, excited: BoolArray, varied: BoolArray, windy: bool, notes: list[str]
) -> tuple[list[list[FittedNumber | None]], FloatArray, _AcrossThrust]:
    """Fit with quadratic parts, then without those that are not told from zero."""
    lateral = _AcrossThrust(motion, excited, varied, windy)
    estimates, values = lateral.solve()
    kept = np.array([_is_told(each) for each in estimates[1]])
    for k in np.flatnonzero(excited & ~kept):
        notes.append(_no_quadratic(AXES[k], estimates[1][k]))
    if (varied & ~kept).any():
        lateral = _AcrossThrust(motion, excited, kept, windy)
        estimates, values = lateral.solve()
    return estimates, values, lateral


def _turns(motion: FlightMotion, notes: list[str]) -> bool:
    heading = np.arctan2(motion.rotation[:, 1, 0], motion.rotation[:, 0, 0])
    varied = bool(np.hypot(np.cos(heading).mean(), np.sin(heading).mean()) < TURNED)
    if not varied:
        notes.append("wind is not told from a bias of the accelerometer: it needs a flight with several headings")
    return varied


def _is_told(estimate: FittedNumber | None) -> bool:
    return estimate is not None and estimate.value > TOLD_APART * estimate.error


def _unexcited(axis: str, speed: float) -> str:
    return (
        f"drag along {axis} of the body is not told: the speed along it varied by {speed:.2f} m/s, "
        f"and {EXCITED:g} m/s are needed"
    )


def _no_quadratic(axis: str, quadratic: FittedNumber | None) -> str:
    size = "" if quadratic is None else f" ({quadratic.value:.3g} ± {quadratic.error:.2g} 1/m)"
    return f"quadratic drag along {axis} is not told from zero{size}, and left out"


class _AlongThrust:
    """The equation along z, with the throttle through motors of first order."""

    def __init__(self, motion: FlightMotion, air: FloatArray) -> None:
        self._motion, self._air = motion, air
        self._size = np.linalg.norm(air, axis=1)
        self._values = (0.0, 0.0, 0.0)
        self._thrust = np.zeros(len(air))

    def solve(self, excited: bool, notes: list[str]) -> tuple[AxisDrag, FittedNumber | None]:
        """Return the drag along z, and the throttle in hover."""
        speed = float(self._air[:, 2].std())
        if self._motion.throttle is None:
            notes.append("drag along z of the body and the hover throttle are not told: the log has no throttle")
            return AxisDrag(speed), None
        if not excited:
            notes.append(_unexcited("z", speed))
        varied = excited and speed >= VARIED
        lag = min(LAGS, key=lambda each: float((self._fit(each, excited, varied)[1] ** 2).sum()))
        numbers, _ = self._fit(lag, excited, varied)
        if excited and not (varied and _is_told(numbers[2])):
            notes.append(_no_quadratic("z", numbers[2] if varied else None))
            numbers, _ = self._fit(lag, True, False)
        self._thrust = self._lagged(lag)
        values = [each.value for each in numbers] + [0.0, 0.0]
        self._values = (values[0], values[1], values[2])
        hover = GRAVITY / numbers[0].value
        drag = [*numbers[1:], None, None]
        return AxisDrag(speed, drag[0], drag[1]), FittedNumber(hover, hover * numbers[0].error / numbers[0].value)

    def _fit(self, lag: float, linear: bool, quadratic: bool) -> tuple[list[FittedNumber], FloatArray]:
        columns = [self._lagged(lag)]
        columns += [-self._air[:, 2]] if linear else []
        columns += [-self._size * self._air[:, 2]] if quadratic else []
        matrix, felt = np.stack(columns, axis=1), self._motion.specific_force[:, 2]
        first = np.asarray(np.linalg.lstsq(matrix, felt, rcond=None)[0], dtype=np.float64)
        return fitted(lambda values: (felt - matrix @ values)[:, None], first, self._motion.rate)

    def _lagged(self, lag: float) -> FloatArray:
        """Throttle after motors with a time constant [s]."""
        from scipy.signal import lfilter

        throttle = self._motion.throttle
        assert throttle is not None
        if lag == 0.0:
            return throttle
        kept = float(np.exp(-1.0 / (lag * self._motion.rate)))
        return np.asarray(lfilter([1.0 - kept], [1.0, -kept], throttle, zi=[kept * throttle[0]])[0])

    def sides(self, drag: AxisDrag) -> tuple[FloatArray, FloatArray]:
        """Return force without thrust, and the fit's; zero where nothing is told."""
        if drag.linear is None:
            return np.zeros(len(self._air)), np.zeros(len(self._air))
        gain, linear, quadratic = self._values
        model = -(linear + quadratic * self._size) * self._air[:, 2]
        return np.asarray(self._motion.specific_force[:, 2] - gain * self._thrust), model
