"""Waypoints of several vehicles, a CSV each: planned apart on one clock, written, and streamed to all of them.

With files of one's own: ``python examples/fleet_from_csv.py out one.csv two.csv ...``.  Then, for PX4's simulators of
one machine (instance i listens at 14540 + i, as in aerial-autonomy-stack's simulation container):

    minsnap stream out/fleet --connect udpin:127.0.0.1:14540+ --origin current --trigger now --arm --land

Each autopilot counts its position from where it was switched on.  ``--origin current`` therefore moves each path to
its vehicle: let the waypoints begin above the places where the vehicles stand.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import minsnap
from minsnap.plot import plot_fleet, save_figure
from minsnap.shows import read_fleet, write_fleet

LIMITS = minsnap.Limits(speed=3.0, acceleration=3.0)
APART = minsnap.Separation(1.0, downwash=2.0)


def places(folder: Path) -> list[Path]:
    """Write a course for each of five vehicles, which stand on a diagonal and cross to the other side."""
    files = [folder / f"drone{number}.csv" for number in range(1, 6)]
    for number, file in enumerate(files):
        start, end = 2.0 * number, 8.0 - 2.0 * number
        rows = [(start, start, 2.0), (start, end + 6.0, 3.0 + 0.5 * number), (end, end + 12.0, 2.0)]
        file.write_text("x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, y, z in rows))
    return files


def main(folder: Path, given: Sequence[str]) -> None:
    """Read, plan, certify what was written, draw."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [Path(name) for name in given] or places(folder)
    courses = [minsnap.read_waypoints(file).points for file in files]
    fleet = minsnap.plan_fleet(courses, LIMITS, APART, names=[file.stem for file in files])
    write_fleet(fleet, folder / "fleet")
    held = minsnap.certify_fleet(read_fleet(folder / "fleet"), APART, LIMITS)
    print(f"{len(fleet)} vehicles in {fleet.duration:.2f} s, {held.least_distance:.3f} m apart at all times: {held.ok}")
    save_figure(plot_fleet(fleet).figure, folder / "fleet_from_csv.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"), sys.argv[2:])
