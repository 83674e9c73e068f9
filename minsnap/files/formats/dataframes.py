"""Samples as pandas tables and Parquet files, with the columns of a setpoint CSV (extra ``tables``)."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.reading import check_size, reading
from minsnap.errors import FileError
from minsnap.files.format import Format, Writing
from minsnap.files.formats.sample_checks import checked_samples
from minsnap.files.frames import get_frame, map_samples
from minsnap.files.setpoint_csv import GROUPS
from minsnap.trajectory.samples import Samples


def to_dataframe(samples: Samples, frame: str = "enu") -> Any:
    """Return a pandas.DataFrame; its ``attrs["frame"]`` names the frame, ``attrs["lead"]`` a lead.

    Parameters
    ----------
    samples : Samples
        Three coordinates, z-up world axes.
    frame : str
        Of the table.

    Raises
    ------
    ImportError
        If pandas is not installed.
    FileError
        If the samples have another number of coordinates.
    """
    pandas = _pandas()
    if samples.position.shape[1] != 3:
        dim = samples.position.shape[1]
        raise FileError(f"a table has x, y and z, and the samples have {dim} coordinates: write them with an altitude")
    mapped = map_samples(samples, "enu", frame)
    columns = {"t": mapped.t}
    for quantity, names in GROUPS.items():
        values = getattr(mapped, quantity)
        if values is not None:
            columns |= dict(zip(names, values.reshape(len(mapped), -1).T, strict=True))
    table = pandas.DataFrame(columns)
    table.attrs["frame"] = get_frame(frame).name
    if samples.lead:
        table.attrs["lead"] = samples.lead
    return table


def from_dataframe(table: Any) -> Samples:
    """Return the samples of a table, in the frame that its ``attrs`` name, else ENU.

    Raises
    ------
    FileError
        If a column is missing.
    """
    missing = [name for name in ("t", *GROUPS["position"]) if name not in table.columns]
    if missing:
        raise FileError(f"the table has no column {', '.join(missing)}")
    there = {quantity: names for quantity, names in GROUPS.items() if all(name in table.columns for name in names)}
    stacks = {quantity: table[list(names)].to_numpy(np.float64) for quantity, names in there.items()}
    squeezed = {quantity: values[:, 0] if quantity.startswith("yaw") else values for quantity, values in stacks.items()}
    samples = Samples(table["t"].to_numpy(np.float64), **squeezed, lead=float(table.attrs.get("lead", 0.0)))
    return map_samples(samples, table.attrs.get("frame", "enu"), "enu")


def write_parquet(samples: Samples, path: str | os.PathLike[str], frame: str = "enu", *, clobber: bool = True) -> None:
    """Write samples as a Parquet file that names its frame.

    Raises
    ------
    ImportError
        If pandas or pyarrow is not installed.
    """
    table = to_dataframe(samples, frame)
    with atomic_write(path, "wb", clobber=clobber) as file:
        table.to_parquet(file, engine="pyarrow", index=False)


def read_parquet(path: str | os.PathLike[str]) -> Samples:
    """Read such a file, or any Parquet file with its columns.

    Raises
    ------
    FileError
        If it cannot be read or lacks columns.
    ImportError
        If pandas or pyarrow is not installed.
    """
    pandas = _pandas()
    check_size(path)
    with reading(path, "a Parquet file"):
        return checked_samples(from_dataframe(pandas.read_parquet(path, engine="pyarrow")))


def _pandas() -> Any:
    try:
        import pandas
        import pyarrow  # noqa: F401 - asked for by name below
    except ImportError:
        raise ImportError("tables need pandas and pyarrow: pip install minsnap[tables]") from None
    return pandas


def _write(content: Samples, path: str | os.PathLike[str], writing: Writing) -> None:
    write_parquet(content, path, writing.frame, clobber=writing.clobber)


def _read(path: str | os.PathLike[str], frame: str | None) -> Samples:
    return read_parquet(path)


FORMAT = Format("parquet", "samples", (".parquet",), _write, (".parquet",), _read, frame="")
