"""Utilisation of a vehicle's rotors, and with drag of its thrust, tilt and body rate, certified over all time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.basics.limit_kinds import KIND
from minsnap.errors import LimitError
from minsnap.limits.proved_bound import MARGIN, Lift, proved
from minsnap.limits.rotor_bounds import Part, axis_ranges, heading_ranges, rotor_ranges
from minsnap.limits.utilisation import leg_at, used_at
from minsnap.limits.vehicle_drag import flat_drag, lateral_alike, medium_of
from minsnap.polynomials.intervals import Interval, cross, dot, length
from minsnap.trajectory.report import Utilisation

if TYPE_CHECKING:
    from minsnap.trajectory.trajectory import Trajectory
    from minsnap.vehicle import Quadrotor
    from minsnap.vehicle.states import FlatStates

LIFTED = ("max_thrust", "min_thrust", "tilt", "body_rate")
"""Limits that depend on the thrust axis, and so on the drag."""

ROTORS = ("rotor_thrust", "min_rotor_thrust")
"""Both sides of the rotors' thrust range."""

PIECE_SAMPLES = 256
"""Samples of a piece from which the largest value is taken."""

Found = tuple[float, float, str]
"""Largest value, instant [s], method."""


def measure_vehicle(
    vehicle: Quadrotor, reserve: float, given: Mapping[str, float], traj: Trajectory
) -> dict[str, Utilisation]:
    """Return the utilisation of the rotors' thrust range, and with drag of those of ``LIFTED`` that are given, by name.

    Raises
    ------
    LimitError
        If the heading follows from the tilt at another gravity than the vehicle's: no attitude has both.
    """
    _check_gravity(vehicle, traj)
    hover, (least, most) = vehicle.hover_thrust, vehicle.rotor_thrust_limits
    lifted = lifted_limits(vehicle, given)
    found = dict(zip((*lifted, *ROTORS), VehicleBound(vehicle, traj, lifted).run(), strict=True))
    used = {
        name: used_at(traj, name, limit, -found[name][0] if KIND[name].least else found[name][0], *found[name][1:])
        for name, limit in lifted.items()
    }
    for name, room in zip(ROTORS, (most - hover, least - hover), strict=True):
        excess, instant, method = found[name]
        share, side = max(excess, 0.0) / ((1.0 - reserve) * abs(room)), float(np.sign(room))
        values = hover + side * excess, hover + (1.0 - reserve) * room
        used[name] = Utilisation(name, *values, share, leg_at(traj, instant), instant, method)
    return used


def keeps_vehicle(vehicle: Quadrotor, reserve: float, given: Mapping[str, float], traj: Trajectory) -> bool:
    """Whether the same quantities are proved to be within their limits; sooner than they are measured.

    False also where there are no interval bounds.

    Raises
    ------
    LimitError
        As ``measure_vehicle``.
    """
    _check_gravity(vehicle, traj)
    hover, lifted = vehicle.hover_thrust, lifted_limits(vehicle, given)
    room = [(1.0 - reserve) * abs(limit - hover) for limit in reversed(vehicle.rotor_thrust_limits)]
    most = [-limit if KIND[name].least else limit for name, limit in lifted.items()]
    return VehicleBound(vehicle, traj, lifted).stays_below(np.array([*most, *room]))


def lifted_limits(vehicle: Quadrotor, given: Mapping[str, float]) -> dict[str, float]:
    """Return the limits of ``LIFTED`` that depend on the drag of a vehicle."""
    return {name: given[name] for name in LIFTED if name in given} if medium_of(vehicle).drags else {}


def _check_gravity(vehicle: Quadrotor, traj: Trajectory) -> None:
    medium = traj.yaw.medium
    if medium is not None and medium.gravity != vehicle.gravity:
        raise LimitError(
            f"the heading follows from the tilt at a gravity of {medium.gravity:g} m/s^2, the vehicle's is "
            f"{vehicle.gravity:g} m/s^2: plan with the vehicle's, or give the heading the same"
        )


