"""Layers of PyTorch: equal to plans, and their gradients to differences. Where PyTorch is not, it is named."""

import importlib.util

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError

TORCH = importlib.util.find_spec("torch") is not None
needs_torch = pytest.mark.skipif(not TORCH, reason="needs PyTorch")


def tensors(problems=3, legs=4, dim=3):
    """Return waypoints and durations whose gradients are followed."""
    import torch

    draw = np.random.default_rng(0)
    points = np.cumsum(draw.normal(size=(problems, legs + 1, dim)), axis=1)
    times = draw.uniform(0.8, 1.5, (problems, legs))
    return torch.tensor(points, requires_grad=True), torch.tensor(times, requires_grad=True)


@pytest.mark.skipif(TORCH, reason="PyTorch is there")
@pytest.mark.parametrize("name", ["cost", "plan"])
def test_what_is_missing_is_named(name):
    with pytest.raises(ImportError, match=r"pip install 'minsnap\[torch\]'"):
        getattr(minsnap.torch, name)([(0, 0), (1, 0)], [1.0])


@needs_torch
@pytest.mark.parametrize("degree", [3, 7, 9])
def test_gradients_of_costs_and_plans_are_those_of_differences(degree):
    import torch

    ends = {"start": {"velocity": (1.0, 0.5, 0.0)}, "end": {"velocity": torch.tensor([0.0, 1.0, 0.0])}}
    for layer in (lambda *given: minsnap.torch.cost(*given, degree=degree, **ends).log(),
                  lambda *given: minsnap.torch.plan(*given, degree=degree, **ends)):  # fmt: skip
        assert torch.autograd.gradcheck(layer, tensors(), rtol=1e-4)


@needs_torch
def test_gradients_in_tubes_are_those_of_differences():
    """Multipliers have the accuracy of a root of the gap."""
    import torch

    points, times = tensors()
    widths = torch.full((4,), 0.3, dtype=torch.float64, requires_grad=True)
    layer = lambda *given: minsnap.torch.cost(*given).log()  # noqa: E731
    assert torch.autograd.gradcheck(layer, (points, times, widths), rtol=2e-3, atol=2e-3, eps=1e-5)


@needs_torch
def test_values_are_those_of_plans():
    points, times = tensors()
    many = minsnap.plan_many(points.detach().numpy(), times.detach().numpy())
    curves = minsnap.torch.plan(points, times)
    assert np.array_equal(minsnap.torch.cost(points, times).detach().numpy(), many.costs)
    assert np.array_equal(curves.detach().numpy(), many.stacked)
    speeds = minsnap.torch.positions(curves, times, [0.0, 0.5, 1.0], order=1).detach().numpy()
    first = times[0, 0].item()
    assert np.allclose(speeds[0, 0], many[0]([0.0, 0.5 * first, first], 1), atol=1e-12)


@needs_torch
def test_leading_dimensions_are_broadcast_and_types_kept():
    import torch

    points, times = tensors()
    shared = times[0].detach().float().requires_grad_()
    costs = minsnap.torch.cost(points.detach().float(), shared, 0.4)
    costs.sum().backward()
    assert costs.shape == (3,) and costs.dtype == torch.float32 and shared.grad.shape == (4,)
    assert minsnap.torch.plan(points[0], times[0]).shape == (4, 8, 3)
    assert minsnap.torch.cost(points[0], times[0]).shape == ()


@needs_torch
def test_what_does_not_fit_is_refused():
    points, times = tensors()
    with pytest.raises(InputError, match="4 legs, not 3"):
        minsnap.torch.cost(points, times[:, :3])
    with pytest.raises(InputError, match="do not fit"):
        minsnap.torch.cost(points, times[:2])
    with pytest.raises(InputError, match="give 0 to 7"):
        minsnap.torch.positions(minsnap.torch.plan(points, times), times, [0.5], order=8)
    with pytest.raises(InputError, match="problem 1: "):
        minsnap.torch.cost(points, times.detach().numpy() * np.array([[1.0], [-1.0], [1.0]]))
