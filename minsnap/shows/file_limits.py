"""Limits of a show in its files: how far the curves that readers play use them, and by how much flights slow down.

A file holds cubics, or pieces of degree 7, of whole millimetres. Their acceleration steps at knots, and their velocity
may, which no maximum over pieces sees: a step counts as an acceleration, over the tenth of a second that the shortest
piece lasts, added to the one beside the knot. Jerk, snap and body rates are limits of the plan alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors import Room
from minsnap.files.formats import STEP_TIME, as_cubic_segments, compressed, curve_of_bytes, velocity_steps
from minsnap.fleet import Fleet, FleetCertificate, FleetUse, Separation, certify_fleet, fleet_use, stretch_of
from minsnap.limits import Limits, used_at
from minsnap.trajectory import Trajectory

ROUNDED_KINDS = ("skyb", "skyc", "traj")
"""Formats of fleets whose curves are not those of the plan."""

COUNTED = {"acceleration": slice(3), "horizontal_acceleration": slice(2), "vertical_acceleration": slice(2, 3)}
"""Limits against which steps of the velocity count, and their coordinates."""


@dataclass(frozen=True)
class SlowingSettings:
    """How flights are slowed.

    Parameters
    ----------
    rounds : int
        How often, at most: what a slower flight is rounded to is known only when it is written.
    more : float
        Share of the time that is added each time.
    """

    rounds: int = 30
    more: float = 2e-3


SLOWING = SlowingSettings()


def played(curve: Trajectory, kind: str) -> Trajectory:
    """Return the curve that the reader of a file of a rounded kind plays; a FileError says what no file holds."""
    return curve_of_bytes(compressed(curve)) if kind == "traj" else as_cubic_segments(curve).trajectory()


def certify_files(
    held: Fleet, separation: Separation | None, limits: Limits, room: Room | Sequence[FloatArray] | None, kind: str
) -> FleetCertificate:
    """Return the certificate of what was read from files: steps of the velocity count against its accelerations."""
    certificate = certify_fleet(held, separation, None if kind in ROUNDED_KINDS else limits, room)
    return replace(certificate, utilisation=use_of_files(held, limits)) if kind in ROUNDED_KINDS else certificate


def use_of_files(held: Fleet, limits: Limits) -> tuple[FleetUse, ...]:
    """Return how far curves of files use the limits, by the vehicle that uses each most.

    Those on jerk, snap and body rates are left out: no curve keeps them whose acceleration steps.
    """
    kept = replace(limits, jerk=None, snap=None, body_rate=None)
    if not kept.given():
        return ()
    uses = {used.use.name: used for used in fleet_use(held, kept)}
    for counted in _counted(held, kept):
        if counted.use.value > uses[counted.use.name].use.value:
            uses[counted.use.name] = counted
    return tuple(uses.values())


def largest_step(held: Fleet) -> float:
    """Return the largest step of a velocity at a knot of any vehicle [m/s]."""
    return max(float(velocity_steps(curve).max(initial=0.0)) for curve in held)


def _counted(held: Fleet, limits: Limits) -> list[FleetUse]:
    """Return the largest acceleration with a step of the velocity, for each limit against which it counts."""
    most: dict[str, FleetUse] = {}
    given = limits.given()
    names = [name for name in COUNTED if name in given]
    for vehicle, curve in enumerate(held):
        if not names or not velocity_steps(curve).any():
            continue
        slopes, bends = (curve.derivative(order).control_points for order in (1, 2))
        for name in names:
            by_axis = limits.norm == "axis" and name == "acceleration"
            steps, beside = (
                _norms(rows[..., COUNTED[name]], by_axis) for rows in (slopes[1:, 0] - slopes[:-1, -1], bends)
            )
            values = steps / STEP_TIME + np.maximum(beside[:-1, -1], beside[1:, 0])
            knot = int(values.argmax())
            used = used_at(curve, name, given[name], float(values[knot]), float(curve.breaks[knot + 1]))
            if name not in most or used.value > most[name].use.value:
                most[name] = FleetUse(vehicle, used)
    return list(most.values())


def _norms(rows: FloatArray, by_axis: bool) -> FloatArray:
    return np.asarray(np.abs(rows).max(axis=-1) if by_axis else np.linalg.norm(rows, axis=-1))


def stretches(held: Fleet, spans: Sequence[tuple[float, float]], limits: Limits) -> FloatArray:
    """Return by how much each span of time is to be stretched so that its pieces keep the limits, shape (spans,).

    Pieces that reach into two spans count for both.
    """
    return np.array([_stretch(held, *span, limits) if span[1] > span[0] else 1.0 for span in spans])


def _stretch(held: Fleet, begins: float, ends: float, limits: Limits) -> float:
    parts = []
    for curve in held:
        within = (curve.breaks[1:] > begins + 1e-6) & (curve.breaks[:-1] < ends - 1e-6)
        if within.any():
            parts.append(Trajectory(curve.control_points[within], curve.durations[within]))
    if not parts:
        return 1.0
    uses = [used for used in use_of_files(Fleet(tuple(parts)), limits) if not used.kept]
    return stretch_of(uses) * (1.0 + SLOWING.more) if uses else 1.0
