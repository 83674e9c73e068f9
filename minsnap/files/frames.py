"""Frames of reference: named, exact mappings between the axes that files, autopilots and cameras use.

Every frame is described from the library's own world (right-handed, z up, yaw counter-clockwise seen from above, body
axes forward-left-up), so a mapping between any two goes through it. Axes are only permuted and negated: nothing is
rounded.

============== ============================ ======================= ===================
name           axes from the world's x y z  body axes               yaw from the world's
============== ============================ ======================= ===================
``enu``        (x, y, z) east north up      forward left up         yaw
``ned``        (y, x, -z) north east down   forward right down      pi/2 - yaw
``flu``        (x, y, z) local, z up        forward left up         yaw
``frd``        (x, -y, -z) local, z down    forward right down      -yaw
``optitrack``  (x, z, -y) local, y up       forward up right        yaw
============== ============================ ======================= ===================

``enu`` and ``ned`` know the compass; ``flu``, ``frd`` and ``optitrack`` are of a room. Mapping from one family to the
other lays the room's x axis on east. Sources: REP 103 (ROS) for enu and flu, the MAVLink and PX4 manuals for ned and
frd with the motion capture mapping (x, z, -y) from y up to z down, and the OptiTrack manual for y up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.errors import FrameError
from minsnap.trajectory.samples import Samples


@dataclass(frozen=True)
class Frame:
    """Axes as signed permutations of the world's, and how yaw is counted in them.

    Parameters
    ----------
    name : str
        What files and messages call it.
    order, sign : tuple of 3
        Coordinate ``i`` of the frame is ``sign[i]`` times coordinate ``order[i]`` of the world (z up).
    body_order, body_sign : tuple of 3
        The same for the axes of the vehicle, from forward-left-up.
    yaw_sign, yaw_offset : float
        Yaw in the frame is ``yaw_offset + yaw_sign * yaw`` [rad].
    """

    name: str
    order: tuple[int, int, int]
    sign: tuple[int, int, int]
    body_order: tuple[int, int, int]
    body_sign: tuple[int, int, int]
    yaw_sign: float
    yaw_offset: float

    @property
    def matrix(self) -> FloatArray:
        """Rotation from world coordinates to this frame's, shape (3, 3), determinant +1."""
        return _permutation(self.order, self.sign)

    @property
    def body_matrix(self) -> FloatArray:
        """Rotation from forward-left-up to this frame's body axes, shape (3, 3), determinant +1."""
        return _permutation(self.body_order, self.body_sign)


_UP = ((0, 1, 2), (1, 1, 1))
_DOWN = ((0, 1, 2), (1, -1, -1))
_Y_UP = ((0, 2, 1), (1, 1, -1))

FRAMES: dict[str, Frame] = {
    frame.name: frame
    for frame in (
        Frame("enu", *_UP, *_UP, 1.0, 0.0),
        Frame("ned", (1, 0, 2), (1, 1, -1), *_DOWN, -1.0, math.pi / 2),
        Frame("flu", *_UP, *_UP, 1.0, 0.0),
        Frame("frd", *_DOWN, *_DOWN, -1.0, 0.0),
        Frame("optitrack", *_Y_UP, *_Y_UP, 1.0, 0.0),
    )
}
"""Every frame, by name."""


def get_frame(name: str | Frame) -> Frame:
    """Return the frame of that name, in any case of letters.

    Raises
    ------
    FrameError
        If no frame is called so; the sentence lists those there are.
    """
    if isinstance(name, Frame):
        return name
    try:
        return FRAMES[name.lower()]
    except (KeyError, AttributeError):
        raise FrameError(f"no frame is called {name!r}: choose one of {', '.join(FRAMES)}") from None


