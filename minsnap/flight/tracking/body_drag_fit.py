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

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import GRAVITY, BoolArray, FloatArray, OwnsArrays, interpolated
from minsnap.basics.storage.text import FileName, check_size
from minsnap.errors import FileError, FitError
from minsnap.files import FlightLog, InertialLog, read_log
from minsnap.trajectory import Samples, between_gaps, gap_remarks, in_gaps
from minsnap.vehicle import rotations


@dataclass(frozen=True)
class DragFitSettings:
    """How drag is fitted, and what a flight must have to tell it.

    Parameters
    ----------
    memory : float
        For how long residuals are taken to depend on each other at least [s].
    blocks : int
        Parts of a flight that are left out in turn to see how far estimates move.
    few : float
        Factor on the error from so few parts: the two-sided 68 % quantile of Student's t with one less.
    rate : float
        Instants a second at most [Hz].
    moving : float
        A flight begins and ends with this speed [m/s].
    rest : float
        What is slower for longer is left out: it may stand on the ground between two flights [s].
    least : float
        Flight that a fit needs at least [s].
    excited : float
        Standard deviation of the speed along an axis that a flight needs to tell its drag [m/s].
    varied : float
        The same for telling a quadratic part from a linear one [m/s].
    told_apart : float
        Standard errors by which a quadratic part must differ from zero to be kept.
    turned : float
        Mean length of the headings' unit vectors below which a wind is told from a bias.
    lags : tuple[float, ...]
        Time constants of the motors that are tried [s].
    """

    memory: float = 1.0
    blocks: int = 8
    few: float = 1.08
    rate: float = 50.0
    moving: float = 0.3
    rest: float = 5.0
    least: float = 5.0
    excited: float = 0.1
    varied: float = 0.3
    told_apart: float = 2.0
    turned: float = 0.9
    lags: tuple[float, ...] = (0.0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2)


FIT = DragFitSettings()


@dataclass(frozen=True)
class FittedNumber:
    """A number from a fit.

    Parameters
    ----------
    value : float
    error : float
        Standard error.
    """

    value: float
    error: float

    def __str__(self) -> str:
        return f"{self.value:.4g} ± {self.error:.2g}"


def fitted(
    residuals: Callable[[FloatArray], FloatArray], first: FloatArray, rate: float
) -> tuple[list[FittedNumber], FloatArray]:
    """Minimise a sum of squares.

    Slow residuals must not pass for many independent ones. The covariance is :math:`(J^T J)^{-1} S (J^T J)^{-1}`, S the
    sum of the products of the rows' gradients over lags up to a second with Bartlett's weights (W. K. Newey and K. D.
    West, Econometrica 55, 1987). An estimator of attitude and velocity wanders for longer: errors are not less than
    those by which the estimates move where each of eight parts of the flight is left out (the jackknife over blocks: H.
    R. Künsch, Annals of Statistics 17, 1989), times Student's factor for so few.

    Parameters
    ----------
    residuals : callable
        From parameters (p,) to residuals (m, axes), rows at equal steps of time.
    first : ndarray, shape (p,)
        Where to begin.
    rate : float
        Rows a second [Hz].

    Returns
    -------
    estimates : list of FittedNumber
    residuals : ndarray, shape (m, axes)
        At the minimum.
    """
    from scipy.optimize import least_squares

    solution = least_squares(lambda values: residuals(values).reshape(-1), first, method="lm", x_scale=1.0)
    left = residuals(solution.x)
    slopes = solution.jac.reshape(*left.shape, len(first))
    inverse = np.linalg.pinv(solution.jac.T @ solution.jac)
    scores = np.einsum("mi,mip->mp", left, slopes)
    spread = inverse @ _long_run(scores, round(FIT.memory * rate)) @ inverse
    errors = np.maximum(np.sqrt(np.maximum(np.diag(spread), 0.0)), _moved_by_parts(slopes, scores))
    return [FittedNumber(*pair) for pair in zip(solution.x.tolist(), errors.tolist(), strict=True)], left


