"""The exceptions of the library: one root, one sentence each, with what a program may want to know attached."""

from __future__ import annotations

from typing import Any


class MinsnapError(Exception):
    """Root of everything the library raises on purpose.

    Parameters
    ----------
    message : str
        One plain sentence: where, what arrived, what to do. Values that it shows over several lines, as NumPy shows
        arrays, are put on one; what is beyond 1,000 characters is left out in the middle.
    **evidence
        Values of the attributes that the class declares.

    Raises
    ------
    TypeError
        If the class does not declare an attribute of that name.
    """

    def __init__(self, message: str, **evidence: Any) -> None:
        line = " ".join(part.strip() for part in message.splitlines())
        super().__init__(line if len(line) <= 1000 else f"{line[:700]} … {line[-290:]}")
        for name, value in evidence.items():
            if not hasattr(type(self), name):
                raise TypeError(f"{type(self).__name__} declares no attribute {name!r}")
            setattr(self, name, value)

    @property
    def code(self) -> str:
        """The heading of the page "When something is wrong" that says what to do, such as ``infeasible``."""
        kind = next(kind for kind in type(self).__mro__ if kind.__module__ == __name__)
        return kind.__name__.removesuffix("Error").lower()


class InputError(MinsnapError, ValueError):
    """What was passed in cannot be used."""


class ArgumentNameError(InputError, TypeError):
    """A call names an argument that does not exist; a TypeError as Python's own is."""


class WaypointError(InputError):
    """Waypoints, pins or end states are malformed or contradict each other.

    Attributes
    ----------
    waypoint : int or None
        The waypoint it is about, counted from 0.
    leg : int or None
        The leg it is about, counted from 0.
    """

    waypoint: int | None = None
    leg: int | None = None


class TimingError(InputError):
    """Durations, totals or rates are missing, malformed or contradict each other.

    Attributes
    ----------
    leg : int or None
        The leg it is about, counted from 0.
    """

    leg: int | None = None


class CorridorError(InputError):
    """A corridor is malformed, empty, or does not match its legs.

    Attributes
    ----------
    leg : int or None
        The leg whose corridor it is about, counted from 0.
    waypoint : int or None
        The waypoint that is outside of it, counted from 0.
    """

    leg: int | None = None
    waypoint: int | None = None


class LimitError(InputError):
    """A limit is malformed, contradicts another, or is exceeded by a pinned state.

    Attributes
    ----------
    waypoint : int or None
        The waypoint whose pinned state exceeds the limit, counted from 0.
    smallest, largest : float or None
        The least and the greatest value that this limit may have, in its unit.
    """

    waypoint: int | None = None
    smallest: float | None = None
    largest: float | None = None


class DegreeError(InputError):
    """There is no such degree, continuity or number of pieces."""


class YawError(InputError):
    """A yaw specification is malformed."""


class ShapeError(InputError):
    """A radius, width, period or other measure of a shape is malformed."""


class IntervalError(InputError):
    """A path was evaluated at an instant outside its interval."""


class FileError(InputError):
    """A file is missing, damaged, or does not contain what it should."""


class FrameError(InputError):
    """A frame of reference is unknown or does not suit the data."""


class VehicleError(InputError):
    """A vehicle's parameters are not those of a physical body."""


class LinkError(InputError):
    """A vehicle cannot be reached, or its link does not support the request.

    Attributes
    ----------
    address : str or None
        The connection it is about.
    """

    address: str | None = None


class OutOfMemoryError(MinsnapError, MemoryError):
    """The request takes more memory than there is.

    Attributes
    ----------
    needed : int or None
        What it takes at least [bytes].
    """

    needed: int | None = None


class BatchError(MinsnapError):
    """A batch could not go on: the disk is full, or a process or the scheduler is lost; what is written is kept."""


class FlightError(MinsnapError):
    """A flight was refused or stopped for a reason of safety.

    Attributes
    ----------
    report : minsnap.flight.mavlink.StreamReport or None
        What was flown until then.
    """

    report: Any = None


class ThrustError(VehicleError):
    """A motion needs more, or less, thrust of a rotor than it can give.

    Attributes
    ----------
    instant : float or None
        When the thrust is furthest outside the rotor's range [s].
    excess : float or None
        How far it is outside then [N].
    """

    instant: float | None = None
    excess: float | None = None


class FleetError(InputError):
    """The question of several vehicles is malformed, or contradicts itself.

    Attributes
    ----------
    vehicle : int or None
        The vehicle it is about, counted from 0.
    pair : tuple of int or None
        The two vehicles it is about, counted from 0.
    """

    vehicle: int | None = None
    pair: tuple[int, int] | None = None


class FitError(InputError):
    """Measurements do not determine the coefficients of a fit."""


class DivergenceError(MinsnapError):
    """A simulated vehicle left every bound of flight.

    Attributes
    ----------
    instant : float or None
        When the simulation was stopped, from the start of the flight [s].
    flight : minsnap.flight.simulation.Flight or None
        The flight up to that instant.
    """

    instant: float | None = None
    flight: Any = None


class OutsideRangeWarning(UserWarning):
    """A fitted model was evaluated outside the range of its measurements."""


class MagnitudeWarning(UserWarning):
    """A number has the size of another unit than the one it is taken in, such as millimetres for metres."""


class MagnitudeError(MinsnapError):
    """A path is none that a vehicle can be meant to fly, mostly since its numbers are in another unit."""


class FirmwareWarning(UserWarning):
    """A file is flown otherwise than it says by older firmware of a vehicle."""


class UnknownSolverError(InputError):
    """The solver is not known or not installed."""


class InfeasibleError(InputError):
    """No trajectory meets all conditions, which ``verify()`` proves.

    Where that has no proof, because only a search failed, the error is an :class:`UnprovedError`.

    Attributes
    ----------
    leg : int or None
        The leg where it fails first, counted from 0.
    instant : float or None
        When it fails, from the start of the trajectory [s].
    smallest_width : float or None
        The smallest half-width of that leg's corridor that has a solution [m]: of its widest walls, where they differ,
        with the others wider by the same factor.
    shortest : float or None
        The shortest total time known to have a solution [s].
    stretch : float or None
        Factor on all durations that has a solution.
    contradiction : minsnap.refusals.contradiction.Contradiction or None
        The proof: walls at instants, with multipliers, that no curve satisfies together at ``contradiction.durations``.
        Where the plan chose these, the sentence says so. Of a total, or a leg, too short for the limits
        a ``refusals.short_total.ShortTotal`` or a ``bounds.least_time.BelowLeast``; of a map without a way a
        ``routes.barrier.Barrier``.
    """

    leg: int | None = None
    instant: float | None = None
    smallest_width: float | None = None
    shortest: float | None = None
    stretch: float | None = None
    contradiction: Any = None

    def verify(self) -> bool:
        """Prove in exact rational arithmetic that there is no such trajectory, by ``contradiction``.

        False means that there is no proof, not that a trajectory exists.
        """
        return self.contradiction is not None and bool(self.contradiction.verify())


class UnprovedError(InfeasibleError):
    """A search ended without a trajectory. It is not proved that there is none, so ``verify()`` is False.

    The message says what was tried; ``shortest`` and ``stretch`` have longer times that do.
    """


class SolverError(MinsnapError):
    """Every solver that was tried failed on a problem that has a solution."""
