"""Learn to follow plans: an environment of Gymnasium whose episodes are certified plans, all made at once.

A vehicle is a point with drag that a gust pushes; an action is the acceleration to add to the plan's own. With
Gymnasium installed its checker looks the environment over; without it the same class runs by itself.
"""

import importlib.util
import sys
from pathlib import Path

import numpy as np

import minsnap

if importlib.util.find_spec("gymnasium"):
    import gymnasium

    Env, Box = gymnasium.Env, gymnasium.spaces.Box
else:
    Env, Box = object, dict

STEP, DRAG, MOST, AHEAD, FAR = 0.05, 0.3, 5.0, 4, 30.0
"""Seconds a step; 1/s; m/s² that an action can add; instants of the plan that are seen; the most that is seen."""


class FollowPlan(Env):
    """Keep to a plan of four legs, drawn anew in every episode."""

    metadata = {"render_modes": []}

    def __init__(self, plans=256, seed=0):
        """Make all plans of the episodes: a second for some thousands."""
        draw = np.random.default_rng(seed)
        points = np.cumsum(draw.normal(scale=1.5, size=(plans, 5, 3)), axis=1)
        self.plans = minsnap.plan_many(points, limits=minsnap.Limits(speed=3.0, acceleration=5.0), pieces=1)
        self.observation_space = Box(low=-FAR, high=FAR, shape=(6 + 3 * AHEAD,), dtype=np.float32)
        self.action_space = Box(low=-1.0, high=1.0, shape=(3,), dtype=np.float32)

    def reset(self, *, seed=None, options=None):
        """Draw a plan and a steady wind; return what is seen, and nothing more."""
        if Env is not object:
            super().reset(seed=seed)
            draw = self.np_random
        else:
            draw = np.random.default_rng(seed)
        self.path = self.plans[int(draw.integers(len(self.plans)))]
        self.wind, self.t = draw.normal(scale=1.0, size=3), 0.0
        self.place, self.speed = self.path(0.0), np.zeros(3)
        return self._seen(), {}

    def step(self, action):
        """Fly one step; the reward is the distance to the plan, negative."""
        push = self._at(self.t, 2) + MOST * np.clip(np.asarray(action, dtype=float), -1.0, 1.0)
        acceleration = push - DRAG * (self.speed - self.wind)
        self.place, self.speed = self.place + STEP * self.speed, self.speed + STEP * acceleration
        self.t += STEP
        error = float(np.linalg.norm(self.place - self._at(self.t)))
        return self._seen(), -error, error > 3.0, self.t >= self.path.duration, {"error": error}

    def _seen(self):
        """Return position and velocity relative to the plan, and where the plan goes."""
        ahead = [self._at(self.t + 0.1 * (k + 1)) - self._at(self.t) for k in range(AHEAD)]
        parts = [self.place - self._at(self.t), self.speed - self._at(self.t, 1), *ahead]
        return np.clip(np.concatenate(parts), -FAR, FAR).astype(np.float32)

    def _at(self, t, order=0):
        """Return the plan at an instant, at rest behind its end."""
        return self.path(min(t, self.path.duration), order) * (t <= self.path.duration or order == 0)


def feedback(seen):
    """Return the action of a proportional and derivative law."""
    return np.clip(-(8.0 * seen[:3] + 4.0 * seen[3:6]) / MOST, -1.0, 1.0).astype(np.float32)


def mean_error(env, policy, episodes=20):
    """Return the mean distance to the plans [m]."""
    errors = []
    for number in range(episodes):
        seen, over = env.reset(seed=number)[0], False
        while not over:
            seen, _, gone, ended, told = env.step(policy(seen))
            over = gone or ended
            errors.append(told["error"])
    return float(np.mean(errors))


if __name__ == "__main__":
    world = FollowPlan()
    if Env is not object:
        from gymnasium.utils.env_checker import check_env

        check_env(world, skip_render_check=True)
        print("Gymnasium's checker has no objection")
    found = {"nothing added": mean_error(world, lambda seen: np.zeros(3, dtype=np.float32))}
    found["feedback"] = mean_error(world, feedback)
    for name, error in found.items():
        print(f"{name:13} {error:.3f} m from the plan in the mean")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "errors.csv").write_text("".join(f"{name},{error:.4f}\n" for name, error in found.items()))
