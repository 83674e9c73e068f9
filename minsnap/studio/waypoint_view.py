"""Waypoints in the scene: gizmos that can be dragged, with their numbers."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

import numpy as np

from minsnap.studio.edits import move_waypoint
from minsnap.studio.page_inputs import Editor
from minsnap.studio.workbench import BenchState

BALL = (40, 40, 40)
"""Colour of a waypoint."""


class WaypointView:
    """Waypoints of the scene.

    Parameters
    ----------
    server : viser.ViserServer
        Where they are drawn.
    editor : Editor
        What drags edit.
    """

    def __init__(self, server: Any, editor: Editor) -> None:
        self._server, self._editor = server, editor
        self._lock = threading.RLock()
        self._gizmos: list[Any] = []
        self._dragged: set[int] = set()
        self._points: Sequence[tuple[float, ...]] = ()

    def show(self, state: BenchState) -> None:
        """Draw the waypoints of the document."""
        with self._lock:
            points = self._points = state.request.waypoints
            while len(self._gizmos) > len(points):
                self._gizmos.pop().remove()
                self._dragged.discard(len(self._gizmos))
            while len(self._gizmos) < len(points):
                self._gizmos.append(self._gizmo(len(self._gizmos), points))
            self._place()

    def _place(self) -> None:
        """Move the gizmos to where the document has them, but for those that a hand holds."""
        for index, (gizmo, point) in enumerate(zip(self._gizmos, self._points, strict=False)):
            if index not in self._dragged and np.abs(np.asarray(gizmo.position) - point).max() > 1e-9:
                gizmo.position = point

    def _gizmo(self, index: int, points: Any) -> Any:
        scene, name = self._server.scene, f"/waypoints/{index}"
        size = 0.1 * float(np.clip(np.ptp(np.array(points), axis=0).max(), 1.0, 10.0))
        how = {"disable_rotations": True, "depth_test": False, "scale": size, "line_width": 3.0}
        gizmo = scene.add_transform_controls(name, position=points[index], **how)
        scene.add_icosphere(f"{name}/ball", radius=0.08 * size, color=BALL)
        scene.add_label(f"{name}/number", str(index), anchor="bottom-left", font_screen_scale=0.9)

        async def moved(event: Any) -> None:
            if event.phase == "start":
                self._dragged.add(index)
            elif event.phase == "update":
                position = tuple(float(value) for value in gizmo.position)
                self._editor.edit(lambda request: move_waypoint(request, index, position), f"drag {index}", held=True)
            else:
                self._editor.pause()
                with self._lock:
                    self._dragged.discard(index)
                    self._place()

        gizmo.on_update(moved)
        return gizmo
