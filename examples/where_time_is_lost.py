"""Where a flight loses its time: which limit binds on each leg, and what one more unit of each would gain.

A course of two gates is flown within speed, acceleration and jerk. The table says what to change first: here the
speed, and no gate.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

import minsnap
from minsnap import Gate, Limits
from minsnap.plot import plot_limits, save_figure

COURSE = [
    (0, 0, 1),
    Gate((5, 1, 1.5), (1, 0.3, 0), 0.8),
    (6, 5, 2),
    Gate((1, 6, 1.5), (-1, 0, 0), 0.6),
    (-2, 3, 1),
]
LIMITS = Limits(speed=4.0, acceleration=6.0, jerk=40.0)


def main(folder: Path) -> None:
    """Plan, print both tables, and draw the use of the limits."""
    path = minsnap.plan(COURSE, limits=LIMITS)
    for use in path.report.legs:
        binding = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in use.binding)
        print(f"leg {use.leg}: {use.duration:.2f} s, {use.mean_speed:.2f} m/s; at its limit: {binding}")
    for one in path.report.sensitivities:
        print(f"{one.label}: {one.seconds:+.3f} s per {one.unit}")
    figure = plot_limits(path, LIMITS)[0].figure
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(figure, folder / "where_time_is_lost.png")
    plt.close(figure)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
