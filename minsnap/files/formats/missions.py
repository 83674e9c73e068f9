"""Missions of waypoints: QGroundControl's plan, ArduPilot's text, KML of Google Earth, DJI's waylines, Litchi's table.

A mission is straight lines between few points, with a speed for each: the vehicle flies them in its own time. What is
written of a path is how far these lines are from it, proved at every instant.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_positive
from minsnap.basics.storage.atomic import write_file
from minsnap.basics.storage.text import FileName
from minsnap.errors import FileError
from minsnap.files.convert import Format
from minsnap.files.geodesy import geodetic_positions
from minsnap.files.kml_missions import TEMPLATE, WAYLINES
from minsnap.files.mission_items import CHANGE_SPEED, LAND, TAKEOFF, WAYPOINT, coordinates
from minsnap.files.mission_points import few_points
from minsnap.trajectory.trajectory import Trajectory

WITHIN = 0.5
"""How far the lines of a mission may be from the path, unless it is said [m]."""

GROUND = 0.5
"""Height above the origin below which a path begins or ends on the ground [m]."""

STEP = 0.01
"""Least change of a speed that is written, as a share of it."""

KML, WPML = "http://www.opengis.net/kml/2.2", "http://www.dji.com/wpmz/1.0.2"

LITCHI = ["latitude", "longitude", "altitude(m)", "heading(deg)", "curvesize(m)", "rotationdir", "gimbalmode"]
LITCHI += ["gimbalpitchangle", *(f"action{what}{i}" for i in range(1, 16) for what in ("type", "param"))]
LITCHI += ["altitudemode", "speed(m/s)", "poi_latitude", "poi_longitude", "poi_altitude(m)", "poi_altitudemode"]
LITCHI += ["photo_timeinterval", "photo_distinterval"]


@dataclass(frozen=True)
class Leg:
    """A waypoint of a mission.

    Parameters
    ----------
    latitude, longitude : float
        [degrees].
    height : float
        Above the origin [m].
    speed : float
        On the way to it [m/s]; that of the first is the one to the second.
    hold : float
        How long to stay [s].
    heading : float or None
        Clockwise from north [degrees]; None is the autopilot's choice.
    """

    latitude: float
    longitude: float
    height: float
    speed: float
    hold: float
    heading: float | None


def legs_of(curve: Trajectory, origin: FloatArray, within: float) -> tuple[list[Leg], float]:
    """Return the waypoints of a mission, and how far its lines are from the curve at most [m]."""
    if curve.dim != 3:
        raise FileError(f"a mission has 3 coordinates, and the path has {curve.dim}")
    check_positive("the distance within which a mission stays", within, "m", FileError)
    few = few_points(curve, within)
    places = geodetic_positions(few.points, origin)
    headings: list[float | None] = [None] * len(few.t)
    if curve.yaw.constant != 0.0:
        headings = list((90.0 - np.degrees(curve.yaw(few.t))) % 360.0)
    speeds = np.maximum(np.concatenate([few.speeds[:1], few.speeds]), STEP)
    rows = zip(places.tolist(), speeds.tolist(), few.holds.tolist(), headings, strict=True)
    base = float(origin[2])
    legs = [Leg(place[0], place[1], place[2] - base, speed, hold, turn) for place, speed, hold, turn in rows]
    return legs, few.distance


def _items(legs: Sequence[Leg]) -> list[tuple[int, int, list[float | None]]]:
    """Return command, frame and parameters of the items: take-off, waypoints with changes of speed, landing."""
    legs = list(legs)
    lifts = legs[0].height <= GROUND and len(legs) > 2 and _above(legs[0], legs[1])
    lands = legs[-1].height <= GROUND and len(legs) > 2 and _above(legs[-1], legs[-2])
    legs = legs[1:] if lifts else legs
    items: list[tuple[int, int, list[float | None]]] = []
    known = 0.0
    for i, leg in enumerate(legs):
        where: list[float | None] = [leg.latitude, leg.longitude, leg.height]
        if i and abs(leg.speed - known) > STEP * known:
            items.append((CHANGE_SPEED, 2, [1.0, round(leg.speed, 2), -1.0, 0.0, 0.0, 0.0, 0.0]))
            known = leg.speed
        command = WAYPOINT
        if i == 0:
            command = TAKEOFF
        elif lands and i == len(legs) - 1:
            command, where[2] = LAND, 0.0
        hold = round(leg.hold, 2) if command == WAYPOINT else 0.0
        items.append((command, 3, [hold, 0.0, 0.0, leg.heading, *where]))
    return items


def _above(one: Leg, other: Leg) -> bool:
    """Whether two waypoints are above each other, to a ten-millionth of a degree, which is a centimetre."""
    return max(abs(one.latitude - other.latitude), abs(one.longitude - other.longitude)) < 1e-7


def _rounded(params: Sequence[float | None]) -> list[float | None]:
    digits = (3, 3, 3, 1, 9, 9, 3)
    return [None if value is None else round(value, n) for value, n in zip(params, digits, strict=True)]


def plan_text(legs: Sequence[Leg], origin: FloatArray) -> str:
    """Return a plan of QGroundControl, version 1."""
    items: list[dict[str, Any]] = []
    for number, (command, frame, params) in enumerate(_items(legs), 1):
        item: dict[str, Any] = {
            "type": "SimpleItem",
            "autoContinue": True,
            "command": command,
            "doJumpId": number,
            "frame": frame,
        }
        item["params"] = _rounded(params)
        if command != CHANGE_SPEED:
            item |= {"Altitude": _rounded(params)[6], "AltitudeMode": 1, "AMSLAltAboveTerrain": None}
        items.append(item)
    fastest = round(max(leg.speed for leg in legs), 2)
    mission: dict[str, Any] = {
        "version": 2,
        "firmwareType": 12,
        "vehicleType": 2,
        "cruiseSpeed": fastest,
        "hoverSpeed": fastest,
    }
    mission |= {"globalPlanAltitudeMode": 1, "plannedHomePosition": origin.tolist(), "items": items}
    content: dict[str, Any] = {"fileType": "Plan", "version": 1, "groundStation": "QGroundControl", "mission": mission}
    content["geoFence"] = {"version": 2, "circles": [], "polygons": []}
    content["rallyPoints"] = {"version": 2, "points": []}
    return json.dumps(content, indent=1) + "\n"


def wpl_text(legs: Sequence[Leg], origin: FloatArray) -> str:
    """Return the text of ArduPilot's ground stations: QGC WPL 110, home first."""
    home: tuple[int, int, list[float | None]] = (WAYPOINT, 0, [0.0, 0.0, 0.0, 0.0, *origin.tolist()])
    lines = ["QGC WPL 110"]
    for i, (command, frame, params) in enumerate([home, *_items(legs)]):
        frame = 3 if command == CHANGE_SPEED else frame
        numbers = ["0" if value is None else f"{value:.9f}".rstrip("0").rstrip(".") for value in _rounded(params)]
        lines.append("\t".join([str(i), str(int(i == 0)), str(frame), str(command), *numbers, "1"]))
    return "\n".join(lines) + "\n"


