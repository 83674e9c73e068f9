"""A show in which two groups fly acts of their own at their own times, and what the audience sees at some instants.

A wheel turns on the left while a ring goes up and down on the right; then both are one heart. Every flight of a group
is planned beside what the other flies, and all is certified as it lies in the file. On the command line:

    minsnap fleet show.yaml -o out/ --to skyc --report report.html
"""

import sys
from pathlib import Path

import numpy as np

import minsnap
from minsnap.plot import save_figure
from minsnap.shows.file_limits import certify_files
from minsnap.shows.preview import Picture, draw_preview
from minsnap.shows.show import fly
from minsnap.shows.show_yaml import read_show

SHOW = """
vehicles: 24
separation: 1.2
downwash: 1.5
limits: {speed: 5, acceleration: 3}
home: {grid: {spacing: 2}}
take_off: 4
acts:
  - name: two
    groups:
      - name: left
        vehicles: 12
        acts:
          - name: wheel
            formation: {circle: {radius: 4, height: 8, upright: true}}
            shift: [-8, 0, 0]
            colour: orange
            hold: 1
            moves: [{turn: 180}]
          - name: arrow
            formation: {text: {words: ">", size: 11, height: 7}}
            shift: [-8, 0, 0]
            colour: gold
            at: 24
            hold: 3
      - name: right
        vehicles: 12
        acts:
          - {name: low, formation: {circle: {radius: 5, height: 7}}, shift: [8, 0, 0], colour: deepskyblue, hold: 2}
          - {name: high, formation: {circle: {radius: 4, height: 15}}, shift: [8, 0, 0], colour: white, hold: 1}
          - {name: low again, formation: {circle: {radius: 5, height: 9}}, shift: [8, 0, 0], colour: deepskyblue}
  - {name: heart, formation: {text: {words: "♥", size: 20, height: 5}}, hold: 3, colour: crimson, fade: true}
"""


def main(folder: Path) -> None:
    """Plan, draw four instants, write, read back, certify."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "show.yaml").write_text(SHOW, encoding="utf-8")
    show = read_show(folder / "show.yaml")
    flown = fly(show, to="skyc")
    stages = {stage.name: stage for stage in flown.stages}
    instants = [stages[name].arrival + 0.1 for name in ("wheel", "high", "arrow", "heart")]
    pictures = [
        Picture(f"{t:.1f} s", flown.fleet(t), np.stack([lamp(np.array(t)) for lamp in flown.lights])) for t in instants
    ]
    save_figure(draw_preview(pictures), folder / "group_show.png")
    sheet = flown.sheet(show, "Groups")
    minsnap.shows.write_fleet(flown.fleet, folder / "show.skyc", lights=flown.lights, sheet=sheet)
    fleet = minsnap.shows.read_fleet(folder / "show.skyc")
    held = certify_files(fleet, show.separation, show.limits, None, "skyc")
    for stage in flown.stages:
        print(f"{stage.group or 'all':6} {stage.name:10} {stage.start:6.2f} s to {stage.end:6.2f} s")
    print(f"{held.least_distance:.3f} m apart at every instant of {fleet.duration:.1f} s")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
