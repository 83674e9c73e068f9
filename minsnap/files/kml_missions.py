"""Missions in KML and KMZ: lines and places of Google Earth, and waylines of DJI.

KML is the standard 07-147r2 of the Open Geospatial Consortium; ``wpml`` is DJI's extension of it
(https://developer.dji.com, *DJI WPML*): a KMZ whose ``wpmz/waylines.wpml`` has a place for each waypoint.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.messages import shown
from minsnap.basics.storage.text import FileName, read_bytes, reading
from minsnap.errors import FileError
from minsnap.files.mission_items import LARGEST, GeodeticMission, Place, coordinates, mission_of
from minsnap.files.xml_text import Element, elements, number, number_of, parse_xml, text_of, texts

WAYLINES, TEMPLATE = "wpmz/waylines.wpml", "wpmz/template.kml"
"""What DJI's archives hold."""

ABOVE_START, ABOVE_SEA, ABOVE_GROUND = "above the start", "above sea level", "above the ground"

MODES = {
    "absolute": ABOVE_SEA,
    "relativeToGround": ABOVE_GROUND,
    "relativeToStartPoint": ABOVE_START,
    "WGS84": ABOVE_SEA,
    "EGM96": ABOVE_SEA,
}
"""Altitude modes of KML and of DJI."""


def read_kml(path: FileName, origin: Sequence[float] | None = None) -> GeodeticMission:
    """Read the line, or the places in their order, of a KML file.

    Heights above the ground are taken as heights above the start, and a note says so.

    Raises
    ------
    FileError
        If it is no KML, has no heights, or several lines.
    """
    return _mission(path, parse_xml(path, read_bytes(path, LARGEST), "kml"), None, origin)


def read_kmz(path: FileName, origin: Sequence[float] | None = None) -> GeodeticMission:
    """Read a KMZ: DJI's waylines, or the KML that Google Earth puts in.

    Raises
    ------
    FileError
        As :func:`read_kml`, or if it is no archive or unpacks to too much.
    """
    members = {name: parse_xml(f"{path}, {name}", content, "kml") for name, content in _unpacked(path).items()}
    template = members.get(TEMPLATE)
    main = members.get(WAYLINES, template)
    if main is None:
        main = next(iter(members.values()), None)
    if main is None:
        raise FileError(f"{path} holds no .kml and no {WAYLINES}")
    return _mission(path, main, template, origin)


def read_outline(path: FileName) -> FloatArray:
    """Return the corners of the only polygon of a KML or KMZ file: latitude, longitude [degrees], shape (n, 2).

    Raises
    ------
    FileError
        If it has none, or several.
    """
    archive = str(path).lower().endswith(".kmz")
    content = next(iter(_unpacked(path).values()), b"") if archive else read_bytes(path, LARGEST)
    rings = [text_of(ring, "coordinates") for ring in elements(parse_xml(path, content, "kml"), "outerBoundaryIs")]
    if len(rings) != 1:
        raise FileError(f"{path} has {len(rings)} polygons: an area is one")
    places = np.array(_coordinates(f"{path}, the polygon", rings[0]))[:, :2]
    return np.asarray(places[:-1] if len(places) > 3 and (places[0] == places[-1]).all() else places)


def _unpacked(path: FileName) -> dict[str, bytes]:
    """Return the KML files of an archive by name, DJI's first."""
    with reading(path, "a KMZ archive", LARGEST), zipfile.ZipFile(io.BytesIO(read_bytes(path, LARGEST))) as archive:
        entries = {entry.filename: entry for entry in archive.infolist()}
        named = sorted(name for name in entries if name.lower().endswith(".kml") or name == WAYLINES)
        named.sort(key=lambda name: (name != WAYLINES, name.lower() != "doc.kml"))
        if sum(entries[name].file_size for name in named) > LARGEST:
            raise FileError(f"{path} unpacks to more than {LARGEST / 1e6:.0f} MB: that is no mission")
        return {name: archive.read(name) for name in named}


