"""Shows as tables of instants, positions and colours: a CSV for each vehicle in a folder or a zip, as of Skybrush.

The columns are ``Time_msec,x_m,y_m,z_m,Red,Green,Blue``; names and units that are usual are read too, and rows without
a header in this order. Files are taken in the order of the numbers in their names: ``Drone 2`` before ``Drone 10``.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.atomic import make_folder, write_file
from minsnap.basics.storage.table import number_row, read_cells
from minsnap.basics.storage.text import FileName, reading
from minsnap.errors import FileError
from minsnap.files import read_columns
from minsnap.files.formats import Lights
from minsnap.fleet import Fleet
from minsnap.shows.skyc import STAMP, lamps_of

HEADER = "Time_msec,x_m,y_m,z_m,Red,Green,Blue"
"""As Skybrush's add-on for Blender knows a header."""

RATE = 25.0
"""Rows a second [Hz]."""

NEAR = 1.5
"""How far a colour may be from the line between two others, of 255 levels."""

LARGEST = 1 << 30
"""Bytes that an archive unpacks to at most."""

MOST_VEHICLES = 5000

COLOURS = (("red", "r", "ledr"), ("green", "g", "ledg"), ("blue", "b", "ledb"))
"""Names of the columns of a colour."""


@dataclass(frozen=True, eq=False)
class Frames:
    """What tables hold of each vehicle.

    Parameters
    ----------
    names : tuple of str
    instants : tuple of ndarray, shape (m,)
        From the first of all on [s].
    positions : tuple of ndarray, shape (m, 3)
        [m].
    colours : tuple of ndarray, shape (m, 3), or None
        From 0 to 255; None where a table has none.
    """

    names: tuple[str, ...]
    instants: tuple[FloatArray, ...]
    positions: tuple[FloatArray, ...]
    colours: tuple[FloatArray, ...] | None

    def __len__(self) -> int:
        return len(self.names)


def read_frames(path: FileName) -> Frames:
    """Read the tables of a folder or a zip.

    Raises
    ------
    FileError
        If there are none, one is malformed, or they do not begin and end together; says which.
    """
    place = Path(path)
    if place.is_dir():
        files = sorted((file for file in place.iterdir() if file.suffix.lower() == ".csv"), key=by_numbers)
        return _together(path, [file.stem for file in files], [_table(file, str(file)) for file in files])
    with (
        reading(path, "a zip of CSV files", LARGEST),
        zipfile.ZipFile(path) as archive,
        TemporaryDirectory() as folder,
    ):
        inside = [info for info in archive.infolist() if info.filename.lower().endswith(".csv")]
        if sum(info.file_size for info in inside) > LARGEST:
            raise FileError(f"it unpacks to more than {LARGEST} bytes")
        names = sorted((info.filename for info in inside), key=by_numbers)
        tables = []
        for name in names[: MOST_VEHICLES + 1]:
            file = Path(folder) / "table.csv"
            file.write_bytes(archive.read(name))
            tables.append(_table(file, f"{path}: {name}"))
    return _together(path, [Path(name).stem for name in names], tables)


