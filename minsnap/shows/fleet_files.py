"""Fleets in files: a folder of polynomials with a manifest, a crazyswarm2 folder, a Skybrush show; all are read back.

What is certified of a fleet on disk is what is in its files: write, read, certify.

A Skybrush show, ``.skyc``, is a zip of JSON files with the cubics and the lights of every vehicle. The points are those
of ``cubic_segments`` in metres, so that the binary files made of a show hold the same curves. The server subtracts
times in floating seconds and cuts their milliseconds off, which loses one in many intervals; each knot is written a
nanosecond later than the one before is, so that none is lost.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import atomic_write, check_destination, make_folder, write_file
from minsnap.basics.storage.text import FileName, digest_of, read_text, reading
from minsnap.errors import FileError
from minsnap.files.convert import read_any
from minsnap.files.formats import crazyflie, skybrush
from minsnap.fleet.common_clock import Fleet, Separation
from minsnap.polynomials.bernstein import elevate
from minsnap.trajectory.trajectory import Trajectory

Lamp = skybrush.Lights | None

MOST_DRONES = 5000
"""Vehicles of a show."""

LATER = 1e-9
"""How much later than it is each knot is written than the one before it [s]."""

MOST_BETWEEN = 6
"""Inner control points of a segment: a curve of degree 7."""

LARGEST = 1 << 28
"""Bytes that a file of a show unpacks to at most."""

STAMP = (1980, 1, 1, 0, 0, 0)
"""Date of the files in the archive: the same show gives the same bytes."""


@dataclass(frozen=True)
class SkybrushShow:
    """What a show holds.

    Parameters
    ----------
    fleet : Fleet
        On the show's clock.
    programmes : tuple of bytes
        Of the lights of each vehicle.
    """

    fleet: Fleet
    programmes: tuple[bytes, ...]

    @property
    def lights(self) -> tuple[Lamp, ...]:
        """Lights of each vehicle; raises FileError if a programme has a command that is not read."""
        return tuple(map(skybrush.lights_of, self.programmes))


def write_skyc(
    fleet: Fleet, path: FileName, lights: Sequence[Lamp] | None = None, *, title: str = "minsnap", clobber: bool = True
) -> float:
    """Write a show in one atomic step, and return the proved distance of its curves to the fleet's [m].

    Raises
    ------
    FileError
        If there are more than 5,000 vehicles, or one leads too far away.
    """
    if len(fleet) > MOST_DRONES:
        raise FileError(f"{len(fleet)} vehicles: a show holds {MOST_DRONES}")
    lamps = lamps_of(fleet, lights)
    curves = [skybrush.cubic_segments(curve) for curve in fleet]
    files = {f"drones/drone_{i + 1}/trajectory.json": _trajectory_json(curve) for i, curve in enumerate(curves)}
    drones = [_drone(fleet, i, lamp) for i, lamp in enumerate(lamps)]
    files["show.json"] = _show_json(fleet, drones, title)
    files["cues.json"] = {"version": 1, "items": [{"time": 0.0, "name": "start"}]}
    make_folder(Path(path).parent)
    with atomic_write(path, "wb", clobber=clobber) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files, reverse=True):
            archive.writestr(zipfile.ZipInfo(name, STAMP), json.dumps(files[name]), zipfile.ZIP_DEFLATED)
    return max(map(_distance, curves))


def _distance(curve: skybrush.CubicSegments) -> float:
    """Return the proved distance of a curve with its knots as late as they are written [m]."""
    return curve.distance + LATER * len(curve.breaks) * curve.trajectory().max_norm(1)[0]


def lamps_of(fleet: Fleet, lights: Sequence[Lamp] | None) -> list[Lamp]:
    """Return the lights of each vehicle, or raise FileError where they are those of another number."""
    lamps: list[Lamp] = [None] * len(fleet) if lights is None else list(lights)
    if len(lamps) != len(fleet):
        raise FileError(f"there are lights for {len(lamps)} vehicles of {len(fleet)}: give one for each, or None")
    return lamps


def _show_json(fleet: Fleet, drones: list[dict[str, Any]], title: str) -> dict[str, Any]:
    separation = fleet.separation
    apart = None if separation is None else separation.distance
    validation = {} if apart is None else {"validation": {"minDistance": apart}}
    return {
        "version": 1,
        "environment": {"type": "indoor"},
        "settings": {"cues": {"$ref": "./cues.json#"}, **validation},
        "swarm": {"drones": drones},
        "meta": {"title": title, "segments": {"show": [0.0, fleet.duration]}},
    }


def _drone(fleet: Fleet, number: int, lamp: Lamp) -> dict[str, Any]:
    curve = fleet[number]
    settings = {
        "name": fleet.name(number),
        "home": np.round(curve(0.0), 3).tolist(),
        "landAt": np.round(curve(curve.duration), 3).tolist(),
        "trajectory": {"$ref": f"./drones/drone_{number + 1}/trajectory.json#"},
        "lights": {"version": 1, "data": base64.b64encode(skybrush.light_bytes(lamp)).decode()},
    }
    return {"type": "generic", "settings": settings}


def _trajectory_json(curve: skybrush.CubicSegments) -> dict[str, Any]:
    metres = np.round(curve.points * (curve.scale / 1e3), 3)
    points: list[Any] = [[0.0, metres[0, 0].tolist(), []]]
    seconds = knot_seconds(curve)[1:]
    for instant, piece, line in zip(seconds, metres, skybrush.is_line(curve.points), strict=True):
        points.append([instant, piece[3].tolist(), [] if line else piece[1:3].tolist()])
    return {"version": 1, "points": points, "takeoffTime": 0.0, "landingTime": seconds[-1]}


def knot_seconds(curve: skybrush.CubicSegments) -> list[float]:
    """Return the instants of knots as they are written [s]."""
    return [round(end / 1e3 + LATER * i, 9) for i, end in enumerate(curve.breaks.tolist())]


def read_skyc(path: FileName) -> SkybrushShow:
    """Read a show, whoever wrote it: lines, quadratics, cubics and curves up to degree 7.

    Raises
    ------
    FileError
        If it is none.
    """
    with reading(path, "a Skybrush show", LARGEST), zipfile.ZipFile(path) as archive:
        show = _load(archive, "show.json")
        settings = [drone["settings"] for drone in show["swarm"]["drones"]]
        if not 1 <= len(settings) <= MOST_DRONES:
            raise FileError(f"{path} has {len(settings)} vehicles: a show has 1 to {MOST_DRONES}")
        curves = [_curve(_resolved(archive, entry["trajectory"])) for entry in settings]
        found = [_resolved(archive, entry.get("lights")) for entry in settings]
        programmes = tuple(base64.b64decode(each["data"]) if each else b"" for each in found)
    names = tuple(str(entry.get("name") or f"drone {i + 1}") for i, entry in enumerate(settings))
    return SkybrushShow(Fleet(tuple(curves), names if len(set(names)) == len(names) else None), programmes)


def _load(archive: zipfile.ZipFile, name: str) -> Any:
    if archive.getinfo(name).file_size > LARGEST:
        raise FileError(f"{name} unpacks to more than {LARGEST} bytes")
    return json.loads(archive.read(name))


def _resolved(archive: zipfile.ZipFile, entry: Any) -> Any:
    """Return the file that an entry refers to, or the entry itself."""
    if not isinstance(entry, dict) or "$ref" not in entry:
        return entry
    return _load(archive, str(entry["$ref"]).removesuffix("#").removeprefix("./"))


def _curve(entry: Any) -> Trajectory:
    """Return the trajectory of its points, with its wait before take-off and the first of them."""
    points = entry["points"]
    pieces: list[FloatArray] = []
    before = np.array(points[0][1], dtype=np.float64).reshape(3)
    wait = float(entry.get("takeoffTime") or 0.0) + float(points[0][0])
    if not wait >= 0.0:
        raise FileError(f"a vehicle of a show has its first point at {wait:g} s: shows begin at 0")
    durations = np.diff([float(point[0]) for point in points])
    for _, end, between in points[1:]:
        if len(between) > MOST_BETWEEN:
            raise FileError(f"a segment of a show has {len(between)} inner control points, and {MOST_BETWEEN} are read")
        pieces.append(np.array([before, *between, end], dtype=np.float64))
        before = pieces[-1][-1]
    if wait > 0.0 or not pieces:
        pieces.insert(0, np.array([points[0][1]] * 2, dtype=np.float64))
        durations = np.concatenate([[wait or 1.0], durations])
    size = max(len(piece) for piece in pieces)
    return Trajectory(np.stack([elevate(piece.T, size).T for piece in pieces]), durations)


MOST_ADDRESSES = 255
"""Vehicles that an address can tell apart."""


def crazyswarm_files(fleet: Fleet) -> dict[str, str]:
    """Return ``crazyflies.yaml`` (fileversion 3) and ``fly.py`` for trajectories ``traj0.csv``, ``traj1.csv``, ...

    A vehicle stands below the start of its trajectory. The script climbs straight up to it; trajectories that begin on
    the ground take off themselves.

    Raises
    ------
    FileError
        If there are more vehicles than addresses.
    """
    if len(fleet) > MOST_ADDRESSES:
        raise FileError(f"{len(fleet)} vehicles: one radio network of crazyswarm2 tells {MOST_ADDRESSES} apart")
    starts, robots = [curve(0.0).tolist() for curve in fleet], ""
    for number, (x, y, _) in enumerate(starts):  # 20 share a channel; the last byte of an address is the number
        uri = f"radio://0/{80 + 10 * (number // 20 % 4)}/2M/E7E7E7E7{number + 1:02X}"
        robots += f"  cf{number + 1}:\n    enabled: true\n    uri: {uri}\n    initial_position: [{x!r}, {y!r}, 0.0]\n"
        robots += "    type: cf21  # see robot_types\n"
    yaws = [float(curve.yaw(np.zeros(1))[0]) for curve in fleet]
    values = {"robots": robots, "heights": [height for *_, height in starts], "yaws": yaws, "duration": fleet.duration}
    templates = Path(__file__).with_name("crazyswarm2")
    names = ("crazyflies.yaml", "fly.py")
    return {name: (templates / f"{name}.txt").read_text(encoding="utf-8").format(**values) for name in names}


MARK, MANIFEST = "minsnap fleet", "manifest.json"
ENDINGS = (".csv", ".skyb", ".traj", ".json", ".npz")
"""Of files of one vehicle, in folders without a manifest."""

Maker = Callable[[Trajectory, Lamp], tuple[str | bytes, float]]
"""Returns the content of a vehicle's file, of its trajectory and lights, and its proved distance to these [m]."""


