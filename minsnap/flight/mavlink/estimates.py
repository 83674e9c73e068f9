"""Whether a vehicle's estimate is fit to fly by, from what its estimator reports.

PX4 sends ESTIMATOR_STATUS, ArduPilot EKF_STATUS_REPORT. Both have the same bits for what is estimated well; those for
what is wrong differ. From version 1.16 on PX4 sets "constant position" for every vehicle at rest
(``Ekf::get_ekf_soln_status``), where older ones set it without a horizontal velocity alone, and ArduPilot without aid.
So it is a fault of a vehicle that is not on the ground, or of one that has no horizontal position.

Bits are those of MAVLink's ESTIMATOR_STATUS_FLAGS and EKF_STATUS_FLAGS.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from minsnap.flight.mavlink.vehicle_messages import Message


@dataclass(frozen=True)
class EstimatorBits:
    """What one autopilot's estimator reports.

    Parameters
    ----------
    spoilt : mapping of str to int
        What is wrong where a bit is set.
    ratios : mapping of str to str
        What each test ratio is of: that of an innovation to what would be rejected.
    most : float
        Test ratio beyond which measurements are rejected, or the estimator's failsafe acts.
    still : bool
        Whether "constant position" is set for a vehicle at rest as well.
    """

    spoilt: Mapping[str, int]
    ratios: Mapping[str, str]
    most: float
    still: bool


ESTIMATORS = {
    "ESTIMATOR_STATUS": EstimatorBits(
        {"GPS glitches": 1024, "its accelerometer is off": 2048},
        {"vel_ratio": "velocity", "pos_horiz_ratio": "position", "pos_vert_ratio": "height", "mag_ratio": "heading"},
        most=1.0,
        still=True,
    ),
    "EKF_STATUS_REPORT": EstimatorBits(
        {"it has never been healthy": 1024, "GPS glitches": 32768},
        {
            "velocity_variance": "velocity",
            "pos_horiz_variance": "position",
            "pos_vert_variance": "height",
            "compass_variance": "heading",
        },
        most=0.8,
        still=False,
    ),
}
"""By message; ArduPilot's failsafe acts from FS_EKF_THRESH (0.8) on."""

_POSITION, _CONSTANT = 8 | 16, 128
_SOUND = {
    "attitude": 1,
    "horizontal velocity": 2,
    "vertical velocity": 4,
    "horizontal position": _POSITION,
    "height": 32,
}


def estimate_faults(statuses: Sequence[Message], landed: bool) -> list[str]:
    """Return what is wrong with an estimate, in words; nothing if it is fit to fly by.

    Parameters
    ----------
    statuses : sequence of messages
        All that came while the vehicle was listened to, one at least; a measurement counts as rejected if all say so.
    landed : bool
        Whether the vehicle stands on the ground.
    """
    flags, bits = statuses[-1].flags, ESTIMATORS[statuses[-1].get_type()]
    faults = [f"no {name}" for name, good in _SOUND.items() if not flags & good]
    assumed = flags & _CONSTANT and not (bits.still and landed and flags & _POSITION)
    faults += ["its position is assumed constant"] if assumed else []
    faults += [words for words, bit in bits.spoilt.items() if flags & bit]
    least = {what: min(_ratio(status, name) for status in statuses) for name, what in bits.ratios.items()}
    rejected = {what: ratio for what, ratio in least.items() if ratio > bits.most}
    return faults + [f"measurements of its {what} do not fit (test ratio {one:.2g})" for what, one in rejected.items()]


def _ratio(status: Message, name: str) -> float:
    """Return a test ratio; 0 where it is not a number, which says that nothing was tested."""
    ratio = float(getattr(status, name))
    return ratio if math.isfinite(ratio) else 0.0
