"""Derivatives of the optimal costs of many plans in their waypoints, durations and widths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import perm
from typing import NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray, ReadOnly
from minsnap.polynomials.bernstein import careful_differences, ends_to_highest, gram_root


class Slopes(NamedTuple):
    """How the optimal cost of one plan changes; not numbers where that is not known.

    Parameters
    ----------
    durations : ndarray, shape (legs,)
    waypoints : ndarray, shape (legs + 1, dim)
    widths : ndarray, shape (legs,)
        In half-widths of tubes; zero where there is none.
    """

    durations: FloatArray
    waypoints: FloatArray
    widths: FloatArray

    @classmethod
    def unknown(cls, legs: int, dim: int) -> Slopes:
        """Return those of a plan that has none."""
        return cls(np.full(legs, np.nan), np.full((legs + 1, dim), np.nan), np.full(legs, np.nan))


@dataclass(frozen=True, eq=False)
class Gradients(ReadOnly):
    """How the optimal cost of every plan changes with its durations, waypoints and half-widths; read-only arrays.

    Plan b has the entries ``offsets[b]`` to ``offsets[b + 1]`` of legs, and one waypoint more. Not a number where a
    plan failed.

    Parameters
    ----------
    durations : ndarray, shape (legs in all,)
        [m^2 / s^(2k)].
    waypoints : ndarray, shape (waypoints in all, dim)
        [m / s^(2k - 1)].
    corridor : ndarray, shape (legs in all,), or None
        In the half-width of each leg's tube, never positive [m / s^(2k - 1)]; zero where there is no tube, None without
        any corridor.
    offsets : ndarray of int, shape (plans + 1,)
    """

    durations: FloatArray
    waypoints: FloatArray
    corridor: FloatArray | None
    offsets: IntArray

    def __post_init__(self) -> None:
        for array in (self.durations, self.waypoints, self.corridor):
            if array is not None:
                array.setflags(write=False)

    @classmethod
    def of_legs(
        cls, durations: FloatArray, displacements: FloatArray, corridor: FloatArray | None, offsets: IntArray
    ) -> Gradients:
        """Return the gradients that follow from derivatives in the displacements of legs (legs in all, dim)."""
        counts = np.diff(offsets)
        first = np.arange(len(durations)) + np.repeat(np.arange(len(counts)), counts)
        waypoints = np.zeros((len(durations) + len(counts), displacements.shape[1]))
        waypoints[first] -= displacements
        waypoints[first + 1] += displacements
        return cls(durations, waypoints, corridor, offsets)

    @classmethod
    def of_plans(cls, each: Sequence[Slopes], dim: int, walls: bool, offsets: IntArray) -> Gradients:
        """Return the gradients of plans that were made one by one, with walls or without any."""
        durations, widths = (np.concatenate([np.zeros(0), *(one[k] for one in each)]) for k in (0, 2))
        waypoints = np.concatenate([np.zeros((0, dim)), *(one.waypoints for one in each)])
        return cls(durations, waypoints, widths if walls else None, offsets)


def free_slopes(points: FloatArray, durations: FloatArray) -> tuple[FloatArray, FloatArray]:
    r"""Return how the optimal cost of a curve without walls changes with durations and displacements of its pieces.

    By the envelope theorem the derivatives at the knots are held. With the scaled ends e of a piece, A their orders and
    :math:`c = T^{1-2k} |R e|^2`: :math:`\partial c / \partial T = T^{-2k} \, 2 (R e) \cdot R ((1 - 2k)/2 + A) e`.

    Parameters
    ----------
    points : ndarray, shape (pieces, 2k, dim)
        Control points of the optimum [m].
    durations : ndarray, shape (pieces,)
        [s].

    Returns
    -------
    ndarray, shape (pieces,), and ndarray, shape (pieces, dim)
    """
    degree = points.shape[1] - 1
    half = (degree + 1) // 2
    steps = [perm(degree, order) * careful_differences(points, order) for order in range(half)]
    ends = np.stack([*(step[:, 0] for step in steps), *(step[:, -1] for step in steps)], axis=1)
    ends[:, half] -= ends[:, 0]
    ends[:, 0] = 0.0
    root = gram_root(half - 1) @ ends_to_highest(degree)
    orders = np.tile(np.arange(half), 2)[:, None]
    value, slope = np.matmul(root, ends), np.matmul(root, ((1.0 - 2.0 * half) + 2.0 * orders) * ends)
    times = (value * slope).sum(axis=(1, 2)) * durations ** (-2.0 * half)
    forces = 2.0 * (value * root[:, half, None]).sum(axis=1) * durations[:, None] ** (1.0 - 2.0 * half)
    return np.asarray(times), np.asarray(forces)
