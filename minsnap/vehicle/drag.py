"""Aerodynamic drag as a force in the body frame: the protocol of a drag model, and physically consistent models."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import FloatArray, ReadOnly, bounded, numbers, set_fields
from minsnap.basics.messages import shown
from minsnap.errors import VehicleError


@runtime_checkable
class Drag(Protocol):
    """Aerodynamic drag force on a vehicle."""

    def force(
        self, velocity: npt.ArrayLike, *, pitch: npt.ArrayLike = 0.0, rotor_speed: npt.ArrayLike = 0.0
    ) -> FloatArray:
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
        self, velocity: npt.ArrayLike, body_rates: npt.ArrayLike, hubs: FloatArray, **air: npt.ArrayLike
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

    def __init__(self, linear: npt.ArrayLike = (0.0, 0.0, 0.0), quadratic: npt.ArrayLike = (0.0, 0.0, 0.0)) -> None:
        across = coefficients("linear drag", linear)
        set_fields(self, linear=across, quadratic=coefficients("quadratic drag", quadratic))

    @property
    def absent(self) -> bool:
        """Whether every coefficient is zero."""
        return not (self.linear.any() or self.quadratic.any())

    def force(
        self, velocity: npt.ArrayLike, *, pitch: npt.ArrayLike = 0.0, rotor_speed: npt.ArrayLike = 0.0
    ) -> FloatArray:
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
class RotorSpeedDrag:
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

    def __init__(self, coefficient: npt.ArrayLike) -> None:
        set_fields(self, coefficient=coefficients("rotor drag", coefficient))

    def force(
        self, velocity: npt.ArrayLike, *, pitch: npt.ArrayLike = 0.0, rotor_speed: npt.ArrayLike = 0.0
    ) -> FloatArray:
        """Return the force in the body frame, shape (..., 3) [N]; a single rotor speed applies to all four rotors."""
        speeds = np.asarray(rotor_speed, dtype=np.float64)
        total = 4.0 * speeds if speeds.ndim == 0 else speeds.sum(axis=-1)
        return -np.asarray(total)[..., None] * self.coefficient * np.asarray(velocity, dtype=np.float64)

    def wrench(
        self, velocity: npt.ArrayLike, body_rates: npt.ArrayLike, hubs: FloatArray, **air: npt.ArrayLike
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

    def force(self, velocity: npt.ArrayLike, **air: npt.ArrayLike) -> FloatArray:
        """Return the force in the body frame, shape (..., 3) [N]; see :class:`Drag`."""
        none = np.zeros(np.shape(velocity))
        return sum((part.force(velocity, **air) for part in self.parts), start=none)

    def wrench(
        self, velocity: npt.ArrayLike, body_rates: npt.ArrayLike, hubs: FloatArray, **air: npt.ArrayLike
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


def coefficients(name: str, values: npt.ArrayLike) -> FloatArray:
    """Return three non-negative finite numbers as a read-only array, or raise VehicleError naming them."""
    array = numbers(values)
    if array is None or array.shape != (3,) or not bounded(array).all() or (array < 0).any():
        raise VehicleError(f"{name} is {shown(values)}: give three numbers along x, y, z of the body, none below 0")
    return array
