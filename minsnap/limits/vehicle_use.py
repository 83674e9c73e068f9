"""Utilisation of a vehicle's rotors, and with drag of its thrust, tilt and body rate, certified over all time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.basics.cached import cached_property
from minsnap.basics.limit_kinds import KIND
from minsnap.errors import LimitError
from minsnap.limits.utilisation import leg_at, used_at
from minsnap.native.library import core
from minsnap.native.vehicle_bounds import VehicleNumbers, vehicle_bounds
from minsnap.polynomials.bernstein import differentiate, elevate, subdivide
from minsnap.trajectory.medium import Medium
from minsnap.trajectory.report import Utilisation
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
        t, sampled = self.sampled(VEHICLE_USE.fewer if provable.all() else VEHICLE_USE.samples)
        if prove and not provable.all():
            t, sampled = remembered(self.traj, f"peaks of {self.names}", self.vehicle, lambda: self._finer(t, sampled))
        values = sampled.max(axis=1) + self.margins
        provable &= np.isfinite(values)
        if prove and provable.any():
            names = [name for name, proof in zip(self.names, provable, strict=True) if proof]
            values[provable] = proved(
                values[provable],
                partial(self.bounds, names),
                self.traj,
                lambda middle: (self._at(middle).max(axis=1) + VEHICLE_USE.finer * self.margins)[provable],
            )
        return [
            (float(value), float(t[i]), "interval" if proof else "sampled")
            for value, i, proof in zip(values, sampled.argmax(axis=1), provable, strict=True)
        ]

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
    def _turns(self) -> float:
        return self.yaw.largest_jerk

    @property
    def _provable(self) -> BoolArray:
        """Whether there are bounds: of rotors, if the yaw is a polynomial or the body turns about no axis.

        The native core computes them.
        """
        if self.yaw.medium is not None:
            known = self.yaw.medium.values[1:3] == self.medium.values[1:3]
        else:
            known = bool(np.isfinite(self._turns))
        alike = lateral_alike(self.vehicle) and core().library is not None
        return np.array([alike and (known or name not in ROTORS) for name in self.names])

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

    def bounds(self, names: Sequence[str], points: FloatArray, start: FloatArray, width: FloatArray) -> FloatArray:
        """Upper bounds of some quantities on parts that begin at instants and are so wide [s], (names, parts)."""
        half = 0.5 * width
        heading = self._heading(start + half) if "rotor_thrust" in names else {}
        bounds = vehicle_bounds(self._numbers, points, half, **heading)
        if bounds is None:
            return np.full((len(names), len(half)), np.inf)
        thrust, least, tangent, rate, most, down = bounds.T
        known = {
            "max_thrust": thrust / self.medium.gravity,
            "min_thrust": least / self.medium.gravity,
            "tilt": np.where(np.isfinite(tangent), np.arctan(np.sqrt(tangent)), np.pi),
            "body_rate": np.sqrt(rate),
            "rotor_thrust": most - self.hover,
            "min_rotor_thrust": down + self.hover,
        }
        return np.array([known[name] for name in names])

    @cached_property
    def _numbers(self) -> VehicleNumbers:
        vehicle = self.vehicle
        return VehicleNumbers(vehicle.mass, np.array(self.medium.values), vehicle.inertia, vehicle.inverse_mixer)

    def _heading(self, middle: FloatArray) -> dict[str, Any]:
        """Return what the bounds take of the heading in the middle of each part."""
        axes = self.yaw.axes(middle)
        if axes is not None:
            return {"axes": np.ascontiguousarray(np.moveaxis(np.array(axes[:2]), 2, 0))}
        yaw = self.yaw(middle)
        turns = np.stack((np.cos(yaw), np.sin(yaw), self.yaw(middle, 1), self.yaw(middle, 2)), axis=1)
        return {"yaw": turns, "jerk": self._turns}


def proved(
    values: FloatArray,
    bounds: Callable[[FloatArray, FloatArray, FloatArray], FloatArray],
    traj: Trajectory,
    attained: Callable[[FloatArray], FloatArray] | None = None,
) -> FloatArray:
    """Return values (count,) of quantities, raised until bounds prove that none goes beyond.

    Parameters
    ----------
    bounds : callable
        From control points (parts, 4, 3, n) of velocity to snap on parts that begin at instants and are so wide [s] to
        bounds (count, parts).
    attained : callable, optional
        From instants (m,) [s] to values (count,) a little above those there, to which the first ones may be raised.
    """
    points, start, width = motion_points(traj), traj.breaks[:-1], traj.durations
    for level in range(VEHICLE_USE.rounds):
        proved_bounds = bounds(points, start, width)
        proved_bounds = np.where(np.isnan(proved_bounds), np.inf, proved_bounds)
        open_ = (proved_bounds > values[:, None]).any(axis=0)
        if attained is not None and level >= VEHICLE_USE.missed and open_.any():
            values = np.fmax(values, attained((start + 0.5 * width)[open_]))
            open_ = (proved_bounds > values[:, None]).any(axis=0)
        if not open_.any():
            return values
        parts = VEHICLE_USE.parts if level else VEHICLE_USE.first
        if open_.sum() * parts > VEHICLE_USE.most or level == VEHICLE_USE.rounds - 1:
            break
        points, start, width = _divided(points[open_], start[open_], width[open_], parts)
    return np.asarray(np.maximum(values, proved_bounds.max(axis=1)))


def motion_points(traj: Trajectory) -> FloatArray:
    """Return control points of velocity to snap on each piece, of one degree, (pieces, 4, 3, n)."""
    control, durations = traj.control_points, traj.durations
    size = control.shape[1] - 1
    scaled = (differentiate(control, order) / durations[:, None, None] ** order for order in range(1, 5))
    return np.stack([elevate(part.transpose(0, 2, 1), size) for part in scaled], axis=1)


def _divided(
    points: FloatArray, start: FloatArray, width: FloatArray, parts: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    count, size = len(points), points.shape[3]
    finer = subdivide(points.reshape(-1, size), parts).reshape(count, 12, parts, size).transpose(0, 2, 1, 3)
    begins = start[:, None] + width[:, None] * np.arange(parts) / parts
    return np.ascontiguousarray(finer).reshape(-1, 4, 3, size), begins.reshape(-1), np.repeat(width / parts, parts)


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
