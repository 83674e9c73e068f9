"""A mission: take-off, two laps through gates and a ball, and landing, from one file.

A gate is given by its center, heading, width and height; ``straight`` makes the path perpendicular to it, and keeps it
inside the prism over its opening, so far before and behind it. The laps close themselves. On the command line:

    minsnap plan course.yaml -o mission.csv --plot mission.png
"""

import sys
from pathlib import Path

import minsnap
from minsnap.plot import save_figure

COURSE = """
name: yard
waypoints:
  - [0, 0, 1.5]
  - {center: [5, 0, 1.5], heading_deg: 0, width: 1.0, height: 0.8, straight: 0.4}
  - {x: 8, y: 3, z: 2, ball: 0.4}
  - {center: [4, 5, 2], heading_deg: 180, width: 1.2}
closed: true
laps: 2
takeoff: true
land: true
yaw: velocity
limits: {speed: 3, acceleration: 5, jerk: 40}
"""


def main(folder: Path) -> None:
    """Read the course, plan all of it, certify the whole, draw it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "course.yaml").write_text(COURSE)
    mission = minsnap.plan_mission(minsnap.read_course(folder / "course.yaml"))
    for part in mission.parts:
        print(f"{part.start:6.2f} s  {part.name}, {part.duration:.2f} s")
    certificate = minsnap.certify(mission.trajectory, limits=mission.limits)
    print("certified" if certificate.ok else "not certified")
    minsnap.write_csv(mission.trajectory, folder / "mission.csv")
    save_figure(minsnap.plot.plot_mission(mission), folder / "mission.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
