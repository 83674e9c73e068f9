"""Missions in GPX: a route, a track, or waypoints (the schema GPX 1.1, https://www.topografix.com/GPX/1/1)."""

from __future__ import annotations

from collections.abc import Sequence

from minsnap.basics.storage.text import FileName, read_bytes
from minsnap.errors import FileError
from minsnap.files.mission_items import LARGEST, GeodeticMission, Place, coordinates, mission_of
from minsnap.files.xml_text import Element, children, number, parse_xml, text_of

CALLED = {"rte": "route", "trk": "track", "wpt": "waypoint"}
"""Elements that hold positions, in the order in which they are looked for, and what messages call them."""


def read_gpx(path: FileName, origin: Sequence[float] | None = None) -> GeodeticMission:
    """Read the only route, else the only track, else the waypoints in their order; heights are above sea level.

    The segments of a track follow one another, straight over the gaps between them. Its gaps, the times of places and
    what else the file holds are left out, and ``left_out`` says so.

    Raises
    ------
    FileError
        If it is no GPX, has several routes or tracks to choose from, or a place without a height.
    """
    root = parse_xml(path, read_bytes(path, LARGEST), "gpx")
    found = {name: children(root, name) for name in CALLED}
    flown = next((name for name in found if found[name]), "wpt")
    if flown != "wpt" and len(found[flown]) > 1:
        raise FileError(f"{path} has {len(found[flown])} {CALLED[flown]}s: a mission is one")
    segments = _segments(flown, found[flown])
    entries = [entry for segment in segments for entry in segment]
    places = [_place(f"{path}, place {i}", entry) for i, entry in enumerate(entries)]
    left_out = ["gaps between segments" for _ in segments[1:]]
    left_out += ["times" for _ in entries[:1] if any(text_of(entry, "time") for entry in entries)]
    left_out += [f"{CALLED[name]}s" for name in found if name != flown for _ in found[name]]
    if not places:
        raise FileError(f"{path} has 0 different positions: a path needs two at least")
    home = coordinates(f"{path}", [places[0].latitude, places[0].longitude, 0.0])
    return mission_of(f"{path}", places, home, origin, left_out)


def _segments(flown: str, found: list[Element]) -> list[list[Element]]:
    """Return the places of what is flown, in parts between which there are gaps."""
    if flown == "wpt":
        return [found]
    if flown == "rte":
        return [children(found[0], "rtept")]
    parts = (children(segment, "trkpt") for segment in children(found[0], "trkseg"))
    return [part for part in parts if part]


def _place(where: str, entry: Element) -> Place:
    height = text_of(entry, "ele")
    if not height:
        raise FileError(f"{where} has no height: give each an <ele>, its height above sea level [m]")
    cells = [number(text) for text in (entry.get("lat", ""), entry.get("lon", ""), height)]
    return Place(*coordinates(where, cells).tolist())
