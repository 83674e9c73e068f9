"""The controller files for lsy_drone_racing and gym-pybullet-drones, called as these call them."""

import runpy
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
RACE = runpy.run_path(str(EXAMPLES / "drone_racing_controller.py"))
BULLET = runpy.run_path(str(EXAMPLES / "pybullet_controller.py"))


@pytest.fixture(scope="module")
def flown():
    """Return the controller, the observation, and all its commands until it says that it is over."""
    obs, config = RACE["track"]()
    controller, commands, over = RACE["PlannedRace"](obs, {}, config), [], False
    while not over:
        commands.append(controller.compute_control(obs))
        over = controller.step_callback(commands[-1], obs, 0.0, False, False, {})
    return controller, obs, np.array(commands)


def test_a_race_begins_at_the_drone_and_its_commands_are_one_motion(flown):
    controller, obs, commands = flown
    assert commands.shape[1:] == (13,) and np.allclose(commands[0, :3], obs["pos"], atol=1e-6)
    step = 1.0 / controller.rate
    moved = np.diff(commands[:, :3], axis=0) / step
    assert np.abs(moved - (commands[1:, 3:6] + commands[:-1, 3:6]) / 2.0).max() <= 60.0 * step**2
    assert np.linalg.norm(commands[:, 3:6], axis=1).max() <= 2.5 * (1.0 + 1e-6)


@pytest.mark.slow
def test_a_race_crosses_every_opening_along_its_axis(flown):
    controller, obs, _ = flown
    path = controller.path
    fine = np.linspace(0.0, path.duration, 200_001)
    at = path(fine)
    for center, quaternion in zip(obs["gates_pos"], obs["gates_quat"], strict=True):
        frame = RACE["Rotation"].from_quat(quaternion).as_matrix()
        local = (at - center) @ frame
        crossed = np.flatnonzero((local[:-1, 0] < 0.0) & (local[1:, 0] >= 0.0))
        assert any(np.abs(local[i, 1:]).max() <= 0.15 + 1e-3 for i in crossed)


def test_a_race_begins_anew_after_an_episode(flown):
    controller, obs, commands = flown
    controller.episode_callback()
    assert np.array_equal(controller.compute_control(obs), commands[0])


def test_a_race_goes_through_a_gate_where_it_is_seen(flown):
    obs, config = RACE["track"]()
    controller, over, places = RACE["PlannedRace"](obs, {}, config), False, []
    moved = obs | {
        "gates_pos": obs["gates_pos"] + [[0.0, 0.0, 0.0], [0.1, -0.12, 0.08], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    }
    while not over:
        seen = obs if len(places) < 30 else moved | {"target_gate": 0 if len(places) < 35 else 1}
        places.append(controller.compute_control(seen))
        over = controller.step_callback(places[-1], seen, 0.0, False, False, {})
    commands = np.array(places)
    assert controller.replans == 1
    step = np.diff(commands[:, :3], axis=0) * controller.rate - (commands[1:, 3:6] + commands[:-1, 3:6]) / 2.0
    assert np.abs(step).max() <= 60.0 / controller.rate**2
    fine = controller.path(np.linspace(0.0, controller.path.duration, 50_001))
    frame = RACE["Rotation"].from_quat(obs["gates_quat"][1]).as_matrix()
    local = (fine - moved["gates_pos"][1]) @ frame
    crossed = np.flatnonzero((local[:-1, 0] < 0.0) & (local[1:, 0] >= 0.0))
    assert any(np.abs(local[i, 1:]).max() <= RACE["OPENING"] / 2.0 + 1e-3 for i in crossed)


class Recorder:
    """A law of control that keeps what it is asked for."""

    def __init__(self):
        self.asked = []

    def reset(self):
        self.asked.clear()

    def computeControlFromState(self, control_timestep, state, **targets):  # noqa: N802
        self.asked.append(targets)
        return np.zeros(4), np.zeros(3), 0.0


def test_the_controller_asks_for_the_plan_on_its_clock_and_rests_behind_its_end():
    path, law = BULLET["planned"](), Recorder()
    control = BULLET["PlanControl"](law, path)
    steps = int(48 * path.duration) + 10
    for _ in range(steps):
        control.computeControlFromState(1.0 / 48.0, np.zeros(20), target_pos=np.ones(3))
    t = np.minimum(np.arange(steps) / 48.0, path.duration)
    assert np.allclose([a["target_pos"] for a in law.asked], path(t), atol=1e-9)
    assert np.allclose([a["target_vel"] for a in law.asked], path(t, 1), atol=1e-9)
    assert np.allclose(law.asked[-1]["target_pos"], path(path.duration)) and law.asked[-1]["target_rpy"][2] == 0.0
    control.reset()
    assert control.t == 0.0 and law.asked == []