def _moved_by_parts(slopes: FloatArray, scores: FloatArray) -> FloatArray:
    """Return standard errors (p,) by leaving out parts of a flight: slopes (m, axes, p), their products (m, p)."""
    whole = np.einsum("mip,miq->pq", slopes, slopes)
    parts = np.array_split(np.arange(len(scores)), FIT.blocks)
    moves = []
    for part in parts:
        rest = whole - np.einsum("mip,miq->pq", slopes[part], slopes[part])
        moves.append(np.linalg.pinv(rest) @ scores[part].sum(axis=0))
    apart = np.array(moves) - np.mean(moves, axis=0)
    return np.asarray(FIT.few * np.sqrt((1.0 - 1.0 / FIT.blocks) * (apart**2).sum(axis=0)))


def _long_run(rows: FloatArray, lags: int) -> FloatArray:
    """Sum the products of rows (m, p) up to ``lags`` apart, with weights that fall linearly."""
    total = rows.T @ rows
    for lag in range(1, min(lags, len(rows) - 1) + 1):
        product = rows[lag:].T @ rows[:-lag]
        total += (1.0 - lag / (lags + 1)) * (product + product.T)
    return total


@dataclass(frozen=True, eq=False)
class FlightMotion(OwnsArrays):
    """Motion of a body in z-up world axes, at equal steps but for gaps.

    Parameters
    ----------
    t : ndarray, shape (m,)
        [s].
    velocity : ndarray, shape (m, 3)
        In the world [m/s].
    rotation : ndarray, shape (m, 3, 3)
        From body (forward, left, up) to world.
    specific_force : ndarray, shape (m, 3)
        In the body, mean over each step [m/s^2].
    throttle : ndarray, shape (m,), or None
    notes : tuple of str
        What is left out.
    """

    t: FloatArray
    velocity: FloatArray
    rotation: FloatArray
    specific_force: FloatArray
    throttle: FloatArray | None
    notes: tuple[str, ...] = ()

    @property
    def rate(self) -> float:
        """Instants a second [Hz]."""
        return float(1.0 / np.median(np.diff(self.t)))


def read_flight_log(path: FileName) -> FlightLog:
    """Read a ULog, a dataflash log or the log of a stream, with what the body felt where it was logged.

    Raises
    ------
    FileError
        If the file is none of these.
    """
    check_size(path)
    log = read_log(path, inertial=True)
    if log is None:
        raise FileError(f"{path} is no log of a flight: give a .ulg, a .bin, or the CSV that stream --log wrote")
    return log


def flown_span(flight: Samples) -> tuple[float, float]:
    """Return the first and the last instant at which the vehicle moves [s].

    Raises
    ------
    FitError
        If it never does, or for less than 5 s, or velocities were not logged.
    """
    if flight.velocity is None:
        raise FitError("the log has no velocities: log them")
    moving = flight.t[np.linalg.norm(flight.velocity, axis=1) > FIT.moving]
    if not len(moving) or moving[-1] - moving[0] < FIT.least:
        advice = "fly a course at several speeds, such as a circle"
        raise FitError(f"the log has less than {FIT.least:g} s of flight: {advice}")
    return float(moving[0]), float(moving[-1])


def body_motion(flight: Samples, felt: InertialLog) -> FlightMotion:
    """Return the motion while the vehicle flew, at the rate of its velocities, at 50 Hz at most, without gaps."""
    first, last = flown_span(flight)
    first = max(first, felt.attitude_t[0], felt.force_t[0] + 1.0 / FIT.rate)
    last = min(last, felt.attitude_t[-1], felt.force_t[-1] - 1.0 / FIT.rate)
    rate = min(FIT.rate, float(1.0 / np.median(np.diff(flight.t))))
    t = first + np.arange(int(max(last - first, 0.0) * rate) + 1) / rate
    logged = [flight.t, felt.attitude_t, felt.force_t, *([] if felt.throttle_t is None else [felt.throttle_t])]
    t = t[~np.any([in_gaps(t, known, 0.5 / rate) for known in logged], axis=0)]
    notes, (begins, ends) = gap_remarks(t), _rests(flight).T[:, :, None]
    resting = ((t > begins) & (t < ends)).any(axis=0)
    if resting.any():
        notes.append(f"{resting.sum() / rate:.0f} s between flights, in which it hardly moves, are left out")
    t = t[~resting]
    if len(t) <= FIT.least * rate:
        raise FitError(f"attitude, accelerometer and velocity were logged together for less than {FIT.least:g} s")
    assert flight.velocity is not None
    return FlightMotion(
        t,
        interpolated(t, flight.t, flight.velocity),
        rotations(interpolated(t, felt.attitude_t, felt.quaternion)),
        _means(t, 1.0 / rate, felt.force_t, felt.specific_force),
        None if felt.throttle is None or felt.throttle_t is None else np.interp(t, felt.throttle_t, felt.throttle),
        tuple(notes),
    )


