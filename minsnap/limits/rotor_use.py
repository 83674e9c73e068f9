"""Utilisation of the thrust range of each rotor of a vehicle, certified over all time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.errors import LimitError
from minsnap.limits.proved_bound import MARGIN, Found, Lift, ProvedBound
from minsnap.limits.rotor_bounds import Part, axis_ranges, heading_ranges, rotor_ranges
from minsnap.limits.utilisation import leg_at
from minsnap.polynomials.intervals import Interval
from minsnap.trajectory.heading import ConstantHeading, RemappedHeading
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.tilt_heading import TiltHeading

if TYPE_CHECKING:
    from minsnap.trajectory.trajectory import Trajectory
    from minsnap.vehicle import Quadrotor
    from minsnap.vehicle.states import FlatStates


def measure_rotors(vehicle: Quadrotor, reserve: float, traj: Trajectory) -> list[Utilisation]:
    """Return the utilisation of the rotors' thrust range above and below hover.

    Raises
    ------
    LimitError
        If the heading follows from the tilt at another gravity than the vehicle's: no attitude has both.
    """
    if isinstance(traj.yaw, TiltHeading) and traj.yaw.gravity != vehicle.gravity:
        raise LimitError(
            f"the heading follows from the tilt at a gravity of {traj.yaw.gravity:g} m/s^2, the vehicle's is "
            f"{vehicle.gravity:g} m/s^2: plan with the vehicle's, or give the heading the same"
        )
    hover, (least, most) = vehicle.hover_thrust, vehicle.rotor_thrust_limits
    found = RotorBound(vehicle, traj).run()
    return [
        _used(traj, "rotor_thrust", hover + (1.0 - reserve) * (most - hover), 1.0, hover, found[0]),
        _used(traj, "min_rotor_thrust", hover - (1.0 - reserve) * (hover - least), -1.0, hover, found[1]),
    ]


def _used(traj: Trajectory, name: str, limit: float, side: float, hover: float, found: Found) -> Utilisation:
    excess, instant, method = found
    fraction = max(excess, 0.0) / abs(limit - hover)
    return Utilisation(name, hover + side * excess, limit, fraction, leg_at(traj, instant), instant, method)


class RotorBound(ProvedBound):
    """Largest deviations of the rotors' thrusts from hover, upwards and downwards [N]."""

    def __init__(self, vehicle: Quadrotor, traj: Trajectory) -> None:
        super().__init__(vehicle, traj)
        self.yaw, self.turns, self.hover = traj.yaw, _yaw_jerk(traj.yaw), vehicle.hover_thrust
        self.margins = np.full(2, MARGIN * self.hover)

    @property
    def _provable(self) -> bool:
        """Whether the yaw is a polynomial, or the body does not spin about the very axis that the thrust has."""
        if isinstance(self.yaw, TiltHeading):
            return self.yaw.drag == (self.medium.linear, self.medium.quadratic)
        return bool(np.isfinite(self.turns))

    def _quantities(self, states: FlatStates) -> FloatArray:
        thrust = self.vehicle.thrust_coefficient * states.rotor_speed * np.abs(states.rotor_speed)
        return np.array([thrust.max(axis=1) - self.hover, self.hover - thrust.min(axis=1)])

    def _bounds(self, motion: Lift, start: FloatArray, width: FloatArray) -> FloatArray:
        rotors = rotor_ranges(self.vehicle, self._part(motion, start + 0.5 * width, 0.5 * width))
        above = np.max([rotor.high for rotor in rotors], axis=0) - self.hover
        below = self.hover - np.min([rotor.low for rotor in rotors], axis=0)
        return np.array([above, below])

    def _part(self, motion: Lift, middle: FloatArray, half: FloatArray) -> Part:
        """Ranges of the motion with those of the heading."""
        thrust = motion.thrust(self.medium.more_linear, self.medium.more_quadratic)
        lift = motion.force, motion.change, motion.bend
        if not isinstance(self.yaw, TiltHeading):
            return Part(thrust, *lift, heading_ranges(*self._yaw_ranges(middle, half)))
        x, y = axis_ranges(motion.force, motion.change, self.yaw.axes(middle)[:2], half)
        return Part(thrust, *lift, (x, y, x), True)

    def _yaw_ranges(self, middle: FloatArray, half: FloatArray) -> tuple[Interval, Interval, Interval]:
        """Ranges of yaw and its derivatives around the middle of each part, from a bound of the third one."""
        spread, ranges = self.turns + np.zeros(len(half)), []
        for order in (2, 1, 0):
            value = self.yaw(middle, order)
            ranges.append(Interval(value - half * spread, value + half * spread))
            spread = np.abs(value) + half * spread
        return ranges[2], ranges[1], ranges[0]


def _yaw_jerk(heading: Any) -> float:
    """Largest third derivative of a yaw that is a polynomial on each leg [rad/s^3]; infinite for any other."""
    if isinstance(heading, ConstantHeading):
        return 0.0
    if isinstance(heading, RemappedHeading):
        return _yaw_jerk(heading.heading) * abs(heading.rate) ** 3
    return float(heading.trajectory.max_norm(3)[0]) if isinstance(heading, PlannedHeading) else float(np.inf)
