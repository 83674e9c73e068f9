"""What of a fleet lies in the memories of Crazyflies at once: all of it, or parts from rest to rest, written in turn.

While one part is flown, the next is written where the one before it lay: even parts lie at the beginning of a memory,
odd ones at its end. Where all rest between two parts, what is late is a longer rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import FileError
from minsnap.files.formats import compressed, crazyflie_rows, curve_of_bytes, curve_of_rows, distance_bounds
from minsnap.fleet import Fleet
from minsnap.trajectory import Trajectory, widest_step

MEMORY = 4096
"""Bytes of the memory of trajectories."""

POLYNOMIALS, COMPRESSED = 0, 1

ALIGNED, PIECE = 4, 132
"""Bytes on a multiple of which a trajectory begins, and those of one piece of polynomials."""

FARTHEST = 0.01
"""How far what is held may be from the planned curve [m]."""

STILL = (1e-3, 0.05)
"""Speed and acceleration up to which a vehicle rests [m/s, m/s^2]."""

TRACE = 1e-6
"""Time that is none [s]."""


@dataclass(frozen=True)
class Upload:
    """One trajectory of a vehicle's memory.

    Parameters
    ----------
    content : bytes
    kind : int
        ``POLYNOMIALS``, 33 float32 a piece, or ``COMPRESSED``.
    pieces : int
    distance : float
        Upper bound of the distance of the curve in it to the planned one [m].
    slot : int
        Its number in the vehicle.
    offset : int
        Where it lies in the memory.
    """

    content: bytes
    kind: int
    pieces: int
    distance: float
    slot: int = 1
    offset: int = 0


@dataclass(frozen=True)
class MemoryPart:
    """What all vehicles fly between two rests.

    Parameters
    ----------
    begins, ends : float
        On the clock of the fleet [s].
    uploads : tuple of Upload
        Of each vehicle.
    """

    begins: float
    ends: float
    uploads: tuple[Upload, ...]

    @property
    def slot(self) -> int:
        """Its number in all vehicles."""
        return self.uploads[0].slot


def upload_of(trajectory: Trajectory, farthest: float = FARTHEST, room: int = MEMORY, *, plain: bool = False) -> Upload:
    """Return the bytes of a trajectory: polynomials if they fit into so many bytes, else the compressed form.

    Raises
    ------
    FileError
        If neither fits, or polynomials do not where ``plain`` allows these alone, or what is held is further than
        ``farthest`` [m] from the trajectory; says by how much.
    """
    pieces, most = max(len(trajectory.durations), 2), room // PIECE
    if plain and pieces > most:
        text = f"{pieces} pieces do not fit the Crazyflie's memory of {most} from rest to rest"
        raise FileError(
            f"{text}: divide them by a hold, or write it --to csv, which minsnap upload flies compressed too"
        )
    if pieces <= most:
        with np.errstate(over="ignore"):
            rows = crazyflie_rows(trajectory, most).astype("<f4")
        held = curve_of_rows(rows.astype(np.float64))
        content, kind = np.roll(rows, -1, axis=1).tobytes(), POLYNOMIALS
    else:
        content, kind = compressed(trajectory), COMPRESSED
        held = curve_of_bytes(content)
    distance = float(distance_bounds(trajectory, held)[0])
    if distance > farthest:
        step, instant, piece = widest_step(trajectory)
        if step > farthest:
            raise FileError(
                f"piece {piece} ends {step:.3g} m from piece {piece + 1}, at {instant:.4g} s: mend the curve"
            )
        text = f"the vehicle would hold a curve up to {distance:.2g} m from the planned one, rounded to its numbers"
        raise FileError(f"{text}: fly slower, or plan legs of more even durations")
    return Upload(content, kind, len(held.durations), distance)


def parts_of(fleet: Fleet, acts: Sequence[tuple[str, float]] = (), *, plain: bool = False) -> list[MemoryPart]:
    """Return the parts in which a fleet lies in its vehicles' memories: one where each fits as a whole.

    Parameters
    ----------
    fleet : Fleet
    acts : sequence of (str, float)
        Names of acts, and when they are reached [s], for what is said of one that does not fit.
    plain : bool
        Polynomials alone: the compressed form is not known to what writes them.

    Raises
    ------
    FileError
        If a flight between two rests of all does not fit beside the next one; says which vehicle, and which act.
    """
    try:
        return [MemoryPart(0.0, fleet.duration, tuple(upload_of(curve, plain=plain) for curve in fleet))]
    except FileError:
        flights = _flights(fleet)
        if len(flights) < 2 or any(widest_step(curve)[0] > FARTHEST for curve in fleet):  # a jump is no rest
            raise
    return _laid_out(_joined(fleet, flights, acts, plain), PIECE if plain else ALIGNED)


def curves_of(fleet: Fleet, part: MemoryPart) -> list[Trajectory]:
    """Return the curves of a part of a fleet."""
    whole = part.ends - part.begins >= fleet.duration
    return list(fleet) if whole else [_between(curve, part.begins, part.ends) for curve in fleet]


def _flights(fleet: Fleet) -> list[tuple[float, float]]:
    """Return from when to when anybody moves, split wherever all rest."""
    knots = np.unique(np.concatenate([curve.breaks for curve in fleet]))
    knots = knots[np.append(True, np.diff(knots) > TRACE)]
    rests = _at_rest(fleet, knots)
    moves = ~_at_rest(fleet, 0.5 * (knots[:-1] + knots[1:])) | ~rests[:-1] | ~rests[1:]
    flights: list[tuple[float, float]] = []
    for i in np.flatnonzero(moves).tolist():
        begins, ends = float(knots[i]), float(knots[i + 1])
        if rests[i] or not flights:
            flights.append((begins, ends))
        else:
            flights[-1] = (flights[-1][0], ends)
    return flights


def _at_rest(fleet: Fleet, instants: FloatArray) -> np.ndarray:
    """Return whether all vehicles rest at each instant."""
    most = [np.linalg.norm(fleet(instants, order), axis=2).max(axis=0) for order in (1, 2)]
    return np.asarray((most[0] <= STILL[0]) & (most[1] <= STILL[1]))


def _joined(
    fleet: Fleet, flights: list[tuple[float, float]], acts: Sequence[tuple[str, float]], plain: bool
) -> list[MemoryPart]:
    """Return as few parts as half a memory holds as polynomials: one flight, or some with the rests between them."""
    parts: list[MemoryPart] = []
    for begins, ends in flights:
        with suppress(FileError):
            with_it = _part(fleet, parts[-1].begins, ends) if parts else None
            if with_it is not None and all(each.kind == POLYNOMIALS for each in with_it.uploads):
                parts[-1] = with_it
                continue
        try:
            parts.append(_part(fleet, begins, ends, MEMORY if plain else MEMORY // 2, plain=plain))
        except FileError as error:
            raise FileError(f"the flight{_reached(begins, ends, acts)}: {error}") from None
    for one, two in zip(parts[:-1], parts[1:], strict=True):
        for vehicle, (first, second) in enumerate(zip(one.uploads, two.uploads, strict=True)):
            if len(first.content) + len(second.content) > MEMORY - ALIGNED:
                larger = max(one, two, key=lambda part: len(part.uploads[vehicle].content))
                raise FileError(_too_long(fleet, vehicle, larger, acts))
    return parts


def _too_long(fleet: Fleet, vehicle: int, part: MemoryPart, acts: Sequence[tuple[str, float]]) -> str:
    text = f"the flight{_reached(part.begins, part.ends, acts)} takes {len(part.uploads[vehicle].content)} bytes of "
    text += f"{fleet.name(vehicle)}, and two flights one after the other share {MEMORY}"
    return f"{text}: divide it by a hold, or give it fewer moves"


def _reached(begins: float, ends: float, acts: Sequence[tuple[str, float]]) -> str:
    """Say where a flight leads, and when."""
    names = [repr(name) for name, at in acts if begins < at <= ends + TRACE]
    return f"{' to ' if names else ''}{' and '.join(names)} from {begins:.2f} to {ends:.2f} s"


def _part(fleet: Fleet, begins: float, ends: float, room: int = MEMORY // 2, *, plain: bool = False) -> MemoryPart:
    """Return what is flown between two instants, polynomials where they take so many bytes at most."""
    uploads = (upload_of(_between(curve, begins, ends), room=room, plain=plain) for curve in fleet)
    return MemoryPart(begins, ends, tuple(uploads))


def _between(curve: Trajectory, begins: float, ends: float) -> Trajectory:
    """Return a curve between two instants, with rests in one piece each; it stays where it ends early."""
    last = curve.control_points[-1, -1]
    stays = np.broadcast_to(last, (1, *curve.control_points.shape[1:]))
    if begins >= curve.duration - TRACE:
        return Trajectory(stays, np.array([ends - begins]), yaw=curve.yaw)
    whole = curve.between(begins, min(ends, curve.duration))
    points, durations = whole.control_points, whole.durations
    still = np.abs(points - points[:, :1]).max(axis=(1, 2)) <= 0.0
    first = np.flatnonzero(np.append(True, ~(still[1:] & still[:-1])))
    if len(first) == len(durations) or np.any(
        whole.yaw(np.append(whole.breaks, 0.5 * (whole.breaks[:-1] + whole.breaks[1:])))
    ):
        return whole
    return Trajectory(points[first], np.add.reduceat(durations, first))


def _laid_out(parts: list[MemoryPart], aligned: int) -> list[MemoryPart]:
    """Return the parts with numbers and places: even ones at the beginning, odd ones at the end of each memory."""
    laid = []
    for number, part in enumerate(parts):
        places = [(MEMORY - len(each.content)) // aligned * aligned * (number % 2) for each in part.uploads]
        own = zip(part.uploads, places, strict=True)
        laid.append(replace(part, uploads=tuple(replace(each, slot=1 + number % 2, offset=at) for each, at in own)))
    return laid
