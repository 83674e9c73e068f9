"""Learn durations: the optimal cost of many certified plans as a layer of PyTorch.

The derivatives are exact and come with the plans (``minsnap.torch.cost``). Without PyTorch the same descent runs in
NumPy, from the gradients of ``minsnap.plan_many``.
"""

import importlib.util
import sys
from pathlib import Path

import numpy as np

import minsnap

rng = np.random.default_rng(0)
waypoints = np.cumsum(rng.normal(size=(64, 5, 3)), axis=1)  # 64 problems of 4 legs, 6 s each, in tubes of 0.3 m
STEPS, RATE = 40, 0.05


def learn_with_torch():
    """Return the mean logarithm of the costs, step by step."""
    import torch

    scores = torch.zeros(64, 4, dtype=torch.float64, requires_grad=True)
    optimiser, history = torch.optim.Adam([scores], lr=RATE), []
    for _ in range(STEPS):
        optimiser.zero_grad()
        durations = 6.0 * torch.softmax(scores, dim=1)
        loss = minsnap.torch.cost(waypoints, durations, corridor=0.3).log().mean()
        loss.backward()
        optimiser.step()
        history.append(loss.item())
    return history


def learn_with_numpy():
    """Return the same, by steps of one size against the signs of the derivatives."""
    scores, history = np.zeros((64, 4)), []
    for _ in range(STEPS):
        shares = np.exp(scores) / np.exp(scores).sum(axis=1, keepdims=True)
        many = minsnap.plan_many(waypoints, 6.0 * shares, corridor=0.3, gradients=True)
        slopes = many.gradients.stacked.durations
        relative = slopes - (shares * slopes).sum(axis=1, keepdims=True)
        scores -= RATE * np.sign(relative)
        history.append(np.log(many.costs).mean())
    return history


history = learn_with_torch() if importlib.util.find_spec("torch") else learn_with_numpy()
print(f"the costs fall to {100.0 * np.exp(history[-1] - history[0]):.0f} % of those of equal durations")
folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
folder.mkdir(exist_ok=True)
np.savetxt(folder / "cost_layer.csv", history, header="mean logarithm of the costs", comments="")
