"""Fly ``examples/drone_racing_controller.py`` in crazyflow, the simulator below lsy_drone_racing.

``pip install crazyflow``, then ``python benchmarks/race_in_crazyflow.py [RACES]``.  The gates are those of that
package's track; in each race they stand up to 15 cm (10 cm in height) elsewhere, which is seen from 0.7 m on.  Beside
it flies the same controller without replanning, and a cubic spline through the gates in 15 s, positions alone, which
is how the package's own state controller flies.
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import numpy as np
from crazyflow import Sim
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

RACE = runpy.run_path(str(Path(__file__).parents[1] / "examples" / "drone_racing_controller.py"))
CENTERS = np.array([(0.5, 0.25, 0.7), (1.05, 0.75, 1.2), (-1.0, -0.25, 0.7), (0.0, -0.75, 1.2)])
TURNS = Rotation.from_euler("z", np.array([[-0.78], [2.35], [3.14], [0.0]]))
START, RANGE, FREQUENCY, HALF = np.array((-1.5, 0.75, 0.05)), 0.7, 50, 0.2
SPLINE, BEFORE = 15.0, 0.3
"""Duration of the spline [s], and how far before and behind a gate it passes a waypoint [m]."""


class Held(RACE["PlannedRace"]):
    """The same without replanning."""

    def _follow_gates(self, obs):
        """Fly on."""


class Spline:
    """Positions along a cubic spline through the gates, in a given time."""

    def __init__(self, obs, info, config):
        """Lay the spline through the gates of the first observation."""
        axes = Rotation.from_quat(obs["gates_quat"]).apply([1.0, 0.0, 0.0])
        points = [c + side * BEFORE * a for c, a in zip(obs["gates_pos"], axes, strict=True) for side in (-1, 0, 1)]
        points = np.array([obs["pos"], obs["pos"] + [0.0, 0.0, 0.15], *points])
        self.spline, self.step = CubicSpline(np.linspace(0.0, SPLINE, len(points)), points), 0

    def compute_control(self, obs):
        """Return the position of this step."""
        return np.concatenate([self.spline(min(self.step / FREQUENCY, SPLINE)), np.zeros(10)])

    def step_callback(self, *_):
        """Count the step."""
        self.step += 1
        return self.step / FREQUENCY >= SPLINE


def race(sim, maker, seed, moved=1.0):
    """Fly one race, gates moved by a share of the most; return gates passed, time of the last [s], replans."""
    draw = np.random.default_rng(seed)
    true = CENTERS + moved * draw.uniform((-0.15, -0.15, -0.1), (0.15, 0.15, 0.1), CENTERS.shape)
    sim.reset()
    sim.data = sim.data.replace(states=sim.data.states.replace(pos=sim.data.states.pos.at[...].set(START)))
    place, target, when, over = START, 0, np.nan, False
    seen = np.zeros(len(true), dtype=bool)
    obs = {"pos": place, "gates_pos": CENTERS, "gates_quat": TURNS.as_quat(), "target_gate": 0}
    pilot, step = maker(obs, {}, {"env": {"freq": FREQUENCY}}), 0
    while not over and target < len(true):
        seen |= np.linalg.norm(true - place, axis=1) < RANGE
        obs |= {"pos": place, "gates_pos": np.where(seen[:, None], true, CENTERS), "target_gate": target}
        action = pilot.compute_control(obs)
        turn = Rotation.from_euler("z", action[9]).as_quat()
        sim.state_control(np.concatenate([action[:9], turn, action[10:]])[None, None].astype(np.float32))
        sim.step(sim.freq // FREQUENCY)
        before, place = place, np.asarray(sim.data.states.pos[0, 0], dtype=float)
        local = [TURNS[target].inv().apply(each - true[target]) for each in (before, place)]
        if local[0][0] < 0.0 <= local[1][0] and np.abs(local[1][1:]).max() <= HALF:
            target, when = target + 1, (step + 1) / FREQUENCY
        over, step = pilot.step_callback(action, obs, 0.0, False, False, {}), step + 1
    return target, when, getattr(pilot, "replans", 0)


def main(races: int) -> None:
    """Print how many races passed all gates, and their times."""
    sim = Sim(control="state")
    makers = {"replanned": RACE["PlannedRace"], "planned once": Held, "spline, 15 s": Spline}
    for name, maker in makers.items():
        print(f"{name:13} gates where they are said to be: {race(sim, maker, 0, 0.0)[:2]}")
        found = [race(sim, maker, seed) for seed in range(races)]
        times = [when for target, when, _ in found if target == len(CENTERS)]
        passed = np.mean([target for target, _, _ in found])
        lap = f"{np.median(times):.2f} s" if times else "none"
        replans = np.mean([count for _, _, count in found])
        print(f"{name:13} {len(times)} of {races} races, {passed:.1f} gates, median {lap}, {replans:.1f} replans")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