def by_numbers(file: Path | str) -> list[str | int]:
    """Return a key by which traj2 comes before traj10: vehicles are told apart by this order."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", Path(file).name)]


Table = tuple[FloatArray, FloatArray, FloatArray | None]


def _table(file: Path, called: str) -> Table:
    """Return instants, positions and colours of one table."""
    try:
        cells = read_cells(file)
        if _is_number(cells[0][1][0]):
            return _plain(file, cells)
        columns, _ = read_columns(file)
        header = [cell.strip().lower() for cell in cells[0][1]]
        places = [next((header.index(name) for name in names if name in header), None) for names in COLOURS]
        taken = [place for place in places if place is not None]
        colours = None
        if len(taken) == len(COLOURS):
            rows = [(i, [row[place] for place in taken]) for i, row in cells[1:]]
            colours = _numbers(file, rows, [names[0] for names in COLOURS])
        return columns["t"], np.column_stack([columns[axis] for axis in "xyz"]), colours
    except FileError as error:
        raise FileError(str(error).replace(str(file), called)) from None


def _plain(file: Path, cells: list[tuple[int, list[str]]]) -> Table:
    """Return those of a table without a header."""
    names = HEADER.split(",")[: len(cells[0][1])]
    if len(names) not in (4, 7):
        raise FileError(f"{file} has {len(cells[0][1])} columns and no header: give {HEADER}")
    rows = _numbers(file, cells, names)
    return rows[:, 0] / 1e3, rows[:, 1:4], rows[:, 4:] if len(names) == 7 else None


def _numbers(file: Path, rows: list[tuple[int, list[str]]], names: Sequence[str]) -> FloatArray:
    return np.array([number_row(f"{file}, line {i}", ",".join(row), row, names) for i, row in rows])


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _together(path: FileName, names: Sequence[str], tables: Sequence[Table]) -> Frames:
    """Return the tables on one clock."""
    if not tables:
        raise FileError(f"{path} holds no CSV: give one for each vehicle, with {HEADER}")
    if len(tables) > MOST_VEHICLES:
        raise FileError(f"{path} has {len(tables)} vehicles: give {MOST_VEHICLES} at most")
    for name, (instants, _, colours) in zip(names, tables, strict=True):
        if colours is not None and not ((colours >= 0.0) & (colours <= 255.0)).all():
            raise FileError(f"{path}: {name} has a colour that is none: give numbers from 0 to 255")
        if len(instants) < 2 or not (np.diff(instants) > 0.0).all():
            raise FileError(f"{path}: {name} has {len(instants)} frames: give two or more, at instants that ascend")
    ends = np.array([(instants[0], instants[-1]) for instants, _, _ in tables])
    step = max(float(np.diff(instants).max()) for instants, _, _ in tables)
    for (first, what), column in zip(((0, "begins"), (1, "ends")), ends.T, strict=True):
        wrong = int(np.abs(column - column[0]).argmax())
        if abs(column[wrong] - column[0]) > step:
            text = f"{path}: {names[wrong]} {what} at {column[wrong]:g} s, and {names[0]} at {column[0]:g} s"
            raise FileError(f"{text}: give frames of all {('from', 'to')[first]} one instant")
    start = ends[:, 0].min()
    lit = tuple(table[2] for table in tables if table[2] is not None)
    kept = lit if len(lit) == len(tables) else None
    return Frames(tuple(names), tuple(table[0] - start for table in tables), tuple(t[1] for t in tables), kept)


def faded(t: FloatArray, colours: FloatArray) -> Lights:
    """Return lights that fade from frame to frame, without those frames that lie on lines between others."""
    kept = _corners(t, colours)
    return Lights(t[kept], colours[kept], np.arange(len(kept)) > 0)


def _corners(t: FloatArray, colours: FloatArray) -> FloatArray:
    """Return the frames between which colours are on straight lines, nearly."""
    kept, first = [0], 0
    while first < len(t) - 1:
        last = first + 1
        while last + 1 < len(t) and _straight(t[first : last + 2], colours[first : last + 2]):
            last += 1
        kept.append(last)
        first = last
    return np.array(kept)


def _straight(t: FloatArray, colours: FloatArray) -> bool:
    share = ((t - t[0]) / (t[-1] - t[0]))[:, None]
    return bool(np.abs(colours[0] + share * (colours[-1] - colours[0]) - colours).max() <= NEAR)


def write_csv_show(
    fleet: Fleet,
    path: FileName,
    lights: Sequence[Lights | None] | None = None,
    *,
    rate: float = RATE,
    clobber: bool = True,
) -> None:
    """Write a fleet as a zip of tables, in one atomic step: rows at a rate, and one at its end, of whole milliseconds.

    Between rows readers move vehicles on straight lines, of which nothing is proved.
    """
    instants, places, colours = sampled(fleet, lights, rate)
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for i in range(len(fleet)):
            rows = np.column_stack((1e3 * instants, places[i], colours[i]))
            lines = [f"{row[0]:.0f},{row[1]:.4f},{row[2]:.4f},{row[3]:.4f},%d,%d,%d" % tuple(row[4:]) for row in rows]
            text = "\n".join([HEADER, *lines]) + "\n"
            archive.writestr(zipfile.ZipInfo(f"Drone {i + 1}.csv", STAMP), text, zipfile.ZIP_DEFLATED)
    make_folder(Path(path).parent)
    write_file(path, content.getvalue(), clobber=clobber)


def sampled(
    fleet: Fleet, lights: Sequence[Lights | None] | None, rate: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return instants of whole milliseconds (m,) [s], positions (vehicles, m, 3) [m] and whole colours of that shape.

    Vehicles without lights are white.
    """
    count = int(np.ceil(round(fleet.duration * rate, 6)))
    instants = np.round(np.arange(count + 1) / rate, 3)
    instants[-1] = np.ceil(round(1e3 * fleet.duration, 6)) / 1e3
    places = fleet(np.minimum(instants, fleet.duration))
    lamps = lamps_of(fleet, lights)
    white = np.full((len(instants), 3), 255.0)
    colours = np.stack([white if lamp is None else np.round(lamp(instants)) for lamp in lamps])
    return instants, places, colours