def _make_csv(most: int | None) -> Maker:
    return lambda curve, lamp: (crazyflie.crazyflie_text(curve, most), 0.0)


def _make_skyb(curve: Trajectory, lamp: Lamp) -> tuple[bytes, float]:
    segments = skybrush.cubic_segments(curve)
    return skybrush.skybrush_bytes(segments, lamp), segments.distance


def _make_traj(curve: Trajectory, lamp: Lamp) -> tuple[bytes, float]:
    return crazyflie.compressed(curve), float(crazyflie.rounding_bounds(curve)[0])


FOLDERS: dict[str, tuple[str, Maker]] = {
    "csv": (".csv", _make_csv(None)),
    "crazyswarm2": (".csv", _make_csv(crazyflie.MAX_PIECES)),
    "skyb": (".skyb", _make_skyb),
    "traj": (".traj", _make_traj),
}
"""Folders with one file a vehicle: its ending, and what makes its content."""

KINDS = (*FOLDERS, "skyc")
EXACT_KINDS = ("csv", "crazyswarm2")
"""Those that lose nothing of the curves."""


@dataclass(frozen=True)
class WrittenFleet:
    """What was written.

    Parameters
    ----------
    kind : str
        One of ``KINDS``.
    files : tuple of Path
        Everything that was written.
    distance : float
        Proved upper bound of the distance of any vehicle's file to its trajectory [m].
    """

    kind: str
    files: tuple[Path, ...]
    distance: float


