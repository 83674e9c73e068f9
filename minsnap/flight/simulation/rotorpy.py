"""Use minsnap's paths in RotorPy, and RotorPy's vehicles here (extra ``sim``).

RotorPy is the multirotor simulator of Folk, Paulos and Kumar (*RotorPy: a Python-based multirotor simulator with
aerodynamics for education and research*, 2023). It numbers rotors front left, front right, rear right, rear left;
minsnap numbers them counter-clockwise, so rotors 2 and 4 are exchanged. Its quaternions are x, y, z, w.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.basics.checks import check_kind
from minsnap.errors import VehicleError
from minsnap.flight.simulation.flight_inputs import drag_feed_forward
from minsnap.trajectory import Samples
from minsnap.vehicle import BodyDrag, Drag, Quadrotor, RotorSpeedDrag, SumOfDrags, spatial

if TYPE_CHECKING:
    from minsnap.trajectory import Path

ROTOR_ORDER = (0, 3, 2, 1)
"""Which of the one's rotors each of the other's is, either way."""

GRAVITY = 9.81
"""What RotorPy takes for gravity [m/s^2]."""


class RotorPyTrajectory:
    """A path in RotorPy's trajectory interface: ``update(t)`` returns the flat outputs; the end is held.

    Parameters
    ----------
    path : Path
        Of two or three dimensions.
    vehicle : Quadrotor or None
        Needed with ``compensation``.
    compensation : Drag or None
        Model of drag that is offset, by adding to ``x_ddot``.

    Raises
    ------
    VehicleError
        If there is a compensation and no vehicle.
    """

    def __init__(self, path: Path, *, vehicle: Quadrotor | None = None, compensation: Drag | None = None) -> None:
        if compensation is not None and vehicle is None:
            raise VehicleError("to offset drag the vehicle is needed for its mass: give vehicle=")
        self._path, self._vehicle, self._compensation = path, vehicle, compensation

    def update(self, t: float) -> dict[str, Any]:
        """Return position, its four derivatives, yaw and its two, at an instant [s].

        Parameters
        ----------
        t : float
            From 0 on; RotorPy asks for infinity to learn the end.

        Returns
        -------
        dict
            ``x``, ``x_dot``, ``x_ddot``, ``x_dddot``, ``x_ddddot``, each of shape (3,), ``yaw``, ``yaw_dot``,
            ``yaw_ddot``.
        """
        inside = float(np.clip(t, 0.0, self._path.duration))
        held = float(t) <= self._path.duration
        motion = [spatial(self._path(inside, order)) * float(held or order == 0) for order in range(5)]
        turning = [float(self._path.yaw(inside, order)) * float(held or order == 0) for order in range(3)]
        if self._compensation is not None and self._vehicle is not None:
            motion[2] = motion[2] + self._offset(self._vehicle, self._compensation, motion, turning)
        names = ("x", "x_dot", "x_ddot", "x_dddot", "x_ddddot", "yaw", "yaw_dot", "yaw_ddot")
        return dict(zip(names, [*motion, *turning], strict=True))

    def _offset(self, vehicle: Quadrotor, drag: Drag, motion: list[FloatArray], turning: list[float]) -> FloatArray:
        position, velocity, acceleration, jerk, snap = (value[None] for value in motion)
        yaw, rate = np.array(turning[:1]), np.array(turning[1:2])
        now = Samples(np.zeros(1), position, velocity, acceleration, jerk, snap, yaw, rate)
        return np.asarray(drag_feed_forward(vehicle, now, drag)[0])


def from_rotorpy(parameters: Mapping[str, Any], *, aero: bool = True) -> Quadrotor:
    """Return the vehicle that RotorPy's parameters describe.

    Its airframe drag and its rotor drag at each hub are converted; flapping moments and translational lift are not.

    Parameters
    ----------
    parameters : mapping
        Such as ``rotorpy.vehicles.hummingbird_params.quad_params``.
    aero : bool
        False leaves drag out, as RotorPy does with ``aero=False``.

    Returns
    -------
    Quadrotor

    Raises
    ------
    VehicleError
        If it is no quadrotor in a level x layout, or its parameters are incomplete or not those of a physical body.
    """
    check_kind("RotorPy's parameters", parameters, Mapping, "a mapping such as hummingbird_params.quad_params")
    try:
        return _vehicle(parameters, aero)
    except KeyError as missing:
        raise VehicleError(f"RotorPy's parameters have no {missing}: give it") from None


def _vehicle(parameters: Mapping[str, Any], aero: bool) -> Quadrotor:
    hubs = np.array(list(parameters["rotor_pos"].values()), dtype=np.float64)
    if hubs.shape != (4, 3):
        raise VehicleError(f"RotorPy's vehicle has {len(hubs)} rotors: only quadrotors are taken over")
    vehicle = Quadrotor(
        mass=parameters["mass"],
        inertia=_inertia(parameters),
        arm_length=float(np.linalg.norm(hubs[0])),
        thrust_coefficient=parameters["k_eta"],
        torque_coefficient=parameters["k_m"],
        rotor_speed_max=parameters["rotor_speed_max"],
        rotor_speed_min=parameters["rotor_speed_min"],
        layout="x",
        drag=_drag(parameters) if aero else BodyDrag(),
        motor_time_constant=parameters["tau_m"],
        gravity=GRAVITY,
        name="from RotorPy",
    )
    _check_layout(hubs, np.asarray(parameters["rotor_directions"]), vehicle)
    return vehicle


def reorder_rotors(values: ArrayLike) -> FloatArray:
    """Convert values of four rotors, shape (..., 4), between RotorPy's order and minsnap's (either direction)."""
    return np.asarray(values, dtype=np.float64)[..., list(ROTOR_ORDER)]


def _inertia(parameters: Mapping[str, Any]) -> FloatArray:
    names = (("Ixx", "Ixy", "Ixz"), ("Ixy", "Iyy", "Iyz"), ("Ixz", "Iyz", "Izz"))
    return np.array([[parameters[name] for name in row] for row in names], dtype=np.float64)


def _drag(parameters: Mapping[str, Any]) -> Drag:
    body = BodyDrag(quadratic=[parameters.get(name, 0.0) for name in ("c_Dx", "c_Dy", "c_Dz")])
    across, along = parameters.get("k_d", 0.0), parameters.get("k_z", 0.0)
    return SumOfDrags((body, RotorSpeedDrag((across, across, along)))) if across or along else body


def _check_layout(hubs: FloatArray, directions: FloatArray, vehicle: Quadrotor) -> None:
    ours = vehicle.rotor_positions[list(ROTOR_ORDER)]
    if np.abs(hubs - ours).max() > 1e-6 * vehicle.arm_length or not np.array_equal(directions, [1, -1, 1, -1]):
        raise VehicleError("RotorPy's vehicle is not in a level x layout with rotors turning in alternation")
