"""From one format to another, by the endings of the files or by name."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from minsnap.errors import FileError
from minsnap.trajectory.samples import Samples
from minsnap.trajectory.trajectory import Trajectory

Content = Trajectory | Samples


def _read_table(path: str | os.PathLike[str], frame: str) -> Content:
    """Read a Crazyflie's file, whose rows have 33 numbers, or setpoints."""
    from minsnap.files.formats.crazyflie import COLUMNS, read_crazyflie
    from minsnap.files.setpoint_csv import read_csv
    from minsnap.storage.text import read_text

    rows = read_text(path).splitlines()[1:2]
    if rows and len(rows[0].rstrip().rstrip(",").split(",")) == len(COLUMNS):
        return read_crazyflie(path)
    return read_csv(path, frame)


def _read_yaml(path: str | os.PathLike[str], frame: str) -> Content:
    from minsnap.files.formats.mav_yaml import read_mav_yaml

    return read_mav_yaml(path)


def _read_npz(path: str | os.PathLike[str], frame: str) -> Content:
    from minsnap.files.formats.npz import read_npz

    return read_npz(path)


def _read_parquet(path: str | os.PathLike[str], frame: str) -> Content:
    from minsnap.files.formats.dataframes import read_parquet

    return read_parquet(path)


def _read_log(path: str | os.PathLike[str], frame: str) -> Content:
    from minsnap.files.flights import load_flight

    return load_flight(path)


READERS: dict[str, Callable[[str | os.PathLike[str], str], Content]] = {
    ".csv": _read_table,
    ".yaml": _read_yaml,
    ".yml": _read_yaml,
    ".npz": _read_npz,
    ".parquet": _read_parquet,
    ".ulg": _read_log,
    ".bin": _read_log,
}
"""By ending."""

FORMATS = {
    "setpoints": ".csv",
    "crazyflie": "",
    "mav": ".yaml",
    "npz": ".npz",
    "parquet": ".parquet",
    "px4": ".npy",
    "multidof": ".json",
}
"""What can be written, and the ending that means it; a Crazyflie file has to be asked for."""


def read_any(path: str | os.PathLike[str], frame: str = "enu") -> Content:
    """Read any file that the library knows, by its ending.

    Parameters
    ----------
    path : str or path
        .csv (setpoints, or a Crazyflie's), .yaml, .npz, .parquet, .ulg or .bin.
    frame : str
        Of a setpoint CSV.

    Returns
    -------
    Trajectory or Samples
        In z-up world axes.

    Raises
    ------
    FileError
        If the ending is not known or the file is bad.
    """
    reader = READERS.get(Path(path).suffix.lower())
    if reader is None:
        raise FileError(f"{path} cannot be read by its ending: it must be one of {', '.join(READERS)}")
    return reader(path, frame)


def write_any(
    content: Content,
    path: str | os.PathLike[str],
    to: str | None = None,
    rate: float = 20.0,
    frame: str = "enu",
    *,
    clobber: bool = True,
) -> str:
    """Write a trajectory or samples in a format, and return its name.

    A trajectory is sampled where the format holds samples; samples are fitted with quintics, to a millimetre, where it
    holds polynomials.

    Parameters
    ----------
    content : Trajectory or Samples
        In z-up world axes.
    path : str or path
        Destination.
    to : str or None
        A name of :data:`FORMATS`; None goes by the ending.
    rate : float
        Samples per second of a trajectory [Hz].
    frame : str
        Of setpoints and tables; the other formats have their own.
    clobber : bool
        False: a destination that exists is an error.

    Raises
    ------
    FileError
        If there is no such format, or it cannot hold this.
    """
    name = to or _format_of(path)
    if name not in FORMATS:
        raise FileError(f"no format is called {name!r}: choose one of {', '.join(FORMATS)}")
    if name == "npz":
        from minsnap.files.formats.npz import write_npz

        write_npz(content, path, clobber=clobber)
    elif name in ("crazyflie", "mav"):
        _write_polynomials(content, path, name, clobber)
    else:
        _write_samples(content if isinstance(content, Samples) else content.sample(rate), path, name, frame, clobber)
    return name


def _format_of(path: str | os.PathLike[str]) -> str:
    ending = Path(path).suffix.lower().replace(".yml", ".yaml")
    for name, its in FORMATS.items():
        if its and its == ending:
            return name
    raise FileError(f"{path} cannot be written by its ending: name a format of {', '.join(FORMATS)}")


def _write_polynomials(content: Content, path: str | os.PathLike[str], name: str, clobber: bool) -> None:
    from minsnap.files.formats.crazyflie import MAX_PIECES, write_crazyflie
    from minsnap.files.formats.mav_yaml import write_mav_yaml
    from minsnap.files.formats.refit import refit

    if isinstance(content, Samples):
        content = refit(content, MAX_PIECES if name == "crazyflie" else None)
    (write_crazyflie if name == "crazyflie" else write_mav_yaml)(content, path, clobber=clobber)


def _write_samples(samples: Samples, path: str | os.PathLike[str], name: str, frame: str, clobber: bool) -> None:
    if name == "setpoints":
        from minsnap.files.setpoint_csv import write_csv

        write_csv(samples, path, frame=frame, clobber=clobber)
    elif name == "parquet":
        from minsnap.files.formats.dataframes import write_parquet

        write_parquet(samples, path, frame, clobber=clobber)
    elif name == "px4":
        from minsnap.files.formats.px4 import write_px4

        write_px4(samples, path, clobber=clobber)
    else:
        from minsnap.files.formats.multidof import write_multidof

        write_multidof(samples, path, clobber=clobber)
