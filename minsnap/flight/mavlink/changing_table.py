"""Setpoints that change while they are flown: from a splice on they are those of another trajectory."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import FlightError, InputError, TimingError
from minsnap.files.frames import map_vectors
from minsnap.flight.mavlink.setpoints import FeedForward, Setpoint, SetpointTable, tabulate
from minsnap.flight.mavlink.vehicle_messages import Vector
from minsnap.trajectory.samples import Samples
from minsnap.trajectory.trajectory import Trajectory

JOIN_DISTANCE = 0.02
"""Greatest distance between the start of a change and the setpoint at that instant [m]."""

ALIKE = 0.1
"""By how much the velocity that it begins with may differ from theirs [m/s]."""


NOTHING = FeedForward()
"""Adds nothing to setpoints."""


@dataclass(frozen=True, eq=False)
class Flown:
    """What is flown: the table, and the instant of the flight at which the present trajectory began [s]."""

    table: SetpointTable
    began: float


@dataclass(frozen=True, eq=False)
class Exchange:
    """What is to be flown, and what was flown when it was prepared."""

    before: Flown
    after: Flown


class ChangingTable:
    """A table of setpoints whose rest can be exchanged.

    It is read like a :class:`~minsnap.flight.mavlink.setpoints.SetpointTable`; one assignment exchanges everything: a
    reader never sees half of a change.

    Parameters
    ----------
    table : SetpointTable
        What is flown at first.
    added : FeedForward
        What is added to the setpoints.
    stays : bool
        Whether the flight stays at the end of what is flown, for changes to come. It may be set to False in flight.
    """

    def __init__(self, table: SetpointTable, feed_forward: FeedForward = NOTHING, stays: bool = False) -> None:
        self._flown, self._added, self.stays = Flown(table, 0.0), feed_forward, stays
        self.rate, self.fields, self.missing, self.mask = table.rate, table.fields, table.missing, table.mask
        self.start, self.note, self.frame, self.lead = table.start, table.note, table.frame, table.lead

    def __len__(self) -> int:
        return len(self._flown.table)

    def __getitem__(self, index: int) -> Setpoint:
        """Return the setpoint of a step; beyond the last it is the last, at rest."""
        table = self._flown.table
        return table[index] if index < len(table) else table[index].held()

    def fly_motion_alone(self) -> bool:
        """Leave out what is added to offset drag, before the flight; return whether there was any."""
        before = self._flown.table
        self._flown, self._added = Flown(before.motion(), self._flown.began), NOTHING
        return before.added is not None

    def planned(self, step: float) -> Vector:
        """Return where the vehicle is to be while a step is sent [m]."""
        return self._flown.table.planned(step)

    @property
    def began(self) -> float:
        """Instant of the flight at which the trajectory flown now had its time 0 [s]."""
        return self._flown.began

    def prepare(self, trajectory: Trajectory, splice: float) -> Exchange:
        """Make the setpoints of a trajectory from a splice on.

        Parameters
        ----------
        trajectory : Trajectory
            Its time 0 is the splice.
        splice : float
            On the clock of the trajectory that is flown now [s].

        Raises
        ------
        TimingError
            If the splice lies beyond the end of what is flown.
        FlightError
            If the trajectory does not begin where the setpoints are at the splice.
        InputError
            If it has other coordinates, or several laps are flown.
        """
        before = self._flown
        table, at = before.table, before.began + splice
        self._check(table, trajectory, at)
        first = max(math.ceil(at * self.rate - 1e-9), 0)
        rows = self._rows(trajectory, first / self.rate - at)
        kept = table.rows[np.minimum(np.arange(first), len(table.rows) - 1)]
        whole = np.concatenate((kept, rows))
        whole.flags.writeable = False
        return Exchange(before, Flown(replace(table, rows=whole), at))

    def exchange(self, exchange: Exchange, elapsed: float) -> None:
        """Fly what was prepared, from its splice on.

        Parameters
        ----------
        exchange : Exchange
        elapsed : float
            Of the flight, now [s].

        Raises
        ------
        TimingError
            If the splice has passed.
        FlightError
            If something else is flown since it was prepared.
        """
        late = elapsed - exchange.after.began
        if late > 0.0:
            at = exchange.after.began
            raise TimingError(f"the change takes over at {at:.6g} s of the flight, {late:.3g} s ago: it is too late")
        if exchange.before is not self._flown:
            raise FlightError("another change was taken over meanwhile: replan from what is flown now")
        self._flown = exchange.after

    def _rows(self, trajectory: Trajectory, begin: float) -> FloatArray:
        """Rows of the setpoints from an instant of a trajectory on, its end state last."""
        steps = max(math.ceil((trajectory.duration - begin) * self.rate - 1e-9), 1)
        t = np.arange(steps + 1) / self.rate
        inside = np.clip(begin + t, 0.0, trajectory.duration)
        position, velocity, acceleration = (trajectory(inside, order) for order in range(3))
        samples = Samples(
            t, position, velocity, acceleration, yaw=trajectory.yaw(inside), yaw_rate=trajectory.yaw(inside, 1)
        )
        return tabulate(self._added.applied(samples), None, self.fields, self.frame).rows

    def _check(self, table: SetpointTable, trajectory: Trajectory, at: float) -> None:
        if table.laps > 1:
            raise InputError(f"{table.laps} laps are flown: a flight that changes has one")
        if trajectory.dim != 3:
            raise InputError(f"a vehicle flies in three coordinates, this trajectory has {trajectory.dim}")
        end = (len(table) - 1) / self.rate
        if at > end + 1.0 / self.rate and not self.stays:
            raise TimingError(f"the change takes over at {at:.6g} s, after the flight ends at {end:.6g} s: plan anew")
        self._check_joint(table, trajectory, at)

    def _check_joint(self, table: SetpointTable, trajectory: Trajectory, at: float) -> None:
        """Compare the start of a trajectory with the setpoints there, between two steps by their derivatives."""
        step = math.floor(at * self.rate + 1e-9)
        before, after = (np.array(table[step + k].position + table[step + k].velocity) for k in (0, 1))
        share = at * self.rate - step
        position = _hermite(before, after, share, 1.0 / self.rate)
        velocity = before[3:] + share * (after[3:] - before[3:])
        begin, speed = map_vectors([trajectory(0.0), trajectory(0.0, 1)], "enu", self.frame)
        gap = float(np.linalg.norm(begin - position))
        if gap > JOIN_DISTANCE:
            raise FlightError(
                f"the change begins {gap:.3g} m from the setpoint at its splice: replan from what is flown"
            )
        jump = float(np.linalg.norm(speed - velocity))
        if "velocity" in self.fields and jump > ALIKE:
            raise FlightError(
                f"the change begins {jump:.3g} m/s off the velocity flown then: replan from what is flown"
            )


def _hermite(before: FloatArray, after: FloatArray, share: float, step: float) -> FloatArray:
    """Position between two steps, from positions and velocities (6,) at both."""
    a, b = before[:3], after[:3]
    u, v = step * before[3:], step * after[3:]
    s = share
    return np.asarray(
        (2 * s**3 - 3 * s**2 + 1) * a + (s**3 - 2 * s**2 + s) * u + (3 * s**2 - 2 * s**3) * b + (s**3 - s**2) * v
    )
