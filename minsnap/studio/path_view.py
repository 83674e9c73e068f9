"""The path in the scene, the vehicle on it, and waypoints and gates with handles that move and turn them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.corridors import Gate
from minsnap.errors import MinsnapError
from minsnap.studio.edits import move_waypoint, reshape_gate
from minsnap.studio.page_inputs import Change, DragHandles, Editor, when_dragged
from minsnap.studio.plan_drawing import VehiclePose, blended, coloured_path, pieces_of
from minsnap.studio.workbench import BenchState
from minsnap.trajectory import Trajectory
from minsnap.vehicle import Quadrotor

GHOST = (128, 136, 146)
FLIGHT = (230, 73, 20)
"""Colours of the plan before and of a simulated flight."""

WIDTH = 5.0
"""Of the path [pixels]."""


ARM, WITHIN, BEYOND = (92, 98, 112), (43, 138, 62), (224, 49, 49)
"""Colours of the arms, and of bars within the range of the rotors and beyond it."""

SMALLEST = 0.03
"""Least length of a drawn arm, as a share of the extent of the scene, so that a small vehicle can be seen."""

BAR, HIGHEST = 1.6, 1.5
"""Length of the bar of a rotor at its greatest thrust, in arms; what is drawn at most of a thrust, in greatest ones."""


class PathView:
    """Lines of the scene.

    Parameters
    ----------
    server : viser.ViserServer
        Where it is drawn.
    """

    def __init__(self, server: Any) -> None:
        nothing = np.zeros((1, 2, 3))
        lines = {"thickness_units": "screen", "visible": False}
        add = server.scene.add_line_segments
        self._path = add("/plan/path", nothing, nothing, thickness=WIDTH, **lines)
        self._ghost = add("/plan/before", nothing, GHOST, thickness=WIDTH / 2.0, **lines)
        self._flight = add("/plan/flight", nothing, FLIGHT, thickness=WIDTH / 1.5, **lines)
        self._drawn: Trajectory | None = None
        self._before: Trajectory | None = None
        self.top_speed = 0.0

    def show(self, state: BenchState) -> None:
        """Draw the last good plan and the one before."""
        if state.planned is not None:
            self.draw(state.planned.trajectory)
        if state.ghost is not None and state.ghost is not self._before and state.ghost is not self._drawn:
            self._before = state.ghost
            t = np.linspace(0.0, self._before.duration, 200)
            self._ghost.points, self._ghost.visible = pieces_of(self._before(t)), True

    def draw(self, curve: Trajectory) -> None:
        """Draw a plan, unless it is the one that is drawn."""
        if curve is not self._drawn:
            self._drawn = curve
            points, colours, self.top_speed = coloured_path(curve)
            self._path.points, self._path.colors, self._path.visible = points, blended(colours), True

    def overlay(self, positions: FloatArray | None) -> None:
        """Draw a simulated flight, positions of shape (m, 3) [m]; or remove it."""
        if positions is not None:
            step = max(len(positions) // 800, 1)
            self._flight.points = pieces_of(positions[::step])
        self._flight.visible = positions is not None

    @property
    def drawn(self) -> tuple[float, bool, bool]:
        """The greatest speed of the path [m/s]; whether the plan before is drawn, and a simulated flight."""
        return self.top_speed, bool(self._ghost.visible), bool(self._flight.visible)


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
        tops[:, 2] += BAR * self._arm * np.clip(pose.rotors / most, -HIGHEST, HIGHEST)
        self._bars.points = np.stack([self._hubs, tops], axis=1).astype(np.float32)
        outside = (pose.rotors < least - 1e-9) | (pose.rotors > most + 1e-9)
        colours = blended(np.where(outside[:, None], BEYOND, WITHIN))
        self._bars.colors = np.repeat(colours[:, None], 2, axis=1)


def _rim(hub: FloatArray, radius: float) -> FloatArray:
    """Return a circle about a hub, shape (16, 2, 3) [m]."""
    angle = np.linspace(0.0, 2.0 * np.pi, 17)
    circle = hub + radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(17)])
    return np.stack([circle[:-1], circle[1:]], axis=1)


BALL, CHOSEN = (84, 90, 104), (247, 103, 7)
"""Colours of a waypoint, and of the chosen one."""

TOGETHER = 0.02
"""Waypoints nearer than this share of the extent have one label with all their numbers."""


FRAME = (230, 119, 0)
"""Colour of gates."""


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
        self._server = server
        self._gizmos = DragHandles(editor, self._gizmo, _moved)
        self._balls: list[Any] = []
        self._labels: list[Any] = []
        self._chosen, self._size = 0, 1.0
        self._clicked: Callable[[int], None] = self.choose

    def show(self, state: BenchState) -> None:
        """Draw the waypoints of the document."""
        points = state.request.waypoints
        with self._gizmos.lock:
            del self._balls[len(points) :], self._labels[len(points) :]  # they go with their gizmo
            self._size = 0.1 * float(np.clip(np.ptp(np.array(points), axis=0).max(), 1.0, 10.0))
            self._gizmos.show(dict(enumerate(points)))
            for label, text in zip(self._labels, numbers(points), strict=True):
                label.text, label.visible = text, bool(text)
            self.choose(self._chosen)

    def choose(self, index: int) -> None:
        """Mark the chosen waypoint."""
        with self._gizmos.lock:
            self._chosen = index
            for i, ball in enumerate(self._balls):
                if ball.color != (CHOSEN if i == index else BALL):
                    ball.color, ball.scale = (CHOSEN, 2.0) if i == index else (BALL, 1.0)

    def when_clicked(self, act: Callable[[int], None]) -> None:
        """Call ``act`` with the number of a waypoint that is clicked."""
        self._clicked = act

    def _gizmo(self, index: int, point: Any) -> Any:
        scene, name, size = self._server.scene, f"/waypoints/{index}", self._size
        how = {"disable_rotations": True, "depth_test": False, "scale": size, "line_width": 3.0}
        gizmo = scene.add_transform_controls(name, position=point, **how)
        ball = scene.add_icosphere(f"{name}/ball", radius=0.09 * size, color=BALL, cast_shadow=False)
        self._balls.append(ball)
        self._labels.append(scene.add_label(f"{name}/number", str(index), anchor="bottom-left", font_screen_scale=0.9))

        async def clicked(event: Any) -> None:
            self._clicked(index)

        ball.on_click(clicked)
        return gizmo


def _moved(index: int, position: tuple[float, ...]) -> tuple[Change, str]:
    return lambda request: move_waypoint(request, index, position), f"drag {index}"


def numbers(points: Sequence[tuple[float, ...]]) -> list[str]:
    """Return the label of each waypoint: all numbers at its place at the first one, nothing at the others."""
    places = np.array(points)
    near = TOGETHER * max(float(np.ptp(places, axis=0).max()), 1e-9)
    together = np.linalg.norm(places[:, None] - places, axis=2) <= near
    first = together.argmax(axis=1)
    return [", ".join(map(str, np.flatnonzero(first == i))) if first[i] == i else "" for i in range(len(places))]


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
        there = request is not None and any(gate.waypoint == index for gate in request.openings)
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

        def turn() -> None:
            nonlocal before
            now = Rotation.from_quat(np.roll(handle.wxyz, -1)).as_matrix()
            step, before = now @ before.T, now
            self._editor.edit(lambda request: reshape_gate(request, self._chosen, step), "turn", held=True)

        when_dragged(handle, self._editor, turn)
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
