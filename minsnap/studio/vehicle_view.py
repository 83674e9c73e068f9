"""The vehicle in the scene, with a bar for the thrust of each rotor."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.studio.plan_drawing import VehiclePose
from minsnap.vehicle.quadrotor import Quadrotor

ARM, WITHIN, BEYOND = (50, 50, 60), (43, 138, 62), (224, 49, 49)
"""Colours of the arms, and of bars within the range of the rotors and beyond it."""

SMALLEST = 0.03
"""Least length of a drawn arm, as a share of the extent of the scene, so that a small vehicle can be seen."""

BAR = 1.6
"""Length of the bar of a rotor at its greatest thrust, in arms."""


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
