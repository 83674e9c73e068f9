"""The flights between the formations of a show, each stored in a file once it is planned."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.archive import read_archive
from minsnap.basics.storage.atomic import atomic_write
from minsnap.errors import MinsnapError
from minsnap.fleet.fleet_planner import plan_fleet
from minsnap.fleet.separation import Separation
from minsnap.limits.limits import Limits
from minsnap.trajectory.trajectory import Trajectory

Conditions = tuple[Limits, Separation, Any, int]
"""Limits, separation, corners of the room or None, and seed of every flight."""


@dataclass(frozen=True)
class KeptFlights:
    """Plans flights, or takes them from a folder where an earlier run has stored them.

    Parameters
    ----------
    conditions : tuple
        What holds for every flight.
    folder : str or path, optional
        Where they are stored.
    progress : bool
        Show a line on the terminal during a search.
    """

    conditions: Conditions
    folder: str | os.PathLike[str] | None
    progress: bool

    def between(self, starts: FloatArray, goals: FloatArray, name: str) -> tuple[list[Trajectory], str]:
        """Return the curves from starts to goals, shape (vehicles, 3), and how they were planned.

        Raises
        ------
        UnprovedError
            If the search ends without any; says in which flight.
        """
        file = None if self.folder is None else Path(self.folder) / f"{self._key(starts, goals)}.npz"
        if file is not None and file.exists():
            stored = read_archive(file)
            return [Trajectory(stored[f"p{i}"], stored[f"d{i}"]) for i in range(len(starts))], "kept"
        limits, separation, room, seed = self.conditions
        ways = np.stack([starts, goals], axis=1)
        try:
            fleet = plan_fleet(ways, limits, separation, room, seed=seed, progress=self.progress)
        except MinsnapError as error:
            error.args = (f"the flight to {name}: {error}",)
            raise
        report = fleet.report
        if report is not None and report.stopped:
            return list(fleet), f"{report.method}, ended by {report.stopped}"
        if file is not None:
            _store(file, list(fleet))
        return list(fleet), report.method if report else ""

    def _key(self, starts: FloatArray, goals: FloatArray) -> str:
        """Return a name of the question of a flight."""
        limits, apart, room, seed = self.conditions
        radii = None if apart.radii is None else apart.radii.tolist()
        corners = None if room is None else [np.asarray(corner).tolist() for corner in room]
        question = (starts.tolist(), goals.tolist(), repr(limits), apart.distance, radii, apart.downwash, corners, seed)
        return hashlib.sha256(repr(question).encode()).hexdigest()[:24]


def _store(file: Path, curves: list[Trajectory]) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    arrays: dict[str, Any] = {f"p{i}": curve.control_points for i, curve in enumerate(curves)}
    arrays |= {f"d{i}": curve.durations for i, curve in enumerate(curves)}
    with atomic_write(file, "wb") as stream:
        np.savez(stream, **arrays)
