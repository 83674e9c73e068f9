"""Where the camera of a browser stands so that it sees the whole scene, whatever the shape of its window."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray

DIRECTION = np.array([-0.8, -1.0, 0.9]) / np.linalg.norm([-0.8, -1.0, 0.9])
"""From the scene to the camera: from the front, the left and above."""

FILLED = 0.8
"""Share of the picture that the scene takes."""

NEAREST = 2.0
"""[m]."""


def framing(points: FloatArray, fov: float, aspect: float) -> tuple[FloatArray, FloatArray]:
    """Return where the camera stands and what it looks at, so that points (n, 3) [m] are all within the picture.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        [m].
    fov : float
        Vertical angle of view [rad].
    aspect : float
        Width of the picture by its height.
    """
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    right = np.cross(-DIRECTION, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    offsets = points - center
    half = FILLED * np.tan(0.5 * fov)
    across = np.abs(offsets @ right) / (half * aspect)
    upwards = np.abs(offsets @ np.cross(right, -DIRECTION)) / half
    away = max(float((np.maximum(across, upwards) + offsets @ DIRECTION).max()), NEAREST)
    return center + away * DIRECTION, center


def frame(client: Any, points: FloatArray) -> FloatArray:
    """Let the camera of a browser see points, shape (n, 3) [m]; return where it stands."""
    camera = client.camera
    place, center = framing(points, camera.fov, camera.image_width / camera.image_height)
    with client.atomic():
        camera.position, camera.look_at = place, center
    return place


def keep_framed(client: Any, points: Callable[[], FloatArray]) -> None:
    """Let a camera see points, again whenever its picture has another size, until its user moves it."""
    camera = client.camera
    place, size = frame(client, points()), (camera.image_width, camera.image_height)

    async def changed(event: Any) -> None:
        nonlocal place, size
        now = (camera.image_width, camera.image_height)
        if now != size and np.allclose(camera.position, place, rtol=1e-3, atol=1e-3):
            place, size = frame(client, points()), now

    camera.on_update(changed)
