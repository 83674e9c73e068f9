"""Replay of poses from a file at the times in the file."""

from __future__ import annotations

import os

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.table import read_table
from minsnap.errors import FileError
from minsnap.flight.mavlink.schedule import Clock
from minsnap.flight.mocap.sources import Pose, PoseSource


class ReplaySource(PoseSource):
    """Poses of a comma-separated file at their times: columns t,x,y,z and yaw or qw,qx,qy,qz.

    Parameters
    ----------
    path : str or path
        The file; other columns, such as a setpoint file's, are passed over.
    clock : Clock
        Whose time it follows, from now on.

    Raises
    ------
    FileError
        If the columns are not there or not numbers.
    """

    def __init__(self, path: str | os.PathLike[str], clock: Clock) -> None:
        optional = ("vx", "vy", "vz", "ax", "ay", "az", "yaw", "yaw_rate", "qw", "qx", "qy", "qz")
        table = read_table(path, ("t", "x", "y", "z"), optional)
        self._t = table["t"] - table["t"][0]
        self._positions = np.stack([table[name] for name in "xyz"], axis=1)
        self._attitudes = _attitudes(path, table)
        self._clock, self._start = clock, clock.now()

    def latest(self) -> Pose | None:
        """Return the pose of the file for the present time."""
        elapsed = self._clock.now() - self._start
        row = int(np.searchsorted(self._t, elapsed, side="right")) - 1
        self.ended = row == len(self._t) - 1 and elapsed > self._t[-1] + 1.0
        x, y, z = self._positions[row].tolist()
        w, i, j, k = self._attitudes[row].tolist()
        return Pose(self._start + float(self._t[row]), (x, y, z), (w, i, j, k))


def _attitudes(path: str | os.PathLike[str], table: dict[str, FloatArray]) -> FloatArray:
    quaternion = ("qw", "qx", "qy", "qz")
    if all(name in table for name in quaternion):
        stacked = np.stack([table[name] for name in quaternion], axis=1)
        unit: FloatArray = stacked / np.linalg.norm(stacked, axis=1, keepdims=True)
        return unit
    if "yaw" not in table:
        raise FileError(f"{path}, line 1: no column yaw, nor qw,qx,qy,qz: a pose needs an attitude")
    half, zero = table["yaw"] / 2, np.zeros_like(table["yaw"])
    return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=1)
