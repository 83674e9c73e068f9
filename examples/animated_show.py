"""A show with an animation: letters, a wave of frames, a heart, and what the audience sees of them.

The frames are a CSV for each vehicle, as an animation program writes them. They are flown on few polynomials near them,
and what is certified is what was read back. On the command line:

    minsnap fleet show.yaml --preview acts.png
    minsnap fleet show.yaml -o out/ --to skyc --export show.vviz --export show.zip
"""

import sys
from pathlib import Path

import numpy as np

import minsnap
from minsnap.plot import save_figure
from minsnap.shows.file_limits import certify_files
from minsnap.shows.preview import draw_preview, pictures_of
from minsnap.shows.show import fly
from minsnap.shows.show_exports import export_show
from minsnap.shows.show_yaml import read_show

SHOW = """
vehicles: 24
separation: 1.2
downwash: 1.5
limits: {speed: 5, acceleration: 3, yaw_rate: 2}
home: {grid: {spacing: 2}}
take_off: 4
acts:
  - {name: letters, formation: {text: {words: FLY, size: 22, height: 6}}, hold: 2, colour: deepskyblue, yaw: -90}
  - {name: wave, animation: {file: wave, height: 6, tolerance: 0.03}}
  - name: heart
    formation: {text: {words: "♥", size: 20, height: 5}}
    hold: 5
    colour: {from: crimson, to: gold, along: z}
    fade: true
    lights: [{after: 1, colour: {from: crimson, to: gold, along: z, period: 4}, fade: false}]
"""


def write_frames(folder: Path) -> None:
    """Write eight seconds of a sheet of 6 by 4 that a wave runs through, 24 frames a second, in two colours."""
    folder.mkdir(parents=True, exist_ok=True)
    t = np.arange(0.0, 8.001, 1.0 / 24.0)
    for i in range(24):
        x, y = 3.0 * (i % 6) - 7.5, 3.0 * (i // 6) - 4.5
        z = 8.0 + 1.5 * np.sin(0.35 * x + 0.2 * y - 1.2 * t)
        level = (z - 6.5) / 3.0
        colours = np.round(255.0 * np.column_stack((0.1 + 0.0 * t, level, 1.0 - 0.6 * level))).astype(int)
        rows = [
            f"{1e3 * now:.0f},{x},{y},{up:.3f},{r},{g},{b}"
            for now, up, (r, g, b) in zip(t, z, colours.tolist(), strict=True)
        ]
        (folder / f"Drone {i + 1}.csv").write_text("\n".join(["Time_msec,x_m,y_m,z_m,Red,Green,Blue", *rows]) + "\n")


def main(folder: Path) -> None:
    """Write frames and show, draw its acts, plan, write, read back, certify, export."""
    write_frames(folder / "wave")
    (folder / "show.yaml").write_text(SHOW, encoding="utf-8")
    show = read_show(folder / "show.yaml")
    save_figure(draw_preview(pictures_of(show)), folder / "animated_show.png")
    flown = fly(show, to="skyc")
    sheet = flown.sheet(show, "Animated")
    minsnap.shows.write_fleet(flown.fleet, folder / "show.skyc", lights=flown.lights, sheet=sheet)
    fleet = minsnap.shows.read_fleet(folder / "show.skyc")
    held = certify_files(fleet, show.separation, show.limits, None, "skyc")
    for stage in flown.stages:
        print(f"{stage.name:12} {stage.start:6.2f} s to {stage.end:6.2f} s")
    print(f"{held.least_distance:.3f} m apart at every instant of {fleet.duration:.1f} s")
    for name in ("show.vviz", "show.zip"):
        export_show(fleet, folder / name, flown.lights, sheet=sheet)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
