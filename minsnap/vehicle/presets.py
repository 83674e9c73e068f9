"""Parameters of the vehicles that come with the library, and the source of each number."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from minsnap.basics.arrays import GRAVITY, FloatArray
from minsnap.vehicle.drag import RPM, BodyDrag, RotorSpeedDrag

F330_AIRFRAME = BodyDrag(
    (0.0, 0.0, 0.18878475695173547), (0.007699517888496992, 0.007699517888496992, 0.009931995378002222)
)
"""Drag of the F330's airframe [N s/m], [N s^2/m^2], by :func:`minsnap.flight.thesis.consistent_parasitic_drag`."""

F330_ROTORS = BodyDrag((0.165728, 0.165728, 0.0))
"""Drag of its four propellers [N s/m]: :func:`minsnap.flight.thesis.consistent_rotor_drag` derives it."""


def dji_f330_parameters() -> dict[str, Any]:
    """Return the parameters of the DJI F330 of the thesis.

    Measured there (section 4.6, in N/RPM^2 and N m/RPM^2): thrust coefficient 7.456e-8 and torque coefficient 2.278e-9
    of the 8045 propeller; drag from its wind tunnel, see :mod:`minsnap.flight.thesis.drag_fits`.

    From the name of the frame: arms of 165 mm, half of the 330 mm between opposite hubs.

    Assumed here, since the thesis does not give them: mass 1.0 kg, which hovers at 5.7 kRPM with that coefficient, a
    speed within the measurements on the bench; inertia (see :func:`_f330_inertia`); 9,500 RPM at most, about 70 % of
    the 13,600 RPM that 920 RPM/V make without load on four cells; 1,200 RPM at idle; motors with a time constant of 40
    ms, as is usual for their size.

    Returns
    -------
    dict
        Fields of :class:`~minsnap.vehicle.Quadrotor`.
    """
    return dict(
        mass=1.0,
        inertia=_f330_inertia(),
        arm_length=0.165,
        thrust_coefficient=7.456e-8 / RPM**2,
        torque_coefficient=2.278e-9 / RPM**2,
        rotor_speed_max=9500.0 * RPM,
        rotor_speed_min=1200.0 * RPM,
        layout="x",
        drag=F330_AIRFRAME + F330_ROTORS,
        motor_time_constant=0.04,
        name="DJI F330",
    )


def _f330_inertia() -> FloatArray:
    """Return the moments of four 75 g points at the hubs and a 0.7 kg block of 12, 10 and 10 cm.

    An estimate from the usual masses of the parts; no measurement of this frame is available.
    """
    points, block = 0.075, 0.7
    length, width, height = 0.12, 0.10, 0.10
    across = 4 * points * (0.165 / math.sqrt(2)) ** 2
    roll = across + block * (width**2 + height**2) / 12
    pitch = across + block * (length**2 + height**2) / 12
    yaw = 2 * across + block * (length**2 + width**2) / 12
    return np.array([roll, pitch, yaw])


def px4_sih_parameters() -> dict[str, Any]:
    """Return the parameters of the quadrotor of PX4's simulation in hardware.

    Default values of its parameters: SIH_MASS 1 kg, SIH_IXX, SIH_IYY 0.025 and SIH_IZZ 0.03 kg m^2, SIH_L_ROLL and
    SIH_L_PITCH 0.2 m, SIH_T_MAX 5 N a rotor, SIH_Q_MAX 0.1 N m, SIH_T_TAU 0.05 s, SIH_KDV 1 N s/m (drag linear in
    velocity).

    Assumed here: 1,000 rad/s for a rotor at full thrust, since that simulation has no rotor speeds.

    Returns
    -------
    dict
        Fields of :class:`~minsnap.vehicle.Quadrotor`.
    """
    fastest = 1000.0
    return dict(
        mass=1.0,
        inertia=np.array([0.025, 0.025, 0.03]),
        arm_length=0.2 * math.sqrt(2.0),
        thrust_coefficient=5.0 / fastest**2,
        torque_coefficient=0.1 / fastest**2,
        rotor_speed_max=fastest,
        layout="x",
        drag=BodyDrag((1.0, 1.0, 1.0)),
        motor_time_constant=0.05,
        name="PX4 SIH",
    )


def crazyflie_parameters() -> dict[str, Any]:
    """Return the parameters of a Crazyflie 2.x.

    Mass and inertia from Förster, *System identification of the Crazyflie 2.0 nano quadrocopter* (ETH 2015). Arm,
    thrust, torque, drag and motor coefficients as RotorPy collects them in its ``crazyflie_params`` (Folk, Paulos and
    Kumar 2023); its inertia is not used, since no rigid body can have it. The rotor drag, which is proportional to the
    rotor speed, is evaluated at the hover speed.

    Returns
    -------
    dict
        Fields of :class:`~minsnap.vehicle.Quadrotor`.
    """
    mass, thrust = 0.028, 2.3e-8
    hover = math.sqrt(mass * GRAVITY / 4 / thrust)
    return dict(
        mass=mass,
        inertia=np.array([16.571710e-6, 16.655602e-6, 29.261652e-6]),
        arm_length=0.043,
        thrust_coefficient=thrust,
        torque_coefficient=7.8e-10,
        rotor_speed_max=2500.0,
        layout="x",
        drag=RotorSpeedDrag((10.2506e-7, 10.2506e-7, 7.553e-7)).at(hover),
        motor_time_constant=0.072,
        name="Crazyflie 2.x",
    )
