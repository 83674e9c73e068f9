"""Aerodynamic drag as a force in the body frame: physically consistent models, and surfaces from a wind tunnel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, ReadOnly, owned, set_fields
from minsnap.basics.checks import check_array
from minsnap.basics.warn import warn_caller
from minsnap.errors import FitError, OutsideRangeWarning, VehicleError


@runtime_checkable
class Drag(Protocol):
    """Aerodynamic drag force on a vehicle."""

    def force(self, velocity: ArrayLike, *, pitch: ArrayLike = 0.0, rotor_speed: ArrayLike = 0.0) -> FloatArray:
        """Return the force in the body frame.

        Parameters
        ----------
        velocity : array_like, shape (..., 3)
            Velocity through the air, in the body frame [m/s].
        pitch : array_like, shape (...)
            Pitch angle [rad], for models that need it.
        rotor_speed : array_like, shape (..., 4) or ()
            Rotor speeds [rad/s], for models that need them.

        Returns
        -------
        ndarray, shape (..., 3)
            [N].
        """
        ...


@runtime_checkable
class HubDrag(Drag, Protocol):
    """Drag that acts at each rotor's hub: it depends on the body rates and also exerts a torque."""

    def wrench(
        self, velocity: ArrayLike, body_rates: ArrayLike, hubs: FloatArray, **air: ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return force [N] and torque [N m] in the body frame, each of shape (..., 3).

        Parameters
        ----------
        velocity, body_rates : array_like, shape (..., 3)
            Through the air, and about the body's axes [m/s], [rad/s].
        hubs : ndarray, shape (4, 3)
            Where the rotors are in the body frame [m].
        **air
            Pitch and rotor speeds, as :meth:`Drag.force` takes them.
        """
        ...


@dataclass(frozen=True, eq=False)
class BodyDrag(ReadOnly):
    r"""Drag along each axis of the body, linear and quadratic in velocity: odd, zero at rest, opposing motion.

    .. math:: F = -(\operatorname{diag}(linear) + |v| \operatorname{diag}(quadratic))\, v

    The linear part is the rotor drag of Faessler, Franchi and Scaramuzza (RA-L 2018), D = diag(dx, dy, dz); the
    quadratic part is the drag of a blunt body. It is the only drag model here for which the motion is differentially
    flat.

    Parameters
    ----------
    linear : array_like, shape (3,)
        [N s/m], none negative.
    quadratic : array_like, shape (3,)
        [N s^2/m^2], none negative.

    Raises
    ------
    VehicleError
        If a coefficient is negative or not a finite number.
    """

    linear: FloatArray
    quadratic: FloatArray

    def __init__(self, linear: ArrayLike = (0.0, 0.0, 0.0), quadratic: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        across = coefficients("linear drag", linear)
        set_fields(self, linear=across, quadratic=coefficients("quadratic drag", quadratic))

    @property
    def absent(self) -> bool:
        """Whether every coefficient is zero."""
        return not (self.linear.any() or self.quadratic.any())

    def force(self, velocity: ArrayLike, *, pitch: ArrayLike = 0.0, rotor_speed: ArrayLike = 0.0) -> FloatArray:
        """Return the force in the body frame, shape (..., 3) [N]; see :class:`Drag`."""
        v = np.asarray(velocity, dtype=np.float64)
        speed = np.linalg.norm(v, axis=-1, keepdims=True)
        return np.asarray(-(self.linear + self.quadratic * speed) * v)

    def __add__(self, other: BodyDrag) -> BodyDrag:
        """Return the model whose force is the sum of both."""
        if not isinstance(other, BodyDrag):
            return NotImplemented
        return BodyDrag(self.linear + other.linear, self.quadratic + other.quadratic)

    def __repr__(self) -> str:
        return f"BodyDrag(linear={tuple(self.linear.tolist())}, quadratic={tuple(self.quadratic.tolist())})"


def linear_rotor_drag(dx: float, dy: float, dz: float = 0.0) -> BodyDrag:
    """Return ``F = -diag(dx, dy, dz) v`` (Faessler 2018); coefficients in N s/m, theirs times the mass."""
    return BodyDrag(linear=(dx, dy, dz))


@dataclass(frozen=True, eq=False)
class RotorSpeedDrag(ReadOnly):
    """Rotor drag that grows with rotor speed, ``F = -sum(speed) diag(coefficient) v``.

    The model of RotorPy (Folk, Paulos and Kumar 2023). In simulation it acts at each hub with the hub's own velocity,
    which damps the body's rotation; without rotation the force is this sum.

    Parameters
    ----------
    coefficient : array_like, shape (3,)
        [N s/m per rad/s], none negative.

    Raises
    ------
    VehicleError
        If a coefficient is negative or not a finite number.
    """

    coefficient: FloatArray

    def __init__(self, coefficient: ArrayLike) -> None:
        set_fields(self, coefficient=coefficients("rotor drag", coefficient))

    def force(self, velocity: ArrayLike, *, pitch: ArrayLike = 0.0, rotor_speed: ArrayLike = 0.0) -> FloatArray:
        """Return the force in the body frame, shape (..., 3) [N]; a single rotor speed applies to all four rotors."""
        speeds = np.asarray(rotor_speed, dtype=np.float64)
        total = 4.0 * speeds if speeds.ndim == 0 else speeds.sum(axis=-1)
        return -np.asarray(total)[..., None] * self.coefficient * np.asarray(velocity, dtype=np.float64)

    def wrench(
        self, velocity: ArrayLike, body_rates: ArrayLike, hubs: FloatArray, **air: ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return force and torque of the drag at every hub; see :class:`HubDrag`."""
        rates = np.asarray(body_rates, dtype=np.float64)[..., None, :]
        local = np.asarray(velocity, dtype=np.float64)[..., None, :] + np.cross(rates, hubs)
        forces = -np.asarray(air.get("rotor_speed", 0.0), dtype=np.float64)[..., None] * self.coefficient * local
        return forces.sum(axis=-2), np.cross(hubs, forces).sum(axis=-2)

    def at(self, rotor_speed: float) -> BodyDrag:
        """Return the linear model for four rotors that all turn at one speed [rad/s]."""
        return BodyDrag(linear=4.0 * rotor_speed * self.coefficient)


@dataclass(frozen=True)
class SumOfDrags:
    """The sum of several models that cannot be combined into one :class:`BodyDrag`.

    Parameters
    ----------
    parts : tuple of Drag
        What is summed.
    """

    parts: tuple[Drag, ...]

    def force(self, velocity: ArrayLike, **air: ArrayLike) -> FloatArray:
        """Return the force in the body frame, shape (..., 3) [N]; see :class:`Drag`."""
        none = np.zeros(np.shape(velocity))
        return sum((part.force(velocity, **air) for part in self.parts), start=none)

    def wrench(
        self, velocity: ArrayLike, body_rates: ArrayLike, hubs: FloatArray, **air: ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return force and torque of all parts; parts that do not act at the hubs add no torque."""
        force, torque = np.zeros(np.shape(velocity)), np.zeros(np.shape(velocity))
        for part in self.parts:
            if isinstance(part, HubDrag):
                more = part.wrench(velocity, body_rates, hubs, **air)
                force, torque = force + more[0], torque + more[1]
            else:
                force = force + part.force(velocity, **air)
        return force, torque


def coefficients(name: str, values: ArrayLike) -> FloatArray:
    """Return three non-negative finite numbers as a read-only array, or raise VehicleError naming them."""
    give = "three numbers along x, y, z of the body, none below 0"
    return check_array(name, values, ((3,),), give, VehicleError, least=0.0)


Range = tuple[float, float]
"""Least and greatest value measured."""

RPM = 2.0 * math.pi / 60.0
"""One revolution a minute [rad/s]."""


@dataclass(frozen=True, eq=False)
class Surface(ReadOnly):
    """A polynomial in named variables, with the range in which it was measured.

    Parameters
    ----------
    name : str
        What it is called.
    variables : tuple of str
        Names of the columns, with their unit: ``pitch_deg``, ``velocity`` [m/s], ``speed_rpm``.
    exponents : tuple of tuple of int
        One tuple a term, one power a variable.
    coefficients : array_like, shape (terms,)
        [N] over the units of the variables.
    measured : dict of str to (low, high)
        Range of each variable in the measurements.
    r_squared : float or None
        Part of the measurements' variance that the surface explains.
    """

    name: str
    variables: tuple[str, ...]
    exponents: tuple[tuple[int, ...], ...]
    coefficients: FloatArray
    measured: dict[str, Range]
    r_squared: float | None

    def __init__(
        self,
        name: str,
        variables: tuple[str, ...],
        exponents: tuple[tuple[int, ...], ...],
        coefficients: ArrayLike,
        measured: dict[str, Range] | None = None,
        r_squared: float | None = None,
    ) -> None:
        terms = {"variables": variables, "exponents": exponents, "coefficients": owned(coefficients)}
        set_fields(self, name=name, **terms, measured=measured or {}, r_squared=r_squared)

    def __call__(self, **values: ArrayLike) -> FloatArray:
        """Return the drag [N] at values of the variables, by name; their shapes must broadcast.

        Raises
        ------
        FitError
            If a variable is missing or not one of the surface's.

        Warns
        -----
        OutsideRangeWarning
            If a value lies outside the measured range.
        """
        wrong = sorted(set(values) ^ set(self.variables))
        if wrong:
            raise FitError(f"{self.name} takes {', '.join(self.variables)}: check {', '.join(wrong)}")
        columns = [np.asarray(values[name], dtype=np.float64) for name in self.variables]
        for name, column in zip(self.variables, columns, strict=True):
            warn_outside(self.name, name, column, self.measured.get(name))
        return np.asarray(self.terms(*columns) @ self.coefficients)

    def terms(self, *columns: ArrayLike) -> FloatArray:
        """Return the value of every term without its coefficient, shape (..., terms); variables in order."""
        arrays = np.broadcast_arrays(*(np.asarray(column, dtype=np.float64) for column in columns))
        powers = [
            np.prod([array**power for array, power in zip(arrays, term, strict=True)], axis=0)
            for term in self.exponents
        ]
        return np.stack(powers, axis=-1)


@dataclass(frozen=True, eq=False)
class SurfaceDrag:
    """A surface as a drag force: its negative value along the body's x and y axes, zero along z.

    A wind tunnel measures drag along x; along y it is assumed equal by symmetry. Velocities of either sign are inserted
    into the polynomial unchanged. Calling the surface outside its measured range warns; evaluating the force does not,
    since most of a flight is outside that range.

    Parameters
    ----------
    surface : Surface
        Of ``pitch_deg``, ``velocity`` and ``speed_rpm``, or some of them.
    count : int
        How many such bodies there are: 1 airframe, 4 propellers.
    """

    surface: Surface
    count: int = 1

    def force(self, velocity: ArrayLike, *, pitch: ArrayLike = 0.0, rotor_speed: ArrayLike = 0.0) -> FloatArray:
        """Return the force in the body frame, shape (..., 3) [N]; rotor speeds enter by their mean."""
        v = np.asarray(velocity, dtype=np.float64)
        speeds = np.asarray(rotor_speed, dtype=np.float64)
        mean = speeds if speeds.ndim == 0 else speeds.mean(axis=-1)
        force = np.zeros(v.shape)
        for axis in (0, 1):
            known = {"pitch_deg": np.degrees(pitch), "velocity": v[..., axis], "speed_rpm": mean / RPM}
            terms = self.surface.terms(*(known[name] for name in self.surface.variables))
            force[..., axis] = -self.count * (terms @ self.surface.coefficients)
        return force


def warn_outside(model: str, name: str, values: FloatArray, measured: Range | None) -> None:
    """Warn if any value lies outside the measured range (low, high)."""
    if measured is None or values.size == 0:
        return
    low, high = float(np.min(values)), float(np.max(values))
    if low < measured[0] or high > measured[1]:
        seen = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        message = f"{model} was measured for {name} from {measured[0]:g} to {measured[1]:g}, not at {seen}"
        warn_caller(message, OutsideRangeWarning)
