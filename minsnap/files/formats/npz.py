"""NumPy archives: a trajectory by its control points, or samples by their columns; exact, and never a pickle."""

from __future__ import annotations

import json
import os

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.messages import shown
from minsnap.basics.storage.archive import read_archive
from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.reading import reading
from minsnap.errors import FileError
from minsnap.files.format import Format, Writing
from minsnap.files.formats.headings import headed, heading_rule, planned_yaw
from minsnap.files.formats.pieces import polynomials_of
from minsnap.files.formats.sample_checks import checked_samples
from minsnap.trajectory.heading import ConstantHeading, Heading
from minsnap.trajectory.path import Path
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.samples import ARRAYS, Samples
from minsnap.trajectory.trajectory import Trajectory

_TRAJECTORY = ("control_points", "durations", "yaw_angle", "yaw_control_points", "yaw_durations", "yaw_rule")
_KNOWN = (*ARRAYS, "lead", *_TRAJECTORY, "frame")


def write_npz(source: Path | Samples, path: str | os.PathLike[str], *, clobber: bool = True) -> None:
    """Write a trajectory or samples, in z-up world axes (the archive's ``frame`` says ``enu``).

    A shape is written as polynomials within 1e-6 m of it.
    A constant or planned heading, one along the velocity, from the tilt or towards a point is kept exactly. Any other
    is approximated by polynomials within one milliradian, or refused.

    Raises
    ------
    YawError
        If a heading is no polynomial.
    """
    arrays = _of_samples(source) if isinstance(source, Samples) else _of_trajectory(polynomials_of(source)[0])
    with atomic_write(path, "wb", clobber=clobber) as file:
        np.savez_compressed(file, frame=np.array("enu"), **arrays)  # type: ignore[arg-type]


def _of_samples(samples: Samples) -> dict[str, FloatArray]:
    arrays = {name: getattr(samples, name) for name in ARRAYS if getattr(samples, name) is not None}
    return arrays | ({"lead": np.array(samples.lead)} if samples.lead else {})


def _of_trajectory(trajectory: Trajectory) -> dict[str, FloatArray]:
    arrays = {"control_points": trajectory.control_points, "durations": trajectory.durations}
    heading = trajectory.yaw
    if heading.constant is not None:
        return arrays | {"yaw_angle": np.array(heading.constant)}
    rule = heading_rule(trajectory)
    if rule is not None:
        return arrays | {"yaw_rule": np.array(json.dumps(rule))}
    planned = planned_yaw(trajectory)
    return arrays | {"yaw_control_points": planned.control_points, "yaw_durations": planned.durations}


def read_npz(path: str | os.PathLike[str]) -> Trajectory | Samples:
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
            curve = Trajectory(arrays["control_points"], arrays["durations"])
            if "yaw_rule" in arrays:
                return headed(curve, json.loads(str(arrays["yaw_rule"])))
            return curve.with_yaw(_heading(arrays))
        if "t" in arrays and "position" in arrays:
            lead = float(arrays.get("lead", np.array(0.0)))
            return checked_samples(Samples(**{name: arrays[name] for name in ARRAYS if name in arrays}, lead=lead))
    raise FileError(f"{path} holds neither a trajectory (control_points, durations) nor samples (t, position)")


def _heading(arrays: dict[str, FloatArray]) -> Heading:
    if "yaw_control_points" in arrays:
        return PlannedHeading(Trajectory(arrays["yaw_control_points"], arrays["yaw_durations"]))
    if "frame" in arrays and "yaw_angle" not in arrays:
        raise FileError("its heading is missing")
    angle = float(arrays.get("yaw_angle", np.array(0.0)))
    if not np.isfinite(angle):
        raise FileError(f"the yaw is {angle}: it must be finite")
    return ConstantHeading(angle)


def _write(content: Trajectory | Samples, path: str | os.PathLike[str], writing: Writing) -> None:
    write_npz(content, path, clobber=writing.clobber)


def _read(path: str | os.PathLike[str], frame: str | None) -> Trajectory | Samples:
    return read_npz(path)


FORMAT = Format("npz", "either", (".npz",), _write, (".npz",), _read)
