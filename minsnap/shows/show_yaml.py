"""Shows from YAML: home, limits, separation, and the acts with their formations and colours."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, numbers
from minsnap.basics.checks import is_whole
from minsnap.basics.messages import shown
from minsnap.basics.storage.reading import reading
from minsnap.basics.storage.text import load_yaml
from minsnap.errors import FileError
from minsnap.fleet.separation import Separation
from minsnap.limits.limits import Limits
from minsnap.shows.formations import circle, grid, points_file, text
from minsnap.shows.mesh_points import mesh
from minsnap.shows.moves import Move
from minsnap.shows.show import Act, Show
from minsnap.shows.svg_lines import svg

KEYS = ("vehicles", "separation", "downwash", "limits", "room", "home", "take_off", "layers", "land", "acts", "seed")
ACT_KEYS = ("name", "formation", "hold", "colour", "fade", "shift", "turn", "moves")
MOVE_KEYS = ("turn", "scale", "along", "seconds")
KINDS: dict[str, Callable[..., FloatArray]] = {"grid": grid, "circle": circle, "text": text, "mesh": mesh, "svg": svg}


def is_show(path: str | os.PathLike[str]) -> bool:
    """Whether a file is YAML that has acts."""
    if Path(path).suffix.lower() not in (".yaml", ".yml"):
        return False
    said = load_yaml(path)
    return isinstance(said, dict) and "acts" in said


def read_show(path: str | os.PathLike[str]) -> Show:
    """Read a show.

    ``vehicles``; ``separation`` [m] and ``downwash``; ``limits``, fields of :class:`~minsnap.Limits`; ``room``, two
    corners; ``home``, a formation on the ground; ``take_off``, the height of the straight climb, and ``layers``, in how
    many heights it ends; ``land``, ``own`` or ``any``; ``acts``, a list of ``formation``, ``name``, ``hold`` [s],
    ``colour`` [r, g, b] or one for each point, ``fade``, ``shift`` [x, y, z], ``turn`` [deg] about the vertical, and
    ``moves``, a list of ``turn`` [deg], ``scale``, ``along`` [[x, y, z], ...] and ``seconds``. A formation is
    ``{grid: {spacing, height, columns}}``, ``{circle: {radius, height, upright}}``, ``{text: {words, size, height}}``,
    ``{mesh: {file, size, height}}``, ``{svg: {file, size, height}}``, ``{points: [[x, y, z], ...]}`` or
    ``{file: points.csv}``.

    Raises
    ------
    FileError
        If a key is not known or a value is of the wrong kind.
    """
    said = load_yaml(path)
    with reading(path, "a show"):
        _known(said, KEYS, f"{path}")
        missing = [key for key in ("vehicles", "separation", "limits", "home", "acts") if key not in said]
        if missing:
            raise FileError(f"{path} has no {' and no '.join(missing)}: a show needs them")
        place = Path(path).parent
        room = said.get("room")
        return Show(
            _formation(said["home"], said["vehicles"], place, "home"),
            tuple(_act(entry, i, said["vehicles"], place) for i, entry in enumerate(said["acts"])),
            Separation(float(said["separation"]), float(said.get("downwash", 1.0))),
            Limits(**said["limits"]),
            float(said.get("take_off", 2.0)),
            None if room is None else (np.array(room[0], dtype=float), np.array(room[1], dtype=float)),
            int(said.get("seed", 0)),
            _layers(said.get("layers", 1)),
            _land(said.get("land", "own")),
        )


def _act(said: Any, number: int, vehicles: int, place: Path) -> Act:
    where = f"act {number + 1}"
    _known(said, ACT_KEYS, where)
    points = _formation(said.get("formation"), vehicles, place, where)
    angle = np.radians(float(said.get("turn", 0.0)))
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    points = points @ turn.T + np.array(said.get("shift", (0.0, 0.0, 0.0)), dtype=float)
    moves = tuple(_move(entry, where) for entry in said.get("moves") or ())
    name, colour = str(said.get("name", where)), _colour(said.get("colour"), vehicles, where)
    return Act(name, points, float(said.get("hold", 3.0)), colour, bool(said.get("fade", False)), moves)


def _colour(said: Any, vehicles: int, where: str) -> FloatArray | None:
    """Return one colour, or one for each point of the formation."""
    colour = None if said is None else numbers(said)
    if said is None:
        return None
    if colour is None or colour.shape not in ((3,), (vehicles, 3)) or not ((colour >= 0) & (colour <= 255)).all():
        text = f"the colour of {where} is {shown(said)}: give red, green and blue from 0 to 255"
        raise FileError(f"{text}, once or for each of {vehicles} points")
    return colour


def _move(said: Any, where: str) -> Move:
    _known(said, MOVE_KEYS, f"a move of {where}")
    along, seconds = said.get("along"), said.get("seconds")
    way = None if along is None else np.array(along, dtype=np.float64)
    scale = float(said.get("scale", 1.0))
    if not scale > 0.0 or (seconds is not None and not float(seconds) > 0.0):
        raise FileError(f"a move of {where} has scale {scale:g} and seconds {shown(seconds)}: give positive numbers")
    turn = np.radians(float(said.get("turn", 0.0)))
    return Move(float(turn), scale, way, None if seconds is None else float(seconds))


def _layers(said: Any) -> int:
    if not is_whole(said) or not 1 <= said <= 100:
        raise FileError(f"layers is {shown(said)}: give a whole number from 1 to 100")
    return int(said)


def _land(said: Any) -> str:
    if said not in ("own", "any"):
        raise FileError(f"land is {shown(said)}: give own or any")
    return str(said)


def _formation(said: Any, vehicles: int, place: Path, where: str) -> FloatArray:
    """Return the points of a formation."""
    if not isinstance(said, dict) or len(said) != 1:
        raise FileError(f"the formation of {where} is {shown(said)}: give one of {', '.join(KINDS)}, points or file")
    ((kind, values),) = said.items()
    if kind == "points":
        return np.array(values, dtype=np.float64).reshape(-1, 3)
    if kind == "file":
        return points_file(place / str(values))
    if kind not in KINDS:
        raise FileError(f"{where} has a formation {kind!r}: give one of {', '.join(KINDS)}, points or file")
    try:
        if kind in ("mesh", "svg"):
            values = {**values, "file": place / str(values["file"])}
        return KINDS[kind](vehicles, **values)
    except (KeyError, TypeError):
        raise FileError(f"the {kind} of {where} does not take {shown(values)}: see the page on shows") from None


def _known(said: Any, keys: tuple[str, ...], where: str) -> None:
    if not isinstance(said, dict):
        raise FileError(f"{where} is {shown(said)}: give a mapping of {', '.join(keys)}")
    strange = [str(key) for key in said if key not in keys]
    if strange:
        raise FileError(f"{where} has {strange[0]!r}, which is not known: there are {', '.join(keys)}")