def _mission(
    path: FileName, root: Element, template: Element | None, origin: Sequence[float] | None
) -> GeodeticMission:
    waylines = list(elements(root, "executeHeight")) or list(elements(root, "useGlobalHeight"))
    rows, mode, asked = _wayline(f"{path}", root) if waylines else _drawn(f"{path}", root)
    if not rows:
        raise FileError(f"{path} has 0 different positions: a path needs two at least")
    start = next((_start(f"{path}", each) for each in (template, root) if each is not None and _has_start(each)), None)
    ground = 0.0 if start is None else float(start[2])
    home = coordinates(f"{path}", [rows[0].latitude, rows[0].longitude, ground]) if start is None else start
    base = 0.0 if mode == ABOVE_SEA else float(home[2] if origin is None else origin[2])
    places = [Place(row.latitude, row.longitude, row.altitude + base, row.speed) for row in rows]
    if mode == ABOVE_GROUND:
        asked = [*asked, "the ground: heights above it are taken as above the start"]
    return mission_of(f"{path}", places, home, origin, asked)


def _drawn(where: str, root: Element) -> tuple[list[Place], str, list[str]]:
    """Return the places of the only line, or else of all points, and what their heights are counted from."""
    lines = [*elements(root, "LineString"), *elements(root, "Track")]
    if len(lines) > 1:
        raise FileError(f"{where} has {len(lines)} lines: a mission is one")
    drawn = lines or list(elements(root, "Point"))
    joined = [" ".join(texts(entry, "coordinates")) for entry in drawn]
    tracks = [",".join(text.split()) for entry in drawn for text in texts(entry, "coord")]
    places = [row for text in (*joined, *tracks) for row in _coordinates(where, text)]
    modes = {text_of(entry, "altitudeMode") for entry in drawn}
    if places and (len(modes) > 1 or not modes & MODES.keys()):
        said = " and ".join(sorted(mode or "no altitude mode" for mode in modes))
        raise FileError(f"{where} has {said}: make its altitudes absolute, or relative to the ground, for all places")
    return [Place(lat, lon, height) for lat, lon, height in places], MODES.get(next(iter(modes), ""), ""), []


def _wayline(where: str, root: Element) -> tuple[list[Place], str, list[str]]:
    """Return the waypoints of the first wayline of DJI, each with the speed of the leg that leads to it."""
    folder = next((each for each in elements(root, "Folder") if any(True for _ in elements(each, "Placemark"))), None)
    if folder is None:
        raise FileError(f"{where} has no folder of waypoints")
    mode = text_of(folder, "executeHeightMode") or text_of(folder, "heightMode")
    if MODES.get(mode) not in (ABOVE_START, ABOVE_SEA):
        raise FileError(f"{where} has heights in the mode {shown(mode)}: use relativeToStartPoint or WGS84")
    usual, leaving = number_of(folder, "autoFlightSpeed"), float("nan")
    places, asked = [], []
    for i, mark in enumerate(elements(folder, "Placemark")):
        place = f"{where}, waypoint {i}"
        lat, lon, _ = _coordinates(place, text_of(mark, "coordinates"))[0]
        heights = [number_of(mark, name) for name in ("executeHeight", "height", "ellipsoidHeight")]
        heights.append(number_of(folder, "globalHeight"))
        height = next((value for value in heights if np.isfinite(value)), None)
        lat, lon, above = coordinates(place, [lat, lon, height]).tolist()
        places.append(Place(lat, lon, above, leaving))
        own = number_of(mark, "waypointSpeed")
        leaving = own if own > 0.0 else usual
        asked += ["actions" for _ in elements(mark, "actionGroup")]
    return places, MODES[mode], asked


def _has_start(root: Element) -> bool:
    return bool(text_of(root, "takeOffRefPoint"))


def _start(where: str, root: Element) -> FloatArray:
    """Return where DJI's waylines begin: latitude, longitude, height."""
    cells = text_of(root, "takeOffRefPoint").split(",")
    return coordinates(f"{where}, takeOffRefPoint", [number(cell) for cell in cells])


def _coordinates(where: str, text: str) -> list[tuple[float, float, float]]:
    """Return latitude, longitude and height of ``lon,lat[,height]`` with spaces between places."""
    rows = []
    for place in text.split():
        cells = [number(cell) for cell in place.split(",")]
        cells = [*cells, 0.0] if len(cells) == 2 else cells
        if len(cells) != 3:
            raise FileError(f"{where} has the coordinates {shown(place)}: they are longitude,latitude,height")
        lat, lon, height = coordinates(where, [cells[1], cells[0], cells[2]]).tolist()
        rows.append((lat, lon, height))
    if not rows:
        raise FileError(f"{where} has a place without coordinates")
    return rows
