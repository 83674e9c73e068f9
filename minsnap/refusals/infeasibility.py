"""Why no curve stays inside a corridor: the leg, the instant, and the smallest sufficient width."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.cached import cached_property
from minsnap.errors import InfeasibleError, MinsnapError, SolverError
from minsnap.native.corridor import Give
from minsnap.native.status import Status
from minsnap.optimisation.least_slacks import SlackProgramme, common_slack, native_slacks
from minsnap.optimisation.optimum import InfeasibleRowsError
from minsnap.optimisation.solve import Effort, solve
from minsnap.optimisation.task import Task
from minsnap.optimisation.task_walls import AllWalls, all_walls
from minsnap.refusals.contradiction import Contradiction, find_contradiction

NOTICEABLE = 1e-6
"""Slack, in widths, below which a problem counts as solvable after all."""

WIDTH_ROOM = 1e-4
"""Share added to a smallest width so that it does; up to a hundred times as much where it does not."""


UNPROVED = "no curve was found that keeps all walls, and it could not be proved that there is none: "


class Pressed:
    """Walls that give way by the least slacks, what presses against them then, and what that proves.

    Parameters
    ----------
    task : Task
        Without what follows where waypoints lie on walls (``touching``).
    durations : ndarray, shape (pieces,)
        [s].
    walls : AllWalls
        Those of the task.
    give : Give
    sign : bool
        Whether it is sufficient to know that they must give way.
    """

    def __init__(self, task: Task, durations: FloatArray, walls: AllWalls, give: Give, sign: bool = False) -> None:
        self.task, self.durations, self.walls = task, durations, walls
        self.give, self.sign, self._proved = give, sign, None
        native = native_slacks(task, durations, give, sign=sign, effort=1.1 if sign else 2.2)
        if native is not None and native.status is not Status.DONE:  # its rows may prove what its slacks are below
            self._proved = find_contradiction(task, durations, walls, native)
        solved = native is not None and (native.status is Status.DONE or self._proved is not None)
        self.least = native if native is not None and solved else self._programme.run(sign)
        self._native = self.least is native

    @cached_property
    def _programme(self) -> SlackProgramme:
        return SlackProgramme(self.task, self.durations, self.give)

    @property
    def possible(self) -> bool:
        """Whether a curve keeps all walls as they are, but for rounding."""
        return self.least.status is Status.DONE and not self.noticeable

    @property
    def noticeable(self) -> bool:
        """Whether walls give way, by what is known."""
        return float(self.least.slacks.max()) > NOTICEABLE

    def proof(self) -> Contradiction | None:
        """Return the contradiction of the rows that press; None where that is not proved."""
        known = self.task, self.durations, self.walls
        self._proved = self._proved or find_contradiction(*known, self.least)
        if self._proved is None and self._native:
            self.least, self._native = self._programme.run(self.sign), False
            self._proved = find_contradiction(*known, self.least)
        return self._proved or find_contradiction(*known, self._programme.evidence())

    def hardest(self) -> tuple[int, float]:
        """Leg and instant of the row that presses hardest, of those of walls that give way if there are any."""
        task, gives = self.task, self.give.group[self.least.wall] >= 0
        chosen = np.flatnonzero(gives if gives.any() else ~gives)
        wall = self.least.wall[chosen]
        if not len(wall):
            return 0, 0.0
        piece, sizes = self.walls.piece[wall], self.walls.width[wall]
        press = np.abs(self.least.multiplier[chosen]) * sizes / task.units(self.durations).length
        press *= task.units(self.durations).time ** self.walls.order[wall]
        leg = int(np.bincount(piece // task.pieces, press, task.legs).argmax())
        row = int(np.where(piece // task.pieces == leg, press, -np.inf).argmax())
        breaks = np.concatenate(([0.0], np.cumsum(self.durations)))
        return leg, float(breaks[piece[row]] + self.least.s[chosen[row]] * self.durations[piece[row]])


def explain_corridor(task: Task, durations: FloatArray) -> InfeasibleError | SolverError | None:
    """Find whether the walls on positions alone are infeasible at piece durations (pieces in all,) [s], and why.

    Returns
    -------
    InfeasibleError, SolverError or None
        With ``leg``, ``instant``, ``smallest_width`` and its proof where a corridor is too narrow; a SolverError where
        that has no proof; None where the walls on positions leave a curve inside.
    """
    corridor = replace(task, walls=[wall for wall in task.walls if wall.order == 0], touching=False)
    walls = all_walls(corridor)
    if not len(walls):
        return None
    give, names = _leg_groups(corridor, walls)
    pressed = Pressed(corridor, durations, walls, give)
    if pressed.possible:
        return None
    proof = pressed.proof()
    leg, instant = pressed.hardest()
    if proof is None:
        advice = f"widen the corridor of leg {leg}, or change durations that differ much"
        return _standing(corridor, durations, walls) or SolverError(f"{UNPROVED}{advice}")
    on_leg = (give.group >= 0) & (walls.piece // task.pieces == leg)
    if not on_leg.any():
        return _too_near(corridor, leg, instant, proof)
    tried = _room(task, durations, pressed.least.slacks)
    room, share = WIDTH_ROOM if tried is None else tried, np.append(pressed.least.slacks, 0.0)
    widths = walls.width * (1.0 + share[give.group] * (1.0 + room) + room)
    width = float(widths[on_leg].max())
    others = {
        name: float(widths[give.group == name].max())
        for name, slack in zip(names, pressed.least.slacks, strict=True)
        if slack > NOTICEABLE and name not in (None, leg)
    }
    message = (
        f"no curve stays inside the {corridor.walls[0].name} of leg {leg}: it is too narrow at {instant:.4g} s; "
        f"{_sufficient(width, names == [None], others, tried is not None)}{_advice(task)}"
    )
    smallest = None if tried is None else width
    return InfeasibleError(message, leg=leg, instant=instant, smallest_width=smallest, contradiction=proof)


def _room(task: Task, durations: FloatArray, slacks: FloatArray) -> float | None:
    """Share to add to widths for which a plan keeps the other walls and limits too; None without one."""
    for room in (WIDTH_ROOM, 10.0 * WIDTH_ROOM, 100.0 * WIDTH_ROOM):
        share = np.broadcast_to(slacks * (1.0 + room) + room, task.legs)
        walls = [wall if wall.order else wall.moved(share[wall.leg] * wall.width) for wall in task.walls]
        try:
            solve(replace(task, walls=walls), durations, effort=Effort.WHOLE)
        except (InfeasibleRowsError, MinsnapError):
            continue
        return room
    return None


def _sufficient(width: float, everywhere: bool, others: Mapping[int, float], tried: bool) -> str:
    """Say what widths would do, or what is needed at least: that of the leg, or of all, and of others."""
    where = "for all legs" if everywhere else "there"
    what = f"a half-width of {width:.6g} m {where} would do"
    if not tried:
        what = (
            f"the walls on positions alone need a half-width of about {width:.6g} m {where}, the others may need more"
        )
    wider = ", ".join(f"{other:.6g} m on leg {name}" for name, other in others.items())
    return f"{what}, together with {wider}" if wider else what


def _standing(task: Task, durations: FloatArray, walls: AllWalls) -> InfeasibleError | None:
    """Return the error where walls contradict each other at waypoints, which widths of a corridor do not help."""
    pressed = Pressed(task, durations, walls, common_slack(walls), sign=True)
    proof = pressed.proof() if pressed.noticeable else None
    return None if proof is None else _too_near(task, *pressed.hardest(), proof)


def _too_near(task: Task, leg: int, instant: float, proof: Contradiction) -> InfeasibleError:
    """Return the error where what is asked of the waypoints alone has no curve."""
    return InfeasibleError(
        f"no curve passes the waypoints as near as asked for: leg {leg} is the hardest, at {instant:.4g} s; widen the "
        f"tolerances or gates, pin fewer derivatives, or lower continuity={task.continuity}",
        leg=leg,
        instant=instant,
        contradiction=proof,
    )


def _leg_groups(task: Task, walls: AllWalls) -> tuple[Give, list[int | None]]:
    """One common slack if all walls are equally wide, else one per leg; and the leg of each slack."""
    leg, stands = walls.piece // task.pieces, walls.momentary  # what holds at one instant never gives way
    width, weight = walls.width[~stands], np.ones(len(leg))
    if len(width) and np.ptp(width) <= 1e-9 * width.max():
        return Give(np.where(stands, -1, 0), weight, 1), [None]
    return Give(np.where(stands, -1, leg), weight, task.legs), list(range(task.legs))


def _advice(task: Task) -> str:
    if task.continuity > task.half - 1:
        return (
            f"; or lower continuity={task.continuity}, which leaves degree {2 * task.half - 1} little freedom: "
            f"continuity={task.half - 1} fits any width from rest to rest"
        )
    return ""
