"""Use of limits over time: at samples, and of the rotors of a vehicle along a path."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.limit_kinds import KIND, Kind
from minsnap.errors import InputError
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.limits.measures import MEASURES, Motion, sampled_motion
from minsnap.limits.vehicle_use import ROTORS
from minsnap.trajectory.leg_uses import LegUse, leg_uses
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples
from minsnap.trajectory.trajectory import Trajectory


def utilisation_curves(samples: Samples, limits: Limits) -> dict[str, FloatArray]:
    """Return the utilisation of each limit at every sample, shape (m,), 1 at the limit; by the limit's name.

    Raises
    ------
    InputError
        If no limit is set, or the samples lack what one bounds.
    """
    bounds = limits.given()
    if not bounds:
        raise InputError("no limit is set: there is nothing to draw")
    motion = sampled_motion(samples, limits.norm, limits.medium)
    try:
        values = {name: _values(KIND[name], samples, motion) for name in bounds}
    except (TypeError, IndexError):
        raise InputError(f"the samples lack a derivative or a coordinate that {', '.join(bounds)} need") from None
    return {name: bounds[name] / value if KIND[name].least else value / bounds[name] for name, value in values.items()}


def _values(kind: Kind, samples: Samples, motion: Motion) -> FloatArray:
    """Return the quantity that a limit bounds at every sample, shape (m,)."""
    if kind.measure != "yaw_rate":
        return MEASURES[kind.measure].sampled(motion, kind.order)
    if samples.yaw_rate is None:
        raise TypeError("samples without a yaw rate")
    return np.abs(samples.yaw_rate)


def rotor_curves(path: Path, limits: VehicleLimits, t: FloatArray) -> dict[str, FloatArray]:
    """Return the use of the rotors' room above and below hover at instants (m,) [s], by name, (m,) each."""
    from minsnap.vehicle import flatness_of

    vehicle = limits.vehicle
    thrusts = vehicle.thrusts(flatness_of(vehicle, path, t, drag=vehicle.flat_drag).rotor_speed)
    hover, share = vehicle.hover_thrust, 1.0 - limits.reserve
    least, most = vehicle.rotor_thrust_limits
    above = np.maximum(thrusts.max(axis=1) - hover, 0.0) / (share * (most - hover))
    below = np.maximum(hover - thrusts.min(axis=1), 0.0) / (share * (hover - least))
    return dict(zip(ROTORS, (above, below), strict=True))


def uses_at(path: Path, limits: Limits, t: FloatArray) -> dict[str, FloatArray]:
    """Return the use of each limit of a path at instants (m,) [s], those of rotors too; by name, (m,) each."""
    samples = path.sampled(t)
    if path.yaw.medium is not None:
        samples = replace(samples, yaw_rate=np.zeros(len(samples)))  # the spin about the thrust axis, which is limited
    uses = utilisation_curves(samples, limits) if limits.given() else {}
    if isinstance(path, Trajectory) and limits.leg_speeds:
        speeds = limits.speeds_of(path.legs)
        leg = np.clip(np.searchsorted(path.leg_breaks, t, side="right") - 1, 0, path.legs - 1)
        uses["speed"] = uses["speed"] * (max(limits.leg_speeds) / speeds[leg])
    return uses | (rotor_curves(path, limits, t) if isinstance(limits, VehicleLimits) else {})


def legs_within(curve: Trajectory, limits: Limits | None) -> tuple[LegUse, ...]:
    """Return what a flight does leg by leg, and which limits bind how long."""
    return leg_uses(curve, None if limits is None else partial(uses_at, curve, limits))
