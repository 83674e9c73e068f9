"""Shows for programs that play them: VVIZ for Finale 3D and others, KMZ for Google Earth. Nothing is proved of these.

VVIZ is the format of Verge Aero (*VVIZ Format*, version 1.0): X to the right, Y up, Z forward, positions and colours as
steps at fixed rates. KMZ holds KML 2.2 with Google's extension ``gx:Track``: a place for each instant.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import make_folder, write_file
from minsnap.basics.storage.text import FileName
from minsnap.errors import FileError
from minsnap.fleet import Fleet
from minsnap.shows.csv_show import sampled, write_csv_show
from minsnap.shows.skyc import STAMP, Lamp, ShowSheet

EXPORTS = (".zip", ".vviz", ".kmz")
"""Endings of these files: a zip of CSV, VVIZ, KMZ."""

POSITION_RATE, COLOUR_RATE, TRACK_RATE = 8.0, 20.0, 4.0
"""Steps a second in VVIZ, of positions and of colours, and in KMZ [Hz]."""

DAY = "2000-01-01T"
"""Day on which a show begins in Google Earth, at midnight."""

LONGEST_DAY = 86_400.0

HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'


def check_export_name(path: FileName) -> str:
    """Return the ending of an export in lower case; refuse one that is none of ``EXPORTS``."""
    ending = Path(path).suffix.lower()
    if ending not in EXPORTS:
        raise FileError(f"{path} does not end in {', '.join(EXPORTS)}")
    return ending


def check_export(path: FileName, sheet: ShowSheet | None = None) -> str:
    """Return the ending; refuse others, and a KMZ of a show that says no place on the earth."""
    ending = check_export_name(path)
    if ending == ".kmz" and (sheet is None or sheet.origin is None):
        raise FileError(f"{path} needs a place on the earth: give the show an origin: {{latitude, longitude}}")
    return ending


def export_show(
    fleet: Fleet,
    path: FileName,
    lights: Sequence[Lamp] | None = None,
    *,
    sheet: ShowSheet | None = None,
    clobber: bool = True,
) -> None:
    """Write a fleet as a file that is played, by its ending, in one atomic step.

    Parameters
    ----------
    fleet : Fleet
    path : str or path
        ``.zip``: Skybrush's CSV; ``.vviz``; ``.kmz``.
    lights : sequence of Lights or None, optional
        Of each vehicle; white by default.
    sheet : ShowSheet, optional
        Title, cues, and the origin that a KMZ needs.
    clobber : bool

    Raises
    ------
    FileError
        If the ending is another, or a KMZ has no origin or is longer than a day.
    """
    ending = check_export(path, sheet)
    if ending == ".zip":
        write_csv_show(fleet, path, lights, clobber=clobber)
        return
    make_folder(Path(path).parent)
    content = _vviz(fleet, lights, sheet or ShowSheet()) if ending == ".vviz" else _kmz(fleet, lights, sheet)
    write_file(path, content, clobber=clobber)


def _vviz(fleet: Fleet, lights: Sequence[Lamp] | None, sheet: ShowSheet) -> str:
    _, places, _ = sampled(fleet, lights, POSITION_RATE)
    _, _, colours = sampled(fleet, lights, COLOUR_RATE)
    right_up_forward = np.round(places[..., [0, 2, 1]], 3)
    head: dict[str, Any] = {"version": "1.0", "performanceName": sheet.title, "coordinateFrame": "ogl"}
    if sheet.origin is not None:
        place = {"lat": sheet.origin.latitude, "lon": sheet.origin.longitude, "alt": sheet.origin.altitude or 0.0}
        head["globalReferenceFrame"] = place
    head |= {"defaultPositionRate": POSITION_RATE, "defaultColorRate": COLOUR_RATE, "timeOffsetSecs": 0.0}
    head["eventTags"] = [{"time": round(time, 3), "tagType": "Act", "tagID": name} for time, name in sheet.cues]
    pairs = enumerate(zip(right_up_forward, colours, strict=True))
    head["performances"] = [_performance(i, place, colour) for i, (place, colour) in pairs]
    return json.dumps(head, separators=(",", ":")) + "\n"


def _performance(number: int, places: FloatArray, colours: FloatArray) -> dict[str, Any]:
    """Return one vehicle: steps of whole millimetres from its home on, and its colours.

    Of a colour that stays, the first entry has no number of frames and the next one the others: programs that hold it
    for that long and those that reach it after that long show the same.
    """
    steps = np.round(np.diff(places, axis=0, prepend=places[:1]), 3) + 0.0
    traversal = [dict(zip(("dx", "dy", "dz"), step, strict=True)) for step in steps.tolist()]
    actions = []
    for colour, run in groupby(map(tuple, colours.astype(int).tolist())):
        shown, frames = dict(zip("rgb", colour, strict=True)), len(list(run)) - 1
        actions += [shown] + ([{**shown, "frames": frames}] if frames else [])
    home = dict(zip(("homeX", "homeY", "homeZ"), places[0].tolist(), strict=True))
    payload = [{"id": 0, "type": "Light", "payloadActions": actions}]
    described = {**home, "homeH": 0.0, "agentTraversal": traversal}
    return {"id": number, "agentDescription": described, "payloadDescription": payload}


def _kmz(fleet: Fleet, lights: Sequence[Lamp] | None, sheet: ShowSheet | None) -> bytes:
    if fleet.duration >= LONGEST_DAY:
        raise FileError(f"the show lasts {fleet.duration:g} s, and Google Earth's day ends at {LONGEST_DAY:g} s")
    assert sheet is not None and sheet.origin is not None
    instants, places, colours = sampled(fleet, lights, TRACK_RATE)
    geodetic = sheet.origin.geodetic(places)
    heights = "relativeToGround" if sheet.origin.altitude is None else "absolute"
    whens = "".join(f"<when>{_clock(t)}</when>" for t in instants.tolist())
    tracks = []
    for i in range(len(fleet)):
        lit = colours[i][colours[i].any(axis=1)]
        red, green, blue = np.round(lit.mean(axis=0) if len(lit) else np.full(3, 255.0)).astype(int).tolist()
        style = f"<Style><IconStyle><color>ff{blue:02x}{green:02x}{red:02x}</color><scale>0.5</scale></IconStyle>"
        style += "<LabelStyle><scale>0</scale></LabelStyle><LineStyle><width>0</width></LineStyle></Style>"
        coords = "".join(f"<gx:coord>{lon:.8f} {lat:.8f} {up:.3f}</gx:coord>" for lat, lon, up in geodetic[i].tolist())
        track = f"<gx:Track><altitudeMode>{heights}</altitudeMode>{whens}{coords}</gx:Track>"
        tracks.append(f"<Placemark><name>{escape(fleet.name(i))}</name>{style}{track}</Placemark>")
    spaces = 'xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2"'
    title = f"<name>{escape(sheet.title)}</name>"
    text = f"<kml {spaces}><Document>{title}{''.join(tracks)}</Document></kml>\n"
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo("doc.kml", STAMP), HEAD + text, zipfile.ZIP_DEFLATED)
    return content.getvalue()


def _clock(t: float) -> str:
    milliseconds = round(1e3 * t)
    hours, rest = divmod(milliseconds, 3_600_000)
    minutes, rest = divmod(rest, 60_000)
    return f"{DAY}{hours:02d}:{minutes:02d}:{rest // 1000:02d}.{rest % 1000:03d}Z"