def map_vectors(values: ArrayLike, source: str | Frame, target: str | Frame) -> FloatArray:
    """Positions, velocities or accelerations in another frame's axes, exactly.

    Parameters
    ----------
    values : array_like, shape (..., 3)
        In the source frame; not-a-number stays in the coordinate it belongs to.
    source, target : str
        Names of frames.

    Returns
    -------
    ndarray, shape (..., 3)

    Raises
    ------
    FrameError
        If a frame is unknown or the last axis does not have 3 coordinates.
    """
    there, here = get_frame(target), get_frame(source)
    array = np.asarray(values, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise FrameError(f"vectors to map from {here.name} to {there.name} need 3 coordinates, got shape {array.shape}")
    world = np.empty_like(array)
    world[..., list(here.order)] = array * here.sign
    return np.asarray(world[..., list(there.order)] * there.sign + 0.0)  # + 0.0 turns -0.0 into 0.0


def map_yaw(yaw: ArrayLike, source: str | Frame, target: str | Frame) -> FloatArray:
    """Headings in another frame [rad], any shape; a continuous heading stays continuous (nothing is wrapped)."""
    here, there = get_frame(source), get_frame(target)
    world = (np.asarray(yaw, dtype=np.float64) - here.yaw_offset) * here.yaw_sign
    return np.asarray(there.yaw_offset + there.yaw_sign * world + 0.0)


def map_yaw_rate(rate: ArrayLike, source: str | Frame, target: str | Frame) -> FloatArray:
    """Yaw rates in another frame [rad/s], any shape."""
    sign = get_frame(source).yaw_sign * get_frame(target).yaw_sign
    return np.asarray(np.asarray(rate, dtype=np.float64) * sign + 0.0)


def map_quaternions(attitude: ArrayLike, source: str | Frame, target: str | Frame) -> FloatArray:
    """Attitudes in another frame: world axes and body axes change together.

    Parameters
    ----------
    attitude : array_like, shape (..., 4)
        Quaternions (w, x, y, z) that rotate body coordinates into the source frame's; normalised here.
    source, target : str
        Names of frames.

    Returns
    -------
    ndarray, shape (..., 4)
        (w, x, y, z), unit length, w >= 0.

    Raises
    ------
    FrameError
        If a frame is unknown, the last axis is not 4 long, or a quaternion has no length.
    """
    from scipy.spatial.transform import Rotation

    here, there = get_frame(source), get_frame(target)
    scalar_last = _check_quaternions(attitude)
    world = Rotation.from_matrix(there.matrix @ here.matrix.T)
    body = Rotation.from_matrix(here.body_matrix @ there.body_matrix.T)
    turned = world * Rotation.from_quat(scalar_last.reshape(-1, 4)) * body
    return np.asarray(np.roll(turned.as_quat(canonical=True), 1, axis=-1).reshape(scalar_last.shape))


def map_samples(samples: Samples, source: str | Frame, target: str | Frame) -> Samples:
    """Return all that ``samples`` hold, in another frame; what is None stays None."""
    here, there = get_frame(source), get_frame(target)
    if here.name == there.name:
        return samples
    mapped: dict[str, Any] = {name: map_vectors(values, here, there) for name, values in samples.vectors().items()}
    if samples.yaw is not None:
        mapped["yaw"] = map_yaw(samples.yaw, here, there)
    if samples.yaw_rate is not None:
        mapped["yaw_rate"] = map_yaw_rate(samples.yaw_rate, here, there)
    return replace(samples, **mapped)


def _permutation(order: tuple[int, int, int], sign: tuple[int, int, int]) -> FloatArray:
    matrix = np.zeros((3, 3))
    matrix[range(3), list(order)] = sign
    return matrix


def _check_quaternions(attitude: ArrayLike) -> FloatArray:
    array = np.asarray(attitude, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != 4:
        raise FrameError(f"quaternions have 4 numbers (w, x, y, z), got shape {array.shape}")
    length = np.linalg.norm(array, axis=-1)
    if not np.all(np.isfinite(length) & (length > 0)):
        raise FrameError("a quaternion has no length or is not a number: attitudes are unit quaternions (w, x, y, z)")
    return np.roll(array, -1, axis=-1)
