"""The command that checks a vehicle's parameters against a flight."""

from __future__ import annotations

import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from minsnap.cli import options
from minsnap.cli.command import command
from minsnap.cli.summary import as_json
from minsnap.errors import InputError, LinkError

if TYPE_CHECKING:
    from minsnap.flight.mavlink.parameters import Parameters
    from minsnap.flight.mavlink.preflight import Finding


@command()
def preflight(
    file: Annotated[Path | None, "[FILE]", "Setpoint CSV that is to be flown: its speeds count."] = None,
    *,
    connect: options.Connect,
    change: Annotated[list[str] | None, "--set", "NAME=VALUE", "Set a parameter first; may be repeated."] = None,
    frame: options.ReadFrame = None,
    autopilot: Annotated[str, "auto, px4 or ardupilot."] = "auto",
    events: Annotated[Path | None, "FILE", "all_events.json of the vehicle's build of PX4: texts of checks."] = None,
    wait: Annotated[float, "S", "For the vehicle's heartbeat."] = 30.0,
    json: options.Json = False,
) -> int:
    """Read the parameters and the state of a vehicle that matter to a flight, and say what does not fit it and why.

    Nothing is written unless ``--set`` names it. Exit status 1 if something does not fit.
    """
    from minsnap.files.setpoint_csv import frame_of, read_csv
    from minsnap.flight.mavlink.link import Clock, open_link
    from minsnap.flight.mavlink.parameters import Parameters
    from minsnap.flight.mavlink.preflight import check_vehicle
    from minsnap.flight.mavlink.setpoints import vehicle_frame
    from minsnap.flight.mavlink.vehicle_messages import TEXTS, get_autopilot, read_events

    samples = None if file is None else read_csv(file, frame)
    axes = "ned" if file is None else vehicle_frame(frame_of(file, frame))
    wanted, clock = _assignments(change or []), Clock()
    with closing(open_link(connect, clock, events=TEXTS if events is None else read_events(events))) as link:
        stack = get_autopilot(autopilot, link.wait_for_vehicle(wait))
        if stack.name == "generic":
            raise LinkError("the autopilot is neither PX4 nor ArduPilot: there are no rules for its parameters")
        _set(Parameters(link, clock), wanted)
        findings = check_vehicle(link, clock, stack, samples, axes)
    _say(findings, json)
    return 1 if any(finding.problem for finding in findings) else 0


def _assignments(texts: list[str]) -> dict[str, float]:
    """Parse NAME=VALUE, before anything is sent."""
    values = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            values[name.strip()] = float(value)
        except ValueError:
            raise InputError(f"--set is {text!r}: give NAME=VALUE with a number, such as COM_OBL_RC_ACT=4") from None
    return values


def _set(parameters: Parameters, wanted: dict[str, float]) -> None:
    for name, value in wanted.items():
        print(f"set {parameters.write(name, value)}", file=sys.stderr)


def _say(findings: list[Finding], json: bool) -> None:
    if json:
        print(as_json({finding.name: _as_dict(finding) for finding in findings}))
        return
    for finding in findings:
        verdict = "not answered" if not finding.known else "does not fit" if finding.problem else "fits"
        named = finding.name if finding.seen is None else f"{finding.name} ({finding.seen})"
        values = ", ".join(map(str, finding.parameters)) or named
        print(f"{verdict:13} {values}" + (f": {finding.problem}" if finding.problem else ""))


def _as_dict(finding: Finding) -> dict[str, object]:
    values = {parameter.name: parameter.value for parameter in finding.parameters}
    return {
        "parameters": values,
        **({} if finding.seen is None else {"seen": finding.seen}),
        "fits": finding.problem is None if finding.known else None,
        "problem": finding.problem,
    }
