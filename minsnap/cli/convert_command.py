"""The command that converts between file formats."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from minsnap.cli import options
from minsnap.cli.app import told_warnings
from minsnap.cli.command import command


@command()
def convert(
    source: Annotated[Path, "IN", ".csv, .yaml, .npz, .parquet, .ulg or .bin."],
    target: Annotated[Path, "OUT", ".csv, .yaml, .npz, .parquet, .npy or .json."],
    *,
    to: Annotated[str | None, "setpoints, crazyflie, mav, npz, parquet, px4 or multidof; else by the ending."] = None,
    rate: options.Rate = 20.0,
    frame: Annotated[str, "--to-frame", "--frame", "Axes of the setpoints or table written."] = "enu",
    from_frame: Annotated[str | None, "Axes of a setpoint CSV, if it does not say so itself."] = None,
    no_clobber: options.NoClobber = False,
) -> int:
    """Convert trajectories, setpoints and logs to another format, and to another frame.

    A trajectory is sampled at --rate where the format holds samples; samples are fitted with polynomials to 1 mm
    where it holds those.
    """
    from minsnap.basics.storage.atomic import refuse_source
    from minsnap.files.convert import check_frame, format_of, formats, read_any, written
    from minsnap.files.format import Writing

    check_frame(format_of(target, to), frame)
    refuse_source(target, source)
    with told_warnings():
        content = read_any(source, from_frame)
    name, lost = written(content, target, to, rate, Writing(frame, not no_clobber))
    print(f"{target}: {name}, frame {formats()[name].frame or frame}{f'; {lost}' if lost else ''}")
    return 0
