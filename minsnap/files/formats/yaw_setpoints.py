"""The heading of a Skybrush show: angles with lines between them, clockwise from the show's x axis.

In a binary show this is block 5: a byte (bit 0: the vehicle turns itself), the first angle as int16 in tenths of a
degree, then entries of a duration (uint16, milliseconds) and a change (int16, tenths of a degree).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import FloatArray, NDArray, ReadOnly
from minsnap.errors import FileError
from minsnap.files.formats.bezier_segments import LONGEST
from minsnap.trajectory.heading import ConstantHeading, Heading
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.trajectory import Trajectory

_Integers = NDArray[np.int64]

TENTHS = -1800.0 / np.pi
"""Tenths of a degree, clockwise, of a radian."""

AUTOMATIC = 1
"""The bit of a vehicle that turns itself."""


@dataclass(frozen=True)
class YawCutting:
    """How a heading is cut into lines.

    Parameters
    ----------
    tolerance : float
        Largest difference from the heading at the instants that are looked at [0.1 degrees].
    shortest : int
        Lines that are not halved any more [ms].
    looked_at : int
        Instants of each line.
    """

    tolerance: float = 5.0
    shortest: int = 50
    looked_at: int = 9


YAW = YawCutting()


@dataclass(frozen=True, eq=False)
class YawSetpoints(ReadOnly):
    """Angles of a vehicle, with lines between them.

    Parameters
    ----------
    instants : ndarray of int, shape (n,)
        From 0, ascending [ms].
    angles : ndarray of int, shape (n,)
        Clockwise, not wrapped [0.1 degrees].
    """

    instants: _Integers
    angles: _Integers

    @classmethod
    def of(cls, trajectory: Trajectory) -> YawSetpoints | None:
        """Return those of a trajectory, within half a degree; None where its yaw is 0 throughout.

        Raises
        ------
        FileError
            If it turns by more than 3276.7 degrees at once.
        """
        yaw = trajectory.yaw
        if yaw.constant is not None:
            angle = round(np.remainder(yaw.constant * TENTHS + 1800.0, 3600.0) - 1800.0)
            return cls(np.zeros(1, dtype=np.int64), np.array([angle])) if angle else None
        instants = _knots(trajectory)
        angles = np.round(_tenths(trajectory, instants / 1e3)).astype(np.int64)
        angles -= int(np.round(angles[0] / 3600.0)) * 3600
        if np.abs(np.diff(angles)).max(initial=0) > 32767:
            raise FileError("a show turns by 3276.7 degrees at once at most: let the vehicle turn slower")
        return cls(instants, angles) if angles.any() else None

    @property
    def content(self) -> bytes:
        """Body of a block."""
        steps = zip(np.diff(self.instants).tolist(), np.diff(self.angles).tolist(), strict=True)
        return struct.pack("<Bh", 0, int(self.angles[0])) + b"".join(struct.pack("<Hh", *step) for step in steps)

    @classmethod
    def parsed(cls, body: bytes) -> YawSetpoints | None:
        """Return those of the body of a block; None where the vehicle turns itself."""
        automatic, first = struct.unpack_from("<Bh", body)
        steps = np.array(list(struct.iter_unpack("<Hh", body[3 : 3 + (len(body) - 3) // 4 * 4]))).reshape(-1, 2)
        instants, angles = (np.cumsum(np.concatenate(([0], column))) for column in steps.astype(np.int64).T)
        return None if automatic & AUTOMATIC else cls(instants, angles + first)

    def heading(self, duration: float) -> Heading:
        """Return the heading of a path of a duration [s]: after its last angle it stays there."""
        instants, angles = self.instants / 1e3, self.angles / TENTHS
        if len(angles) == 1 or instants[-1] <= 0.0:
            return ConstantHeading(float(angles[-1]))
        inside = np.concatenate(([0.0], instants[(instants > 0.0) & (instants < duration)], [duration]))
        shown = np.interp(inside, instants, angles)
        points = np.stack([shown[:-1], shown[1:]], axis=1)[:, :, None]
        return PlannedHeading(Trajectory(points, np.diff(inside)))


def _tenths(trajectory: Trajectory, t: FloatArray) -> FloatArray:
    return np.asarray(trajectory.yaw(np.minimum(t, trajectory.duration)) * TENTHS)


def _knots(trajectory: Trajectory) -> _Integers:
    """Return instants between which the heading is a line, within the tolerance [ms]."""
    end = max(int(np.ceil(trajectory.duration * 1e3 - 1e-6)), 1)
    known = np.concatenate(([0.0, trajectory.duration], trajectory.yaw.breaks))
    breaks = np.unique(np.clip(np.round(known * 1e3), 0, end)).astype(np.int64)
    share = np.linspace(0.0, 1.0, YAW.looked_at)
    while True:
        spans = np.diff(breaks)
        t = breaks[:-1, None] + spans[:, None] * share
        angles = _tenths(trajectory, t / 1e3)
        lines = angles[:, :1] * (1.0 - share) + angles[:, -1:] * share
        far = (np.abs(lines - angles).max(axis=1) > YAW.tolerance) & (spans >= 2 * YAW.shortest)
        far |= spans > LONGEST
        if not far.any():
            return breaks
        breaks = np.union1d(breaks, (breaks[:-1] + spans // 2)[far])
