"""Layers of PyTorch: the optimal cost of plans, and the plans themselves, with exact gradients.

It needs the extra ``torch``. All is computed in double precision on the processor, whatever the tensors are, and comes
back in their type and on their device.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from minsnap.basics.arrays import ArrayLike
from minsnap.basics.messages import explains_names
from minsnap.errors import InputError
from minsnap.polynomials.bernstein import basis, derivative_basis_map

State = Mapping[str, ArrayLike]


@explains_names({"limits": "nothing: the cost is of given durations; see minsnap.torch.plan"})
def cost(
    waypoints: Any,
    durations: Any,
    corridor: Any = None,
    *,
    degree: int = 7,
    start: State | None = None,
    end: State | None = None,
    threads: int | None = None,
) -> Any:
    r"""Return the optimal costs of certified plans, with their gradients in waypoints, durations and half-widths.

    The derivatives are exact, by the envelope theorem, and come with the plans (``minsnap.plan_many``). They have no
    derivatives of their own: no second derivative can be taken.

    Parameters
    ----------
    waypoints : tensor or array_like, shape (…, n, dim)
        [m].
    durations : tensor or array_like, shape (…, n - 1)
        [s]. Leading dimensions are problems; those of all arguments are broadcast together.
    corridor : tensor or array_like, shape () or (…, n - 1), optional
        Half-width of a tube around each leg [m].
    degree : int
        2k - 1.
    start, end : mapping, optional
        Derivatives at the ends, such as ``{"velocity": (1, 0, 0)}``, of all problems; without gradients.
    threads : int, optional
        As ``plan_many`` takes it.

    Returns
    -------
    tensor, shape (…)
        Integrals of the squared norm of the k-th derivative [m^2 / s^(2k - 1)].

    Raises
    ------
    ImportError
        If PyTorch is not installed.
    MinsnapError
        The error of the first problem that has no plan, with its number.
    """
    from minsnap.torch import autograd_functions as functions

    places, times, widths = functions.broadcast(waypoints, durations, corridor)
    options = {"degree": degree, "start": functions.state_of(start), "end": functions.state_of(end), "threads": threads}
    shape = places.shape[:-2]
    widths = None if widths is None else widths.reshape(-1, widths.shape[-1])
    flat = places.reshape(-1, *places.shape[-2:]), times.reshape(-1, times.shape[-1]), widths
    return functions.OptimalCost.apply(*flat, options).reshape(shape)


@explains_names({})
def plan(
    waypoints: Any,
    durations: Any,
    *,
    degree: int = 7,
    start: State | None = None,
    end: State | None = None,
    threads: int | None = None,
) -> Any:
    """Return the control points of plans without walls, with their gradients in waypoints and durations.

    The derivatives are exact: one more solve with the matrix of each plan. They have no derivatives of their own.

    Parameters
    ----------
    waypoints, durations, degree, start, end, threads
        As ``cost`` takes them.

    Returns
    -------
    tensor, shape (…, n - 1, degree + 1, dim)
        Bernstein control points of each leg [m]; ``positions`` evaluates them.

    Raises
    ------
    ImportError, MinsnapError
        As ``cost``.
    """
    from minsnap.torch import autograd_functions as functions

    places, times, _ = functions.broadcast(waypoints, durations, None)
    options = {"degree": degree, "start": functions.state_of(start), "end": functions.state_of(end), "threads": threads}
    flat = places.reshape(-1, *places.shape[-2:]), times.reshape(-1, times.shape[-1])
    points = functions.OptimalPlan.apply(*flat, options)
    return points.reshape(*places.shape[:-2], *points.shape[1:])


def positions(points: Any, durations: Any, shares: ArrayLike, order: int = 0) -> Any:
    """Return positions, or derivatives of them, at shares of each leg; gradients pass through.

    Parameters
    ----------
    points : tensor, shape (…, legs, degree + 1, dim)
        Of ``plan`` [m].
    durations : tensor or array_like, shape (…, legs)
        [s].
    shares : array_like, shape (m,)
        Where on each leg, 0 at its start and 1 at its end.
    order : int
        0 position, 1 velocity, 2 acceleration, …

    Returns
    -------
    tensor, shape (…, legs, m, dim)

    Raises
    ------
    InputError
        If the order is above the degree.
    """
    degree = points.shape[-2] - 1
    if not 0 <= order <= degree:
        raise InputError(f"order is {order}: give 0 to {degree}, the degree of the polynomials")
    from minsnap.torch.autograd_functions import torch

    matrix = basis(degree - order, torch.as_tensor(shares, dtype=torch.float64).numpy())
    if order:
        matrix = matrix @ derivative_basis_map(degree, order)
    values = torch.as_tensor(matrix, dtype=points.dtype, device=points.device) @ points
    times = torch.as_tensor(durations, dtype=points.dtype, device=points.device)
    return values / times[..., None, None] ** order
