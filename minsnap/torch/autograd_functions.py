"""Plans as functions of PyTorch: tensors of problems one after the other, and what they hand back to tensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from minsnap.basics.arrays import FloatArray
from minsnap.basics.optional_packages import optional
from minsnap.errors import InputError
from minsnap.optimisation.plan_pullback import plan_pullback
from minsnap.planning.plan_many import plan_many
from minsnap.trajectory.trajectories import Trajectories

torch = optional("torch", "minsnap.torch needs PyTorch", "torch")
Function: Any = torch.autograd.Function


class OptimalCost(Function):  # type: ignore[misc]  # known where PyTorch is installed
    """Costs (plans,) of waypoints (plans, n, dim), durations (plans, n - 1) and half-widths (plans, n - 1) or None."""

    @staticmethod
    def forward(context: Any, waypoints: Any, durations: Any, widths: Any, options: dict[str, Any]) -> Any:
        """Plan, and keep the slopes where somebody asks for them."""
        needed = any(context.needs_input_grad[:3])
        corridor = None if widths is None else numbers_of(widths)
        many = _planned(plan_many(numbers_of(waypoints), numbers_of(durations), corridor, gradients=needed, **options))
        if needed and many.gradients is not None:
            slopes = many.gradients.stacked
            context.save_for_backward(like(waypoints, slopes.waypoints), like(durations, slopes.durations))
            context.widths = None if slopes.corridor is None else like(widths, slopes.corridor)
        return like(durations, many.costs)

    @staticmethod
    @torch.autograd.function.once_differentiable  # type: ignore[untyped-decorator]
    def backward(context: Any, upstream: Any) -> tuple[Any, ...]:
        """Weigh the slopes."""
        waypoints, durations = context.saved_tensors
        widths = None if context.widths is None else upstream[:, None] * context.widths
        return upstream[:, None, None] * waypoints, upstream[:, None] * durations, widths, None


class OptimalPlan(Function):  # type: ignore[misc]
    """Control points (plans, legs, 2k, dim) of waypoints (plans, n, dim) and durations (plans, n - 1)."""

    @staticmethod
    def forward(context: Any, waypoints: Any, durations: Any, options: dict[str, Any]) -> Any:
        """Plan."""
        many = _planned(plan_many(numbers_of(waypoints), numbers_of(durations), **options))
        context.curves = many.stacked, numbers_of(durations)
        context.kinds = waypoints.new_empty(0), durations.new_empty(0)
        return like(waypoints, many.stacked)

    @staticmethod
    @torch.autograd.function.once_differentiable  # type: ignore[untyped-decorator]
    def backward(context: Any, upstream: Any) -> tuple[Any, ...]:
        """Solve once more."""
        pulled = plan_pullback(context.curves[0], context.curves[1], numbers_of(upstream))
        waypoints, durations = context.kinds
        return like(waypoints, pulled.waypoints), like(durations, pulled.durations), None


def _planned(many: Trajectories) -> Trajectories:
    """Return plans that were all made, or raise the error of the first that was not."""
    for number, error in enumerate(many.errors):
        if error is not None:
            error.args = (f"problem {number}: {error}",)
            raise error
    return many


def numbers_of(tensor: Any) -> FloatArray:
    """Return the numbers of a tensor."""
    values: FloatArray = tensor.detach().to("cpu", torch.float64).contiguous().numpy()
    return values


def like(tensor: Any, values: FloatArray) -> Any:
    """Return numbers as a tensor of the same type and on the same device as another."""
    return torch.tensor(values, dtype=tensor.dtype, device=tensor.device)


def broadcast(waypoints: Any, durations: Any, corridor: Any) -> tuple[Any, Any, Any]:
    """Return tensors with the same leading dimensions; a half-width for every leg."""
    places, times = _tensor("waypoints", waypoints, 2), _tensor("durations", durations, 1)
    widths = None if corridor is None else _tensor("corridor", corridor, 0)
    if times.shape[-1] != places.shape[-2] - 1:
        raise InputError(f"{places.shape[-2]} waypoints have {places.shape[-2] - 1} legs, not {times.shape[-1]}")
    leading = [places.shape[:-2], times.shape[:-1], () if widths is None else widths.shape[:-1]]
    try:
        shape = torch.broadcast_shapes(*leading)
        widths = None if widths is None else widths.expand(*shape, times.shape[-1])
    except RuntimeError:
        shapes = ", ".join(str(tuple(one.shape)) for one in (places, times, widths) if one is not None)
        raise InputError(f"shapes {shapes} do not fit: give (…, n, dim), (…, n - 1) and () or (…, n - 1)") from None
    return places.expand(*shape, *places.shape[-2:]), times.expand(*shape, times.shape[-1]), widths


def _tensor(name: str, values: Any, least: int) -> Any:
    """Return a tensor of floats with so many dimensions at least."""
    try:
        tensor = values if torch.is_tensor(values) else torch.as_tensor(values, dtype=torch.float64)
    except (TypeError, ValueError, RuntimeError):
        raise InputError(f"{name} are no numbers in rows of equal length") from None
    if not tensor.is_floating_point() or tensor.ndim < least:
        raise InputError(f"{name} of shape {tuple(tensor.shape)} and {tensor.dtype}: give floats of {least} dimensions")
    return tensor


def state_of(state: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Return derivatives at an end as numbers."""
    if state is None:
        return None
    return {name: numbers_of(value) if torch.is_tensor(value) else value for name, value in state.items()}