def write_fleet(
    fleet: Fleet, path: FileName, to: str | None = None, lights: Sequence[Lamp] | None = None, *, clobber: bool = True
) -> WrittenFleet:
    """Write a fleet.

    Parameters
    ----------
    fleet : Fleet
        Three coordinates.
    path : str or path
        A file ending in ``.skyc``, or a folder; folders that are missing are made.
    to : str, optional
        ``csv``: one file of polynomials a vehicle and a manifest with the hash of each; ``crazyswarm2``: the same with
        ``crazyflies.yaml`` and a script that flies it; ``skyb`` and ``traj``: the bytes that Skybrush's firmware and
        the Crazyflie's (compressed) fly; ``skyc``: a Skybrush show. By default by the ending.
    lights : sequence of Lights or None, optional
        Of each vehicle; ``skyb`` and ``skyc`` hold them.
    clobber : bool
        False: files that exist are an error. Else files with the same ending of a former fleet, which has more
        vehicles, are removed from the folder, and its script, unless they were changed since.

    Raises
    ------
    FileError
        If a vehicle does not fit the format, there are lights for another number of vehicles, or a folder cannot be
        made.
    """
    kind = to or ("skyc" if Path(path).suffix.lower() == ".skyc" else "csv")
    if kind not in KINDS:
        raise FileError(f"no format of fleets is called {kind!r}: choose one of {', '.join(KINDS)}")
    if fleet.dim != 3:
        raise FileError(f"files of fleets hold 3 coordinates, and the fleet has {fleet.dim}")
    if kind == "skyc":
        return WrittenFleet(kind, (Path(path),), write_skyc(fleet, path, lights, clobber=clobber))
    (ending, make), folder, lamps = FOLDERS[kind], Path(path), lamps_of(fleet, lights)
    made = [make(*each) for each in zip(fleet, lamps, strict=True)]  # all of them before anything is written
    files = {folder / f"traj{i}{ending}": content for i, (content, _) in enumerate(made)}
    beside = crazyswarm_files(fleet) if kind == "crazyswarm2" else {}
    further: dict[Path, str | bytes] = {folder / name: content for name, content in beside.items()}
    manifest = folder / MANIFEST
    make_folder(folder)
    for file in (manifest, *files, *further):
        check_destination(file, clobber=clobber)
    former = _unchanged(folder, ending)
    write_file(manifest, _manifest(fleet, kind, files, further))  # first: what was cut short is refused by it
    for file, content in (files | further).items():
        write_file(file, content, clobber=clobber)
    for file in former - {*files, *further}:
        with suppress(OSError):
            file.unlink()
    return WrittenFleet(kind, (*files, *further, manifest), max(distance for _, distance in made))


