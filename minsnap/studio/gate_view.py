"""Gates in the scene: their edges, the way through them, and a handle that turns the chosen one."""

from __future__ import annotations

from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors.gates import Gate
from minsnap.errors import MinsnapError
from minsnap.studio.edits import reshape_gate
from minsnap.studio.page_inputs import Editor
from minsnap.studio.workbench import BenchState

FRAME = (230, 119, 0)
"""Colour of gates."""


class GateView:
    """Gates of the scene.

    Parameters
    ----------
    server : viser.ViserServer
        Where they are drawn.
    editor : Editor
        What turning the handle edits.
    """

    def __init__(self, server: Any, editor: Editor) -> None:
        self._scene, self._editor = server.scene, editor
        lines: dict[str, Any] = {"thickness": 4.0, "thickness_units": "screen", "visible": False}
        self._edges = server.scene.add_line_segments("/gates", np.zeros((1, 2, 3)), FRAME, **lines)
        self._handle: Any = None
        self._chosen = 0
        self._state: BenchState | None = None

    def show(self, state: BenchState) -> None:
        """Draw the gates of the document."""
        self._state = state
        parts = [outline(corners, crossing) for _, corners, crossing, _ in state.request.openings]
        self._edges.visible = bool(parts)
        if parts:
            self._edges.points = np.concatenate(parts).astype(np.float32)
        self.choose(self._chosen)

    def choose(self, index: int) -> None:
        """Give the gate at a waypoint, if there is one, the handle."""
        self._chosen = index
        request = None if self._state is None else self._state.request
        there = request is not None and any(gate[0] == index for gate in request.openings)
        if self._handle is not None and not there:
            self._handle.remove()
            self._handle = None
        if there and request is not None:
            if self._handle is None:
                self._handle = self._add_handle()
            self._handle.position = request.waypoints[index]

    def _add_handle(self) -> Any:
        from scipy.spatial.transform import Rotation

        how = {"disable_axes": True, "disable_sliders": True, "depth_test": False, "scale": 1.2}
        handle = self._scene.add_transform_controls("/turn", **how)
        before = np.eye(3)

        async def turned(event: Any) -> None:
            nonlocal before
            if event.phase == "update":
                now = Rotation.from_quat(np.roll(handle.wxyz, -1)).as_matrix()
                step, before = now @ before.T, now
                self._editor.edit(lambda request: reshape_gate(request, self._chosen, step), "turn", held=True)
            elif event.phase != "start":
                self._editor.pause()

        handle.on_update(turned)
        return handle


def outline(corners: Any, crossing: int) -> FloatArray:
    """Return the edges of an opening, and the way through it from its center, shape (n, 2, 3) [m]."""
    points = np.array(corners)
    edges = np.stack([points, np.roll(points, -1, axis=0)], axis=1)
    try:
        gate = Gate.polygon(points)
    except MinsnapError:
        return edges
    reach = 0.5 * np.linalg.norm(points - gate.center, axis=1).max() * gate.normal * crossing
    return edges if crossing == 0 else np.concatenate([edges, [[gate.center, gate.center + reach]]])
