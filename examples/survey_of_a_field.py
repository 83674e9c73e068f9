"""A field in six lines at 8 m/s, and a facade in five at 2 m/s with the nose at the wall.

Lines are exactly straight and at exactly their speed; turns are as quick as the limits allow, outside. On the command
line:

    minsnap survey area.csv --spacing 20 --height 40 --speed 8 -o survey.csv --plot survey.png
    minsnap survey wall.csv --facade 5 25 --spacing 4 --distance 6 --speed 2 -o facade.json
"""

import sys
from pathlib import Path

import numpy as np

import minsnap
from minsnap.plot import plot_survey, save_figure

FIELD = [(0, 0), (100, 20), (120, 90), (30, 120), (-20, 60)]


def main(folder: Path) -> None:
    """Plan both, check what is promised of them, and draw them."""
    folder.mkdir(parents=True, exist_ok=True)
    field = minsnap.plan_survey(FIELD, spacing=20, height=40, speed=8)
    facade = minsnap.plan_facade((0, 0), (30, 10), 5, 25, 4, distance=6, speed=2)
    for name, found in (("field", field), ("facade", facade)):
        assert minsnap.certify(found.trajectory, limits=found.limits).ok
        speeds = [np.linalg.norm(found.trajectory(np.linspace(*span, 101), 1), axis=1) for span in found.spans]
        off = max(np.abs(speed - found.speed).max() for speed in speeds)
        share = f"{found.on_lines:.0%} of {found.trajectory.duration:.1f} s"
        print(f"{name}: {len(found.lines)} lines, {share} on them, speed constant to {max(off, 1e-9):.0e} m/s")
    minsnap.write_csv(field.trajectory, folder / "survey.csv")
    save_figure(plot_survey(field), folder / "survey_of_a_field.png")
    save_figure(plot_survey(facade, view="xz"), folder / "survey_of_a_facade.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
