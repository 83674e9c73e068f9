"""The path of the plan in the scene, with the plan before and a simulated flight; the vehicle on it."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.studio.plan_drawing import VehiclePose, coloured_path, pieces_of
from minsnap.studio.workbench import BenchState
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle.quadrotor import Quadrotor

GHOST = (173, 181, 189)
FLIGHT = (230, 73, 20)
"""Colours of the plan before and of a simulated flight."""

WIDTH = 5.0
"""Of the path [pixels]."""


ARM, WITHIN, BEYOND = (50, 50, 60), (43, 138, 62), (224, 49, 49)
"""Colours of the arms, and of bars within the range of the rotors and beyond it."""

SMALLEST = 0.03
"""Least length of a drawn arm, as a share of the extent of the scene, so that a small vehicle can be seen."""

BAR = 1.6
"""Length of the bar of a rotor at its greatest thrust, in arms."""


class PathView:
    """Lines of the scene.

    Parameters
    ----------
    server : viser.ViserServer
        Where it is drawn.
    """

    def __init__(self, server: Any) -> None:
        nothing, white = np.zeros((1, 2, 3)), (255, 255, 255)
        lines = {"thickness_units": "screen", "visible": False}
        add = server.scene.add_line_segments
        self._path = add("/plan/path", nothing, np.zeros((1, 2, 3)), thickness=WIDTH, **lines)
        self._ghost = add("/plan/before", nothing, GHOST or white, thickness=WIDTH / 2.0, **lines)
        self._flight = add("/plan/flight", nothing, FLIGHT, thickness=WIDTH / 1.5, **lines)
        self._drawn: Trajectory | None = None
        self._before: Trajectory | None = None
        self.top_speed = 0.0

    def show(self, state: BenchState) -> None:
        """Draw the last good plan and the one before."""
        if state.planned is not None and state.planned.trajectory is not self._drawn:
            self._drawn = state.planned.trajectory
            points, colours, self.top_speed = coloured_path(self._drawn)
            self._path.points, self._path.colors, self._path.visible = points, colours, True
        if state.ghost is not None and state.ghost is not self._before and state.ghost is not self._drawn:
            self._before = state.ghost
            t = np.linspace(0.0, self._before.duration, 200)
            self._ghost.points, self._ghost.visible = pieces_of(self._before(t)), True

    def overlay(self, positions: FloatArray | None) -> None:
        """Draw a simulated flight, positions of shape (m, 3) [m]; or remove it."""
        if positions is not None:
            step = max(len(positions) // 800, 1)
            self._flight.points = pieces_of(positions[::step])
        self._flight.visible = positions is not None


class VehicleView:
    """A quadrotor: arms, rotors, bars.

    Parameters
    ----------
    server : viser.ViserServer
        Where it is drawn.
    """

    def __init__(self, server: Any) -> None:
        scene = server.scene
        self._frame = scene.add_frame("/vehicle", show_axes=False, visible=False)
        lines = {"thickness_units": "screen"}
        nothing = np.zeros((1, 2, 3))
        self._arms = scene.add_line_segments("/vehicle/arms", nothing, ARM, thickness=5.0, **lines)
        self._rims = scene.add_line_segments("/vehicle/rims", nothing, ARM, thickness=2.0, **lines)
        self._bars = scene.add_line_segments("/vehicle/bars", np.zeros((4, 2, 3)), WITHIN, thickness=9.0, **lines)
        self._hubs = np.zeros((4, 3))
        self._limits = (0.0, 1.0)
        self._arm = 1.0

    def show(self, vehicle: Quadrotor, extent: float) -> float:
        """Draw a vehicle in a scene of an extent [m]; return how many times its own size."""
        larger = max(1.0, SMALLEST * extent / vehicle.arm_length)
        self._arm = larger * vehicle.arm_length
        self._hubs = np.asarray(larger * vehicle.rotor_positions)
        self._limits = vehicle.rotor_thrust_limits
        self._arms.points = np.stack([np.zeros((4, 3)), self._hubs], axis=1).astype(np.float32)
        self._rims.points = np.concatenate([_rim(hub, 0.45 * self._arm) for hub in self._hubs]).astype(np.float32)
        return larger

    def place(self, pose: VehiclePose) -> None:
        """Move the vehicle to a pose, with the bars of its rotors."""
        self._frame.position, self._frame.wxyz, self._frame.visible = pose.position, pose.quaternion, True
        least, most = self._limits
        tops = self._hubs.copy()
        tops[:, 2] += BAR * self._arm * pose.rotors / most
        self._bars.points = np.stack([self._hubs, tops], axis=1).astype(np.float32)
        outside = (pose.rotors < least - 1e-9) | (pose.rotors > most + 1e-9)
        colours = np.where(outside[:, None], BEYOND, WITHIN).astype(np.uint8)
        self._bars.colors = np.repeat(colours[:, None], 2, axis=1)


def _rim(hub: FloatArray, radius: float) -> FloatArray:
    """Return a circle about a hub, shape (16, 2, 3) [m]."""
    angle = np.linspace(0.0, 2.0 * np.pi, 17)
    circle = hub + radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(17)])
    return np.stack([circle[:-1], circle[1:]], axis=1)
