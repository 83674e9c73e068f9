"""Fleets in files: a folder of polynomials with a manifest, a crazyswarm2 folder, a Skybrush show; all are read back.

What is certified of a fleet on disk is what is in its files: write, read, certify.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.reading import reading
from minsnap.basics.storage.text import read_text
from minsnap.errors import FileError
from minsnap.files.convert import read_any
from minsnap.files.formats.crazyflie import (
    MAX_PIECES,
    read_crazyflie,
    rounding_bounds,
    write_compressed,
    write_crazyflie,
)
from minsnap.files.formats.light_programme import Lights
from minsnap.files.formats.skybrush import write_skybrush
from minsnap.fleet.common_clock import Fleet, Separation
from minsnap.shows.crazyswarm import write_crazyswarm
from minsnap.shows.skybrush_show import lamps_of, read_skyc, write_skyc
from minsnap.trajectory.trajectory import Trajectory

MARK, MANIFEST = "minsnap fleet", "manifest.json"
ENDINGS = (".csv", ".skyb", ".traj", ".json", ".npz")
"""Of files of one vehicle, in folders without a manifest."""

Lamp = Lights | None
Writer = Callable[[Trajectory, Path, Lamp, bool], float]
"""Writes a vehicle's trajectory and lights, clobbers or does not, and returns the proved distance of the file [m]."""


def _write_csv(most: int | None) -> Writer:
    def write(curve: Trajectory, file: Path, lamp: Lamp, clobber: bool) -> float:
        write_crazyflie(curve, file, max_pieces=most, clobber=clobber)
        return 0.0

    return write


def _write_skyb(curve: Trajectory, file: Path, lamp: Lamp, clobber: bool) -> float:
    return write_skybrush(curve, file, lamp, clobber=clobber).distance


def _write_traj(curve: Trajectory, file: Path, lamp: Lamp, clobber: bool) -> float:
    write_compressed(curve, file, clobber=clobber)
    return rounding_bounds(curve).position


FOLDERS: dict[str, tuple[str, Writer]] = {
    "csv": (".csv", _write_csv(None)),
    "crazyswarm2": (".csv", _write_csv(MAX_PIECES)),
    "skyb": (".skyb", _write_skyb),
    "traj": (".traj", _write_traj),
}
"""Folders with one file a vehicle: its ending, and what writes it."""

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
    fleet: Fleet,
    path: str | os.PathLike[str],
    to: str | None = None,
    lights: Sequence[Lights | None] | None = None,
    *,
    clobber: bool = True,
) -> WrittenFleet:
    """Write a fleet.

    Parameters
    ----------
    fleet : Fleet
        Three coordinates.
    path : str or path
        A file ending in ``.skyc``, or a folder, which is made.
    to : str, optional
        ``csv``: one file of polynomials a vehicle and a manifest with the hash of each; ``crazyswarm2``: the same with
        ``crazyflies.yaml`` and a script that flies it; ``skyb`` and ``traj``: the bytes that Skybrush's firmware and
        the Crazyflie's (compressed) fly; ``skyc``: a Skybrush show. By default by the ending.
    lights : sequence of Lights or None, optional
        Of each vehicle; ``skyb`` and ``skyc`` hold them.
    clobber : bool
        False: files that exist are an error.

    Raises
    ------
    FileError
        If a vehicle does not fit the format, or there are lights for another number of vehicles.
    """
    kind = to or ("skyc" if Path(path).suffix.lower() == ".skyc" else "csv")
    if kind not in KINDS:
        raise FileError(f"no format of fleets is called {kind!r}: choose one of {', '.join(KINDS)}")
    if fleet.dim != 3:
        raise FileError(f"files of fleets hold 3 coordinates, and the fleet has {fleet.dim}")
    if kind == "skyc":
        return WrittenFleet(kind, (Path(path),), write_skyc(fleet, path, lights, clobber=clobber))
    folder = Path(path)
    folder.mkdir(parents=True, exist_ok=True)
    ending, write = FOLDERS[kind]
    files, lamps = [folder / f"traj{i}{ending}" for i in range(len(fleet))], lamps_of(fleet, lights)
    lost = [write(*each, clobber) for each in zip(fleet, files, lamps, strict=True)]
    further = write_crazyswarm(fleet, folder, clobber=clobber) if kind == "crazyswarm2" else ()
    manifest = _write_manifest(fleet, folder, kind, files, clobber)
    return WrittenFleet(kind, (*files, *further, manifest), max(lost))


def _write_manifest(fleet: Fleet, folder: Path, kind: str, files: Sequence[Path], clobber: bool) -> Path:
    rows = [
        {"name": fleet.name(i), "file": file.name, "duration": fleet[i].duration, "sha256": digest(file)}
        for i, file in enumerate(files)
    ]
    separation = None if fleet.separation is None else fleet.separation.plain
    content = {"format": MARK, "version": 1, "kind": kind, "frame": "enu", "units": "m, s, rad"}
    with atomic_write(folder / MANIFEST, clobber=clobber) as file:
        file.write(json.dumps({**content, "separation": separation, "vehicles": rows}, indent=1) + "\n")
    return folder / MANIFEST


def digest(path: str | os.PathLike[str]) -> str:
    """Return the SHA-256 of a file, in hexadecimal."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def is_fleet(path: str | os.PathLike[str]) -> bool:
    """Whether a file is one of a whole fleet: a folder or a Skybrush show."""
    return Path(path).is_dir() or Path(path).suffix.lower() == ".skyc"


def read_fleet(path: str | os.PathLike[str]) -> Fleet:
    """Read a fleet.

    Parameters
    ----------
    path : str or path
        What :func:`write_fleet` wrote, a Skybrush show, or any folder with one file of polynomials a vehicle.

    Raises
    ------
    FileError
        If it holds none, a file was changed since its manifest was written, or a file holds samples alone.
    """
    place = Path(path)
    if place.suffix.lower() == ".skyc":
        return read_skyc(place).fleet
    if not place.is_dir():
        raise FileError(f"{path} is no folder and no .skyc: a fleet is one of these")
    if (place / MANIFEST).exists():
        with reading(place / MANIFEST, "the manifest of a fleet"):
            return _listed(place, json.loads(read_text(place / MANIFEST)))
    files = sorted(file for file in place.iterdir() if file.suffix.lower() in ENDINGS)
    if not files:
        raise FileError(f"{path} holds no trajectories: one .csv of polynomials, .skyb, .traj, .json or .npz a vehicle")
    return Fleet(tuple(_trajectory(file) for file in files), tuple(file.stem for file in files))


def _listed(folder: Path, content: Any) -> Fleet:
    """Return the fleet of a manifest."""
    if content.get("format") != MARK or content.get("version") != 1:
        raise FileError(f"{folder / MANIFEST} is not the manifest of a fleet of version 1")
    curves = []
    for row in content["vehicles"]:
        file = folder / Path(row["file"]).name
        if not file.exists() or digest(file) != row["sha256"]:
            raise FileError(f"{file} is missing or was changed since its manifest was written: write the fleet again")
        curves.append(read_crazyflie(file) if file.suffix == ".csv" else _trajectory(file))
    separation = Separation(**content["separation"]) if content.get("separation") else None
    return Fleet(tuple(curves), tuple(row["name"] for row in content["vehicles"]), separation)


def _trajectory(file: Path) -> Trajectory:
    content = read_any(file)
    if not isinstance(content, Trajectory):
        raise FileError(f"{file} holds samples, and nothing is certain between them: give polynomials")
    return content
