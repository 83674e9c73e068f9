"""Utilisation of a vehicle's rotors, and with drag of its thrust, tilt and body rate, certified over all time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray, IntArray
from minsnap.basics.cached import cached_property
from minsnap.basics.limit_kinds import KIND
from minsnap.errors import LimitError
from minsnap.limits.utilisation import leg_at, used_at
from minsnap.native.library import core
from minsnap.native.vehicle_proof import Facing, VehicleNumbers, VehicleQuestion, vehicle_proof, vehicle_samples
from minsnap.trajectory.heading import RemappedHeading, TurnedHeading
from minsnap.trajectory.medium import Medium
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.tilt_heading import TiltHeading
from minsnap.trajectory.trajectory import Trajectory, remembered

if TYPE_CHECKING:
    from minsnap.vehicle import Quadrotor
    from minsnap.vehicle.dynamics import FlatStates


@dataclass(frozen=True)
class VehicleUseSettings:
    """How largest values of a vehicle's quantities are sampled and proved.

    Parameters
    ----------
    margin : float
        Share added to the largest of many samples, below which bounds prove that all values stay.
    samples, fewer : int
        Samples of a piece from which the largest value is taken, and those where bounds prove it.
    finer_steps, between, peaks : int
        Where bounds prove nothing, and more than samples are wanted, how often each step beside the highest so many
        peaks of them is divided, and into how many parts: before a heading turns in another way a value rises and
        jumps, as it does before a knot.
    rounds : int
        How often pieces are divided.
    first, parts, most : int
        Into how many parts at first and later, and up to how many in all.
    missed : int
        Rounds after which samples have missed what is still open: its parts are sampled in their middle.
    finer : float
        Share of the margin that is added there.
    """

    margin: float = 1e-4
    samples: int = 256
    fewer: int = 64
    finer_steps: int = 2
    between: int = 32
    peaks: int = 3
    rounds: int = 9
    first: int = 8
    parts: int = 4
    most: int = 400_000
    missed: int = 4
    finer: float = 0.1


VEHICLE_USE = VehicleUseSettings()

LIFTED = ("max_thrust", "min_thrust", "tilt", "body_rate")
"""Limits that depend on the thrust axis, and so on the drag."""

ROTORS = ("rotor_thrust", "min_rotor_thrust")
"""Both sides of the rotors' thrust range."""

QUANTITIES = (*LIFTED, *ROTORS)
"""What is measured, in the order of the native core."""

Bound = tuple[float, float, str]
"""Largest value, instant [s], method."""


def measure_vehicle(
    vehicle: Quadrotor, reserve: float, bounds: Mapping[str, float], traj: Trajectory, proved: bool = True
) -> dict[str, Utilisation]:
    """Return the utilisation of the rotors' thrust range, and with drag of those of ``LIFTED`` that are set, by name.

    Raises
    ------
    LimitError
        If the heading follows from the tilt at another gravity than the vehicle's: no attitude has both.
    """
    medium = traj.yaw.medium
    if medium is not None and medium.gravity != vehicle.gravity:
        raise LimitError(
            f"the heading follows from the tilt at a gravity of {medium.gravity:g} m/s^2, the vehicle's is "
            f"{vehicle.gravity:g} m/s^2: plan with the vehicle's, or give the heading the same"
        )
    hover, (least, most) = vehicle.hover_thrust, vehicle.rotor_thrust_limits
    lifted = {name: bounds[name] for name in LIFTED if name in bounds} if medium_of(vehicle).drags else {}
    measured = dict(zip((*lifted, *ROTORS), VehicleBound(vehicle, traj, lifted).run(proved), strict=True))
    used = {
        name: used_at(
            traj, name, limit, -measured[name][0] if KIND[name].least else measured[name][0], *measured[name][1:]
        )
        for name, limit in lifted.items()
    }
    for name, room in zip(ROTORS, (most - hover, least - hover), strict=True):
        excess, instant, method = measured[name]
        share, side = max(excess, 0.0) / ((1.0 - reserve) * abs(room)), float(np.sign(room))
        values = hover + side * excess, hover + (1.0 - reserve) * room
        used[name] = Utilisation(name, *values, share, leg_at(traj, instant), instant, method)
    return used