def _rests(flight: Samples) -> FloatArray:
    """Return from when to when the vehicle hardly moves for long, shape (m, 2) [s]."""
    assert flight.velocity is not None
    moving = flight.t[np.linalg.norm(flight.velocity, axis=1) > FIT.moving]
    long = np.flatnonzero(np.diff(moving) > FIT.rest)
    return np.stack([moving[long], moving[long + 1]], axis=1)


def _means(t: FloatArray, width: float, known: FloatArray, values: FloatArray) -> FloatArray:
    """Return means over [t - width/2, t + width/2] of values interpolated linearly."""
    steps = np.diff(known)[:, None]
    total = np.vstack([np.zeros(values.shape[1]), np.cumsum(0.5 * steps * (values[1:] + values[:-1]), axis=0)])
    ends = [interpolated(np.clip(t + side * width / 2, known[0], known[-1]), known, total) for side in (-1.0, 1.0)]
    return np.asarray((ends[1] - ends[0]) / width)


AXES = "xyz"


def is_physical(number: FittedNumber | None) -> bool:
    """Whether a coefficient of drag may be zero or more, within twice its error; one that is not told may be."""
    return number is None or number.value >= -2.0 * number.error


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
class BodyDragFit(OwnsArrays):
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


def fit_drag_of(motion: FlightMotion) -> BodyDragFit:
    """Fit drag per mass, and wind and hover throttle where the flight tells them."""
    notes = list(motion.notes)
    speeds = _air(motion, np.zeros(2)).std(axis=0)
    excited = speeds >= FIT.excited
    notes += [_unexcited(axis, speeds[k]) for k, axis in enumerate(AXES[:2]) if not excited[k]]
    estimates, values = _lateral_fit(motion, excited[:2], speeds[:2] >= FIT.varied, _turns(motion, notes), notes)
    air = _air(motion, values[3])
    third, hover, *vertical = _vertical_fit(motion, air, bool(excited[2]), notes)
    x, y = (AxisDrag(float(speeds[k]), estimates[0][k], estimates[1][k]) for k in range(2))
    east, north = estimates[3]
    wind = None if east is None or north is None else (east, north)
    sizes = np.linalg.norm(air, axis=1)[:, None]
    lateral = motion.specific_force[:, :2] - values[2], -(values[0] + values[1] * sizes) * air[:, :2]
    force, model = (np.column_stack(pair) for pair in zip(lateral, vertical, strict=True))
    return BodyDragFit((x, y, third), wind, hover, tuple(notes), air, force, model)


def _air(motion: FlightMotion, wind: FloatArray) -> FloatArray:
    """Return the velocity through the air in the body, for a horizontal wind (2,), shape (m, 3)."""
    return np.asarray(np.einsum("mji,mj->mi", motion.rotation, motion.velocity - np.array([*wind, 0.0])))


Estimates = list[list[FittedNumber | None]]
"""Along x and y: linear, quadratic, bias, wind; None for those that are left out."""


def _fit_axes(
    motion: FlightMotion, linear: BoolArray, quadratic: BoolArray, windy: bool
) -> tuple[Estimates, FloatArray]:
    """Fit the two equations along x and y; return the estimates and their values (4, 2), zero for those left out."""
    slots = np.concatenate([linear, quadratic, [True, True], [windy, windy]])

    def unpacked(values: FloatArray) -> FloatArray:
        full = np.zeros(8)
        full[slots] = values
        return full.reshape(4, 2)

    def residuals(values: FloatArray) -> FloatArray:
        linear, quadratic, bias, wind = unpacked(values)
        air = _air(motion, wind)
        drag = (linear + quadratic * np.linalg.norm(air, axis=1)[:, None]) * air[:, :2]
        return np.asarray(motion.specific_force[:, :2] + drag - bias)

    numbers, _ = fitted(residuals, np.zeros(int(slots.sum())), motion.rate)
    remaining = iter(numbers)
    listed = [next(remaining) if kept else None for kept in slots]
    return [listed[2 * k : 2 * k + 2] for k in range(4)], unpacked(np.array([each.value for each in numbers]))