class VehicleBound:
    """Largest values of quantities of a vehicle along a path: sampled, then proved by interval bounds.

    These are, of ``LIFTED``, thrust and minus the least one over weight, tilt [rad] and body rate [rad/s]; then the
    largest deviations of the rotors' thrusts from hover, upwards and downwards [N].

    Parameters
    ----------
    vehicle : Quadrotor
    traj : Trajectory
    lifted : mapping of str to float
        Limits of ``LIFTED``, whose quantities are asked for.
    """

    def __init__(self, vehicle: Quadrotor, traj: Trajectory, lifted: Mapping[str, float]) -> None:
        self.vehicle, self.traj, self.yaw, self.medium = vehicle, traj, traj.yaw, medium_of(vehicle)
        self.names, self.hover = (*lifted, *ROTORS), vehicle.hover_thrust
        self.margins = MARGIN * np.array([*lifted.values(), self.hover, self.hover])

    def run(self) -> list[Found]:
        """Return the largest value of each quantity, the margin added."""
        t, sampled = self.sampled()
        values = sampled.max(axis=1) + self.margins
        provable = self._provable & np.isfinite(values)
        if provable.any():
            names = [name for name, proof in zip(self.names, provable, strict=True) if proof]
            values[provable] = proved(values[provable], partial(self.bounds, names), self.medium, self.traj)
        return [
            (float(value), float(t[i]), "interval" if proof else "sampled")
            for value, i, proof in zip(values, sampled.argmax(axis=1), provable, strict=True)
        ]

    def stays_below(self, most: FloatArray) -> bool:
        """Whether every quantity is proved to stay below a value (count,), with the margin at samples."""
        if not self._provable.all() or not (self.sampled()[1].max(axis=1) + self.margins <= most).all():
            return False
        return bool((proved(most, partial(self.bounds, self.names), self.medium, self.traj) <= most).all())

    def sampled(self) -> tuple[FloatArray, FloatArray]:
        """Return many instants (m,) [s] and the quantities there, (count, m)."""
        from minsnap.vehicle import flatness_of

        inner = np.linspace(0.0, 1.0, PIECE_SAMPLES, endpoint=False)
        grid = self.traj.breaks[:-1, None] + self.traj.durations[:, None] * inner
        t = np.append(grid, self.traj.duration)
        states = flatness_of(self.vehicle, self.traj, t, drag=flat_drag(self.vehicle))
        return t, self._quantities(states)

    @cached_property
    def _turns(self) -> float:
        return self.yaw.largest_jerk

    @property
    def _provable(self) -> BoolArray:
        """Whether there are interval bounds: of rotors, if the yaw is a polynomial or the body turns about no axis."""
        if self.yaw.medium is not None:
            known = self.yaw.medium.values[1:3] == self.medium.values[1:3]
        else:
            known = bool(np.isfinite(self._turns))
        alike = lateral_alike(self.vehicle)
        return np.array([alike and (known or name not in ROTORS) for name in self.names])

    def _quantities(self, states: FlatStates) -> FloatArray:
        thrust, up = states.thrust / self.vehicle.weight, states.rotation[:, :, 2]
        rotors = self.vehicle.thrust_coefficient * states.rotor_speed * np.abs(states.rotor_speed)
        found = {
            "max_thrust": thrust,
            "min_thrust": -thrust,
            "tilt": np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2]),
            "body_rate": np.hypot(states.body_rates[:, 0], states.body_rates[:, 1]),
            "rotor_thrust": rotors.max(axis=1) - self.hover,
            "min_rotor_thrust": self.hover - rotors.min(axis=1),
        }
        return np.array([found[name] for name in self.names])

    def bounds(self, names: Sequence[str], motion: Lift, start: FloatArray, width: FloatArray) -> FloatArray:
        """Upper bounds of some quantities on parts that begin at instants and are so wide [s], (names, parts)."""
        found = self._lifted(motion) if names[0] in LIFTED else {}
        if "rotor_thrust" in names:
            rotors = rotor_ranges(self.vehicle, self._part(motion, start + 0.5 * width, 0.5 * width))
            found["rotor_thrust"] = np.max([rotor.high for rotor in rotors], axis=0) - self.hover
            found["min_rotor_thrust"] = self.hover - np.min([rotor.low for rotor in rotors], axis=0)
        return np.array([found[name] for name in names])

    def _lifted(self, motion: Lift) -> dict[str, FloatArray]:
        force, gravity = motion.force, self.medium.gravity
        thrust = motion.thrust(self.medium.more_linear, self.medium.more_quadratic)
        aside = np.hypot(*(np.maximum(-part.low, part.high) for part in force[:2]))
        rate = (length(cross(force, motion.change)) / dot(force, force)).high
        return {
            "max_thrust": thrust.high / gravity,
            "min_thrust": -thrust.low / gravity,
            "tilt": np.where(force[2].low > 0.0, np.arctan2(aside, force[2].low), np.pi),
            "body_rate": np.minimum(rate, (length(motion.change) / length(force)).high),
        }

    def _part(self, motion: Lift, middle: FloatArray, half: FloatArray) -> Part:
        """Ranges of the motion with those of the heading."""
        thrust = motion.thrust(self.medium.more_linear, self.medium.more_quadratic)
        lift = motion.force, motion.change, motion.bend
        axes = self.yaw.axes(middle)
        if axes is None:
            return Part(thrust, *lift, heading_ranges(*self._yaw_ranges(middle, half)))
        x, y = axis_ranges(motion.force, motion.change, axes[:2], half)
        return Part(thrust, *lift, (x, y, x), True)

    def _yaw_ranges(self, middle: FloatArray, half: FloatArray) -> tuple[Interval, Interval, Interval]:
        """Ranges of yaw and its derivatives around the middle of each part, from a bound of the third one."""
        spread, ranges = self._turns + np.zeros(len(half)), []
        for order in (2, 1, 0):
            value = self.yaw(middle, order)
            ranges.append(Interval(value - half * spread, value + half * spread))
            spread = np.abs(value) + half * spread
        return ranges[2], ranges[1], ranges[0]
