"""The exceptions of the library: one root, one sentence each, with the evidence attached."""

from __future__ import annotations

from typing import Any, ClassVar


class MinsnapError(Exception):
    """Root of everything the library raises on purpose.

    Parameters
    ----------
    message : str
        One plain sentence: where, what arrived, what to do.
    **evidence
        Values a program may want, kept as attributes (``leg``, ``smallest_width``, …).

    Attributes
    ----------
    exit_status : int
        What the command line exits with: 1 when the request cannot be met, 2 on bad input.
    """

    exit_status: ClassVar[int] = 2

    def __init__(self, message: str, **evidence: Any) -> None:
        super().__init__(message)
        for name, value in evidence.items():
            setattr(self, name, value)


class InputError(MinsnapError, ValueError):
    """What was passed in cannot be used."""


class WaypointError(InputError):
    """Waypoints, pins or end states are malformed or contradict each other."""


class TimingError(InputError):
    """Durations, totals or rates are missing, malformed or contradict each other."""


class CorridorError(InputError):
    """A corridor is malformed, empty, or does not match its legs."""


class LimitError(InputError):
    """A limit is malformed or contradicts another."""


class DegreeError(InputError):
    """The degree or the continuity asked for does not exist."""


class YawError(InputError):
    """A yaw specification is malformed."""


class ShapeError(InputError):
    """A radius, width, period or other measure of a shape is malformed."""


class IntervalError(InputError):
    """A path was asked about an instant outside its interval."""


class FileError(InputError):
    """A file is missing, damaged, or does not hold what it should."""


class FrameError(InputError):
    """A frame of reference is unknown or does not suit the data."""


class VehicleError(InputError):
    """A vehicle's parameters are not those of a physical body."""


class LinkError(InputError):
    """A vehicle cannot be reached, or what was asked of the link to it cannot be had.

    Attributes
    ----------
    address : str or None
        The connection it is about.
    """

    address: str | None = None


class FlightError(MinsnapError):
    """A flight was refused or stopped, for a reason of safety.

    Attributes
    ----------
    report : minsnap.mavlink.streaming.StreamReport or None
        What had been flown until then.
    """

    exit_status = 1
    report: Any = None


class ThrustError(VehicleError):
    """A motion asks a rotor for more, or less, thrust than it can give.

    Attributes
    ----------
    instant : float or None
        When it asks for the most too much, or too little [s].
    excess : float or None
        By how much a rotor's thrust is missed then [N].
    """

    exit_status = 1
    instant: float | None = None
    excess: float | None = None


class FitError(InputError):
    """Measurements do not determine the coefficients they are fitted with."""


class DivergenceError(MinsnapError):
    """A simulated vehicle left every bound of flight; what was flown until then is kept.

    Attributes
    ----------
    instant : float or None
        When it was stopped, seconds from the start.
    flight : Flight or None
        The flight up to that instant.
    """

    exit_status = 1
    instant: float | None = None
    flight: Any = None


class OutsideRangeWarning(UserWarning):
    """A fitted model was evaluated outside the range it was measured in."""


class UnknownSolverError(InputError):
    """The solver asked for is not known or not installed."""


class InfeasibleError(InputError):
    """No trajectory meets everything that was asked for.

    Attributes
    ----------
    leg : int or None
        The leg where it fails first, counted from 0.
    instant : float or None
        When it fails, seconds from the start.
    smallest_width : float or None
        The smallest half-width of that leg's corridor that would do [m].
    """

    exit_status = 1
    leg: int | None = None
    instant: float | None = None
    smallest_width: float | None = None


class SolverError(MinsnapError):
    """Every solver that was tried failed on a problem that has a solution."""

    exit_status = 1
