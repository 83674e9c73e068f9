"""What a page draws of a plan: the path with its speed, profiles against time, the vehicle's pose, and thin lines."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from minsnap.basics.arrays import GRAVITY, FloatArray
from minsnap.trajectory.path import Path
from minsnap.vehicle.flatness import specific_thrust, tilt
from minsnap.vehicle.quadrotor import Quadrotor
from minsnap.vehicle.states import flatness_of

PIECES = 320
"""Straight pieces that a path is drawn with."""

INSTANTS = 241
"""Instants of a profile."""

SPEED_SCALE = np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37)], dtype=np.float64)
"""Colours from rest to the greatest speed: five of matplotlib's viridis (Smith and van der Walt, CC0)."""

ColourArray = npt.NDArray[np.uint8]


KINDS = {"VEC3": 5126, "VEC4": 5121, "SCALAR": 5125}
"""Numbers of places (float32), of colours (uint8) and of indices (uint32), by their shapes."""


@dataclass(frozen=True, eq=False)
class Profiles:
    """Quantities against time, arrays of shape (m,), rotors (m, 4).

    Parameters
    ----------
    t : ndarray
        [s].
    speed, acceleration : ndarray
        Euclidean norms [m/s], [m/s^2].
    thrust : ndarray
        Thrust to weight.
    tilt : ndarray
        [degrees].
    rotors : ndarray, shape (m, 4)
        Thrust of each rotor [N].
    """

    t: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    thrust: FloatArray
    tilt: FloatArray
    rotors: FloatArray


@dataclass(frozen=True, eq=False)
class VehiclePose:
    """Where a vehicle is.

    Parameters
    ----------
    position : ndarray, shape (3,)
        [m].
    quaternion : ndarray, shape (4,)
        Attitude w, x, y, z.
    rotors : ndarray, shape (4,)
        Thrust of each rotor [N].
    speed : float
        [m/s].
    """

    position: FloatArray
    quaternion: FloatArray
    rotors: FloatArray
    speed: float


def coloured_path(path: Path) -> tuple[npt.NDArray[np.float32], ColourArray, float]:
    """Return the pieces of a path, shape (n, 2, 3) [m], the colours of their ends, and the greatest speed [m/s]."""
    t = np.linspace(0.0, path.duration, PIECES + 1)
    speed = np.linalg.norm(path(t, 1), axis=1)
    top = float(speed.max())
    colours = speed_colours(speed / top if top > 0.0 else speed)
    return pieces_of(path(t)), np.stack([colours[:-1], colours[1:]], axis=1), top


def pieces_of(points: FloatArray) -> npt.NDArray[np.float32]:
    """Return the straight pieces between consecutive points, shape (n, 2, 3) [m]."""
    return np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)


def speed_colours(share: npt.ArrayLike) -> ColourArray:
    """Return colours of shares in [0, 1] of the greatest speed, shape (..., 3)."""
    at = np.clip(np.asarray(share, dtype=np.float64), 0.0, 1.0) * (len(SPEED_SCALE) - 1)
    below = np.minimum(at.astype(np.intp), len(SPEED_SCALE) - 2)
    part = (at - below)[..., None]
    return np.asarray((1.0 - part) * SPEED_SCALE[below] + part * SPEED_SCALE[below + 1]).round().astype(np.uint8)


def profiles_of(path: Path, vehicle: Quadrotor) -> Profiles:
    """Return the profiles of a path flown by a vehicle, drag included in the rotors' thrusts."""
    t = np.linspace(0.0, path.duration, INSTANTS)
    acceleration = path(t, 2)
    return Profiles(
        t,
        np.linalg.norm(path(t, 1), axis=1),
        np.linalg.norm(acceleration, axis=1),
        specific_thrust(acceleration) / GRAVITY,
        np.degrees(tilt(acceleration)),
        _rotor_thrusts(vehicle, path, t)[0],
    )


def pose_at(path: Path, vehicle: Quadrotor, instant: float) -> VehiclePose:
    """Return the pose of a vehicle on a path, its attitude and thrusts by differential flatness."""
    t = np.array([min(max(instant, 0.0), path.duration)])
    thrusts, quaternion = _rotor_thrusts(vehicle, path, t)
    return VehiclePose(path(t)[0], quaternion[0], thrusts[0], float(np.linalg.norm(path(t, 1)[0])))


def _rotor_thrusts(vehicle: Quadrotor, path: Path, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    states = flatness_of(vehicle, path, t)
    return vehicle.thrust_coefficient * states.rotor_speed * np.abs(states.rotor_speed), states.quaternion


def thin_lines(points: FloatArray, colours: FloatArray) -> bytes:
    """Return lines through points as a binary glTF.

    Parameters
    ----------
    points : ndarray, shape (lines, n, 3)
        [m].
    colours : ndarray, shape (n, 3)
        Of the points of every line, as the screen has them, from 0 to 255.
    """
    count, each = points.shape[:2]
    places = points.reshape(-1, 3).astype("<f4")
    first = (each * np.arange(count)[:, None] + np.arange(each - 1)).ravel()
    pairs = np.stack([first, first + 1], axis=1).astype("<u4")
    linear = np.round(255.0 * _linear(np.clip(colours / 255.0, 0.0, 1.0)))
    shades = np.tile(np.column_stack([linear, np.full(each, 255)]).astype(np.uint8), (count, 1))
    parts = [places.tobytes(), shades.tobytes(), pairs.tobytes()]
    return _glb(_layout(places, pairs.size, [len(part) for part in parts]), b"".join(parts))


def _linear(colours: FloatArray) -> FloatArray:
    """Return the intensities of colours of sRGB (IEC 61966-2-1), both from 0 to 1."""
    low = colours / 12.92
    return np.asarray(np.where(colours <= 0.04045, low, ((colours + 0.055) / 1.055) ** 2.4))


def _layout(places: FloatArray, indices: int, sizes: list[int]) -> dict[str, Any]:
    """Return what the JSON chunk says of the binary one."""
    starts = [0, *np.cumsum(sizes).tolist()]
    views = [{"buffer": 0, "byteOffset": a, "byteLength": n} for a, n in zip(starts, sizes, strict=False)]
    box = {"min": places.min(axis=0).tolist(), "max": places.max(axis=0).tolist()}
    accessors: list[dict[str, Any]] = [
        {"count": len(places), "type": "VEC3", **box},
        {"count": len(places), "type": "VEC4", "normalized": True},
        {"count": indices, "type": "SCALAR"},
    ]
    for view, accessor in enumerate(accessors):
        accessor |= {"bufferView": view, "componentType": KINDS[accessor["type"]]}
    primitive = {"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "mode": 1}  # pairs of ends
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": starts[-1]}],
    }


def _glb(layout: dict[str, Any], content: bytes) -> bytes:
    head = json.dumps(layout, separators=(",", ":")).encode()
    head += b" " * (-len(head) % 4)
    chunks = struct.pack("<I4s", len(head), b"JSON") + head + struct.pack("<I4s", len(content), b"BIN\0") + content
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
