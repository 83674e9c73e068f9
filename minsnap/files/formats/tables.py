"""Tables of numbers: NumPy archives, exact and never a pickle, pandas' tables and Parquet files (extra ``tables``).

An archive holds a trajectory by its control points, or samples by their columns; a table has the columns of a setpoint
CSV.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.messages import shown
from minsnap.basics.optional_packages import optional
from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.table import read_archive
from minsnap.basics.storage.text import LARGEST, FileName, reading
from minsnap.errors import FileError, FrameError
from minsnap.files.convert import Format
from minsnap.files.formats.pieces import headed, polynomials_of, yaw_description
from minsnap.files.frames import get_frame, map_samples
from minsnap.files.setpoint_csv import COLUMNS, GROUPS, LEFT_OUT, columns_of, samples_of
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import ARRAYS, VECTORS, Samples
from minsnap.trajectory.trajectory import Trajectory


def checked_samples(samples: Samples) -> Samples:
    """Return samples unchanged.

    Raises
    ------
    FileError
        If an array has another shape than the instants and the position ask for, a number is not finite, or the
        instants do not increase.
    """
    count, dim = np.shape(samples.t), np.shape(samples.position)[1:]
    if len(count) != 1 or not count[0] or len(dim) != 1 or not dim[0]:
        raise FileError(f"samples have instants (m,) and positions (m, dim), not {count} and {samples.position.shape}")
    if not (np.isfinite(samples.lead) and samples.lead >= 0.0):
        raise FileError(f"the lead is {samples.lead} s: it must be 0 or more")
    for name, values in samples.arrays().items():
        wanted = (*count, *dim) if name in VECTORS else count
        if values.shape != wanted:
            raise FileError(f"{name} has the shape {values.shape}, and the instants ask for {wanted}")
        if not np.isfinite(values).all():
            raise FileError(f"{name} holds a number that is not finite")
    late = np.flatnonzero(np.diff(samples.t) <= 0.0)
    if late.size:
        raise FileError(f"instant {late[0] + 1} is not after the one before: instants must increase")
    return samples


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
    if samples.dim != 3:
        have = f"the samples have {samples.dim} coordinates"
        raise FileError(f"a table has x, y and z, and {have}: write them with an altitude")
    table = pandas.DataFrame(columns_of(map_samples(samples, "enu", frame)))
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
    columns = {name: table[name].to_numpy(np.float64) for name in COLUMNS if name in table.columns}
    samples = samples_of(columns, float(table.attrs.get("lead", 0.0)))
    return map_samples(samples, table.attrs.get("frame", "enu"), "enu")


def write_parquet(samples: Samples, path: FileName, frame: str = "enu", *, clobber: bool = True) -> None:
    """Write samples as a Parquet file that names its frame.

    Raises
    ------
    ImportError
        If pandas or pyarrow is not installed.
    """
    table = to_dataframe(samples, frame)
    with atomic_write(path, "wb", clobber=clobber) as file:
        table.to_parquet(file, engine="pyarrow", index=False)


def read_parquet(path: FileName, frame: str | None = None) -> Samples:
    """Read such a file, or any Parquet file with its columns; in a frame, by default ENU, unless it names its own.

    Raises
    ------
    FileError
        If it cannot be read, lacks columns, or names another frame than the one that is given.
    ImportError
        If pandas or pyarrow is not installed.
    """
    pandas = _pandas()
    with reading(path, "a Parquet file", LARGEST):
        with open(path, "rb") as file:  # pyarrow takes no name that is not UTF-8
            table = pandas.read_parquet(file, engine="pyarrow")
        wanted = None if frame is None else get_frame(frame).name
        if table.attrs.setdefault("frame", wanted or "enu") != wanted is not None:
            raise FrameError(f"{path} is in {table.attrs['frame']}, as it says, not in {wanted}: leave the frame out")
        return checked_samples(from_dataframe(table))


def _pandas() -> Any:
    _, pandas = (optional(name, "tables need pandas and pyarrow", "tables") for name in ("pyarrow", "pandas"))
    return pandas


_HEADING = ("angle", "control_points", "durations")
_CURVE = ("control_points", "durations", "pieces_per_leg", *(f"yaw_{name}" for name in _HEADING), "yaw_rule")
_KNOWN = (*ARRAYS, "lead", *_CURVE, "frame")


def write_npz(source: Path | Samples, path: FileName, *, clobber: bool = True) -> None:
    """Write a trajectory or samples, in z-up world axes (the archive's ``frame`` says ``enu``).

    A shape is written as polynomials within 1e-6 m of it.
    A constant or planned heading, one along the velocity, from the tilt or towards a point is kept exactly. Any other
    is approximated by polynomials within one milliradian, or refused.

    Raises
    ------
    YawError
        If a heading is no polynomial.
    """
    if isinstance(source, Samples):
        arrays = source.arrays() | ({"lead": np.array(source.lead)} if source.lead else {})
    else:
        arrays = _of_trajectory(polynomials_of(source)[0])
    with atomic_write(path, "wb", clobber=clobber) as file:
        np.savez_compressed(file, frame=np.array("enu"), **arrays)


def _of_trajectory(trajectory: Trajectory) -> dict[str, FloatArray]:
    arrays = {"control_points": trajectory.control_points, "durations": trajectory.durations}
    if trajectory.pieces > 1:
        arrays["pieces_per_leg"] = np.array(trajectory.pieces)
    heading = yaw_description(trajectory)
    if "rule" in heading:
        return arrays | {"yaw_rule": np.array(json.dumps(heading))}
    return arrays | {f"yaw_{name}": np.array(value) for name, value in heading.items()}


def read_npz(path: FileName) -> Trajectory | Samples:
    """Read what :func:`write_npz` wrote.

    Raises
    ------
    FileError
        If it is no such archive.
    """
    arrays = read_archive(path)
    unknown = sorted(set(arrays) - set(_KNOWN))
    if unknown:
        raise FileError(f"{path} holds {shown(unknown[0])}, which neither a trajectory nor samples have")
    with reading(path, "a trajectory or samples"):
        if "control_points" in arrays and "durations" in arrays:
            pieces = int(arrays.get("pieces_per_leg", np.array(1)))
            curve = Trajectory(arrays["control_points"], arrays["durations"], pieces=pieces)
            return headed(curve, _heading(arrays))
        if "t" in arrays and "position" in arrays:
            lead = float(arrays.get("lead", np.array(0.0)))
            return checked_samples(Samples(**{name: arrays[name] for name in ARRAYS if name in arrays}, lead=lead))
    raise FileError(f"{path} holds neither a trajectory (control_points, durations) nor samples (t, position)")


def _heading(arrays: dict[str, FloatArray]) -> dict[str, Any]:
    """Return the heading as :func:`yaw_description` does; archives without a frame may lack it."""
    if "yaw_rule" in arrays:
        return dict(json.loads(str(arrays["yaw_rule"])))
    if "frame" in arrays and not {"yaw_angle", "yaw_control_points"} & arrays.keys():
        raise FileError("its heading is missing")
    return {"angle": 0.0} | {name: arrays[f"yaw_{name}"] for name in _HEADING if f"yaw_{name}" in arrays}


_PARQUET = ((".parquet",), write_parquet, (".parquet",), read_parquet)
FORMATS = (
    Format("npz", "either", (".npz",), write_npz, (".npz",), read_npz, leaves_out=()),
    Format("parquet", "samples", *_PARQUET, frame="", reads_frame=True, leaves_out=LEFT_OUT),
)