def _lateral_fit(
    motion: FlightMotion, excited: BoolArray, varied: BoolArray, windy: bool, notes: list[str]
) -> tuple[Estimates, FloatArray]:
    """Fit with quadratic parts, then without those that are not told from zero, or leave a negative linear one."""
    estimates, values = _fit_axes(motion, excited, varied, windy)
    kept = np.array([_is_told(part) and values[0, k] >= 0.0 for k, part in enumerate(estimates[1])])
    notes += [_no_quadratic(AXES[k], estimates[1][k]) for k in np.flatnonzero(excited & ~kept)]
    return _fit_axes(motion, excited, kept, windy) if (varied & ~kept).any() else (estimates, values)


def _turns(motion: FlightMotion, notes: list[str]) -> bool:
    heading = np.arctan2(motion.rotation[:, 1, 0], motion.rotation[:, 0, 0])
    varied = bool(np.hypot(np.cos(heading).mean(), np.sin(heading).mean()) < FIT.turned)
    if not varied:
        notes.append("wind is not told from a bias of the accelerometer: it needs a flight with several headings")
    return varied


def _is_told(estimate: FittedNumber | None) -> bool:
    return estimate is not None and estimate.value > FIT.told_apart * estimate.error


def _unexcited(axis: str, speed: float) -> str:
    varied = f"the speed along it varied by {speed:.2f} m/s, and {FIT.excited:g} m/s are needed"
    return f"drag along {axis} of the body is not told: {varied}"


def _no_quadratic(axis: str, quadratic: FittedNumber | None) -> str:
    size = "" if quadratic is None else f" ({quadratic.value:.3g} ± {quadratic.error:.2g} 1/m)"
    return f"quadratic drag along {axis} is not told from zero{size}, and left out"


def _vertical_fit(
    motion: FlightMotion, air: FloatArray, excited: bool, notes: list[str]
) -> tuple[AxisDrag, FittedNumber | None, FloatArray, FloatArray]:
    """Return drag along z, the throttle in hover, and the force without thrust and the fit's, zero where not told."""
    w, felt, nothing = air[:, 2], motion.specific_force[:, 2], np.zeros(len(air))
    speed = float(w.std())
    if motion.throttle is None or not motion.throttle.mean() > 0.0:
        notes.append("drag along z of the body and the hover throttle are not told: the log has no throttle")
        return AxisDrag(speed), None, nothing, nothing
    thrusts = {lag: _lagged(motion.throttle, lag, motion) for lag in FIT.lags}
    pulls = [-w, -np.linalg.norm(air, axis=1) * w]

    def fit(lag: float, parts: int) -> tuple[list[FittedNumber], FloatArray]:
        matrix = np.stack([thrusts[lag], *pulls[:parts]], axis=1)
        first = np.asarray(np.linalg.lstsq(matrix, felt, rcond=None)[0], dtype=np.float64)
        return fitted(lambda values: (felt - matrix @ values)[:, None], first, motion.rate)

    parts = (2 if speed >= FIT.varied else 1) if excited else 0
    if not excited:
        notes.append(_unexcited("z", speed))
    lag = min(FIT.lags, key=lambda each: float((fit(each, parts)[1] ** 2).sum()))
    (gain, *drag), _ = fit(lag, parts)
    if excited and not (parts == 2 and _is_told(drag[1]) and drag[0].value >= 0.0):
        notes.append(_no_quadratic("z", drag[1] if parts == 2 else None))
        (gain, *drag), _ = fit(lag, 1)
    hover = GRAVITY / gain.value
    told = FittedNumber(hover, hover * gain.error / gain.value)
    if not drag:
        return AxisDrag(speed), told, nothing, nothing
    model = sum((part.value * pull for part, pull in zip(drag, pulls, strict=False)), start=nothing)
    return AxisDrag(speed, *drag), told, np.asarray(felt - gain.value * thrusts[lag]), model


def _lagged(throttle: FloatArray, lag: float, motion: FlightMotion) -> FloatArray:
    """Return a throttle after motors with a time constant [s], which have reached it at the start and after gaps."""
    from scipy.signal import lfilter

    kept = float(np.exp(-1.0 / (lag * motion.rate))) if lag else 0.0
    parts = between_gaps(motion.t, throttle)
    return np.concatenate([lfilter([1.0 - kept], [1.0, -kept], part, zi=[kept * part[0]])[0] for part in parts])
