"""A task and its limits, as the joint search sees them with any number of pieces a leg."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from minsnap.arrays import FloatArray
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.optimisation.problem import Task
from minsnap.optimisation.units import Units
from minsnap.time_allocation.joint_layout import JointLayout
from minsnap.time_allocation.joint_rows import Block, wall_blocks
from minsnap.time_allocation.joint_search import JointSearch, Told
from minsnap.time_allocation.momentary_limits import momentary_blocks
from minsnap.time_allocation.rotor_limits import rotor_block


class JointProblem:
    """What is searched for.

    Parameters
    ----------
    task : Task
        Without walls of limits; its pieces are those asked for.
    limits : Limits
    guess : ndarray, shape (legs,)
        Durations from which units follow [s].
    yaw : float or None
        Constant yaw for which the rotors' thrusts are limited [rad]; None for any heading without spin.
    """

    def __init__(self, task: Task, limits: Limits, guess: FloatArray, yaw: float | None = 0.0) -> None:
        self.task, self.limits, self.guess, self.yaw = task, limits, guess, yaw
        self.units: Units = task.units(guess)

    def search(self, pieces: int, told: Told | None = None, ticked: Callable[[], None] | None = None) -> JointSearch:
        """Return a search over curves of so many pieces a leg."""
        layout = JointLayout(replace(self.task, pieces=pieces), self.units)
        return JointSearch(layout, self.blocks(layout), told, ticked)

    def blocks(self, layout: JointLayout) -> list[Block]:
        """Return all walls and limits on the pieces of a layout."""
        pieces, total, limits = layout.task.pieces, layout.pieces, self.limits
        momentary = momentary_blocks(limits, self.units, total)
        stricter = {block.name for block in momentary}
        convex = [wall for wall in limits.walls(self.task.waypoints) if wall.name not in stricter]
        blocks = wall_blocks([*self.task.walls, *convex], self.units, pieces, total) + momentary
        if isinstance(limits, VehicleLimits):
            blocks.append(rotor_block(limits.vehicle, limits.reserve, self.units, total, self.yaw))
        return blocks
