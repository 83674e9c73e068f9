"""Fleets in files: a folder of polynomials with a manifest, a crazyswarm2 folder, a Skybrush show; all are read back.

What is certified of a fleet on disk is what is in its files: write, read, certify.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.storage.atomic import check_destination, make_folder, write_file
from minsnap.basics.storage.text import FileName, digest_of, read_text, reading
from minsnap.errors import FileError
from minsnap.files import frame_for, read_any
from minsnap.files.formats import YawSetpoints, as_cubic_segments, crazyflie, skybrush, through
from minsnap.fleet import Fleet, Separation
from minsnap.shows.crazyswarm_folder import crazyswarm_files
from minsnap.shows.csv_show import by_numbers, read_frames
from minsnap.shows.returns import Returns
from minsnap.shows.site import ShowOrigin
from minsnap.shows.skyc import Lamp, ShowSheet, lamps_of, read_skyc, write_skyc
from minsnap.trajectory import SHORTEST_PIECE, Samples, Trajectory

MARK, MANIFEST = "minsnap fleet", "manifest.json"
ENDINGS = (".csv", ".skyb", ".traj", ".json", ".npz")
"""Of files of one vehicle, in folders without a manifest."""

Maker = Callable[[Trajectory, Lamp, bytes], tuple[str | bytes, float]]
"""Returns the content of a vehicle's file, of its trajectory, lights and returns, and its proved distance to it [m]."""


def _make_csv(curve: Trajectory, lamp: Lamp, returns: bytes) -> tuple[str, float]:
    return crazyflie.crazyflie_text(curve, None), 0.0


def _make_skyb(curve: Trajectory, lamp: Lamp, returns: bytes) -> tuple[bytes, float]:
    segments = as_cubic_segments(curve)
    return skybrush.skybrush_bytes(segments, lamp, YawSetpoints.of(curve), returns), segments.distance


def _make_traj(curve: Trajectory, lamp: Lamp, returns: bytes) -> tuple[bytes, float]:
    return crazyflie.compressed(curve), float(crazyflie.rounding_bounds(curve)[0])


FOLDERS: dict[str, tuple[str, Maker]] = {
    "csv": (".csv", _make_csv),
    "crazyswarm2": (".csv", _make_csv),
    "skyb": (".skyb", _make_skyb),
    "traj": (".traj", _make_traj),
}
"""Folders with one file a vehicle: its ending, and what makes its content."""

KINDS = (*FOLDERS, "skyc")
RETURNING = ("skyb", "skyc")
"""Those that hold returns."""

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
    notes : tuple of str
        What is to be said of them: where vehicles are to stand, and what is proved of their ways.
    """

    kind: str
    files: tuple[Path, ...]
    distance: float
    notes: tuple[str, ...] = ()


def write_fleet(
    fleet: Fleet,
    path: FileName,
    to: str | None = None,
    lights: Sequence[Lamp] | None = None,
    *,
    sheet: ShowSheet | None = None,
    returns: Returns | None = None,
    clobber: bool = True,
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
        ``crazyflies.yaml`` and a script that flies it, on ways to the starts and to the ground that are proved apart;
        ``skyb`` and ``traj``: the bytes that Skybrush's firmware and the Crazyflie's (compressed) fly; ``skyc``: a
        Skybrush show. By default by the ending.
    lights : sequence of Lights or None, optional
        Of each vehicle; ``skyb`` and ``skyc`` hold them.
    sheet : ShowSheet, optional
        What a ``skyc`` says of itself besides: title, indoors or outdoors, limits, cues, segments; its origin is in
        the manifest of folders too.
    returns : Returns, optional
        How all return from each second, which ``skyb`` holds, and ``skyc`` those at one height (``plan_returns(...,
        level=True)``).
    clobber : bool
        False: files that exist are an error. Else files with the same ending of a former fleet, which has more
        vehicles, are removed from the folder, and its script, unless they were changed since.

    Raises
    ------
    FileError
        If a vehicle does not fit the format, there are lights for another number of vehicles, or a folder cannot be
        made.
    FleetError
        If a vehicle of a crazyswarm2 folder has no way to its start or to the ground that is proved apart.
    """
    kind = to or ("skyc" if Path(path).suffix.lower() == ".skyc" else "csv")
    if kind not in KINDS:
        raise FileError(f"no format of fleets is called {kind!r}: choose one of {', '.join(KINDS)}")
    if fleet.dim != 3:
        raise FileError(f"files of fleets hold 3 coordinates, and the fleet has {fleet.dim}")
    if returns is not None and kind not in RETURNING:
        raise FileError(f"files of the kind {kind} hold no returns: write them as {' or '.join(RETURNING)}")
    if kind == "skyc":
        lost = write_skyc(fleet, path, lights, sheet=sheet, returns=returns, clobber=clobber)
        return WrittenFleet(kind, (Path(path),), lost)
    (ending, make), folder, lamps = FOLDERS[kind], Path(path), lamps_of(fleet, lights)
    blocks = [b"" if returns is None else returns.block(i) for i in range(len(fleet))]
    made = [make(*each) for each in zip(fleet, lamps, blocks, strict=True)]  # all of them before anything is written
    files = {folder / f"traj{i}{ending}": content for i, (content, _) in enumerate(made)}
    acts = [] if sheet is None else [(name, at) for at, name in sheet.cues]
    beside, notes = crazyswarm_files(fleet, acts) if kind == "crazyswarm2" else ({}, ())
    further: dict[Path, str | bytes] = {folder / name: content for name, content in beside.items()}
    manifest = folder / MANIFEST
    for place in {folder, *(file.parent for file in further)}:
        make_folder(place)
    for file in (manifest, *files, *further):
        check_destination(file, clobber=clobber)
    former = _unchanged(folder, ending)
    write_file(manifest, _manifest(fleet, kind, files, further, sheet))  # first: what was cut short is refused by it
    for file, content in (files | further).items():
        write_file(file, content, clobber=clobber)
    for file in former - {*files, *further}:
        with suppress(OSError):
            file.unlink()
    return WrittenFleet(kind, (*files, *further, manifest), max(distance for _, distance in made), notes)


