"""The command that corrects setpoints by what the last flight of them missed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from minsnap.cli import options
from minsnap.cli.app import app
from minsnap.errors import InputError


@app.command()
def tune(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="Setpoint CSV of what is to be flown.")],
    flight: Annotated[Path, typer.Argument(metavar="FLIGHT", help="Log of a flight: .ulg, .bin, or of stream --log.")],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="FILE", help="Setpoint CSV of the next flight."),
    ],
    sent: Annotated[
        Path | None, typer.Option("--sent", metavar="FILE", help="What was sent in that flight; the plan unless given.")
    ] = None,
    gain: Annotated[float, typer.Option("--gain", help="Share of the error that is corrected.")] = 0.8,
    frame: options.ReadFrame = None,
) -> None:
    """Write setpoints whose flight misses the plan by less: what the last flight missed, filtered, is added earlier.

    Fly the plan, tune, fly what it wrote, and tune again with it as --sent: three flights took 84 to 94 % off the error
    in simulation.
    """
    from minsnap.files.flights import load_log
    from minsnap.files.setpoint_csv import read_csv, write_csv
    from minsnap.files.sidecar import frame_of
    from minsnap.flight.tracking.comparison import compare
    from minsnap.flight.tracking.learning import LearningSettings, learned
    from minsnap.flight.tracking.log_comparison import compare_in_log

    wanted, before, log = read_csv(plan, frame), read_csv(sent or plan, frame), load_log(flight)
    if log is None or log.reference is None or log.flight is None:
        raise InputError(f"{flight} is no log with setpoints and positions: give a .ulg, a .bin or a log of stream")
    last = compare_in_log(before, log.reference, log.flight)[-1]
    if last.place is not None and (last.place.end is not None or last.place.shift.any()):
        raise InputError(f"{last.remarks()[0]}: tune learns from a whole flight where the plan lies")
    missed, settings = compare(wanted, last.flight), LearningSettings(gain=gain)
    after = learned(wanted, before, last.flight, max(0.0, last.comparison.delay), settings)
    write_csv(after, output, frame=frame_of(plan, frame))
    print(f"this flight missed the plan by {missed.rmse_3d:.3f} m (rms), {missed.max_error:.3f} m at most")
    print(f"its delay was {last.comparison.delay:.2f} s; {output} is for the next one")
