"""Draw the pictures of the documentation again: run every example, and keep its figure with a small palette.

``make figures`` runs this; ``docs/images`` holds the result.
"""

import runpy
import sys
import tempfile
from pathlib import Path

import matplotlib
from PIL import Image

import minsnap
from minsnap.plot import animate_fleet, animate_path

ROOT = Path(__file__).parents[1]
COLOURS = 128
FILMS = ROOT / "docs" / "images"
SLOW = {"race": ["3"]}
"""More arguments of examples: the race with three polynomials a leg, as the page on racing says."""


def draw(script: Path, folder: Path) -> None:
    """Run an example in a folder of its own and copy its figure, if it has one."""
    matplotlib.use("agg")
    sys.argv = [str(script), str(folder), *SLOW.get(script.stem, [])]
    runpy.run_path(str(script), run_name="__main__")
    figure = folder / f"{script.stem}.png"
    if figure.exists():
        target = ROOT / "docs" / "images" / figure.name
        Image.open(figure).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(target, optimize=True)
        print(f"{target.name}: {target.stat().st_size // 1024} KB")


def race() -> None:
    """Film one loop of the race."""
    scene = runpy.run_path(str(ROOT / "examples" / "race.py"))
    course, limits = scene["COURSE"][:8], minsnap.Limits.of(scene["VEHICLE"], reserve=0.0, body_rate=15.0, yaw_rate=3.0)
    path = minsnap.plan(course, limits=limits, yaw="tilt", waypoint_tolerance=minsnap.Ball(0.3), pieces=3)
    drawn = {"waypoints": course, "tolerance": minsnap.Ball(0.3), "colour_by": "speed"}
    title = f"Split-S, one loop in {path.duration:.2f} s"
    animate_path(path, FILMS / "race.gif", rate=6.0, title=title, **drawn)


def show() -> None:
    """Film the show of 16 vehicles from the side."""
    with tempfile.TemporaryDirectory() as folder:
        sys.argv = ["fleet_show.py", folder]
        runpy.run_path(str(ROOT / "examples" / "fleet_show.py"), run_name="__main__")
        fleet = minsnap.shows.read_fleet(Path(folder) / "show.skyc")
    title = "16 vehicles, 1 m apart at every instant"
    animate_fleet(fleet, FILMS / "show.gif", view="xz", rate=6.0, speed=4.0, title=title)


def main(names: list[str]) -> None:
    """Draw the figures and films of the examples named, or of all."""
    for script in sorted((ROOT / "examples").glob("*.py")):
        if not names or script.stem in names:
            with tempfile.TemporaryDirectory() as folder:
                draw(script, Path(folder))
    for film in (race, show):
        if not names or film.__name__ in names:
            film()


if __name__ == "__main__":
    main(sys.argv[1:])
