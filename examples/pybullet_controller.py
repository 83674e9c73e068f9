"""A plan flown in gym-pybullet-drones: a controller of its form that takes its targets from a trajectory.

With that package installed, ``python examples/pybullet_controller.py --fly`` flies a Crazyflie through the plan with
the package's own PID controller.  Without it the script writes the targets of every step, which is all that the
controller adds: position, velocity and yaw on the plan's clock.
"""

import sys
from pathlib import Path

import numpy as np

import minsnap

RATE = 48
"""Steps of the controller per second."""


class PlanControl:
    """A controller of gym-pybullet-drones (``computeControlFromState``) that follows a plan with another one's law."""

    def __init__(self, control, path):
        """Take a controller, such as DSLPIDControl, and a path."""
        self.control, self.path, self.t = control, path, 0.0

    def reset(self):
        """Begin the plan anew."""
        self.t = 0.0
        self.control.reset()

    def targets(self):
        """Return position, velocity, and roll, pitch and yaw of this instant; at rest behind the end."""
        t = min(self.t, self.path.duration)
        yaw = np.array([0.0, 0.0, float(self.path.yaw(t))])
        return {"target_pos": self.path(t), "target_vel": self.path(t, 1), "target_rpy": yaw}

    def computeControlFromState(self, control_timestep, state, **others):  # noqa: N802
        """Return the rotors' speeds, and the errors, for a state (20,) of the simulator."""
        found = self.control.computeControlFromState(control_timestep, state, **{**others, **self.targets()})
        self.t += control_timestep
        return found


def planned():
    """Return a small climbing rectangle, from rest to rest."""
    corners = [(0, 0, 0.5), (1, 0, 0.8), (1, 1, 1.1), (0, 1, 0.8), (0, 0, 0.5)]
    return minsnap.plan(corners, limits=minsnap.Limits(speed=1.0, acceleration=2.0, jerk=10.0), corridor=0.1)


def fly():
    """Fly the plan in the simulator, and print how far off it was."""
    from gym_pybullet_drones.control.DSLPIDControl import DSLPIDControl
    from gym_pybullet_drones.envs.CtrlAviary import CtrlAviary
    from gym_pybullet_drones.utils.enums import DroneModel

    path, model = planned(), DroneModel.CF2X
    env = CtrlAviary(drone_model=model, num_drones=1, initial_xyzs=path(0.0)[None], ctrl_freq=RATE, gui=True)
    control, action, errors = PlanControl(DSLPIDControl(drone_model=model), path), np.zeros((1, 4)), []
    for _ in range(int(RATE * path.duration)):
        obs, *_ = env.step(action)
        errors.append(np.linalg.norm(obs[0][:3] - control.targets()["target_pos"]))
        action[0], *_ = control.computeControlFromState(1.0 / RATE, obs[0])
    env.close()
    print(f"root mean square error {np.sqrt(np.mean(np.square(errors))):.3f} m over {path.duration:.2f} s")


def main(folder: Path) -> None:
    """Write the targets of every step."""
    folder.mkdir(parents=True, exist_ok=True)
    samples = planned().sample(float(RATE))
    np.savez(folder / "targets.npz", t=samples.t, position=samples.position, velocity=samples.velocity)
    print(f"{len(samples)} targets for {samples.duration:.2f} s at {RATE} Hz")


if __name__ == "__main__":
    if "--fly" in sys.argv:
        fly()
    else:
        main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
