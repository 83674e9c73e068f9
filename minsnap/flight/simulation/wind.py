"""Wind in the world frame: none, constant, or Dryden gusts, reproducible by their seed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import SMALLEST, FloatArray
from minsnap.basics.checks import check_array, check_seed, is_number
from minsnap.basics.messages import shown
from minsnap.errors import InputError


class Wind(Protocol):
    """Velocity of the air as a series in time."""

    def sample(self, count: int, step: float) -> FloatArray:
        """Return the wind at instants 0, step, 2 step, …, shape (count, 3) [m/s]."""
        ...


@dataclass(frozen=True)
class ConstantWind:
    """A constant wind.

    Parameters
    ----------
    velocity : tuple of 3 floats
        In the world frame [m/s].
    """

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "velocity", vector("wind velocity", self.velocity))

    def sample(self, count: int, step: float) -> FloatArray:
        """Return the wind at every instant, shape (count, 3) [m/s]."""
        return np.tile(self.velocity, (count, 1))


@dataclass(frozen=True)
class DrydenWind:
    r"""A mean wind with gusts of the Dryden spectra, as a stationary random process.

    Gusts along the mean wind have the first-order spectrum, those across it and vertical ones the second-order spectrum
    of MIL-F-8785C,

    .. math:: H_u = \sigma\sqrt{2T}\,\frac{1}{1 + T s}, \qquad
              H_{v,w} = \sigma\sqrt{T}\,\frac{1 + \sqrt{3}\,T s}{(1 + T s)^2}, \qquad T = L / V,

    driven by white noise of unit spectral density. The discretisation is exact for any step: transition matrix and
    noise covariance are those of the continuous process. The series starts in the stationary state.

    Parameters
    ----------
    mean : tuple of 3 floats
        Mean wind in the world frame [m/s].
    intensity : tuple of 3 floats
        Standard deviation of the gusts along, across and up [m/s].
    length : tuple of 3 floats
        Scale lengths along, across and up [m]. Those of MIL-F-8785C at the 1.5 m of a flight room are 19, 19 and 1.5 m.
    airspeed : float or None
        V, at which the frozen gusts pass the vehicle [m/s]; by default the mean wind's speed, at least 1 m/s.
    seed : int
        Repeats the same gusts.

    Raises
    ------
    InputError
        If a value is not finite, or an intensity, length or airspeed is negative.
    """

    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    intensity: tuple[float, float, float] = (0.5, 0.5, 0.25)
    length: tuple[float, float, float] = (19.0, 19.0, 1.5)
    airspeed: float | None = None
    seed: int = 0
    _speed: float = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean", vector("mean wind", self.mean))
        for name in ("intensity", "length"):
            values = vector(f"gust {name}", getattr(self, name))
            if min(values) < 0:
                raise InputError(f"gust {name} is {values}: no part may be below 0")
            object.__setattr__(self, name, values)
        speed = max(math.hypot(*self.mean), 1.0) if self.airspeed is None else self.airspeed
        check_seed(self.seed)
        if not (is_number(speed) and speed >= SMALLEST) or min(self.length) < SMALLEST:
            raise InputError(
                f"gusts need lengths and an airspeed above 0, not {self.length} m and {shown(self.airspeed)} m/s"
            )
        object.__setattr__(self, "_speed", float(speed))

    def sample(self, count: int, step: float) -> FloatArray:
        """Return the wind at 0, step, …, shape (count, 3) [m/s]; a shorter series is the start of a longer one."""
        streams = np.random.default_rng(self.seed).spawn(3)
        times = [length / self._speed for length in self.length]
        along = _first_order(streams[0].standard_normal(count), math.exp(-step / times[0]))
        across = _second_order(streams[1].standard_normal((count, 2)), step, times[1])
        upward = _second_order(streams[2].standard_normal((count, 2)), step, times[2])
        gusts = np.stack([along, across, upward], axis=-1) * self.intensity
        return np.asarray(self.mean + gusts @ self._axes())

    def _axes(self) -> FloatArray:
        """Return the along, across and up axes as rows; along is the direction of the mean wind, or x without wind."""
        heading = math.atan2(self.mean[1], self.mean[0])
        forward, side = math.cos(heading), math.sin(heading)
        return np.array([[forward, side, 0.0], [-side, forward, 0.0], [0.0, 0.0, 1.0]])


def _first_order(noise: FloatArray, decay: float) -> FloatArray:
    """Return the stationary process of unit variance with the spectrum of ``1 / (1 + T s)``, shape (count,)."""
    series, spread = np.empty(len(noise)), math.sqrt(1.0 - decay * decay)
    value = 0.0
    for index, shock in enumerate(noise.tolist()):
        value = shock if index == 0 else decay * value + spread * shock
        series[index] = value
    return series


def _second_order(noise: FloatArray, step: float, time: float) -> FloatArray:
    """Return the stationary process of unit variance with the spectrum of ``(1 + sqrt(3) T s) / (1 + T s)^2``.

    In the controllable form x1' = x2, x2' = -x1/T^2 - 2 x2/T + n, the stationary covariance is diagonal,
    diag(T^3, T) / 4, and the transition over a step is the exponential of a Jordan block.
    """
    rate = step / time
    decay = math.exp(-rate)
    transition = decay * np.array([[1.0 + rate, step], [-rate / time, 1.0 - rate]])
    stationary = np.diag([time**3 / 4.0, time / 4.0])
    shocks = noise[1:] @ _root(stationary - transition @ stationary @ transition.T).T
    (a, b), (c, d) = transition.tolist()
    first, second = (noise[0] * np.sqrt(np.diag(stationary))).tolist() if len(noise) else (0.0, 0.0)
    states = [(first, second)]
    for one, two in shocks.tolist():
        first, second = a * first + b * second + one, c * first + d * second + two
        states.append((first, second))
    output = np.array([1.0, math.sqrt(3.0) * time]) * math.sqrt(time) / time**2
    return np.asarray(np.array(states[: len(noise)]) @ output)


def _root(covariance: FloatArray) -> FloatArray:
    """Return a square root of a positive semidefinite matrix."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def vector(name: str, values: npt.ArrayLike) -> tuple[float, float, float]:
    """Return three finite floats, or raise InputError that names the argument."""
    x, y, z = check_array(name, values, ((3,),), "three finite numbers, x, y and z", InputError).tolist()
    return x, y, z
