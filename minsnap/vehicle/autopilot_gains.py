"""Gains, lags and bounds of the loops of PX4 and ArduCopter, from their parameters.

Sources: PX4's parameter reference (v1.16); ArduPilot's AC_PosControl.cpp (4.7, whose names differ from those before).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import radians
from typing import Any

from minsnap.basics.checks import SIZE, is_number
from minsnap.basics.messages import shown
from minsnap.errors import VehicleError


@dataclass(frozen=True)
class LoopParameter:
    """A parameter that a loop is read from.

    Parameters
    ----------
    usual : float
        Its default.
    names : tuple of str
        Newest first.
    """

    usual: float
    names: tuple[str, ...]

    def of(self, given: Mapping[str, float]) -> float:
        """Return its value, or its default."""
        return float(next((given[name] for name in self.names if name in given), self.usual))


def _named(usual: float, *names: str) -> LoopParameter:
    return LoopParameter(usual, names)


@dataclass(frozen=True)
class LoopSource:
    """How an autopilot's loop is read.

    Parameters
    ----------
    gains : dict
        By field: the horizontal and the vertical parameter.
    attitude : LoopParameter
        Gain of the attitude loop, whose inverse is the lag of horizontal accelerations [1/s].
    hover, most, least : LoopParameter
        Throttle in hover, and the greatest and the least one.
    tilt : LoopParameter
        [degrees].
    speeds : dict
        By field: greatest velocities that its position loop asks for [m/s].
    others : dict
        Fields without a parameter.
    older : tuple of str
        Parameters of older versions in other units.
    """

    gains: dict[str, tuple[LoopParameter, LoopParameter]]
    attitude: LoopParameter
    hover: LoopParameter
    most: LoopParameter
    least: LoopParameter
    tilt: LoopParameter
    speeds: dict[str, LoopParameter]
    others: dict[str, Any]
    older: tuple[str, ...] = ()


MOTORS = 0.05
"""Time constant of the thrust after its command [s]."""

AUTOPILOTS = {
    "px4": LoopSource(
        gains={
            "position_gain": (_named(0.95, "MPC_XY_P"), _named(1.0, "MPC_Z_P")),
            "velocity_gain": (_named(1.8, "MPC_XY_VEL_P_ACC"), _named(4.0, "MPC_Z_VEL_P_ACC")),
            "velocity_integral": (_named(0.4, "MPC_XY_VEL_I_ACC"), _named(2.0, "MPC_Z_VEL_I_ACC")),
            "velocity_derivative": (_named(0.2, "MPC_XY_VEL_D_ACC"), _named(0.0, "MPC_Z_VEL_D_ACC")),
        },
        attitude=_named(6.5, "MC_ROLL_P"),
        hover=_named(0.5, "MPC_THR_HOVER"),
        most=_named(1.0, "MPC_THR_MAX"),
        least=_named(0.12, "MPC_THR_MIN"),
        tilt=_named(45.0, "MPC_TILTMAX_AIR"),
        speeds={
            "speed": _named(12.0, "MPC_XY_VEL_MAX"),
            "climb_speed": _named(3.0, "MPC_Z_VEL_MAX_UP"),
            "descent_speed": _named(1.5, "MPC_Z_VEL_MAX_DN"),
        },
        others={"delay": 0.03, "latency": 0.025},
    ),
    "ardupilot": LoopSource(
        gains={
            "position_gain": (_named(1.0, "PSC_NE_POS_P", "PSC_POSXY_P"), _named(1.0, "PSC_D_POS_P", "PSC_POSZ_P")),
            "velocity_gain": (_named(2.0, "PSC_NE_VEL_P", "PSC_VELXY_P"), _named(5.0, "PSC_D_VEL_P", "PSC_VELZ_P")),
            "velocity_integral": (_named(1.0, "PSC_NE_VEL_I", "PSC_VELXY_I"), _named(0.0, "PSC_D_VEL_I", "PSC_VELZ_I")),
            "velocity_derivative": (
                _named(0.25, "PSC_NE_VEL_D", "PSC_VELXY_D"),
                _named(0.0, "PSC_D_VEL_D", "PSC_VELZ_D"),
            ),
        },
        attitude=_named(4.5, "ATC_ANG_RLL_P"),
        hover=_named(0.35, "MOT_THST_HOVER"),
        most=_named(1.0, "MOT_THST_MAX"),
        least=_named(0.0, "MOT_THST_MIN"),
        tilt=_named(30.0, "ATC_ANGLE_MAX"),
        speeds={},
        others={"delay": 0.05, "latency": 0.025, "of_error": True},
        older=("ANGLE_MAX",),
    ),
}
"""By name. Delays are those of simulated flights; ArduCopter's filters of 5 Hz are counted in its delay."""


def loop_parameters(autopilot: str) -> list[str]:
    """Return the names of all parameters from which the loop of an autopilot is read.

    Raises
    ------
    VehicleError
        If the autopilot is another.
    """
    known = _known(autopilot)
    pairs = [each for both in known.gains.values() for each in both]
    single = [known.attitude, known.hover, known.most, known.least, known.tilt, *known.speeds.values()]
    return [name for each in (*pairs, *single) for name in each.names] + list(known.older)


def _known(autopilot: Any) -> LoopSource:
    known = AUTOPILOTS.get(autopilot) if isinstance(autopilot, str) else None
    if known is None:
        raise VehicleError(f"the autopilot is {shown(autopilot)}: give px4 or ardupilot")
    return known


def gains_of(autopilot: Any, parameters: Any) -> dict[str, Any]:
    """Return the fields of a loop that parameters tell; those that are missing have the autopilot's defaults.

    Raises
    ------
    VehicleError
        If the autopilot is another, a parameter no number, or the throttle does not hover.
    """
    known = _known(autopilot)
    given = _numbers(parameters)
    if "ANGLE_MAX" in given:  # before 4.7, in hundredths
        given.setdefault("ATC_ANGLE_MAX", 0.01 * given["ANGLE_MAX"])
    hover, most, least = (each.of(given) for each in (known.hover, known.most, known.least))
    if hover <= 0.0 or most <= hover:
        raise VehicleError(f"the throttle in hover is {hover:g} and the greatest one {most:g}: it cannot hover")
    return {
        **{field: (across.of(given), upright.of(given)) for field, (across, upright) in known.gains.items()},
        **{field: each.of(given) for field, each in known.speeds.items()},
        "lag": (1.0 / max(known.attitude.of(given), 1e-3), MOTORS),
        "tilt": radians(known.tilt.of(given)),
        "max_thrust": most / hover,
        "min_thrust": min(1.0, max(0.0, least) / hover),
        **known.others,
    }


def _numbers(parameters: Any) -> dict[str, float]:
    """Return a copy of a mapping of names to numbers, or raise VehicleError."""
    if parameters is None:
        return {}
    if not isinstance(parameters, Mapping):
        raise VehicleError(f"the parameters are {shown(parameters)}: give a mapping of their names to numbers")
    for name, number in parameters.items():
        if not is_number(number):
            raise VehicleError(f"the parameter {name} is {shown(number)}: give a number {SIZE}")
    return {name: float(number) for name, number in parameters.items()}
