"""What a page draws of a plan: the path with its speed, plots against time with a cursor, the pose, thin lines."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray, NDArray
from minsnap.basics.limit_kinds import KIND, Kind
from minsnap.limits import MEASURES, Motion
from minsnap.trajectory import Medium, Path
from minsnap.vehicle import Quadrotor, flatness_of

PIECES = 320
"""Straight pieces that a path is drawn with."""

INSTANTS = 241
"""Instants of a profile."""

SPEED_SCALE = np.array([(40, 84, 224), (122, 56, 214), (190, 44, 150), (218, 66, 66), (222, 124, 0)], dtype=np.float64)
"""Colours from rest to the greatest speed, from blue to orange: each has a contrast of 2.9 to 1 and more on white and
on a dark page; who tells red from green badly still sees blue turn to yellow."""

ColourArray = NDArray[np.uint8]


KINDS = {"VEC3": 5126, "VEC4": 5121, "SCALAR": 5125}
"""Numbers of places (float32), of colours (uint8) and of indices (uint32), by their shapes."""


@dataclass(frozen=True, eq=False)
class Profiles:
    """Quantities against time.

    Parameters
    ----------
    t : ndarray, shape (m,)
        [s].
    curves : dict
        By the title of their plot, arrays of shape (n, m) in its unit.
    """

    t: FloatArray
    curves: dict[str, FloatArray]


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
    """

    position: FloatArray
    quaternion: FloatArray
    rotors: FloatArray


def coloured_path(path: Path) -> tuple[NDArray[np.float32], ColourArray, float]:
    """Return the pieces of a path, shape (n, 2, 3) [m], the colours of their ends, and the greatest speed [m/s]."""
    t = np.linspace(0.0, path.duration, PIECES + 1)
    speed = np.linalg.norm(path(t, 1), axis=1)
    top = float(speed.max())
    colours = speed_colours(speed / top if top > 0.0 else speed)
    return pieces_of(path(t)), np.stack([colours[:-1], colours[1:]], axis=1), top


def blended(colours: ArrayLike) -> ColourArray:
    """Return colours of the screen, 0 to 255, as those of the ends of lines must be given: linear (IEC 61966-2-1).

    Pages mix the colours of two ends as light and show the result by the curve of the screen; given as they are on the
    screen they come out pale.
    """
    shares = np.clip(np.asarray(colours, dtype=np.float64) / 255.0, 0.0, 1.0)
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.round(255.0 * linear).astype(np.uint8))


def pieces_of(points: FloatArray) -> NDArray[np.float32]:
    """Return the straight pieces between consecutive points, shape (n, 2, 3) [m]."""
    return np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)


def speed_colours(share: ArrayLike) -> ColourArray:
    """Return colours of shares in [0, 1] of the greatest speed, shape (..., 3)."""
    at = np.clip(np.asarray(share, dtype=np.float64), 0.0, 1.0) * (len(SPEED_SCALE) - 1)
    below = np.minimum(at.astype(np.intp), len(SPEED_SCALE) - 2)
    part = (at - below)[..., None]
    return np.asarray((1.0 - part) * SPEED_SCALE[below] + part * SPEED_SCALE[below + 1]).round().astype(np.uint8)


def profiles_of(path: Path, vehicle: Quadrotor) -> Profiles:
    """Return the profiles of a path flown by a vehicle, drag included in the rotors' thrusts."""
    t = np.linspace(0.0, path.duration, INSTANTS)
    motion = Motion(lambda order: path(t, order), "euclidean", Medium())
    curves = {
        title: _shown(kind, MEASURES[kind.measure].sampled(motion, kind.order))[None] for title, kind in CHARTS.items()
    }
    rotors = vehicle.thrusts(flatness_of(vehicle, path, t).rotor_speed)
    return Profiles(t, curves | {ROTORS: rotors.T})


def _shown(kind: Kind, value: Any) -> Any:
    """Return what a limit of a kind bounds as a page shows it: angles in degrees."""
    return np.degrees(value) if kind.degrees and value is not None else value


def pose_at(path: Path, vehicle: Quadrotor, instant: float) -> VehiclePose:
    """Return the pose of a vehicle on a path, its attitude and thrusts by differential flatness."""
    t = np.array([min(max(instant, 0.0), path.duration)])
    states = flatness_of(vehicle, path, t)
    return VehiclePose(path(t)[0], states.quaternion[0], vehicle.thrusts(states.rotor_speed[0]))


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
    shades = np.tile(np.column_stack([blended(colours), np.full(each, 255, dtype=np.uint8)]), (count, 1))
    parts = [places.tobytes(), shades.tobytes(), pairs.tobytes()]
    return _glb(_layout(places, pairs.size, [len(part) for part in parts]), b"".join(parts))


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


HEIGHT = 172
"""Of a plot [pixels]."""

TIME_AXIS = {"label": "time [s]", "labelSize": 16, "labelGap": -2, "size": 30}
VALUE_AXIS = {"size": 44}
PADDING = (10, 14, 2, 0)
"""The axes of a plot, and the room around it in which its outermost numbers are whole [pixels]."""

LINES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
LIMIT, CURSOR = "#e03131", "#868e96"
"""Colours: of the curves, from the palette of Okabe and Ito; of limits; of the cursor."""


CHARTS = {"speed [m/s]": KIND["speed"], "acceleration [m/s²]": KIND["acceleration"]}
CHARTS |= {"thrust [weights]": KIND["max_thrust"], "tilt [degrees]": KIND["tilt"]}
"""Plots of what limits bound, by their titles, from top to bottom; those of the rotors follow."""

ROTORS = "rotor thrusts [N]"

Bounds = tuple[float, float, float, float]
"""Lower and upper edge of a plot, lower and upper limit."""