class VehicleBound:
    """Largest values of quantities of a vehicle along a path: sampled, then proved by bounds on parts.

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
        self.margins = VEHICLE_USE.margin * np.array([*lifted.values(), self.hover, self.hover])

    def run(self, prove: bool = True) -> list[Bound]:
        """Return the largest value of each quantity, the margin added; proved, or only expected to be."""
        provable = self._provable
        largest, instants = self._largest(prove)
        values = largest + self.margins
        provable &= np.isfinite(values)
        if prove and provable.any():
            values = self._proved(values, provable)
        return [
            (float(value), float(t), "interval" if proof else "sampled")
            for value, t, proof in zip(values, instants, provable, strict=True)
        ]

    def _largest(self, prove: bool) -> tuple[FloatArray, FloatArray]:
        """Return the largest of many samples of each quantity and the instants of these, (count,)."""
        all_ = bool(self._provable.all())
        samples = VEHICLE_USE.fewer if all_ else VEHICLE_USE.samples
        if all_:
            what = f"largest of {samples} samples"
            known = remembered(self.traj, what, self.vehicle, lambda: vehicle_samples(self._question(), samples))
            if known is not None:
                return known[0][self._places], known[1][self._places]
        t, sampled = self.sampled(samples)
        if prove and not all_:
            t, sampled = remembered(self.traj, f"peaks of {self.names}", self.vehicle, lambda: self._finer(t, sampled))
        return sampled.max(axis=1), t[sampled.argmax(axis=1)]

    def _proved(self, values: FloatArray, provable: BoolArray) -> FloatArray:
        """Return values (count,), those that are provable raised until bounds prove that nothing goes beyond."""
        every, finer, places = np.zeros(len(QUANTITIES)), np.zeros(len(QUANTITIES)), self._places
        every[places], finer[places] = values, VEHICLE_USE.finer * self.margins
        wanted = sum(1 << int(place) for place in places[provable])
        return np.asarray(vehicle_proof(self._question(), every, finer, wanted, VEHICLE_USE)[places])

    @property
    def _places(self) -> IntArray:
        return np.array([QUANTITIES.index(name) for name in self.names])

    def sampled(self, samples: int = VEHICLE_USE.samples) -> tuple[FloatArray, FloatArray]:
        """Return many instants (m,) [s] and the quantities there, (count, m); the same curve is sampled once."""
        what = f"{samples} samples a piece of {self.names}"
        return remembered(self.traj, what, self.vehicle, lambda: self._sampled(samples))

    def _sampled(self, samples: int) -> tuple[FloatArray, FloatArray]:
        inner = np.linspace(0.0, 1.0, samples, endpoint=False)
        grid = self.traj.breaks[:-1, None] + self.traj.durations[:, None] * inner
        t = np.append(grid, self.traj.duration)
        return t, self._at(t)

    def _finer(self, t: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return instants (m,) and values (count, m) with those before knots and beside peaks of what has no bounds."""
        for step in range(VEHICLE_USE.finer_steps + 1):
            before = np.nextafter(self.traj.breaks[1:-1], 0.0)
            more = self._beside_peaks(t, values[~self._provable]) if step else before
            order = np.append(t, more).argsort(kind="stable")
            t, values = np.append(t, more)[order], np.append(values, self._at(more), axis=1)[:, order]
        return t, values

    def _beside_peaks(self, t: FloatArray, values: FloatArray) -> FloatArray:
        """Return instants between those (m,) beside the highest peaks of the values (count, m) there."""
        with np.errstate(invalid="ignore"):
            step = np.diff(values, axis=1, prepend=-np.inf, append=-np.inf)
        heights = np.where((step[:, :-1] >= 0.0) & (step[:, 1:] <= 0.0), values, -np.inf)
        highest = np.argsort(heights, axis=1, kind="stable")[:, -VEHICLE_USE.peaks :]
        first = np.unique(np.clip((highest, highest - 1), 0, len(t) - 2))
        inner = np.arange(1, VEHICLE_USE.between) / VEHICLE_USE.between
        return np.asarray(t[first, None] + (t[first + 1] - t[first])[:, None] * inner).reshape(-1)

    def _at(self, t: FloatArray) -> FloatArray:
        from minsnap.vehicle import flatness_of

        return self._quantities(flatness_of(self.vehicle, self.traj, t, drag=self.vehicle.flat_drag))

    @cached_property
    def _facing(self) -> Facing | None:
        return facing(self.traj, self.medium)

    @property
    def _provable(self) -> BoolArray:
        """Whether there are bounds: of rotors, if the yaw is a polynomial or the body turns about no axis.

        The native core computes them.
        """
        alike = lateral_alike(self.vehicle) and self.traj.dim == 3 and core().library is not None
        return np.array([alike and (self._facing is not None or name not in ROTORS) for name in self.names])

    def _quantities(self, states: FlatStates) -> FloatArray:
        thrust, up = states.thrust / self.vehicle.weight, states.rotation[:, :, 2]
        rotors = self.vehicle.thrusts(states.rotor_speed)
        quantities = {
            "max_thrust": thrust,
            "min_thrust": -thrust,
            "tilt": np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2]),
            "body_rate": np.hypot(states.body_rates[:, 0], states.body_rates[:, 1]),
            "rotor_thrust": rotors.max(axis=1) - self.hover,
            "min_rotor_thrust": self.hover - rotors.min(axis=1),
        }
        return np.array([quantities[name] for name in self.names])

    def _question(self) -> VehicleQuestion:
        vehicle = self.vehicle
        numbers = VehicleNumbers(vehicle.mass, np.array(self.medium.values), vehicle.inertia, vehicle.inverse_mixer)
        return VehicleQuestion(numbers, self.traj, self._facing)


