"""Fly 32 plans at once in crazyflow, a simulator of Crazyflies on JAX: each in a world of its own, by full states.

With that package installed (``pip install crazyflow``) the script flies them and tells how far off each was. Without
it, it writes the states that it would send.
"""

import importlib.util
import sys
from pathlib import Path

import numpy as np

import minsnap

WORLDS, RATE = 32, 50
"""How many plans; states a second."""


def planned():
    """Return plans of four legs above the ground, all at once, by their own least times."""
    draw = np.random.default_rng(4)
    points = np.cumsum(draw.uniform(-0.8, 0.8, size=(WORLDS, 5, 3)), axis=1)
    points[..., 2] = draw.uniform(0.6, 1.4, size=(WORLDS, 5))
    return minsnap.plan_many(points, limits=minsnap.Limits(speed=1.5, acceleration=3.0, jerk=20.0))


def states(many):
    """Return the states of every step, (steps, plans, 1, 16): position, velocity, acceleration, attitude, rates."""
    steps = np.arange(0.0, many.duration.max() + 1.0, 1.0 / RATE)
    t = np.minimum(steps, many.duration[:, None])
    flown = [many(t, order) * (steps <= many.duration[:, None])[..., None] ** min(order, 1) for order in range(3)]
    level = np.zeros((*t.shape, 7))
    level[..., 3] = 1.0  # no turn: x, y, z, w
    return np.concatenate([*flown, level], axis=-1).swapaxes(0, 1)[:, :, None].astype(np.float32)


def fly(sent):
    """Fly the states, and return the largest distance of each vehicle from its plan [m]."""
    from crazyflow import Sim

    sim = Sim(n_worlds=WORLDS, control="state")
    sim.reset()
    sim.data = sim.data.replace(states=sim.data.states.replace(pos=sim.data.states.pos.at[...].set(sent[0, ..., :3])))
    farthest = np.zeros(WORLDS)
    for state in sent:
        sim.state_control(state)
        sim.step(sim.freq // RATE)
        places = np.asarray(sim.data.states.pos[:, 0], dtype=float)
        farthest = np.maximum(farthest, np.linalg.norm(places - state[:, 0, :3], axis=1))
    return farthest


if __name__ == "__main__":
    plans = planned()
    told = states(plans)
    print(f"{len(plans)} plans of {plans.duration.min():.2f} to {plans.duration.max():.2f} s, {len(told)} states each")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(folder / "states.npz", states=told)
    if importlib.util.find_spec("crazyflow"):
        print(
            f"farthest from its plan: {fly(told).max():.3f} m, in the median of vehicles {np.median(fly(told)):.3f} m"
        )
