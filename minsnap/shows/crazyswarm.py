"""What crazyswarm2 needs beside the trajectories of a fleet: its robots, and a script that flies them together."""

from __future__ import annotations

from pathlib import Path

from minsnap.basics.storage.atomic import atomic_write
from minsnap.errors import FileError
from minsnap.fleet.common_clock import Fleet

MOST = 255
"""Vehicles that an address can tell apart."""

SCRIPT = '''"""Fly the trajectories of this folder with crazyswarm2, started with its crazyflies.yaml."""

from pathlib import Path

import numpy as np
from crazyflie_py import Crazyswarm
from crazyflie_py.uav_trajectory import Trajectory

FOLDER = Path(__file__).parent
HEIGHTS = {heights}
DURATION = {duration}


def main():
    """Take off, go to the starts, fly all trajectories from one broadcast, and land."""
    swarm = Crazyswarm()
    clock, everyone = swarm.timeHelper, swarm.allcfs
    vehicles = [everyone.crazyfliesByName[f"cf{{number + 1}}"] for number in range(len(HEIGHTS))]
    for number, vehicle in enumerate(vehicles):
        trajectory = Trajectory()
        trajectory.loadcsv(str(FOLDER / f"traj{{number}}.csv"))
        vehicle.uploadTrajectory(0, 0, trajectory)
    everyone.takeoff(targetHeight=0.5, duration=2.5)
    clock.sleep(3.0)
    for vehicle, height in zip(vehicles, HEIGHTS):
        vehicle.goTo(np.array(vehicle.initialPosition) + np.array([0.0, 0.0, height]), 0.0, 2.5)
    clock.sleep(3.0)
    everyone.startTrajectory(0, relative=False)
    clock.sleep(DURATION + 1.0)
    everyone.land(targetHeight=0.04, duration=3.0)
    clock.sleep(4.0)


if __name__ == "__main__":
    main()
'''


def write_crazyswarm(fleet: Fleet, folder: Path, *, clobber: bool = True) -> tuple[Path, Path]:
    """Write ``crazyflies.yaml`` (fileversion 3) and ``fly.py`` for trajectories ``traj0.csv``, ``traj1.csv``, ...

    A vehicle stands below the start of its trajectory; the script climbs straight up to it.

    Raises
    ------
    FileError
        If there are more vehicles than addresses.
    """
    if len(fleet) > MOST:
        raise FileError(f"{len(fleet)} vehicles: one radio network of crazyswarm2 tells {MOST} apart")
    starts = [curve(0.0).tolist() for curve in fleet]
    robots = "".join(_robot(i, start) for i, start in enumerate(starts))
    with atomic_write(folder / "crazyflies.yaml", clobber=clobber) as file:
        file.write(f"fileversion: 3\n\nrobots:\n{robots}{TYPES}")
    heights = [start[2] for start in starts]
    with atomic_write(folder / "fly.py", clobber=clobber) as file:
        file.write(SCRIPT.format(heights=heights, duration=fleet.duration))
    return folder / "crazyflies.yaml", folder / "fly.py"


def _robot(number: int, start: list[float]) -> str:
    """Return the entry of a vehicle: 20 share a channel, and the last byte of the address is its number."""
    uri = f"radio://0/{80 + 10 * (number // 20 % 4)}/2M/E7E7E7E7{number + 1:02X}"
    place = ", ".join(repr(value) for value in (*start[:2], 0.0))
    return (
        f"  cf{number + 1}:\n    enabled: true\n    uri: {uri}\n    initial_position: [{place}]\n"
        "    type: cf21  # see robot_types\n"
    )


TYPES = """
robot_types:
  cf21:
    motion_capture:
      tracking: "librigidbodytracker"
      marker: default_single_marker
      dynamics: default
    big_quad: false
    battery:
      voltage_warning: 3.8
      voltage_critical: 3.7

all:
  firmware_logging:
    enabled: false
  firmware_params:
    commander:
      enHighLevel: 1
    stabilizer:
      estimator: 2
      controller: 2
  broadcasts:
    num_repeats: 15
    delay_between_repeats_ms: 1
"""
