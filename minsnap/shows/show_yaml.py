"""Shows from YAML: home, limits, separation, and the acts with their formations and colours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.messages import shown
from minsnap.basics.schema import BOX, FLAG, NUMBER, TEXT, WHOLE, Key, either, mapping, several, word
from minsnap.basics.storage.text import FileName, load_yaml, reading
from minsnap.basics.tolerances import EXACT
from minsnap.errors import FileError
from minsnap.files import LIMITS, limits_of, read_waypoints
from minsnap.fleet import Separation
from minsnap.shows.act_lights import Colour, Gradient, LightChange
from minsnap.shows.acts import Act, Group, Groups, Show
from minsnap.shows.contradictions import refuse_contradictions
from minsnap.shows.csv_show import read_frames
from minsnap.shows.energy import PowerModel
from minsnap.shows.formations import LINES, circle, grid, mesh, relaxed, spacing_of, svg, text
from minsnap.shows.frame_animation import Animation
from minsnap.shows.letters import FONT_FILES
from minsnap.shows.moves import Move
from minsnap.shows.site import Fence, ShowOrigin, read_survey

LAYERS = 100
"""Most heights in which a climb may end."""

KINDS: dict[str, Callable[..., FloatArray]] = {"grid": grid, "circle": circle, "text": text, "mesh": mesh, "svg": svg}

METRES, NEEDED_METRES = Key(NUMBER, "[m]"), Key(NUMBER, "[m]", needed=True)
IN_SPACE = several(NUMBER, "three numbers [m]", 3, 3)
RGB = several(NUMBER, "red, green and blue from 0 to 255", 3, 3)
COLOUR = either(
    replace(TEXT, said="a name or a code of a colour"),
    replace(RGB, fits=lambda value: RGB.fits(value) and not any(isinstance(each, str | list) for each in value)),
)
GRADIENT = mapping(
    {
        "from": Key(COLOUR, "of the points that are lowest along the axis", needed=True),
        "to": Key(COLOUR, "of those that are highest", needed=True),
        "along": Key(word("x", "y", "z"), "an axis; z unless given"),
        "period": Key(NUMBER, "in which colours run to the other end and back; they stand unless given [s]"),
    },
    "a mapping from one colour to another",
    ("from",),
)
SIZED = {"size": Key(NUMBER, "largest extent [m]", needed=True), "height": Key(NUMBER, "of the lowest point [m]")}
DRAWN = {"file": Key(TEXT, "beside the show", needed=True), **SIZED}
LETTERS = {
    "words": Key(TEXT, "a line break begins a new line", needed=True),
    **SIZED,
    "outlines": Key(FLAG, "of a font in place of single strokes"),
    "font": Key(TEXT, "the name of a font, or a file of one beside the show: its outlines"),
}
FORMATION = mapping(
    {
        "grid": Key(mapping({"spacing": NEEDED_METRES, "height": METRES, "columns": Key(WHOLE)}, "a mapping")),
        "circle": Key(mapping({"radius": NEEDED_METRES, "height": METRES, "upright": Key(FLAG)}, "a mapping")),
        "text": Key(mapping(LETTERS, "a mapping")),
        "mesh": Key(mapping(DRAWN, "a mapping")),
        "svg": Key(mapping(DRAWN, "a mapping")),
        "points": Key(several(IN_SPACE, "a list of points"), "[m]"),
        "file": Key(TEXT, "a CSV of points, beside the show"),
    },
    "a mapping with one formation",
)
MOVE = mapping(
    {
        "turn": Key(NUMBER, "about the vertical [degrees]"),
        "scale": Key(NUMBER, "by which it grows"),
        "along": Key(several(IN_SPACE, "a list of points"), "[m]"),
        "seconds": Key(NUMBER, "that it takes; as fast as the limits allow unless given"),
    },
    "a mapping of a move",
)
SHOWN = either(GRADIENT, COLOUR, several(COLOUR, "a colour for each point"))
ANIMATION = mapping(
    {
        "file": Key(TEXT, "a folder of CSV, one for each vehicle, or a zip of them", needed=True),
        "size": Key(NUMBER, "largest extent of all frames; as they are unless given [m]"),
        "height": Key(NUMBER, "of the lowest point of all frames; as they are unless given [m]"),
        "slower": Key(NUMBER, "how many times as long it lasts"),
        "tolerance": Key(NUMBER, "how far curves may be from frames; 0.02 unless given [m]"),
    },
    "a mapping with a file",
)
LIGHTS = mapping(
    {
        "after": Key(NUMBER, "since all have arrived [s]", needed=True),
        "colour": Key(SHOWN, needed=True),
        "fade": Key(FLAG, "from the colour before; true unless given"),
    },
    "a mapping of a change of the lights",
)
ACT = mapping(
    {
        "name": Key(TEXT),
        "formation": Key(FORMATION, "or an animation"),
        "animation": Key(ANIMATION, "frames of all vehicles, in place of a formation"),
        "vehicles": Key(WHOLE, "how many are in it; all unless given"),
        "hold": Key(NUMBER, "[s]"),
        "colour": Key(SHOWN, "one, or one for each point, or a gradient"),
        "fade": Key(FLAG, "the colour is reached on the way there"),
        "lights": Key(several(LIGHTS, "a list of changes"), "how colours change after the arrival"),
        "yaw": Key(
            either(NUMBER, several(NUMBER, "a number for each point")), "heading, counter-clockwise from x [degrees]"
        ),
        "shift": Key(IN_SPACE),
        "turn": Key(NUMBER, "about the vertical [degrees]"),
        "moves": Key(several(MOVE, "a list of moves")),
        "at": Key(NUMBER, "when all have arrived, since the start of the show [s]"),
        "seconds": Key(NUMBER, "how long the flight there lasts [s]"),
        "delay": Key(
            either(NUMBER, several(NUMBER, "a number for each point")),
            "how long after the vehicle of each point that of the next leaves, or after the first that of each [s]",
        ),
    },
    "a mapping of an act",
)
GROUP = mapping(
    {
        "name": Key(TEXT),
        "vehicles": Key(WHOLE, "how many are in it", needed=True),
        "acts": Key(several(ACT, "a list of acts", 1, first=1), "its own, one after the other", needed=True),
    },
    "a mapping of a group",
)
GROUPS = mapping(
    {
        "name": Key(TEXT),
        "groups": Key(
            several(GROUP, "a list of groups", 1, first=1), "which fly at once, each its own acts", needed=True
        ),
    },
    "a mapping of groups",
    ("groups",),
)
TAKE_OFF = mapping(
    {
        "height": Key(NUMBER, "of the straight climb [m]"),
        "speed": Key(NUMBER, "at most [m/s]"),
        "wait": Key(NUMBER, "on the ground before it [s]"),
        "layer": Key(NUMBER, "least height between groups that climb in turn, where homes are near [m]"),
    },
    "a mapping of a take-off",
)
LAND = mapping(
    {
        "place": Key(word("own", "any"), "each at its own home, or at any"),
        "speed": Key(NUMBER, "at most [m/s]"),
    },
    "a mapping of a landing",
)
HOME = either(
    mapping({"survey": Key(TEXT, "a CSV of latitude, longitude, altitude")}, "a mapping with a survey", ("survey",)),
    FORMATION,
)
ORIGIN = mapping(
    {
        "latitude": Key(NUMBER, "[degrees]", needed=True),
        "longitude": Key(NUMBER, "[degrees]", needed=True),
        "altitude": Key(NUMBER, "above mean sea level [m]"),
        "orientation": Key(NUMBER, "of the x axis, clockwise from north; 90 unless given [degrees]"),
    },
    "a mapping of latitude and longitude",
)
FENCE = mapping(
    {
        "polygon": Key(several(several(NUMBER, "x and y [m]", 2, 2), "a list of corners"), "convex [m]"),
        "survey": Key(TEXT, "a CSV of latitudes and longitudes of the corners"),
        "margin": Key(either(NUMBER, several(NUMBER, "a number for each wall")), "how far all stay away [m]"),
    },
    "a mapping with a polygon, or the file of a survey",
)
ENERGY = mapping(
    {
        "mass": Key(NUMBER, "with its battery [kg]", needed=True),
        "rotor_radius": Key(NUMBER, "[m]", needed=True),
        "rotors": Key(WHOLE, "4 unless given"),
        "efficiency": Key(NUMBER, "of rotor, motor and controller together; 0.5 unless given"),
        "battery": Key(NUMBER, "what it holds [Wh]"),
    },
    "a mapping of mass and rotor_radius",
)
SHOW = mapping(
    {
        "vehicles": Key(WHOLE, needed=True),
        "separation": Key(NUMBER, "[m]", needed=True),
        "downwash": Key(NUMBER, "by which heights count less than widths"),
        "ground": Key(NUMBER, "separation of two of which one stands on the ground; the same unless given [m]"),
        "limits": Key(LIMITS, needed=True),
        "room": Key(BOX, "[m]"),
        "home": Key(HOME, "on the ground", needed=True),
        "origin": Key(ORIGIN, "where on the earth it is flown"),
        "fence": Key(FENCE, "vertical walls around all"),
        "energy": Key(ENERGY, "what power a vehicle takes, for the report"),
        "environment": Key(word("outdoor", "indoor"), "which checks of Skybrush's viewer hold; outdoor unless given"),
        "take_off": Key(either(NUMBER, TAKE_OFF), "height of the straight climb [m], or how they take off"),
        "layers": Key(WHOLE, "in how many heights the climb ends, from 1 to 100"),
        "land": Key(either(word("own", "any"), LAND), "each at its own home, or at any, or how they land"),
        "return_home": Key(FLAG, "all fly home before they land, else below the last act; true unless given"),
        "acts": Key(several(either(GROUPS, ACT), "a list of acts", 1, first=1), needed=True),
        "seed": Key(WHOLE),
    },
    "a mapping with acts",
)
"""The whole file."""


def is_show(path: FileName) -> bool:
    """Whether a file is YAML that has acts."""
    if Path(path).suffix.lower() not in (".yaml", ".yml"):
        return False
    content = load_yaml(path)
    return isinstance(content, dict) and "acts" in content


def read_show(path: FileName) -> Show:
    """Read a show.

    The keys are those of :data:`SHOW`; a formation is a mapping with one of the keys of :data:`FORMATION`.

    Raises
    ------
    FileError
        If a key is not known or a value is of the wrong kind.
    """
    with reading(path, "a show"):
        content, place = SHOW.read(f"{path}", load_yaml(path)), Path(path).parent
        if not 1 <= content.get("layers", 1) <= LAYERS:
            raise FileError(f"layers is {content['layers']}: give a whole number from 1 to {LAYERS}")
        refuse_contradictions(content)
        room, limits = content.get("room"), content["limits"]
        up, down = (_mapped(content.get(name), key) for name, key in (("take_off", "height"), ("land", "place")))
        origin = None if content.get("origin") is None else ShowOrigin(**content["origin"])
        apart = Separation(content["separation"], content.get("downwash", 1.0), ground=content.get("ground"))
        return Show(
            _home(content["home"], content["vehicles"], place, origin),
            tuple(
                (_groups if "groups" in entry else _act)(entry, f"act {i}", content["vehicles"], place, apart)
                for i, entry in enumerate(content["acts"], 1)
            ),
            apart,
            limits_of("limits", limits, place),
            room=None if room is None else (np.array(room[0]), np.array(room[1])),
            smooth=limits.get("jerk", 0.0) is not None,
            climb_speed=up.get("speed"),
            wait=up.get("wait"),
            descent_speed=down.get("speed"),
            origin=origin,
            fence=_fence(content.get("fence"), place, origin),
            energy=None if content.get("energy") is None else PowerModel(**content["energy"]),
            **_named(content, "environment", "seed", "layers", "return_home"),
            **_named({**up, "take_off": up.get("height"), "land": down.get("place")}, "take_off", "land", "layer"),
        )


def _home(content: dict[str, Any], vehicles: int, place: Path, origin: ShowOrigin | None) -> FloatArray:
    survey = content.get("survey")
    places = _formation(content, vehicles, place, "home") if survey is None else read_survey(place / survey, origin)
    if len(places) != vehicles:
        where = "home" if survey is None else place / survey
        raise FileError(f"{where} has {len(places)} places for {vehicles} vehicles: give as many")
    return places


def _fence(content: dict[str, Any] | None, place: Path, origin: ShowOrigin | None) -> Fence | None:
    if content is None:
        return None
    if ("polygon" in content) == ("survey" in content):
        raise FileError("the fence needs a polygon, or the file of a survey: give one of both")
    survey = content.get("survey")
    corners = content["polygon"] if survey is None else read_survey(place / survey, origin)[:, :2]
    return Fence(corners, content.get("margin", 0.0))


def _mapped(content: Any, key: str) -> dict[str, Any]:
    """Return the entries of a mapping, or of what stands for one of them alone."""
    return dict(content) if isinstance(content, dict) else {key: content}


def _named(content: dict[str, Any], *names: str) -> dict[str, Any]:
    """Return those of some entries that are there; the others have their defaults in the class that takes them."""
    return {name: content[name] for name in names if content.get(name) is not None}


def _groups(content: dict[str, Any], where: str, _: int, place: Path, apart: Separation) -> Groups:
    groups = []
    for number, entry in enumerate(content["groups"], 1):
        name, count = entry.get("name", f"group {number}"), entry["vehicles"]
        each = ((f"act {i} of {name} of {where}", {"vehicles": count, **own}) for i, own in enumerate(entry["acts"], 1))
        groups.append(Group(name, tuple(_act(own, said, count, place, apart) for said, own in each)))
    return Groups(content.get("name", where), tuple(groups))


def _act(content: dict[str, Any], where: str, vehicles: int, place: Path, apart: Separation) -> Act:
    if ("formation" in content) == ("animation" in content):
        raise FileError(f"{where} needs a formation or an animation: give one of both")
    vehicles = content.get("vehicles", vehicles)
    angle, shift = np.radians(content.get("turn", 0.0)), content.get("shift", (0.0, 0.0, 0.0))
    moves: tuple[Move | Animation, ...] = tuple(_move(entry, where) for entry in content.get("moves", ()))
    if "animation" in content:
        told = dict(content["animation"])
        animation = Animation(read_frames(place / told.pop("file")), **told, turn=float(angle), shift=shift)
        points, moves = animation.start, (animation, *moves)
    else:
        points = _apart(content["formation"], _formation(content["formation"], vehicles, place, where), place, apart)
        turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        points = points @ turn.T + np.array(shift)
    if len(points) != content.get("vehicles", len(points)):
        text = f"{where} has {content['vehicles']} vehicles and {len(points)} points"
        raise FileError(f"{text}: give as many, or leave out what is too much")
    lights = tuple(
        LightChange(entry["after"], _colour(entry["colour"], points, where), entry.get("fade", True))
        for entry in content.get("lights", ())
    )
    given = {"hold": 0.0} if "animation" in content else {}
    return Act(
        content.get("name", where),
        points,
        colour=_colour(content["colour"], points, where) if "colour" in content else None,
        moves=moves,
        delays=_delays(content, len(points)),
        lights=lights,
        yaw=np.radians(content["yaw"]) if "yaw" in content else None,
        **given | _named(content, "hold", "fade", "at", "seconds"),
    )


def _apart(content: dict[str, Any], points: FloatArray, place: Path, apart: Separation) -> FloatArray:
    """Return the points of a text or a drawing moved along its lines until they are apart; others as they are."""
    if len(points) < 2 or spacing_of(apart.flat(points))[0] >= (apart.distance or 0.0):
        return points
    ((kind, values),) = content.items()
    return relaxed(LINES[kind](**_beside(values, place)), points, apart) if kind in LINES else points


def _beside(values: dict[str, Any], place: Path) -> dict[str, Any]:
    """Return the entries of a drawing, its files beside the show."""
    files = {name: place / values[name] for name in ("file",) if name in values}
    if str(values.get("font", "")).lower().endswith(FONT_FILES):
        files["font"] = place / values["font"]
    return values | files


def _delays(content: dict[str, Any], vehicles: int) -> FloatArray | None:
    """Return how long after the first the vehicle of each point leaves, shape (vehicles,) [s]."""
    if content.get("delay") is None:
        return None
    said = content["delay"]
    each = np.arange(vehicles) * said if isinstance(said, float) else said
    return np.array(each, dtype=np.float64)


def _colour(content: Any, points: FloatArray, where: str) -> Colour:
    """Return one colour, or one for each point of the formation, shape (points, 3), or a gradient."""
    if isinstance(content, dict):
        axis = content.get("along", "z")
        along = points[:, "xyz".index(axis)]
        ends = np.stack([_rgb(content[end], where) for end in ("from", "to")])
        period = content.get("period")
        if period is not None and not 0.1 <= period <= 3600.0:
            raise FileError(f"the gradient of {where} has the period {period:g}: give a number from 0.1 to 3600 [s]")
        if period is None and float(np.ptp(along)) <= EXACT:
            text = f"the gradient of {where} is along {axis}, and all of its points have the same {axis}"
            raise FileError(f"{text}: give it another axis, such as along: {_longest(points)}")
        return Gradient((along - along.min()) / max(float(np.ptp(along)), 1e-12), ends, period)
    if isinstance(content, str) or not any(isinstance(each, str | tuple) for each in content):
        return _rgb(content, where)
    if len(content) != len(points):
        raise FileError(f"{where} has {len(content)} colours for {len(points)} points: give one, or one for each")
    return np.stack([_rgb(each, where) for each in content])


def _longest(points: FloatArray) -> str:
    """Return the axis along which points have their largest extent."""
    return "xyz"[int(np.ptp(points, axis=0).argmax())]


def _rgb(content: Any, where: str) -> FloatArray:
    """Return red, green and blue of a colour: three numbers, or a name or code of matplotlib's."""
    from matplotlib.colors import to_rgb

    if isinstance(content, str):
        try:
            return np.round(255.0 * np.array(to_rgb(content)))
        except ValueError:
            give = "give a name such as orange, a code such as '#ff8000', or red, green and blue"
            raise FileError(f"the colour of {where} is {shown(content)}, which is not known: {give}") from None
    colour = np.array(content)
    if not ((colour >= 0) & (colour <= 255)).all():
        raise FileError(f"the colour of {where} is {shown(content)}: give red, green and blue from 0 to 255")
    return colour


def _move(content: dict[str, Any], where: str) -> Move:
    scale, seconds = content.get("scale", 1.0), content.get("seconds")
    if not scale > 0.0 or (seconds is not None and not seconds > 0.0):
        raise FileError(f"a move of {where} has scale {scale:g} and seconds {shown(seconds)}: give positive numbers")
    turn, way = content.get("turn", 0.0), np.array(content["along"]) if "along" in content else None
    if not abs(turn) <= 36_000:
        raise FileError(f"a move of {where} turns by {turn:g} degrees: give 36000 at most, 100 turns")
    return Move(float(np.radians(turn)), scale, way, seconds)


def _formation(content: dict[str, Any], vehicles: int, place: Path, where: str) -> FloatArray:
    """Return the points of a formation."""
    if len(content) != 1:
        raise FileError(f"the formation of {where} is {shown(content)}: give one of {', '.join(KINDS)}, points or file")
    ((kind, values),) = content.items()
    if kind == "points":
        return np.array(values).reshape(-1, 3)
    if kind == "file":
        return read_waypoints(place / values).points
    return KINDS[kind](vehicles, **_beside(values, place))
