r"""What the joint search minimises: the time, or the cost and a price of time.

The cost of a piece of duration T is the sum over the axes of the square of :math:`R = T^{(1-2k)/2} L e`, with its ends
:math:`e = w\,\rho(T)` (``joint_layout``) and the root L of the Gram matrix of the k-th derivative.
:math:`2\,\dot R^\top \dot R` in place of its second derivative is never negative (Gauss and Newton).

A total time is reached by a price and a stiffness, the augmented Lagrangian (M. J. D. Powell, 1969); the square of the
change of the total is at most the total times the sum of those of the durations over them, which no two pieces share.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.polynomials.bernstein import ends_to_highest, gram_root
from minsnap.time_allocation.cone_programme import ACCURACY
from minsnap.time_allocation.joint_layout import SLACKS, JointLayout, JointState


@dataclass(frozen=True)
class Penalties:
    """Price of the largest excess, as a share of the objective: of a limit in factors on time, of a wall in widths."""

    limit: float = 2.0
    wall: float = 1.0


@dataclass(frozen=True, eq=False)
class Terms:
    """A linear and a quadratic model of an objective around a state, as shares of its value.

    Parameters
    ----------
    linear : ndarray, shape (unknowns,)
        Zero for the slacks.
    hessian : ndarray, shape (pieces, width, width), or None
        In the unknowns of every piece.
    """

    linear: FloatArray
    hessian: FloatArray | None

    def change(self, unknowns: IntArray, step: FloatArray) -> float:
        """Relative change that the model foresees for a step, with the unknowns of every piece (pieces, width)."""
        found = float(self.linear @ step)
        if self.hessian is not None:
            local = np.append(step, 0.0)[unknowns]
            found += 0.5 * float(np.einsum("ix,ixy,iy->", local, self.hessian, local))
        return found


class Objective(Protocol):
    """What is minimised; always positive."""

    penalties: Penalties
    touches: bool
    """Whether the time is always as short as the limits allow."""
    gain: float
    """Relative change of the merit that counts as none."""
    accuracy: float
    """Gap and residuals, relative to the value, at which a step is solved well enough."""

    def value(self, state: JointState) -> float:
        """Value at a state."""
        ...

    def terms(self, state: JointState) -> Terms:
        """Model around a state."""
        ...


class TotalTime:
    """The sum of the durations.

    Parameters
    ----------
    layout : JointLayout
    """

    penalties, touches, gain, accuracy = Penalties(limit=1.2), True, 1e-4, 1e-3

    def __init__(self, layout: JointLayout) -> None:
        self.layout = layout

    def value(self, state: JointState) -> float:
        """Sum of the durations."""
        return state.total

    def terms(self, state: JointState) -> Terms:
        """Return the shares of the durations."""
        linear = np.zeros(self.layout.size + self.layout.pieces + SLACKS)
        linear[self.layout.size : -SLACKS] = state.durations / state.total
        return Terms(linear, None)


class PricedCost:
    """The cost, and a price of time.

    Parameters
    ----------
    layout : JointLayout
    price : float
        Of a unit of time, normalised as the cost.
    total : float
        Total time that is aimed at, normalised.
    stiffness : float
        Price of half the square of the distance to it.
    """

    touches, gain, accuracy = False, 3e-6, ACCURACY

    def __init__(self, layout: JointLayout, price: float, total: float = 0.0, stiffness: float = 0.0) -> None:
        self.layout, self.price, self.total, self.stiffness = layout, price, total, stiffness
        power = 2.0 * layout.half
        self.penalties = Penalties(power * Penalties.limit, power * Penalties.wall)
        self._root = gram_root(layout.half - 1) @ ends_to_highest(layout.degree)

    def value(self, state: JointState) -> float:
        """Sum of the cost and the prices of time."""
        return self._value(state, self._residuals(state))

    def _value(self, state: JointState, residuals: FloatArray) -> float:
        apart = state.total - self.total
        return float((residuals**2).sum()) + self.price * state.total + 0.5 * self.stiffness * (apart * apart)

    def _residuals(self, state: JointState) -> FloatArray:
        """R of every piece, (pieces, k, dim)."""
        share = state.durations ** (0.5 - self.layout.half)
        return np.asarray(share[:, None, None] * np.einsum("lj,ijd->ild", self._root, self.layout.ends(state)))

    def terms(self, state: JointState) -> Terms:
        """Return the gradient, and the second derivative of Gauss and Newton."""
        layout, residuals = self.layout, self._residuals(state)
        value, slopes = self._value(state, residuals), self._slopes(state, residuals)
        local = 2.0 / value * np.einsum("ildx,ild->ix", slopes, residuals)
        linear = np.zeros(layout.size + layout.pieces + SLACKS + 1)
        np.add.at(linear, layout.unknowns, local)
        price = self.price + self.stiffness * (state.total - self.total)
        linear[layout.size : layout.size + layout.pieces] += price / value * state.durations
        linear[-1 - SLACKS :] = 0.0
        hessian = 2.0 / value * np.einsum("ildx,ildy->ixy", slopes, slopes)
        hessian[:, -SLACKS - 2, -SLACKS - 2] += self.stiffness / value * state.total * state.durations
        return Terms(linear[:-1], hessian)

    def _slopes(self, state: JointState, residuals: FloatArray) -> FloatArray:
        """Differentiate R in the unknowns of every piece, (pieces, k, dim, width)."""
        layout, dim, ends = self.layout, self.layout.dim, 2 * self.layout.half
        share = state.durations ** (0.5 - layout.half)
        found = np.zeros((*residuals.shape, layout.unknowns.shape[1]))
        plain = self._root[None] * (share[:, None] * layout.scales(state))[:, None, :]
        for axis in range(dim):
            found[:, :, axis, axis : ends * dim : dim] = plain
        bends = layout.ends(state)[..., None] * layout.exponents[:, :, None, :]
        times = share[:, None, None, None] * np.einsum("lj,ijdq->ildq", self._root, bends)
        times[..., 1] += (0.5 - layout.half) * residuals
        found[..., ends * dim : -SLACKS] = times
        return found