class Charts:
    """The plots of a page.

    Parameters
    ----------
    gui : viser.GuiApi
        Where they are added, in the present container.
    """

    def __init__(self, gui: Any) -> None:
        names: dict[str, tuple[str, ...]] = {title: (title.split(" [")[0],) for title in CHARTS}
        names[ROTORS] = tuple(f"rotor {number}" for number in (1, 2, 3, 4))
        self._handles = {title: time_chart(gui, title, of) for title, of in names.items()}
        self._drawn: dict[str, tuple[FloatArray, FloatArray, Bounds]] = {}

    def show(self, profiles: Profiles, limits: Mapping[str, Any], vehicle: Quadrotor, now: float) -> None:
        """Draw profiles with their limits, by name, and the cursor at an instant [s]."""
        limited: dict[str, tuple[float | None, float | None]] = {ROTORS: vehicle.rotor_thrust_limits}
        limited |= {title: (None, _shown(kind, limits.get(kind.name))) for title, kind in CHARTS.items()}
        for title, handle in self._handles.items():
            low, high, *_ = bounds = _bounds(profiles.curves[title], *limited[title])
            self._drawn[title] = profiles.t, profiles.curves[title], bounds
            scales = {"x": {"time": False, "range": (0.0, float(profiles.t[-1]))}, "y": {"range": (low, high)}}
            if handle.scales != scales:
                handle.scales = scales
        self.point_at(now)

    def point_at(self, now: float) -> None:
        """Move the cursor to an instant [s]."""
        for title, drawn in self._drawn.items():
            self._handles[title].data = data_with_cursor(*drawn, now)


def time_chart(gui: Any, title: str, names: tuple[str, ...], height: int = HEIGHT) -> Any:
    """Add an empty plot against time: curves of these names, both limits and the cursor."""
    curves = [{"label": name, "stroke": LINES[i], "width": 2} for i, name in enumerate(names)]
    limits = [{"label": name, "stroke": LIMIT, "width": 1.5, "dash": (6, 4)} for name in ("least", "most")]
    series = ({"label": "t [s]"}, *curves, *limits, {"label": "now", "stroke": CURSOR, "width": 1.5})
    still: dict[str, Any] = {"legend": {"show": False}, "height": height, "title": title}
    still |= {"axes": (TIME_AXIS, VALUE_AXIS), "padding": PADDING}
    return gui.add_uplot((np.linspace(0.0, 1.0, 8),) + (np.zeros(8),) * (len(series) - 1), series, **still)


def data_with_cursor(t: FloatArray, curves: FloatArray, bounds: Bounds, now: float) -> tuple[FloatArray, ...]:
    """Return the columns of a plot: time, curves, both limits, and the cursor.

    The cursor is a curve along the lower edge that rises to the upper one at its instant, which is there three times.

    Parameters
    ----------
    t : ndarray, shape (m,)
        [s].
    curves : ndarray, shape (n, m)
    bounds : tuple of 4 floats
        Lower and upper edge, lower and upper limit.
    now : float
        [s].

    Returns
    -------
    tuple of n + 4 ndarrays, shape (m + 3,)
    """
    low, high, least, most = bounds
    instant = min(max(now, float(t[0])), float(t[-1]))
    place = int(np.searchsorted(t, instant))
    times = np.insert(t, place, [instant] * 3)
    drawn = [np.insert(curve, place, [np.interp(instant, t, curve)] * 3) for curve in curves]
    cursor = np.full(len(times), low)
    cursor[place + 1] = high
    return times, *drawn, np.full(len(times), least), np.full(len(times), most), cursor


def _bounds(curves: FloatArray, least: float | None, most: float | None) -> Bounds:
    """Return the edges of a plot and its limits; a limit that is not set lies outside."""
    high = round_up(1.05 * max(float(curves.max()), most or 0.0, 1e-3))
    low = -round_up(-1.05 * float(curves.min())) if curves.min() < 0.0 else 0.0
    outside = low - high
    return low, high, outside if least is None else least, outside if most is None else most


def round_up(value: float) -> float:
    """Return the next of 1, 1.25, 1.6, 2, 2.5, 3.2, 4, 5, 6.4, 8 times a power of ten, so that edges seldom move."""
    steps = np.array([1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.4, 8.0, 10.0]) * 10.0 ** np.floor(np.log10(value))
    return float(steps[steps >= value][0])


def legend(top: float, *keys: tuple[str, Any]) -> str:
    """Return what the lines of the scene are, as HTML.

    Parameters
    ----------
    top : float
        The greatest speed of the path, which is coloured by it [m/s].
    *keys : tuple
        What else is drawn, and in which colour.
    """
    stops = ",".join(f"rgb({','.join(str(int(c)) for c in colour)})" for colour in SPEED_SCALE)
    numbers = "".join(f"<span>{share * top:.2f}</span>" for share in (0.0, 0.5, 1.0))
    bar = f'<div style="height:10px;border-radius:3px;background:linear-gradient(to right,{stops})"></div>'
    row = f'<div style="display:flex;justify-content:space-between;font-size:0.8em">{numbers}</div>'
    line = "display:inline-block;width:1.4em;height:4px;border-radius:2px;margin-right:0.4em;vertical-align:middle"
    others = "".join(
        f'<span style="margin-right:1em;white-space:nowrap"><i style="{line};background:rgb{colour}"></i>{name}</span>'
        for name, colour in keys
    )
    below = f'<div style="font-size:0.8em;padding-top:0.2em">{others}</div>' if others else ""
    return f'<div style="padding:0.3em 0.8em"><span style="font-size:0.85em">speed [m/s]</span>{bar}{row}{below}</div>'
