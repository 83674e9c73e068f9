"""A figure of eight as setpoints for an autopilot, in NED.

Twice round at no more than 2 m/s, nose along the velocity, 50 setpoints per second in north, east, down: yaw counts
clockwise from north there, and z is negative above the ground.
"""

import sys
from pathlib import Path

import minsnap
from minsnap.plot import save_figure


def main(folder: Path) -> None:
    """Write the file, read it back, draw it."""
    path = minsnap.lemniscate(length=5.0, width=2.5, speed=2.0, laps=2, altitude=2.0, yaw="velocity")
    folder.mkdir(parents=True, exist_ok=True)
    minsnap.write_csv(path, folder / "eight_ned.csv", rate=50.0, frame="ned")
    print((folder / "eight_ned.csv").read_text().splitlines()[0])
    flown = minsnap.read_csv(folder / "eight_ned.csv", frame="ned")
    figure = minsnap.plot.plot_overview(flown, title="figure of eight, read back from its file")
    save_figure(figure, folder / "eight_in_ned.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
