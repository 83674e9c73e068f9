"""Laps without a stop: the end state is the start state.

With ``closed=True`` velocity, acceleration and jerk at the end are those at the start, and the optimiser chooses them.
The lap can be flown again and again; from rest to rest the same corners cost more.
"""

import sys
from pathlib import Path

import minsnap
from minsnap.plot import save_figure

CORNERS = [(0, 0, 1), (6, 0, 1), (6, 4, 1), (0, 4, 1), (0, 0, 1)]


def main(folder: Path) -> None:
    """Plan both, compare, draw the lap."""
    given = {"durations": [3, 2, 3, 2], "corridor": 0.4}
    lap, once = minsnap.plan(CORNERS, closed=True, **given), minsnap.plan(CORNERS, **given)
    print(f"closed lap {lap.cost():.1f} m²/s⁷, rest to rest {once.cost():.1f} m²/s⁷")
    print(f"speed through the first corner {float((lap(0.0, order=1) ** 2).sum() ** 0.5):.2f} m/s")
    folder.mkdir(parents=True, exist_ok=True)
    save_figure(minsnap.plot.plot_overview(lap, corridor=0.4, title="a lap without a stop"), folder / "closed_laps.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
