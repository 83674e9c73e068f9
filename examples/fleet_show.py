"""A show of 16 vehicles: a grid, a ring and a letter, apart at every instant, as a Skybrush show and a page to sign.

The flights between formations are planned in the shortest time; what is certified is what was read back from the file.
On the command line, from a YAML file (docs/shows.rst):

    minsnap fleet show.yaml -o out/ --to skyc --returns --report report.html
"""

import sys
from pathlib import Path

import minsnap
from minsnap.plot import plot_fleet, plot_separation, save_figure
from minsnap.shows.acts import Act, Show
from minsnap.shows.failures import failures_of
from minsnap.shows.file_limits import certify_files
from minsnap.shows.formations import circle, grid, text
from minsnap.shows.returns import plan_returns
from minsnap.shows.safety_report import SafetyReport, write_report
from minsnap.shows.show import fly


def main(folder: Path) -> None:
    """Plan, write, read back, certify, draw."""
    folder.mkdir(parents=True, exist_ok=True)
    ring = Act("ring", circle(16, 6.0, 8.0), hold=2.0, colour=(255, 80, 0), at=14.0)  # when the music has it
    letter = Act("letter", text(16, "M", 12.0, 5.0), hold=3.0, colour=(0, 80, 255), fade=True)
    limits = minsnap.Limits(speed=4.0, acceleration=3.0)
    show = Show(grid(16, 2.0), (ring, letter), minsnap.Separation(1.0, downwash=2.0), limits)
    flown = fly(show, to="skyc")  # flights are slowed until the file keeps the limits
    for stage in flown.stages:
        print(f"{stage.name:10} leaves {stage.start:6.2f} s, arrives {stage.arrival:6.2f} s")
    written = minsnap.shows.write_fleet(
        flown.fleet, folder / "show.skyc", lights=flown.lights, sheet=flown.sheet(show, "Ring")
    )
    held = certify_files(minsnap.shows.read_fleet(folder / "show.skyc"), show.separation, limits, None, "skyc")
    planned = minsnap.certify_fleet(flown.fleet, show.separation, limits)
    print(f"{1e3 * written.distance:.1f} mm from the plan at most, {held.least_distance:.3f} m apart at all times")
    returns, failures = plan_returns(held.fleet, show.separation, limits, 2.0), failures_of(held.fleet, show.separation)
    print(f"a way home is proved from {len(returns.plans)} seconds; one may fail in {failures.seconds_apart} of them")
    report = SafetyReport(
        *("Ring and letter", held, planned, written.distance, flown.stages, written.files),
        returns=returns,
        failures=failures,
    )
    write_report(report, folder / "report.html")
    save_figure(plot_fleet(flown.fleet, "xz").figure, folder / "fleet_show.png")
    save_figure(plot_separation(held).figure, folder / "fleet_show_separation.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