def kml_text(legs: Sequence[Leg], origin: FloatArray, name: str) -> str:
    """Return a KML with the line and its places, altitudes above sea."""
    places = [f"{leg.longitude:.9f},{leg.latitude:.9f},{leg.height + float(origin[2]):.3f}" for leg in legs]
    marks = "".join(
        f"  <Placemark><name>{i}</name><description>{leg.speed:.2f} m/s to here"
        f"{f', stay {leg.hold:.1f} s' if leg.hold else ''}</description>"
        f"<Point><altitudeMode>absolute</altitudeMode><coordinates>{place}</coordinates></Point></Placemark>\n"
        for i, (leg, place) in enumerate(zip(legs, places, strict=True))
    )
    line = (
        f"<LineString><altitudeMode>absolute</altitudeMode><coordinates>{' '.join(places)}</coordinates></LineString>"
    )
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<kml xmlns="{KML}"><Document>\n  <name>{escape(name)}</name>\n'
        f"  <Placemark><name>{escape(name)}</name>{line}</Placemark>\n{marks}</Document></kml>\n"
    )


def waylines(legs: Sequence[Leg], origin: FloatArray, duration: float) -> bytes:
    """Return DJI's archive: heights above the start, a speed for each waypoint, turns that pass without a stop."""
    fastest = max(leg.speed for leg in legs)
    start = f"{legs[0].latitude:.9f},{legs[0].longitude:.9f},{float(origin[2]):.3f}"
    settings = {
        "flyToWaylineMode": "safely",
        "finishAction": "noAction",
        "exitOnRCLost": "executeLostAction",
        "executeRCLostAction": "goBack",
        "takeOffSecurityHeight": f"{max(legs[0].height, 2.0):.1f}",
        "globalTransitionalSpeed": f"{fastest:.2f}",
    }
    drone = _tag("droneInfo", _tag("droneEnumValue", "68") + _tag("droneSubEnumValue", "0"))
    shared = "".join(_tag(name, value) for name, value in settings.items())
    ways = {"templateId": "0", "executeHeightMode": "relativeToStartPoint", "waylineId": "0"}
    ways |= {"duration": f"{duration:.1f}", "autoFlightSpeed": f"{fastest:.2f}"}
    frame = _tag("coordinateMode", "WGS84") + _tag("heightMode", "relativeToStartPoint")
    model = _tag("templateType", "waypoint") + _tag("templateId", "0") + _tag("waylineCoordinateSysParam", frame)
    model += _tag("autoFlightSpeed", f"{fastest:.2f}")
    rest = "".join(_tag(name, value) for name, value in ways.items())
    texts = {
        WAYLINES: _document(_tag("missionConfig", shared + drone), rest, legs, "executeHeight"),
        TEMPLATE: _document(
            _tag("missionConfig", shared + _tag("takeOffRefPoint", start) + drone), model, legs, "height"
        ),
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in texts.items():
            archive.writestr(zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0)), text, zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def _tag(name: str, content: str) -> str:
    return f"<wpml:{name}>{content}</wpml:{name}>"