def _unchanged(folder: Path, ending: str) -> set[Path]:
    """Return files of a former fleet that nobody has changed: those of vehicles of an ending, and those beside them."""
    try:
        content = json.loads(read_text(folder / MANIFEST))
        former = content["vehicles"] if content["format"] == MARK else []
        rows = [row for row in former if row["file"].endswith(ending)] + content.get("further", [])
        named = [(folder / row["file"], row["sha256"]) for row in rows]
        return {file for file, digest in named if file.parent == folder and digest_of(file) == digest}
    except (FileError, OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return set()


def _manifest(fleet: Fleet, kind: str, files: dict[Path, str | bytes], further: dict[Path, str | bytes]) -> str:
    """Return the manifest of files with these contents: those of the vehicles, and those beside them."""
    vehicles = [
        {"name": fleet.name(i), "file": file.name, "duration": fleet[i].duration, "sha256": _sha256(content)}
        for i, (file, content) in enumerate(files.items())
    ]
    beside = [{"file": file.name, "sha256": _sha256(content)} for file, content in further.items()]
    separation = None if fleet.separation is None else fleet.separation.plain
    content = {"format": MARK, "version": 1, "kind": kind, "frame": "enu", "units": "m, s, rad"}
    return json.dumps({**content, "separation": separation, "vehicles": vehicles, "further": beside}, indent=1) + "\n"


def _sha256(content: str | bytes) -> str:
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()


def is_fleet(path: FileName) -> bool:
    """Whether a file is one of a whole fleet: a folder or a Skybrush show."""
    return Path(path).is_dir() or Path(path).suffix.lower() == ".skyc"


def show_at(path: FileName) -> Path | None:
    """Return the Skybrush show that a path is, or that a folder without other trajectories holds, or None."""
    place = Path(path)
    if place.suffix.lower() == ".skyc":
        return place
    files = [file for file in place.iterdir() if file.suffix.lower() in (*ENDINGS, ".skyc")] if place.is_dir() else []
    return files[0] if len(files) == 1 and files[0].suffix.lower() == ".skyc" else None


def read_fleet(path: FileName) -> Fleet:
    """Read a fleet.

    Parameters
    ----------
    path : str or path
        What :func:`write_fleet` wrote, a Skybrush show or a folder of one, any folder with one file of polynomials a
        vehicle, or the file of a single one.

    Raises
    ------
    FileError
        If it holds none, a file was changed since its manifest was written, or a file holds samples alone.
    """
    place = Path(path)
    if (show := show_at(place)) is not None:
        return read_skyc(show).fleet
    if not place.is_dir():
        return Fleet((_trajectory(place),), (place.stem,))
    if (place / MANIFEST).exists():
        with reading(place / MANIFEST, "the manifest of a fleet"):
            return _listed(place, json.loads(read_text(place / MANIFEST)))
    files = sorted((file for file in place.iterdir() if file.suffix.lower() in ENDINGS), key=_counted)
    if not files:
        raise FileError(
            f"{path} holds no trajectories: one .skyc, or a .csv of polynomials, .skyb, .traj, .json or .npz a vehicle"
        )
    return Fleet(tuple(_trajectory(file) for file in files), tuple(file.stem for file in files))


def _counted(file: Path) -> list[str | int]:
    """Return a key by which traj2 comes before traj10: vehicles are told apart by this order."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", file.name)]


def _listed(folder: Path, content: Any) -> Fleet:
    """Return the fleet of a manifest."""
    if content.get("format") != MARK or content.get("version") != 1:
        raise FileError(f"{folder / MANIFEST} is not the manifest of a fleet of version 1")
    curves = []
    for row in content["vehicles"]:
        file = folder / Path(row["file"]).name
        if not file.exists() or digest_of(file) != row["sha256"]:
            raise FileError(f"{file} is missing or was changed since its manifest was written: write the fleet again")
        curves.append(crazyflie.read_crazyflie(file) if file.suffix == ".csv" else _trajectory(file))
    separation = Separation(**content["separation"]) if content.get("separation") else None
    return Fleet(tuple(curves), tuple(row["name"] for row in content["vehicles"]), separation)


def _trajectory(file: Path) -> Trajectory:
    content = read_any(file)
    if not isinstance(content, Trajectory):
        raise FileError(f"{file} holds samples, and nothing is certain between them: give polynomials")
    return content
