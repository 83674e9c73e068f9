"""The frames of gates as obstacles: four bars around a rectangular opening, each an upright prism."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, set_fields
from minsnap.basics.checks import check_distance, check_positive
from minsnap.basics.tolerances import EXACT
from minsnap.corridors.prism import Prism
from minsnap.errors import WaypointError


@dataclass(frozen=True, eq=False)
class Bar(Prism):
    """A bar of the frame around a gate, larger on all sides by what a vehicle needs.

    Parameters
    ----------
    polygon, low, high
        Of the enlarged bar, as ``Prism`` takes them [m].
    gate : int, optional
        The number of its gate among the stops of a course.
    clearance : float
        By how much it is larger [m].
    """

    gate: int | None
    clearance: float

    def __init__(
        self, polygon: ArrayLike, low: float, high: float, gate: int | None = None, clearance: float = 0.0
    ) -> None:
        super().__init__(polygon, low, high)
        set_fields(self, gate=gate, clearance=float(clearance))

    def called(self, which: int) -> str:
        """Return what messages call it, where it is obstacle ``which``."""
        name = f"obstacle {which}" if self.gate is None else f"the frame of gate {self.gate}"
        return f"{name} and its margin of {self.clearance:g} m" if self.clearance else name


def bars_of(
    center: FloatArray,
    normal: FloatArray,
    corners: FloatArray,
    bar: float,
    depth: float,
    clearance: float,
    gate: int | None = None,
) -> tuple[Bar, ...]:
    """Return the bars of a gate, larger by a clearance on all sides; see :meth:`minsnap.Gate.frame`."""
    wide = check_positive("the bar of a frame", bar, "m", WaypointError)
    deep = check_positive("the depth of a frame", depth, "m", WaypointError)
    room = check_distance("the clearance of a frame", clearance, WaypointError)
    sides = np.roll(corners, -1, axis=0) - corners if len(center) == 3 else np.zeros((0, 3))
    across, up = (sides[0], sides[1]) if len(sides) == 4 else (np.zeros(3), np.zeros(3))
    upright = abs(normal[-1]) <= EXACT and abs(across[-1]) <= EXACT * np.linalg.norm(across)
    level = np.linalg.norm(normal[:-1]) <= EXACT
    if len(sides) != 4 or np.linalg.norm(across) == 0.0 or abs(across @ up) > EXACT * (across @ across):
        raise WaypointError("a frame is known of rectangular gates in space: give the obstacles around this one")
    if not (upright or level):
        raise WaypointError("a frame is known of gates that stand upright or lie level: give the obstacles around it")
    half = np.array([np.linalg.norm(across), np.linalg.norm(up)]) / 2.0
    axes = np.stack([across / (2.0 * half[0]), up / (2.0 * half[1]), normal])
    inner, outer = half - room, half + wide + room
    thick = deep / 2.0 + room
    (x, y), (u, v) = inner.tolist(), outer.tolist()
    boxes = [((-u, -v), (-x, v)), ((x, -v), (u, v)), ((-u, -v), (u, -y)), ((-u, y), (u, v))]
    sides_of = [_box(center, axes, (*low, -thick), (*high, thick)) for low, high in boxes]
    return tuple(Bar(*sides, gate, room) for sides in sides_of)


def _box(
    center: FloatArray, axes: FloatArray, low: tuple[float, ...], high: tuple[float, ...]
) -> tuple[FloatArray, float, float]:
    """Return polygon and ends of the box between two corners in a frame one of whose axes is vertical."""
    upwards = int(np.argmax(np.abs(axes[:, 2])))
    first, second = (k for k in range(3) if k != upwards)
    flat = [
        (low[first], low[second]),
        (high[first], low[second]),
        (high[first], high[second]),
        (low[first], high[second]),
    ]
    polygon = [center[:2] + u * axes[first, :2] + v * axes[second, :2] for u, v in flat]
    ends = sorted((center[2] + low[upwards] * axes[upwards, 2], center[2] + high[upwards] * axes[upwards, 2]))
    return np.array(polygon), float(ends[0]), float(ends[1])
