"""A task and its limits, as the joint search sees them with any number of pieces a leg."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.limits.limits import Limits, VehicleLimits
from minsnap.optimisation.problem import Task
from minsnap.optimisation.units import Units
from minsnap.time_allocation.joint_layout import JointLayout
from minsnap.time_allocation.joint_rows import Block, wall_blocks
from minsnap.time_allocation.joint_search import JointSearch, Told
from minsnap.time_allocation.momentary_limits import heading_block, look_block, momentary_blocks
from minsnap.time_allocation.objectives import Objective
from minsnap.time_allocation.rotor_limits import rotor_block
from minsnap.trajectory.heading import Heading
from minsnap.trajectory.look_at import LookAtHeading
from minsnap.trajectory.velocity_heading import VelocityHeading


class JointProblem:
    """What is searched for.

    Parameters
    ----------
    task : Task
        Without walls of limits; its pieces are those asked for.
    limits : Limits
    guess : ndarray, shape (legs,)
        Durations from which units follow [s].
    heading : Heading or None
        Of any curve of the task: rotors' thrusts are limited for a constant yaw, or without spin about the thrust axis;
        the yaw rate for a heading along the velocity.
    """

    def __init__(self, task: Task, limits: Limits, guess: FloatArray, heading: Heading | None = None) -> None:
        self.task, self.limits, self.guess, self.heading = task, limits, guess, heading
        # Not the power of two of given durations: with it some searches past a point ended in far slower curves.
        self.units: Units = replace(task.units(guess), time=float(np.exp(np.log(guess).mean())))

    @property
    def yaw(self) -> float | None:
        """The yaw [rad] if it is constant."""
        return None if self.heading is None else self.heading.constant

    @property
    def turns(self) -> bool:
        """Whether a limit on the yaw rate bounds how fast the horizontal velocity turns."""
        return self.limits.yaw_rate is not None and isinstance(self.heading, VelocityHeading)

    @property
    def complete(self) -> bool:
        """Whether a search knows every limit: of rotors under a constant yaw or without spin, of no rate of a yaw."""
        return self.heading is None or self.yaw is not None or self.heading.medium is not None

    def search(
        self,
        pieces: int,
        told: Told | None = None,
        ticked: Callable[[], None] | None = None,
        turns: bool = False,
        objective: Objective | None = None,
        least: FloatArray | None = None,
    ) -> JointSearch:
        """Return a search over curves of so many pieces a leg.

        Parameters
        ----------
        pieces : int
        told, ticked : callable, optional
        turns : bool
            Whether with the limit on the rate of a heading along the velocity.
        objective : Objective, optional
            On the layout of so many pieces; the time unless given.
        least : ndarray, shape (pieces in all,), optional
            Durations that no step goes below, normalised.
        """
        layout = self.layout(pieces)
        blocks = self.blocks(layout)
        self.task.deadline.check()
        if turns and isinstance(self.heading, VelocityHeading) and self.limits.yaw_rate is not None:
            blocks.append(heading_block(self.limits.yaw_rate, self.heading, self.units, layout.pieces, layout.dim))
        return JointSearch(layout, blocks, told, ticked, objective, least)

    def layout(self, pieces: int) -> JointLayout:
        """Return the layout of so many pieces a leg."""
        return JointLayout(replace(self.task, pieces=pieces), self.units)

    def blocks(self, layout: JointLayout) -> list[Block]:
        """Return walls and limits on the pieces of a layout; of yaw rates only that towards a point."""
        pieces, total, limits = layout.task.pieces, layout.pieces, self.limits
        momentary = momentary_blocks(limits, self.units, total)
        stricter = {block.name for block in momentary}
        convex = [wall for wall in limits.walls(self.task.waypoints) if wall.name not in stricter]
        blocks = wall_blocks([*self.task.walls, *convex], self.units, pieces, total) + momentary
        if isinstance(limits, VehicleLimits):
            blocks.append(rotor_block(limits.vehicle, limits.reserve, self.units, total, self.yaw))
        if limits.yaw_rate is not None and isinstance(self.heading, LookAtHeading):
            blocks.append(look_block(limits.yaw_rate, self.heading, self.units, total, layout.dim))
        return blocks
