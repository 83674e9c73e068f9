"""One plan in the formats of six other programs, each in its own frame, and back.

A rectangle for a Crazyflie, for ETH's trajectory tools, for PX4 through ROS 2, for MAVROS, as a table, and for
PegasusSimulator, whose NonlinearController reads rows of numbers, the last instant first.
"""

import sys
from pathlib import Path

import numpy as np

import minsnap
from minsnap.files.convert import read_any, write_any


def main(folder: Path) -> None:
    """Write every format, read back those that can be, and say how far they are from the plan."""
    plan = minsnap.rectangle(width=6.0, length=4.0, corridor=0.3)
    folder.mkdir(parents=True, exist_ok=True)
    files = {"crazyflie": "crazyflie.csv", "mav": "segments.yaml", "npz": "plan.npz", "px4": "px4.npy"}
    files |= {"multidof": "multidof.json", "parquet": "setpoints.parquet", "setpoints": "setpoints.csv"}
    t = plan.sample(20.0).t[:-1]
    for name, file in files.items():
        write_any(plan, folder / file, name)
        size = (folder / file).stat().st_size
        if name in ("px4", "multidof"):
            print(f"{file}: {size} bytes")
            continue
        back = read_any(folder / file)
        positions = back.position[: len(t)] if isinstance(back, minsnap.Samples) else back(np.minimum(t, back.duration))
        print(f"{file}: {size} bytes, {np.abs(positions - plan(t)).max():.1g} m from the plan when read back")
    np.savetxt(folder / "pegasus.csv", pegasus(plan.sample(100.0))[::-1], delimiter=",")
    print(f"pegasus.csv: {(folder / 'pegasus.csv').stat().st_size} bytes")


def pegasus(samples):
    """Return t, position, velocity, acceleration, jerk, yaw and yaw rate, a row for each instant (m, 15)."""
    motion = (samples.position, samples.velocity, samples.acceleration, samples.jerk)
    return np.column_stack([samples.t, *motion, samples.yaw, samples.yaw_rate])


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
