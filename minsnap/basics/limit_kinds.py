"""The table of limits: name, unit, option and measure of each limit, defined here once for the whole library.

A row gives a limit its name, unit and option of the command line, and names what it measures
(:data:`minsnap.limits.measures.MEASURES`). From a row and its measure come the walls of the QP, the exact maximum over
all time, the curve in figures, the line of a summary and the option of the commands that plan. To add a limit on
a derivative of the position, add a row here and a field of the same name, at the same place, to
:class:`~minsnap.limits.limits.Limits`; if it measures something new, also a measure.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi


@dataclass(frozen=True)
class Kind:
    """One kind of limit.

    Parameters
    ----------
    name : str
        The field of ``Limits``.
    unit : str
        Of the limit, as a summary prints it.
    measure : str
        What is measured: a name of :data:`~minsnap.limits.measures.MEASURES`, or ``yaw_rate`` or ``rotors``, which
        need more than the position.
    order : int
        Derivative that is measured; 0 where the measure takes several.
    option : str
        Option of the command line; empty for those that have none.
    degrees : bool
        Whether the option takes degrees.
    spatial : bool
        Whether it needs three coordinates, z up.
    least : bool
        Whether it is a lower bound.
    above, below : float
        Between which it lies: what a vehicle needs to hold its altitude.
    many : float
        Value beyond which it may be in another unit: no quadrotor flies so.
    mistaken : str
        Which unit that is, and what to do.
    """

    name: str
    unit: str
    measure: str
    order: int = 0
    option: str = ""
    degrees: bool = False
    spatial: bool = True
    least: bool = False
    above: float = 0.0
    below: float = inf
    many: float = inf
    mistaken: str = ""

    def doubt(self, value: float) -> str:
        """Return a sentence on a limit that may be in another unit; empty for an ordinary one."""
        unit = "times the weight" if self.unit == "of the weight" else self.unit
        return f"{self.name} is {value:g} {unit}: if it is {self.mistaken}" if value > self.many else ""

    @property
    def label(self) -> str:
        """The name in figures and summaries."""
        return self.name.replace("_", " ")

    @property
    def typed_unit(self) -> str:
        """Unit of the option, in ASCII."""
        return "degrees" if self.degrees else self.unit.translate(_ASCII)


_ASCII = str.maketrans({"²": "^2", "³": "^3", "⁴": "^4"})

NEWTONS, DEGREES = "newtons, divide it by the weight", "degrees per second, give radians"
"""Units that limits are mistaken in. Racing vehicles reach some ten times their weight, and 35 rad/s."""

KINDS = (
    Kind("speed", "m/s", "norm", 1, "--max-speed", spatial=False),
    Kind("acceleration", "m/s²", "norm", 2, "--max-acceleration", spatial=False),
    Kind("jerk", "m/s³", "norm", 3, "--max-jerk", spatial=False),
    Kind("snap", "m/s⁴", "norm", 4, "--max-snap", spatial=False),
    Kind("horizontal_speed", "m/s", "horizontal", 1, "--max-horizontal-speed"),
    Kind("horizontal_acceleration", "m/s²", "horizontal", 2, "--max-horizontal-acceleration"),
    Kind("climb_speed", "m/s", "upwards", 1, "--max-climb-speed"),
    Kind("descent_speed", "m/s", "downwards", 1, "--max-descent-speed"),
    Kind("vertical_speed", "m/s", "vertical", 1, "--max-vertical-speed"),
    Kind("vertical_acceleration", "m/s²", "vertical", 2, "--max-vertical-acceleration"),
    Kind("max_thrust", "of the weight", "thrust", option="--max-thrust", above=1.0, many=15.0, mistaken=NEWTONS),
    Kind("min_thrust", "of the weight", "least_thrust", option="--min-thrust", least=True, below=1.0),
    Kind("tilt", "rad", "tilt", option="--max-tilt", degrees=True, below=pi / 2.0),
    Kind("body_rate", "rad/s", "body_rate", option="--max-body-rate", many=60.0, mistaken=DEGREES),
    Kind("yaw_rate", "rad/s", "yaw_rate", option="--max-yaw-rate", spatial=False, many=30.0, mistaken=DEGREES),
    Kind("rotor_thrust", "N", "rotors"),
    Kind("min_rotor_thrust", "N", "rotors", least=True),
)
"""In the order of the fields of ``Limits``; the thrusts of rotors are limits of :meth:`Limits.of` alone."""

KIND = {kind.name: kind for kind in KINDS}
"""By name."""
