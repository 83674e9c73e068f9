"""A controller file for lsy_drone_racing: the shortest time through the gates that the observation names.

Copy it into ``lsy_drone_racing/control`` and name it in the race's configuration.  The controller plans once, from
where the drone is, through every opening (a gate is crossed along the x axis of its own frame), and then returns one
state per step: position, velocity, acceleration, yaw and three rates.  It does not look at the obstacles beside the
gates; give their free space as a corridor.  Without that package this script plans four gates of its own.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import minsnap
from minsnap.plot import plot_overview, save_figure

try:
    from lsy_drone_racing.control import Controller
except ImportError:
    Controller = object

LIMITS = minsnap.Limits(speed=2.5, acceleration=8.0, jerk=60.0)
OPENING = 0.3
"""Side of the square that is flown through [m]; the gates' openings are 0.4 m."""

PAST = 0.5
"""Length of the way on behind the last gate [m]."""


class PlannedRace(Controller):
    """Fly a certified plan through the gates, one setpoint per step."""

    def __init__(self, obs, info, config):
        """Plan from the position and the gates of the first observation."""
        self.step, self.rate = 0, config["env"]["freq"]
        axes = Rotation.from_quat(np.asarray(obs["gates_quat"])).apply([1.0, 0.0, 0.0])
        centers = np.asarray(obs["gates_pos"])
        gates = [minsnap.Gate(c, n, OPENING, crossing=1) for c, n in zip(centers, axes, strict=True)]
        end = centers[-1] + PAST * axes[-1]
        self.path = minsnap.plan([np.asarray(obs["pos"]), *gates, end], limits=LIMITS, pieces=2)

    def compute_control(self, obs, info=None):
        """Return the state of this step: position, velocity, acceleration, yaw, and no rates (13,)."""
        t = min(self.step / self.rate, self.path.duration)
        return np.concatenate([*(self.path(t, order) for order in range(3)), np.zeros(4)]).astype(np.float32)

    def step_callback(self, action, obs, reward, terminated, truncated, info):
        """Count the step; True when the plan is over."""
        self.step += 1
        return self.step / self.rate >= self.path.duration

    def episode_callback(self):
        """Begin anew."""
        self.step = 0


def track():
    """Return an observation and a configuration of four gates."""
    centers = np.array([(0.6, -0.8, 0.7), (1.2, 0.7, 1.2), (-0.2, 1.2, 0.7), (-0.9, 0.0, 1.2)])
    turns = Rotation.from_rotvec(np.radians(np.outer([20.0, 80.0, 180.0, -110.0], [0.0, 0.0, 1.0])))
    obs = {"pos": np.array((-0.9, -0.9, 0.1)), "gates_pos": centers, "gates_quat": turns.as_quat()}
    return obs, {"env": {"freq": 50}}


def main(folder: Path) -> None:
    """Fly the controller against its own commands, and draw its path."""
    obs, config = track()
    controller, over = PlannedRace(obs, {}, config), False
    while not over:
        action = controller.compute_control(obs)
        over = controller.step_callback(action, obs, 0.0, False, False, {})
    print(f"{controller.step} steps at {config['env']['freq']} Hz through {len(obs['gates_pos'])} gates")
    folder.mkdir(parents=True, exist_ok=True)
    title = f"four gates in {controller.path.duration:.2f} s"
    save_figure(plot_overview(controller.path, title=title), folder / "drone_racing.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
