"""Options that several commands share, and their conversion."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import degrees, inf, pi, radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import minsnap
import minsnap.flight
from minsnap.basics.limit_kinds import KINDS
from minsnap.cli import quantities
from minsnap.errors import InputError, LimitError, MagnitudeWarning

if TYPE_CHECKING:
    from minsnap.corridors import Avoided
    from minsnap.flight.simulation.flight_inputs import Wind
    from minsnap.vehicle import Loop, Quadrotor

Triple = tuple[float, float, float]

VEHICLE_HELP = "f330, crazyflie, px4-sih, or a YAML file."

READABLE = ".csv, .json, .yaml, .npz, .traj, .skyb, .parquet, .ulg, .bin, .mcap or .db3"
WRITABLE = ".csv, .json, .yaml, .npz, .traj, .skyb, .parquet, .npy, .lua; missions: .plan, .waypoints, .kml, .kmz"
FORMATS = "setpoints, crazyflie, crazyflie-compressed, mav, polynomials, multidof, px4, skybrush, npz, parquet, "
FORMATS += "qgroundcontrol, ardupilot, ardupilot-lua, kml, dji or litchi"
"""As :func:`minsnap.files.file_formats` has them, which is too slow to import for a help."""

Output = Annotated[
    Path | None,
    "--output",
    "-o",
    "FILE",
    f"File to write, in the format of its ending: {WRITABLE}; - is standard output.",
]

Rate = Annotated[float, "HZ", "Setpoints per second."]
Format = Annotated[str | None, "NAME", f"Format of the file, if not by its ending: {FORMATS}."]
ReadFrame = Annotated[str | None, "--from-frame", "--frame", "Axes of a CSV that does not name them: enu, ned, …"]
Columns = Annotated[str | None, "NAMES", "Columns of a table: t=time,x=px,…; a unit after a colon: t=clock:ms."]
Origin = Annotated[Triple | None, "LAT LON ALT", "Place of (0, 0, 0), of files by latitude and longitude [degrees, m]."]
Within = Annotated[float | None, "M", "Of a mission: how far its lines may be from the path [m], by default 0.5."]
Plot = Annotated[Path | None, "FILE", "Figure to write: PNG, SVG or PDF, by its ending."]
Downwash = Annotated[float | None, "W", "Heights are divided by it; without --separation that of the files, else 1."]
Ground = Annotated[float | None, "M", "Separation of two of which one stands at its start or its end; else the same."]
View = Annotated[str | None, "View of the figure: xy (default; climbs also from the side), xz, yz or 3d."]

Tracking = Annotated[str | None, "LOOP", "Control loop of the vehicle: px4, ardupilot, or a YAML file of one."]
WindChange = Annotated[float, "M/S", "With --tracking: largest change of the wind [m/s]."]

LINKS = "udpin:, udpout:, tcp: or tcpin:HOST:PORT, serial:DEVICE:BAUD."
Connect = Annotated[str, "LINK", LINKS]
FlightReport = Annotated[Path | None, "FILE", "HTML page: maps, error against time, legs, lag, wind."]
ColourBy = Annotated[str | None, "speed", "Draw the path in the colours of its speed."]
Json = Annotated[bool, "Print the summary as JSON."]
NoClobber = Annotated[bool, "Refuse to replace a file that is there."]
Force = Annotated[bool, "Write a path that no vehicle flies, too, such as one of over 100 g."]
OffsetDrag = Annotated[float, "K", "Add K times the velocity to the acceleration, against drag [1/s]."]
OffsetVehicle = Annotated[str | None, "NAME", "Take the drag of a vehicle instead: " + VEHICLE_HELP]
Lead = Annotated[float, "S", "Send setpoints S seconds earlier, against the vehicle's delay."]
FlownLead = Annotated[float | None, "S", "How much earlier than planned the flight's setpoints were sent."]
NoLimit = Annotated[
    str | None, "NAME", "Remove a default limit: speed, acceleration, tilt, jerk or altitude; several with commas."
]

Corridor = Annotated[str | None, "M", "Half-width around each leg [m]: one, or one per leg with commas."]
References = Annotated[str, "What the cascade follows: position, velocity or acceleration."]
Yaw = Annotated[
    str | None,
    "Heading [degrees]; velocity: along the flight; tilt: no spin; free: the best constant one.",
]
LookAtPoint = Annotated[tuple[float, float] | None, "X Y", "Point that the nose points at [m]."]
Center = Annotated[tuple[float, float], "X Y", "Center [m]."]
Altitude = Annotated[float, "M", "z [m]."]
Clockwise = Annotated[bool, "Turn clockwise seen from above."]
Degree = Annotated[int, "Degree of the polynomials: 3, 5, 7, 9 or 11."]


def vehicle_of(name: str) -> Quadrotor:
    """Return a preset by its name, here or in Python and files, or the vehicle of a YAML file.

    Raises
    ------
    InputError
        If it is neither.
    """
    from minsnap.vehicle import SHORT_NAMES, VEHICLES, Quadrotor, named_vehicle

    preset = SHORT_NAMES.get(name, name)
    if preset in VEHICLES:
        return named_vehicle(preset)
    if not Path(name).suffix and not Path(name).exists():
        raise InputError(f"--vehicle is {name!r}: give {VEHICLE_HELP.rstrip('.')}")
    return Quadrotor.from_yaml(name)


def refuse_unwritten(output: Path | None, **given: bool) -> None:
    """Raise InputError where an option that is given says how a file is written, and none is."""
    unused = [name for name, said in given.items() if said]
    if output is not None or not unused:
        return
    said = f"--{unused[0]} is of the file that is written: give -o FILE with it"
    if unused[0] == "vehicle":
        said = "--vehicle offsets the drag of a vehicle in the setpoints that are written: give -o FILE with it; the "
        said += "limits of a vehicle are asked for by vehicle: NAME in a YAML file"
    raise InputError(said)


def feed_forward_of(options: Any) -> minsnap.flight.FeedForward:
    """Return what ``--drag``, ``--vehicle`` and ``--lead`` among options offset."""
    vehicle = None if options.vehicle is None else vehicle_of(options.vehicle)
    return minsnap.flight.FeedForward(options.drag, vehicle, options.lead)


@dataclass(frozen=True)
class SimulatedVehicle:
    """Options of a simulated flight: the vehicle, its controller, the noise of its poses, and the wind."""

    vehicle: Annotated[str, VEHICLE_HELP] = "f330"
    controller: Annotated[str, "cascade (PX4's), lee or mellinger."] = "cascade"
    noise: Annotated[float, "M", "Standard deviation of a pose [m]."] = 0.0
    wind: Annotated[Triple, "X Y Z", "Mean wind [m/s]."] = (0.0, 0.0, 0.0)
    gust: Annotated[float, "M/S", "Intensity of Dryden gusts [m/s]."] = 0.0
    seed: Annotated[int, "Seed: the same number gives the same noise and gusts."] = 0

    @property
    def craft(self) -> Quadrotor:
        """The vehicle."""
        return vehicle_of(self.vehicle)

    @property
    def air(self) -> Wind:
        """A constant wind, or one with Dryden gusts."""
        from minsnap.flight.simulation.flight_inputs import ConstantWind, DrydenWind

        gusts = (self.gust, self.gust, 0.5 * self.gust)
        return DrydenWind(self.wind, gusts, seed=self.seed) if self.gust else ConstantWind(self.wind)

    def pilot(self, references: str) -> minsnap.flight.Controller:
        """Return the controller; ``references`` is what the cascade follows."""
        if self.controller == "cascade":
            return minsnap.flight.CascadeController(references=references)
        if self.controller in ("lee", "mellinger"):
            return minsnap.flight.GeometricController(feed_forward=self.controller == "lee")
        raise InputError(f"--controller is {self.controller!r}: it must be one of cascade, lee, mellinger")


def loop_of(name: str | None, wind: float) -> Loop | None:
    """Return the control loop that ``--tracking`` names.

    Raises
    ------
    InputError
        If there is a wind without one.
    VehicleError
        If it is neither an autopilot nor a loop in YAML.
    """
    if name is None:
        if wind:
            raise InputError(f"--wind {wind:g} is of a vehicle in its loop: give --tracking px4 or another with it")
        return None
    from minsnap.vehicle import loop_of as named

    return named(name)


LIMITS = {kind.option.lstrip("-").replace("-", "_"): kind for kind in KINDS if kind.option}
"""Kinds of limits by the name of the field that holds their option."""


def limit_field(name: str) -> tuple[str, Any, None]:
    """Return the option of a limit as a field of a dataclass: name, type as typer reads it, default."""
    kind = LIMITS[name]
    metavar = "RATIO" if kind.unit == "of the weight" else kind.typed_unit.upper().replace("^", "")
    side = "Least" if kind.least else "Greatest"
    label = kind.label.removeprefix("min ").removeprefix("max ")
    return name, Annotated[float | None, metavar, f"{side} {label} [{kind.typed_unit}]."], None


def limit_values(options: Any) -> dict[str, Any]:
    """Return the limits that the options name, in the units of the library."""
    values = {kind: getattr(options, name) for name, kind in LIMITS.items()}
    for kind, value in values.items():
        if kind.degrees and value is not None and value >= degrees(kind.below):
            raise LimitError(f"{kind.option} is {value:g} degrees: it must be below {degrees(kind.below):g}")
        if kind.degrees and value is not None and 0.0 < value < kind.below:
            doubt = f"{kind.option} is {value:g} degrees: if that is in radians, give {degrees(value):.3g}"
            warnings.warn(doubt, MagnitudeWarning, stacklevel=1)  # at one place, so that it is told once
    return {kind.name: radians(value) if kind.degrees else value for kind, value in values.items() if value is not None}


def taken_off(text: str | None) -> list[str]:
    """Return the names that ``--no-limit`` takes off.

    Raises
    ------
    InputError
        If one of them holds only where it is named.
    """
    from minsnap.limits import ORDINARY

    known = (*ORDINARY, "altitude")
    names = [] if text is None else text.split(",")
    for name in names:
        if name not in known:
            raise InputError(f"--no-limit is {name!r}: it takes {', '.join(known)}; other limits hold only where named")
    return names


def parse_corridor(text: str | None) -> float | list[float] | None:
    """Return one half-width or a list of them [m].

    Raises
    ------
    InputError
        If the text is not numbers with commas.
    """
    if text is None:
        return None
    numbers = parse_numbers("--corridor", text)
    return numbers[0] if len(numbers) == 1 else numbers


def parse_numbers(option: str, text: str, unit: str | None = "M") -> list[float]:
    """Return numbers that are separated by commas; ``unit`` is what stands for one in the help.

    Raises
    ------
    InputError
        If the text is something else.
    """
    return [
        read_number(part, f"{option} is {part!r}, which {quantities.refusal(part, unit)}") for part in text.split(",")
    ]


LENGTH_UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}


def parse_length(option: str, text: str) -> float:
    """Return a length in metres: a number with mm, cm or m behind it.

    Raises
    ------
    InputError
        If the text is something else.
    """
    number = text.rstrip("cm ")
    unit, refusal = (
        text[len(number) :].strip(),
        f"{option} is {text!r}: it takes a length such as 8mm, 1cm or 0.5m",
    )
    if unit not in LENGTH_UNITS:
        raise InputError(refusal)
    length = read_number(number, refusal) * LENGTH_UNITS[unit]
    if not 0.0 < length < inf:
        raise InputError(refusal)
    return length


def parse_named(text: str | None) -> dict[str, str] | None:
    """Return the names of columns that ``--columns`` gives, or None."""
    from minsnap.files import parse_columns

    return None if text is None else parse_columns(text)


def avoided(texts: list[str] | None, fence: Path | None) -> list[Avoided] | None:
    """Return the cylinders to keep out of, and the geofence of a file, or None."""
    listed = parse_avoid(texts)
    if fence is None:
        return listed
    from minsnap.files import read_fence

    return [*(listed or ()), *read_fence(fence)]


def parse_avoid(texts: list[str] | None) -> list[Avoided] | None:
    """Return the cylinders to keep out of, or None.

    Raises
    ------
    InputError
        If a text is not three or five numbers with commas.
    """
    from minsnap.corridors import named_obstacle

    return [named_obstacle("cylinder", parse_numbers("--avoid", text)) for text in texts or ()] or None


def chosen_yaw(text: str | None, look_at: tuple[float, float] | None) -> Any:
    """Return the yaw that ``--yaw`` or ``--look-at`` says: an angle [rad], a rule's word, a point, or None.

    Raises
    ------
    InputError
        If both are set, or the text is neither degrees nor one of the words.
    """
    if look_at is not None and text is not None:
        raise InputError("--yaw and --look-at both say where the nose points: give one of them")
    if look_at is not None:
        return minsnap.LookAt(look_at)
    if text is None or text in ("velocity", "tilt", "free"):
        return text
    return angle_of("--yaw", read_number(text, f"--yaw is {text!r}: it takes degrees, velocity, tilt or free"))


EIGHTH, ALIKE = pi / 4.0, 2e-3
"""What yaws in radians are multiples of [rad], and by how much they are rounded, as 1.57 is."""


MOST_TURNED = 1e6
"""Greatest angle of an option [degrees]."""


def angle_of(option: str, angle: float) -> float:
    """Return an angle in degrees [rad]; warn where it is an eighth of a turn, or more of them, in radians.

    Raises
    ------
    InputError
        If it is not finite, or turns on and on.
    """
    if not abs(angle) <= MOST_TURNED:
        raise InputError(f"{option} is {angle:g}: give an angle in degrees")
    eighths = round(angle / EIGHTH)
    if 1 <= abs(eighths) <= 8 and abs(angle - eighths * EIGHTH) < ALIKE * abs(eighths):
        doubt = f"{option} is {angle:g} degrees: if that is in radians, give {45 * eighths}"
        warnings.warn(doubt, MagnitudeWarning, stacklevel=1)
    return radians(angle)


def parse_pieces(text: str | None) -> int | str | None:
    """Return a whole number of polynomials per leg, "auto", or None.

    Raises
    ------
    InputError
        If the text is neither.
    """
    if text is None or text == "auto":
        return text
    return int(read_number(text, f"--pieces is {text!r}: it takes a whole number, or auto", int))


def check_mission(written: Any, origin: Sequence[float] | None, within: float | None) -> None:
    """Raise InputError for a mission without an origin, or a distance of what is no mission, before it is planned."""
    from minsnap.files import ORIGIN

    geodetic = written is not None and written.geodetic
    if geodetic and origin is None:
        raise InputError(f"a mission holds latitudes and longitudes: {ORIGIN}, which plan and convert have")
    if within is not None and not geodetic:
        raise InputError("--within is of a mission that is written: -o FILE.plan, .waypoints, .kml or .kmz")
    if within is not None and not 0.0 < within < inf:
        raise InputError(f"--within is {within:g}: give a positive distance [m]")


def check_corridor(corridor: Any, waypoints: Any) -> None:
    """Raise InputError for a half-width without the legs that it is around, or legs without it."""
    if (waypoints is None) != (corridor is None):
        raise InputError("--corridor and --waypoints go together: a half-width, and the legs it is around")


def present(**options: Any) -> dict[str, Any]:
    """Return the options that are not None."""
    return {name: value for name, value in options.items() if value is not None}


def read_number(text: str, refusal: str, kind: Callable[[str], float] = float) -> float:
    """Return the number that a text says, or raise InputError with a sentence."""
    try:
        return kind(text)
    except ValueError:
        raise InputError(refusal) from None
