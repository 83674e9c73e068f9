r"""Limits of a path from an autopilot's own parameters: what its controller does not cut.

At a speed v the thrust leans against the drag k v as well as along the acceleration a, so that
:math:`a + k v \le g \tan\theta`. Drag may take half of the tilt at the greatest speed; the rest, less a tenth for
feedback, is what a path may ask for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from minsnap.basics.arrays import GRAVITY
from minsnap.errors import LinkError
from minsnap.limits.limits import Limits

FEEDBACK = 0.9
"""Share of what the controller allows that a path may use: the rest corrects errors."""

DRAG_SHARE = 0.5
"""Share of the level thrust that drag may take at the greatest speed."""

PARAMETERS = {
    "px4": (
        "MPC_XY_VEL_MAX",
        "MPC_Z_VEL_MAX_UP",
        "MPC_Z_VEL_MAX_DN",
        "MPC_TILTMAX_AIR",
        "MC_ROLLRATE_MAX",
        "MC_PITCHRATE_MAX",
        "MC_YAWRATE_MAX",
    ),
    "ardupilot": (
        "WPNAV_SPEED",
        "WPNAV_SPEED_UP",
        "WPNAV_SPEED_DN",
        "WPNAV_ACCEL",
        "WPNAV_ACCEL_Z",
        "PSC_JERK_XY",
        "ANGLE_MAX",
        "PSC_ANGLE_MAX",
        "ATC_SLEW_YAW",
    ),
}
"""What is read, by autopilot."""


def autopilot_limits(autopilot: str, values: Mapping[str, float], drag: float = 0.0) -> Limits:
    """Return the limits that an autopilot's parameters leave to a path.

    Parameters
    ----------
    autopilot : str
        ``px4`` or ``ardupilot``.
    values : mapping of str to float
        Its parameters, in its own units; those that are missing limit nothing.
    drag : float
        Linear drag of the vehicle over its mass [1/s].

    Raises
    ------
    LinkError
        If the autopilot is another, or has neither a speed nor a tilt.
    """
    if autopilot not in PARAMETERS:
        raise LinkError("the autopilot is neither PX4 nor ArduPilot: its limits are not known")
    limits = (_px4 if autopilot == "px4" else _ardupilot)(values)
    if "horizontal_speed" not in limits or "tilt" not in limits:
        raise LinkError("the vehicle did not answer with its greatest speed and tilt")
    rounded: dict[str, Any] = {name: _rounded(value) for name, value in _with_drag(limits, drag).items()}
    return Limits(**rounded)


def _px4(values: Mapping[str, float]) -> dict[str, float]:
    rates = [values[name] for name in ("MC_ROLLRATE_MAX", "MC_PITCHRATE_MAX") if name in values]
    return _scaled(
        values,
        horizontal_speed=("MPC_XY_VEL_MAX", 1.0),
        climb_speed=("MPC_Z_VEL_MAX_UP", 1.0),
        descent_speed=("MPC_Z_VEL_MAX_DN", 1.0),
        tilt=("MPC_TILTMAX_AIR", math.radians(1.0)),
        yaw_rate=("MC_YAWRATE_MAX", math.radians(1.0)),
    ) | ({"body_rate": math.radians(min(rates))} if rates else {})


def _ardupilot(values: Mapping[str, float]) -> dict[str, float]:
    lean = "PSC_ANGLE_MAX" if values.get("PSC_ANGLE_MAX") else "ANGLE_MAX"
    return _scaled(
        values,
        horizontal_speed=("WPNAV_SPEED", 0.01),
        climb_speed=("WPNAV_SPEED_UP", 0.01),
        descent_speed=("WPNAV_SPEED_DN", 0.01),
        horizontal_acceleration=("WPNAV_ACCEL", 0.01),
        vertical_acceleration=("WPNAV_ACCEL_Z", 0.01),
        jerk=("PSC_JERK_XY", 1.0),
        tilt=(lean, math.radians(1.0 if lean == "PSC_ANGLE_MAX" else 0.01)),
        yaw_rate=("ATC_SLEW_YAW", math.radians(0.01)),
    )


def _scaled(values: Mapping[str, float], **wanted: tuple[str, float]) -> dict[str, float]:
    return {name: scale * values[key] for name, (key, scale) in wanted.items() if values.get(key, 0.0) > 0.0}


def _with_drag(values: dict[str, float], drag: float) -> dict[str, Any]:
    """Return limits with the reserve of feedback taken off, and with room in the tilt for drag."""
    level = GRAVITY * math.tan(min(values["tilt"], math.radians(85.0)))
    limits = {name: FEEDBACK * value for name, value in values.items()}
    if drag > 0.0:
        limits["horizontal_speed"] = min(limits["horizontal_speed"], DRAG_SHARE * level / drag)
    left = FEEDBACK * level - drag * limits["horizontal_speed"]
    limits["horizontal_acceleration"] = min(limits.get("horizontal_acceleration", math.inf), left)
    limits["tilt"] = min(limits["tilt"], math.atan(left / GRAVITY))
    return limits


def _rounded(value: float) -> float:
    """Return a limit rounded down to four digits."""
    step = 10.0 ** (math.floor(math.log10(value)) - 3)
    return round(math.floor(value / step) * step, 9)
