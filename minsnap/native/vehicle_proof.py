"""The largest thrust, tilt, body rate and rotors' thrusts of a vehicle along a path, and bounds on parts of one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.library import Entry
from minsnap.native.records import PiecewiseCurve, VehicleRecord, VehicleUseRecord
from minsnap.native.status import Status

_BOUNDS = Entry("minsnap_vehicle_bounds", VehicleRecord)
_SAMPLES = Entry("minsnap_vehicle_samples", VehicleUseRecord)
_PROOF = Entry("minsnap_vehicle_proof", VehicleUseRecord)

UNKNOWN, BY_YAW, UNSPUN = range(3)
"""How a body heads, as the native core calls it."""


@dataclass(frozen=True, eq=False)
class VehicleNumbers:
    """What the bounds take of a vehicle.

    Parameters
    ----------
    mass : float
        [kg].
    medium : ndarray, shape (5,)
        As ``Medium.values``.
    inertia : ndarray, shape (3, 3)
        [kg m^2].
    mixer : ndarray, shape (4, 4)
        From thrust and torques to the thrusts of the rotors.
    """

    mass: float
    medium: FloatArray
    inertia: FloatArray
    mixer: FloatArray


@dataclass(frozen=True, eq=False)
class Facing:
    """How a body heads.

    Parameters
    ----------
    yaw : Trajectory or None
        Of one coordinate [rad], where it is a polynomial.
    begin, rate : float
        Of its clock, ``begin + rate t`` [s], [-].
    angle : float
        Of a constant yaw, or about the thrust axis at the start [rad].
    spinless : bool
        Whether the body never spins about its thrust axis.
    jerk : float
        Bound of the yaw's third derivative [rad/s^3].
    """

    yaw: Any = None
    begin: float = 0.0
    rate: float = 1.0
    angle: float = 0.0
    spinless: bool = False
    jerk: float = 0.0


@dataclass(frozen=True, eq=False)
class VehicleQuestion:
    """A vehicle on a trajectory.

    Parameters
    ----------
    vehicle : VehicleNumbers
    traj : Trajectory
        Of three coordinates.
    facing : Facing or None
        Without one there are no rotors.
    """

    vehicle: VehicleNumbers
    traj: Any
    facing: Facing | None

    def record(self, **further: Any) -> VehicleUseRecord:
        """Return them as the native core takes them."""
        facing = self.facing or Facing()
        heads = UNKNOWN if self.facing is None else UNSPUN if facing.spinless else BY_YAW
        turns = {"begin": facing.begin, "rate": facing.rate, "angle": facing.angle, "jerk": facing.jerk, "heads": heads}
        yaw = None if facing.yaw is None else [_curve(facing.yaw)]
        return VehicleUseRecord(curve=[_curve(self.traj)], yaw=yaw, **turns, **vars(self.vehicle), **further)


def _curve(traj: Any) -> PiecewiseCurve:
    points = np.ascontiguousarray(traj.control_points)
    pieces, size, dim = points.shape
    sizes = {"pieces": pieces, "degree": size - 1, "dim": dim}
    return PiecewiseCurve(points=points, durations=traj.durations, breaks=traj.breaks, **sizes)


def vehicle_samples(question: VehicleQuestion, samples: int) -> tuple[FloatArray, FloatArray] | None:
    """Return the largest of so many samples of a piece of each of the six quantities, and the instants of these [s].

    They are thrust and minus the thrust over weight, tilt [rad], body rate [rad/s], and the largest deviations of the
    rotors' thrusts from hover, upwards and downwards [N].

    Returns
    -------
    (values (6,), instants (6,)) or None
        None where the Python core has to answer: at an instant its attitude is known only from those around it.
    """
    values, instants = np.zeros(6), np.zeros(6)
    status = Status(_SAMPLES(question.record(samples=samples, values=values, instants=instants)))
    return (values, instants) if status is Status.DONE else None


def vehicle_proof(
    question: VehicleQuestion, values: FloatArray, finer: FloatArray, wanted: int, settings: Any
) -> FloatArray:
    """Return the six quantities, raised until bounds prove that none of those wanted goes beyond.

    Parameters
    ----------
    values : ndarray, shape (6,)
        From which to begin.
    finer : ndarray, shape (6,)
        Added to samples to which they are raised.
    wanted : int
        Those that are to be proved, one bit for each; what no bound holds is infinite.
    settings : VehicleUseSettings
    """
    raised, names = values.copy(), ("rounds", "first", "parts", "most", "missed")
    how = {name: getattr(settings, name) for name in names} | {"wanted": wanted, "finer": finer, "samples": 1}
    if _PROOF(question.record(values=raised, **how)):
        raised[[bool(wanted >> place & 1) for place in range(len(values))]] = np.inf
    return raised


def vehicle_bounds(
    vehicle: VehicleNumbers,
    points: FloatArray,
    half: FloatArray,
    yaw: FloatArray | None = None,
    jerk: float = 0.0,
    axes: FloatArray | None = None,
) -> FloatArray | None:
    """Return bounds on parts of a path, (parts, 6), or None where the Python core is in use.

    They are the greatest and minus the least thrust per mass [m/s^2], the squares of the tilt's tangent and of the body
    rate [rad^2/s^2], and the greatest and minus the least thrust of a rotor [N], zero where no heading is known.

    Parameters
    ----------
    points : ndarray, shape (parts, 4, 3, n)
        Control points of velocity to snap on each part, of one degree.
    half : ndarray, shape (parts,)
        Half of what each part takes [s].
    yaw : ndarray, shape (parts, 4), optional
        In the middle of each part: cosine and sine of the yaw, its rate and its acceleration.
    jerk : float
        Bound of the yaw's third derivative [rad/s^3].
    axes : ndarray, shape (parts, 2, 3), optional
        Of a body that does not spin: its axes x and y in the middle of each part.

    Raises
    ------
    ValueError
        If there are more than 64 control points.
    """
    call = _BOUNDS.function()
    if call is None:
        return None
    parts, _, _, count = points.shape
    bounds = np.empty((parts, 6))
    motion = {"points": points, "half": half, "yaw": yaw, "jerk": jerk, "axes": axes, "bounds": bounds}
    if call(VehicleRecord(parts=parts, count=count, **vars(vehicle), **motion)):
        raise ValueError(f"{count} control points on a part are more than the native core takes")
    return bounds
