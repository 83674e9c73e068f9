"""The command that writes a fleet into Crazyflies, and flies it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

from minsnap.cli.command import command
from minsnap.errors import FileError


@command()
def upload(
    folder: Annotated[Path, "FLEET", "Folder of a fleet, or a .skyc."],
    *,
    uri: Annotated[list[str] | None, "URI", "Of each vehicle, in order; else from crazyflies.yaml in FLEET."] = None,
    start: Annotated[bool, "Take off, fly it, and land."] = False,
    dry_run: Annotated[bool, "Say what would be written, without a link."] = False,
) -> int:
    """Write a fleet into the trajectory memories of Crazyflies, read it back, and with --start fly it.

    Nothing takes off before every memory was read back. Ctrl-C, or a vehicle that does not answer, lands all in place.
    """
    from minsnap.flight import swarm_upload
    from minsnap.flight.swarm_upload import COMPRESSED, planned_ways
    from minsnap.shows.fleet_files import read_fleet

    fleet = read_fleet(folder)
    uris = list(uri) if uri else _addresses(folder)
    if dry_run:
        for address, part in zip(uris, swarm_upload.uploads(fleet, uris), strict=True):
            form = "compressed" if part.kind == COMPRESSED else "polynomials"
            print(f"{address}: {part.pieces} pieces, {len(part.content)} bytes, {form}")
        print(f"start: {planned_ways(uris)}")
        return 0
    swarm_upload.upload(fleet, uris, start=start, told=lambda line: print(f"minsnap: {line}", file=sys.stderr))
    return 0


def _addresses(folder: Path) -> list[str]:
    """Return the addresses of the robots of a crazyswarm2 folder, in their order."""
    from minsnap.basics.storage.text import load_yaml, reading

    file = folder / "crazyflies.yaml"
    if not file.exists():
        raise FileError(f"{folder} has no crazyflies.yaml: give --uri for each vehicle")
    with reading(file, "a file of robots"):
        robots: dict[str, Any] = load_yaml(file)["robots"]
        return [str(robot["uri"]) for robot in robots.values() if robot.get("enabled", True)]
