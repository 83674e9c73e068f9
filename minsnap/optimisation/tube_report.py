"""The report of a plan in a tube that the native core made in one call."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.corridors.margins import margin_to
from minsnap.corridors.tubes import Tube
from minsnap.optimisation.solved_task import NATIVE
from minsnap.trajectory.leg_uses import PlainLegs
from minsnap.trajectory.plan_notes import plan_notes
from minsnap.trajectory.report import Report, steps_of
from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class TubeReport:
    """What is known of such a plan when it is made; its report is made when somebody asks for it.

    Parameters
    ----------
    seconds : float
        What the plan took.
    figures : ndarray, shape (4,)
        Cost and lower bound [m^2/s^(2k - 1)], contacts, rounds.
    waypoints : ndarray, shape (legs + 1, dim)
        [m].
    widths : ndarray, shape () or (legs,)
        Half-widths of the tube [m].
    history : ndarray, shape (evaluations, 2), or None
        As for ``LinearSystem``.
    """

    seconds: float
    figures: FloatArray
    waypoints: FloatArray
    widths: FloatArray
    history: FloatArray | None = None

    def report(self, curve: Trajectory) -> Report:
        """Return the report, with the proved distance of the curve to the tube."""
        margin = min(margin_to(curve, walls).value for walls in Tube(self.widths).walls(self.waypoints))
        rows, rounds = self.figures[2:].astype(int).tolist()
        milliseconds, steps = 1e3 * self.seconds, steps_of(self.history)
        notes = plan_notes(curve, widths=self.widths)
        how: dict[str, Any] = {"steps": steps, "core": NATIVE, "notes": notes, "known": PlainLegs(curve)}
        return Report(NATIVE, rounds, rows, curve.cost(), margin, milliseconds, **how)


@dataclass(frozen=True, eq=False)
class TubeReports:
    """What is known of many such plans, one after the other: ``reports[b]`` is made at its first use.

    Parameters
    ----------
    seconds : float
        What each plan took, in the mean.
    figures : ndarray, shape (plans, 4)
    waypoints : ndarray, shape (knots in all, dim)
        [m].
    widths : ndarray, shape (legs in all,)
        [m].
    offsets : ndarray of int, shape (plans + 1,)
        First leg of each plan, and the number of all legs; plans have one knot more than legs.
    """

    seconds: float
    figures: FloatArray
    waypoints: FloatArray
    widths: FloatArray
    offsets: IntArray

    def __getitem__(self, index: int) -> TubeReport:
        first, last = self.offsets[index : index + 2].tolist()
        points = self.waypoints[first + index : last + index + 1]
        return TubeReport(self.seconds, self.figures[index], points, self.widths[first:last])