def _unchanged(folder: Path, ending: str) -> set[Path]:
    """Return files of a former fleet that nobody has changed: those of vehicles of an ending, and those beside them."""
    try:
        content = json.loads(read_text(folder / MANIFEST))
        former = content["vehicles"] if content["format"] == MARK else []
        rows = [row for row in former if row["file"].endswith(ending)] + content.get("further", [])
        named = [(folder / row["file"], row["sha256"]) for row in rows]
        return {file for file, digest in named if folder in file.parents and digest_of(file) == digest}
    except (FileError, OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return set()


def _manifest(
    fleet: Fleet,
    kind: str,
    files: dict[Path, str | bytes],
    further: dict[Path, str | bytes],
    sheet: ShowSheet | None,
) -> str:
    """Return the manifest of files with these contents: those of the vehicles, and those beside them."""
    folder = next(iter(files)).parent
    origin, acts = (None, ()) if sheet is None else (sheet.origin, sheet.cues)
    vehicles: list[dict[str, Any]] = [
        {"name": fleet.name(i), "file": file.name, "duration": fleet[i].duration, "sha256": _sha256(content)}
        for i, (file, content) in enumerate(files.items())
    ]
    if origin is not None:
        for row, place in zip(vehicles, origin.geodetic(fleet(0.0)).tolist(), strict=True):
            row["home"] = {"latitude": place[0], "longitude": place[1]}
            row["home"] |= {} if origin.altitude is None else {"altitude": place[2]}
    beside = [
        {"file": file.relative_to(folder).as_posix(), "sha256": _sha256(content)} for file, content in further.items()
    ]
    separation = None if fleet.separation is None else fleet.separation.plain
    content: dict[str, Any] = {"format": MARK, "version": 1, "kind": kind, "frame": "enu", "units": "m, s, rad"}
    content |= {} if origin is None else {"origin": vars(origin)}
    content |= {"acts": [{"name": name, "at": at} for at, name in acts]} if acts else {}
    return json.dumps({**content, "separation": separation, "vehicles": vehicles, "further": beside}, indent=1) + "\n"


def _sha256(content: str | bytes) -> str:
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()


def is_fleet(path: FileName) -> bool:
    """Whether a file is one of a whole fleet: a folder, a Skybrush show, or a zip of frames."""
    return Path(path).is_dir() or Path(path).suffix.lower() in (".skyc", ".zip")


def show_at(path: FileName) -> Path | None:
    """Return the Skybrush show that a path is, or that a folder without other trajectories holds, or None."""
    place = Path(path)
    if place.suffix.lower() == ".skyc":
        return place
    files = [file for file in place.iterdir() if file.suffix.lower() in (*ENDINGS, ".skyc")] if place.is_dir() else []
    return files[0] if len(files) == 1 and files[0].suffix.lower() == ".skyc" else None


def read_fleet(path: FileName, *, between: bool = False, frame: str | None = None) -> Fleet:
    """Read a fleet.

    Parameters
    ----------
    path : str or path
        What :func:`write_fleet` wrote, a Skybrush show or a folder of one, any folder with one file of polynomials a
        vehicle, the file of a single one, or a zip of frames, which are samples.
    between : bool
        Whether files of samples are taken too: each as the curve through all its samples, quintics where they have
        velocities and accelerations, else cubics or lines. All are on one clock, that of their instants; before its
        first sample a vehicle waits there.
    frame : str or None
        Axes of files of samples, where they do not say so themselves.

    Raises
    ------
    FileError
        If it holds none, a file was changed since its manifest was written, or a file holds samples alone.
    """
    place = Path(path)
    if between and place.is_dir() and show_at(place) is None and not (place / MANIFEST).exists():
        return _sampled_fleet(_files_of(place), frame)
    if (show := show_at(place)) is not None:
        return read_skyc(show).fleet
    if place.suffix.lower() == ".zip":
        return _framed_fleet(place, between=between)
    if not place.is_dir():
        return Fleet((_trajectory(place),), (place.stem,))
    if (place / MANIFEST).exists():
        with reading(place / MANIFEST, "the manifest of a fleet"):
            return _listed(place, json.loads(read_text(place / MANIFEST)))
    files = _files_of(place)
    return Fleet(tuple(_trajectory(file) for file in files), tuple(file.stem for file in files))


def _files_of(place: Path) -> list[Path]:
    """Return the files of vehicles in a folder without a manifest, or raise FileError if there is none."""
    files = sorted((file for file in place.iterdir() if file.suffix.lower() in ENDINGS), key=by_numbers)
    if not files:
        raise FileError(
            f"{place} holds no trajectories: one .skyc, or a .csv of polynomials, .skyb, .traj, .json or .npz a vehicle"
        )
    return files


def _sampled_fleet(files: Sequence[Path], frame: str | None) -> Fleet:
    """Return the fleet of files that may hold samples, on the clock of their instants."""
    contents = [read_any(file, frame_for(file, frame)) for file in files]
    short = next(
        (
            file
            for file, each in zip(files, contents, strict=True)
            if not isinstance(each, Trajectory) and len(each) < 2
        ),
        None,
    )
    if short is not None:
        raise FileError(f"{short} holds one sample: a path needs two at least")
    first = min((float(each.t[0]) for each in contents if isinstance(each, Samples)), default=0.0)
    curves = tuple(each if isinstance(each, Trajectory) else _waiting(each, first) for each in contents)
    return Fleet(curves, tuple(file.stem for file in files))


def _framed_fleet(place: Path, *, between: bool) -> Fleet:
    """Return the fleet of a zip of frames, as the curves through all of them."""
    if not between:
        raise FileError(
            f"{place} holds frames, and nothing is certain between them: minsnap fleet {place} -o FOLDER makes curves"
        )
    frames = read_frames(place)
    samples = (Samples(t, places) for t, places in zip(frames.instants, frames.positions, strict=True))
    named = len(set(frames.names)) == len(frames.names)
    return Fleet(tuple(_waiting(each, 0.0) for each in samples), frames.names if named else None)


def _waiting(samples: Samples, start: float) -> Trajectory:
    """Return the curve through samples, on a clock that begins at an instant; the vehicle waits for its first one."""
    curve, wait = through(samples), float(samples.t[0]) - start
    if wait < SHORTEST_PIECE:
        return curve
    held = np.broadcast_to(curve.control_points[:1, :1], (1, *curve.control_points.shape[1:]))
    return Trajectory(np.concatenate([held, curve.control_points]), np.concatenate([[wait], curve.durations]))


def read_origin(path: FileName) -> ShowOrigin | None:
    """Return where on the earth the fleet of a folder or a Skybrush show is flown; None where nothing says it."""
    place = Path(path)
    if (show := show_at(place)) is not None:
        return read_skyc(show).origin
    if not (place / MANIFEST).exists():
        return None
    with reading(place / MANIFEST, "the manifest of a fleet"):
        content = json.loads(read_text(place / MANIFEST)).get("origin")
        return None if content is None else ShowOrigin(**content)


def read_acts(path: FileName) -> tuple[tuple[str, float], ...]:
    """Return the names of acts of the fleet of a folder, and when each is reached [s]; none where nothing says it."""
    place = Path(path)
    if not (place / MANIFEST).exists():
        return ()
    with reading(place / MANIFEST, "the manifest of a fleet"):
        content = json.loads(read_text(place / MANIFEST)).get("acts", [])
        return tuple((str(act["name"]), float(act["at"])) for act in content)


def read_lights(path: FileName) -> tuple[Lamp, ...] | None:
    """Return the lights of each vehicle of a fleet in Skybrush's files; None where its format holds none."""
    place = Path(path)
    if (show := show_at(place)) is not None:
        return read_skyc(show).lights
    if place.suffix.lower() == ".zip":
        return None
    files = sorted((file for file in place.iterdir() if file.suffix.lower() == ".skyb"), key=by_numbers)
    return tuple(skybrush.read_skybrush(file).lights for file in files) or None


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
        raise FileError(
            f"{file} holds samples, and nothing is certain between them: give polynomials, such as minsnap convert "
            "--tolerance 1cm makes of them"
        )
    return content