def facing(traj: Trajectory, medium: Medium) -> Facing | None:
    """Return how a trajectory heads, where that is known in closed form: by a polynomial, or without any spin.

    Parameters
    ----------
    traj : Trajectory
    medium : Medium
        Gravity and drag of the vehicle that flies it.
    """
    yaw, start, rate = traj.yaw, 0.0, 1.0
    while isinstance(yaw, (RemappedHeading, TurnedHeading)):
        if isinstance(yaw, RemappedHeading):
            start, rate = yaw.start + yaw.rate * start, yaw.rate * rate
        yaw = yaw.heading
    if yaw.constant is not None:
        return Facing(angle=yaw.constant)
    if yaw.polynomial is not None:
        return Facing(yaw.polynomial, start, rate, jerk=traj.yaw.largest_jerk)
    if not isinstance(yaw, TiltHeading) or (start, rate) != (0.0, 1.0):
        return None
    known = yaw.medium.values[1:3] == medium.values[1:3] and traj._is_like(yaw.path)
    return Facing(angle=yaw.angle, spinless=True) if known else None


def lateral_alike(vehicle: Quadrotor) -> bool:
    """Whether the drag is the same along both lateral axes, so that the thrust axis does not depend on the yaw."""
    drag = vehicle.flat_drag
    return bool(drag.linear[0] == drag.linear[1] and drag.quadratic[0] == drag.quadratic[1])


def medium_of(vehicle: Quadrotor) -> Medium:
    """Return gravity and drag per mass; lateral drag that is not the same along both axes is replaced by its mean."""
    drag = vehicle.flat_drag
    across, more = [], []
    for values in (drag.linear / vehicle.mass, drag.quadratic / vehicle.mass):
        across.append(0.5 * float(values[0] + values[1]))
        more.append(float(values[2]) - across[-1])
    return Medium(vehicle.gravity, across[0], across[1], more[0], more[1])
