"""A controller file for lsy_drone_racing: the shortest time through the gates that the observation names.

Copy it into ``lsy_drone_racing/control`` and name it in the race's configuration.  The controller plans from where the
drone is through every opening (a gate is crossed along the x axis of its own frame), and returns one state per step:
position, velocity, acceleration, yaw and the body rates that the path takes.  Where a gate is seen elsewhere than it
was planned for, it plans anew from the state of that step.  It does not look at the obstacles beside the gates; give
their free space as a corridor.  Without that package this script plans four gates of its own.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import minsnap
from minsnap.plot import plot_overview, save_figure
from minsnap.vehicle import Quadrotor, flatness_of

try:
    from lsy_drone_racing.control import Controller
except ImportError:
    Controller = object

LIMITS = minsnap.Limits(speed=2.0, acceleration=4.0, jerk=30.0)
OPENING = 0.1
"""Side of the square that is flown through [m]; the gates' openings are 0.4 m, and half of the rest is for tracking."""

BEHIND = 0.15
"""How far behind a gate it turns at the earliest, so that a vehicle that lags is through [m]."""

PAST = 0.5
"""Length of the way on behind the last gate [m]."""

SEEN = 0.01
"""How far a gate is from where it was planned, before the rest is planned anew [m]."""

BUDGET = None
"""How long a replan may take [s]; None where time stands still meanwhile, as in simulation; 1 / rate on a vehicle."""

VEHICLE = Quadrotor.crazyflie()
"""Whose body rates are fed forward; they do not depend on its mass."""


class PlannedRace(Controller):
    """Fly a certified plan through the gates, one setpoint per step, and plan anew where a gate has moved."""

    def __init__(self, obs, info, config):
        """Plan from the position and the gates of the first observation."""
        self.step, self.rate, self.replans = 0, config["env"]["freq"], 0
        self.start = obs
        self._plan(obs, [np.asarray(obs["pos"])], {}, None)

    def _plan(self, obs, origin, state, search):
        """Plan from a state through the gates that are still ahead, and note for which gates that was."""
        centers = np.array(obs["gates_pos"], dtype=float)
        axes = Rotation.from_quat(np.asarray(obs["gates_quat"])).apply([1.0, 0.0, 0.0])
        first = int(obs.get("target_gate", 0))
        ahead = zip(centers[first:], axes[first:], strict=True)
        gates = [minsnap.Gate(c + d * n, n, OPENING, crossing=1) for c, n in ahead for d in (0.0, BEHIND)]
        end = centers[-1] + PAST * axes[-1]
        self.path = minsnap.plan([*origin, *gates, end], limits=LIMITS, pieces=2, start=state, search=search)
        t = np.arange(int(self.path.duration * self.rate) + 2) / self.rate
        self.rates = flatness_of(VEHICLE, self.path, np.minimum(t, self.path.duration)).body_rates
        self.began, self.planned = self.step, centers

    def _follow_gates(self, obs):
        """Plan anew from the state of this step where a gate ahead is elsewhere; else the plan is flown on."""
        first, t = int(obs.get("target_gate", 0)), self._time()
        moved = np.abs(np.asarray(obs["gates_pos"]) - self.planned)[first:] if first >= 0 else np.zeros((0, 3))
        if not len(moved) or moved.max() <= SEEN or t >= self.path.duration:
            return
        names = ("velocity", "acceleration", "jerk")
        state = {name: self.path(t, order) for order, name in enumerate(names, 1)}
        try:
            self._plan(obs, [self.path(t)], state, minsnap.Search(time_limit=BUDGET))
            self.replans += 1
        except minsnap.MinsnapError:  # too late to reach it: the next observation is another chance
            pass

    def _time(self):
        return min((self.step - self.began) / self.rate, self.path.duration)

    def compute_control(self, obs, info=None):
        """Return the state of this step: position, velocity, acceleration, yaw, and body rates (13,)."""
        self._follow_gates(obs)
        t, rates = self._time(), self.rates[min(self.step - self.began, len(self.rates) - 1)]
        return np.concatenate([*(self.path(t, order) for order in range(3)), [0.0], rates]).astype(np.float32)

    def step_callback(self, action, obs, reward, terminated, truncated, info):
        """Count the step; True when the plan is over."""
        self.step += 1
        return (self.step - self.began) / self.rate >= self.path.duration

    def episode_callback(self):
        """Begin anew."""
        self.step = 0
        self._plan(self.start, [np.asarray(self.start["pos"])], {}, None)


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