def _document(settings: str, folder: str, legs: Sequence[Leg], height: str) -> str:
    marks = []
    leaving = [*(leg.speed for leg in legs[1:]), legs[-1].speed]
    for i, (leg, speed) in enumerate(zip(legs, leaving, strict=True)):
        mode = "followWayline" if leg.heading is None else "smoothTransition"
        turn = (
            "" if leg.heading is None else _tag("waypointHeadingAngle", f"{(leg.heading + 180.0) % 360.0 - 180.0:.1f}")
        )
        at_end = i in (0, len(legs) - 1) or leg.hold > 0.0
        stop = "toPointAndStopWithDiscontinuityCurvature" if at_end else "toPointAndPassWithContinuityCurvature"
        marks.append(
            f"<Placemark><Point><coordinates>{leg.longitude:.9f},{leg.latitude:.9f}</coordinates></Point>"
            + _tag("index", str(i))
            + _tag(height, f"{leg.height:.3f}")
            + _tag("waypointSpeed", f"{speed:.2f}")
            + _tag("waypointHeadingParam", _tag("waypointHeadingMode", mode) + turn)
            + _tag("waypointTurnParam", _tag("waypointTurnMode", stop) + _tag("waypointTurnDampingDist", "0"))
            + _tag("useStraightLine", "1")
            + "</Placemark>\n"
        )
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<kml xmlns="{KML}" xmlns:wpml="{WPML}"><Document>\n{settings}\n'
        f"<Folder>{folder}\n{''.join(marks)}</Folder></Document></kml>\n"
    )


def litchi_text(legs: Sequence[Leg]) -> str:
    """Return the table that Litchi's Mission Hub imports: heights above the start, speeds from each waypoint on."""
    lines = [",".join(LITCHI)]
    leaving = [*(leg.speed for leg in legs[1:]), legs[-1].speed]
    for leg, speed in zip(legs, leaving, strict=True):
        place = [f"{leg.latitude:.9f}", f"{leg.longitude:.9f}", f"{leg.height:.3f}", f"{leg.heading or 0.0:.1f}"]
        stay = ["0", f"{1000.0 * leg.hold:.0f}"] if leg.hold else ["-1", "0"]
        actions = [*stay, *["-1", "0"] * 14]
        lines.append(",".join([*place, "0", "0", "0", "0", *actions, "0", f"{speed:.2f}", *["0"] * 4, "-1", "-1"]))
    return "\n".join(lines) + "\n"


Maker = Callable[[list[Leg], FloatArray, Trajectory, FileName], str | bytes]

MAKERS: dict[str, tuple[str, Maker]] = {
    "qgroundcontrol": (".plan", lambda legs, origin, curve, path: plan_text(legs, origin)),
    "ardupilot": (".waypoints", lambda legs, origin, curve, path: wpl_text(legs, origin)),
    "kml": (".kml", lambda legs, origin, curve, path: kml_text(legs, origin, Path(path).stem)),
    "dji": (".kmz", lambda legs, origin, curve, path: waylines(legs, origin, curve.duration)),
    "litchi": ("", lambda legs, origin, curve, path: litchi_text(legs)),
}
"""Formats by name: their ending, and what makes their content."""


def write_mission(
    curve: Trajectory,
    path: FileName,
    to: str,
    origin: Sequence[float],
    within: float = WITHIN,
    *,
    clobber: bool = True,
) -> str:
    """Write a path as a mission of few waypoints with a speed for each.

    Parameters
    ----------
    curve : Trajectory
        Three coordinates, east, north and up of the origin [m].
    path : str or path
        Destination.
    to : str
        ``qgroundcontrol``, ``ardupilot``, ``kml``, ``dji`` or ``litchi``.
    origin : sequence of 3 float
        Latitude, longitude [degrees] and altitude above sea level [m] of the point (0, 0, 0).
    within : float
        How far the straight lines between waypoints may be from the path [m].
    clobber : bool
        False: a destination that exists is an error.

    Returns
    -------
    str
        What is proved of it.

    Raises
    ------
    FileError
        If the path has other than three coordinates, or the origin or the distance is none.
    """
    home = coordinates("the origin", [float(value) if isinstance(value, (int, float)) else value for value in origin])
    legs, distance = legs_of(curve, home, within)
    content = MAKERS[to][1](legs, home, curve, path)
    write_file(path, content, clobber=clobber)
    slowest, fastest = min(leg.speed for leg in legs), max(leg.speed for leg in legs)
    speeds = f"{fastest:.2g} m/s" if slowest > 0.99 * fastest else f"{slowest:.2g} to {fastest:.2g} m/s"
    return (
        f"{len(legs)} waypoints, whose lines are within {distance:.2g} m of the path; the vehicle flies them in its "
        f"own time, at {speeds}"
    )


def _format(name: str, ending: str) -> Format:
    def write(content: Trajectory, path: FileName, *, clobber: bool, origin: Any, within: float | None) -> str:
        return write_mission(content, path, name, origin, WITHIN if within is None else within, clobber=clobber)

    return Format(name, "polynomials", (ending,) if ending else (), write, geodetic=True)


FORMATS = tuple(_format(name, ending) for name, (ending, _) in MAKERS.items())
