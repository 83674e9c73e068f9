"""The command that turns one format into another."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import Annotated

import typer

from minsnap.cli import options
from minsnap.cli.app import app


@app.command()
def convert(
    source: Annotated[Path, typer.Argument(metavar="IN", help=".csv, .yaml, .npz, .parquet, .ulg or .bin.")],
    target: Annotated[Path, typer.Argument(metavar="OUT", help=".csv, .yaml, .npz, .parquet, .npy or .json.")],
    to: Annotated[
        str | None,
        typer.Option("--to", help="setpoints, crazyflie, mav, npz, parquet, px4 or multidof; else by the ending."),
    ] = None,
    rate: options.Rate = 20.0,
    frame: options.Frame = "enu",
    from_frame: Annotated[str, typer.Option("--from-frame", help="Axes of a setpoint CSV that is read.")] = "enu",
    no_clobber: options.NoClobber = False,
) -> int:
    """Convert trajectories, setpoints and logs; --frame is that of the setpoints or table written.

    A trajectory is sampled at --rate where the format holds samples; samples are fitted with polynomials to 1 mm
    where it holds those.
    """
    from minsnap.files.convert import read_any, write_any

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        content = read_any(source, from_frame)
    for warning in caught:  # a damaged log says what could be read of it
        print(f"minsnap: {warning.message}", file=sys.stderr)
    name = write_any(content, target, to, rate, frame, clobber=not no_clobber)
    print(f"{target}: {name}, frame {_frame_of(name, frame)}")
    return 0


def _frame_of(name: str, frame: str) -> str:
    """Return the frame that a format is written in."""
    return {"setpoints": frame, "parquet": frame, "px4": "ned"}.get(name, "enu")
