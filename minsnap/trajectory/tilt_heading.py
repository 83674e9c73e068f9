r"""A heading that follows from the tilt alone: the body never spins about its thrust axis.

With :math:`f = a + g e_z`, and drag where there is some (:mod:`minsnap.trajectory.medium`), :math:`z = f / \|f\|` is
the thrust axis. At the start the attitude is the least rotation
from upright,

.. math:: H(z) = \begin{pmatrix} 1 - a^2/(1 + c) & -ab/(1 + c) & a \\ -ab/(1 + c) & 1 - b^2/(1 + c) & b \\
          -a & -b & c \end{pmatrix}, \quad z = (a, b, c)

(the section of the Hopf fibration of M. Watterson and V. Kumar, "Control of quadrotors using the Hopf fibration on
SO(3)", ISRR 2017); from there on it turns, at every instant, by the least rotation that carries the thrust axis along:
the body rate about z is zero (R. L. Bishop, "There is more than one way to frame a curve", 1975). In
:math:`R = H(z) R_z(\varphi)` that is

.. math:: \dot\varphi = \frac{f_1 j_2 - f_2 j_1}{\|f\| (\|f\| + f_3)},

with j the derivative of f, integrated to rounding on cells by Legendre series. H is singular only upside down; there
the same formula is used after half a turn about x, so that the attitude is regular wherever there is thrust.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from minsnap.basics.arrays import BoolArray, FloatArray
from minsnap.basics.cached import cached_property
from minsnap.errors import YawError
from minsnap.trajectory.heading import Heading, Largest, RuledHeading, nearest_turn
from minsnap.trajectory.instants import parted_instants
from minsnap.trajectory.medium import AIRLESS, Medium
from minsnap.trajectory.path import Path

Frame = tuple[FloatArray, FloatArray, FloatArray]
"""Body axes x, y, z in the world frame at m instants, each of shape (3, m)."""


@dataclass(frozen=True)
class TransportSettings:
    """How finely a frame is carried along a path.

    Parameters
    ----------
    nodes : int
        Nodes of the Legendre series on a cell.
    tail_angle : float
        Part of the angle on a cell [rad] that the last coefficients of its series may make up.
    most_halvings : int
        How often a cell is halved at most; only where thrust all but vanishes is that not enough.
    chart_cosine : float
        Cosine of the tilt up to which a cell may reach on the far side of the horizon of its chart.
    cells : int
        Cells to begin with on a path that has no pieces.
    samples : int
        Instants a cell at which the turns of the yaw are counted.
    vertical_axis : float
        Squared length of the lateral axis seen from above below which its direction, the yaw, is held.
    """

    nodes: int = 16
    tail_angle: float = 1e-12
    most_halvings: int = 24
    chart_cosine: float = 0.8
    cells: int = 64
    samples: int = 16
    vertical_axis: float = 1e-12


CARRYING = TransportSettings()


FREE_FALL = 1e-6
"""Thrust below this part of gravity has no direction: it is taken as upright there."""


@dataclass(frozen=True, eq=False)
class Transport:
    """Cells on which the angle from the least rotation is a Legendre series.

    Parameters
    ----------
    path : Path
    medium : Medium
    start, width : ndarray, shape (m,)
        Of the cells [s].
    below : ndarray of bool, shape (m,)
        Whether the angle is that after half a turn about x.
    series : ndarray, shape (m, CARRYING.nodes)
        Coefficients of the angle's rate [rad/s].
    angle : ndarray, shape (m,)
        At the start of each cell [rad].
    """

    path: Path
    medium: Medium
    start: FloatArray
    width: FloatArray
    below: BoolArray
    series: FloatArray
    angle: FloatArray

    def frame(self, t: FloatArray, thrust: FloatArray | None = None) -> Frame:
        """Body axes at instants (m,), where the thrust (3, m) may be known."""
        cell = np.clip(np.searchsorted(self.start, t, side="right") - 1, 0, len(self.start) - 1)
        share = (t - self.start[cell]) / self.width[cell]
        angle = self.angle[cell] + self.width[cell] * _integral(self.series[cell], 2.0 * share - 1.0)
        thrust = lift_of(self.path, self.medium, t)[0] if thrust is None else thrust
        x, y, z = least_rotation(thrust, self.below[cell])
        cosine, sine = np.cos(angle), np.sin(angle)
        return cosine * x + sine * y, cosine * y - sine * x, z


def carried(path: Path, angle: float, medium: Medium) -> Transport:
    """Integrate along a path: halve cells until the series converge and no chart comes near to where it is singular.

    Parameters
    ----------
    path : Path
        Of two or three coordinates.
    angle : float
        About the thrust axis at the start, from the least rotation [rad].
    medium : Medium
    """
    grid = parted_instants(path, 1, CARRYING.cells)
    start, width, done = grid[:-1], np.diff(grid), []
    for depth in range(CARRYING.most_halvings + 1):
        below, series, rough = _series(path, medium, start, width)
        rough &= depth < CARRYING.most_halvings
        done.append((start[~rough], width[~rough], below[~rough], series[~rough]))
        if not rough.any():
            break
        width = np.repeat(width[rough] / 2.0, 2)
        start = np.repeat(start[rough], 2) + width * np.tile([0.0, 1.0], int(rough.sum()))
    start, width, below, series = map(np.concatenate, zip(*done, strict=True))
    order = np.argsort(start, kind="stable")
    start, width, below, series = start[order], width[order], below[order], series[order]
    gain, swap = width * _integral(series, np.ones(len(start))), np.zeros(len(start))
    index = np.flatnonzero(np.diff(below, prepend=False))  # where the chart changes, by the turn between both
    if len(index):
        swap[index] = _between_charts(lift_of(path, medium, start[index])[0], below[index])
    turned = np.cumsum(swap) + np.concatenate(([0.0], np.cumsum(gain)[:-1]))
    return Transport(path, medium, start, width, below, series, angle + turned)


def _series(
    path: Path, medium: Medium, start: FloatArray, width: FloatArray
) -> tuple[BoolArray, FloatArray, BoolArray]:
    """Chart and series of each cell, and whether it must be halved."""
    nodes, coefficients = _nodes()
    t = start[:, None] + width[:, None] * (nodes + 1.0) / 2.0
    thrust, jerk = (part.reshape(3, *t.shape) for part in lift_of(path, medium, t.reshape(-1), 1))
    size = np.linalg.norm(thrust, axis=0)
    below = thrust[2, :, CARRYING.nodes // 2] < 0.0
    up = np.where(below[:, None], -thrust[2], thrust[2])
    area = np.where(below[:, None], -1.0, 1.0) * (thrust[0] * jerk[1] - thrust[1] * jerk[0])
    series = area / (size * np.maximum(size + up, FREE_FALL * size)) @ coefficients.T
    tail = np.abs(series[:, -3:]).max(axis=1) * width
    return below, series, (tail > CARRYING.tail_angle) | ((up / size).min(axis=1) < -CARRYING.chart_cosine)


def lift_of(path: Path, medium: Medium, t: FloatArray, derivatives: int = 0) -> list[FloatArray]:
    """Vector along the thrust axis and its derivatives, each (3, m) [m/s^2], ...; upright where there is no thrust."""
    motion = np.zeros((2 + derivatives, len(t), 3))
    for order in range(1 if medium.drags else 2, 3 + derivatives):  # without drag the velocity does not matter
        motion[order - 1, :, : path.dim] = path(t, order)
    forces = [part.T.copy() for part in medium.lift(*motion)]
    forces[0][:, np.linalg.norm(forces[0], axis=0) <= FREE_FALL * medium.gravity] = [[0.0], [0.0], [medium.gravity]]
    return forces


@cache
def _nodes() -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre nodes, and the matrix from values there to Legendre coefficients."""
    nodes, weights = np.polynomial.legendre.leggauss(CARRYING.nodes)
    values = np.polynomial.legendre.legvander(nodes, CARRYING.nodes - 1)
    return nodes, (values * weights[:, None]).T * (np.arange(CARRYING.nodes)[:, None] + 0.5)


def _integral(series: FloatArray, x: FloatArray) -> FloatArray:
    """Half the integrals from -1 to x (m,) of Legendre series (m, CARRYING.nodes)."""
    values = np.polynomial.legendre.legvander(x, CARRYING.nodes)
    order = np.arange(1, CARRYING.nodes)
    parts = np.empty((len(x), CARRYING.nodes))
    parts[:, 0] = x + 1.0
    parts[:, 1:] = (values[:, 2:] - values[:, :-2]) / (2.0 * order + 1.0)
    return np.asarray(0.5 * (series * parts).sum(axis=1))


def least_rotation(thrust: FloatArray, below: BoolArray) -> Frame:
    """Columns of H, or of H after half a turn about x, for thrusts (3, m)."""
    turn = np.where(below, -1.0, 1.0)
    a, b, c = thrust / np.linalg.norm(thrust, axis=0)
    b, c = turn * b, turn * c
    share = 1.0 / np.maximum(1.0 + c, np.finfo(np.float64).tiny)
    x = np.stack([1.0 - a * a * share, -a * b * share * turn, -a * turn])
    y = np.stack([-a * b * share, (1.0 - b * b * share) * turn, -b * turn])
    return x, y, np.stack([a, turn * b, turn * c])


def _between_charts(thrust: FloatArray, below: BoolArray) -> FloatArray:
    """Angle to be added on entering a chart from the other one, (m,)."""
    before, here = least_rotation(thrust, ~below)[0], least_rotation(thrust, below)
    return np.asarray(np.arctan2((before * here[1]).sum(axis=0), (before * here[0]).sum(axis=0)))


class TiltHeading(RuledHeading):
    r"""Yaw of a vehicle that turns only as its thrust axis tilts, and never spins about it.

    Called, it gives the yaw angle :math:`\psi` of that attitude, :math:`y_B \perp (\cos\psi, \sin\psi, 0)`, and its
    derivatives; ``axes`` and ``forward`` give the attitude itself, which is
    regular wherever there is thrust. The yaw angle is not: it has no value where the lateral axis is vertical, beyond
    a tilt of 90 degrees; its rate is zero there.

    The attitude depends on the whole path up to an instant: after a closed lap it has turned by the solid angle that
    the thrust axis went round.

    Parameters
    ----------
    path : Path
        Of two or three coordinates, z up.
    angle : float
        Turn about the thrust axis at the start, from the least rotation from upright [rad].
    medium : Medium
        Gravity, and drag across the thrust axis; drag along it does not matter.

    Raises
    ------
    YawError
        If the path has one coordinate, or more than three.
    """

    what, highest = "a heading from the tilt", 2
    medium: Medium

    def __init__(self, path: Path, angle: float = 0.0, medium: Medium = AIRLESS) -> None:
        if path.dim not in (2, 3):
            raise YawError(f"a heading from the tilt needs two or three coordinates, this path has {path.dim}")
        self.path, self.angle, self.medium = path, float(angle), Medium(*medium.values[:3])

    def _at(self, t: FloatArray, order: int) -> FloatArray:
        if order:
            return self._yaw_derivative(t, order)
        return nearest_turn(_yaw_of(self.axes(t)[1]), np.interp(t, *self._unwrapped))

    def axes(self, t: FloatArray) -> Frame:
        """Body axes x, y, z in the world frame at instants (m,), each of shape (3, m)."""
        return self._transport.frame(t)

    def forward(self, t: FloatArray) -> Frame:
        """Forward axis x and its two derivatives at instants (m,), each of shape (3, m)."""
        (x, y, z), (roll, pitch), (_, pitch_rate) = self._turning(t)
        return x, -pitch * z, -pitch_rate * z - pitch * (pitch * x - roll * y)

    def on(self, curve: Path, start: float = 0.0, rate: float = 1.0) -> TiltHeading:
        """Return the heading of another path that begins as this one is turned at an instant [s]."""
        if start == 0.0:
            return TiltHeading(curve, self.angle, self.medium)
        at, upright = np.array([start]), np.zeros(1, dtype=np.bool_)
        level = least_rotation(lift_of(self.path, self.medium, at)[0], upright)
        x = self.axes(at)[0]
        angle = np.arctan2((x * level[1]).sum(), (x * level[0]).sum())
        return TiltHeading(curve, float(angle), self.medium)

    def before(self, other: Heading, curve: Path, switch: float) -> Heading:
        """Return one heading from the tilt where both are one."""
        return super().before(other, curve, switch) if other.medium is None else self.on(curve)

    def largest_rate(self, start: float, end: float) -> Largest:
        """Return the spin about the thrust axis, which is limited in place of the yaw: there is none."""
        return 0.0, start

    def _rule(self) -> dict[str, Any]:
        gravity, *drag = self.medium.values[:3]
        return {"rule": "tilt", "angle_at_start": self.angle, "gravity": gravity, "drag": drag}

    @cached_property
    def _transport(self) -> Transport:
        return carried(self.path, self.angle, self.medium)

    def _turning(self, t: FloatArray) -> tuple[Frame, FloatArray, FloatArray]:
        """Axes, rates (roll, pitch) and their derivatives, (2, m) each, from x . f = y . f = 0 differentiated."""
        thrust, jerk, snap = lift_of(self.path, self.medium, t, 2)
        x, y, z = self._transport.frame(t, thrust)
        size, across = np.linalg.norm(thrust, axis=0), np.stack([-y, x])
        rates = (across * jerk).sum(axis=1) / size
        pull = (z * jerk).sum(axis=0) / size
        return (x, y, z), rates, (across * snap).sum(axis=1) / size - 2.0 * pull * rates

    def _yaw_derivative(self, t: FloatArray, order: int) -> FloatArray:
        """First or second derivative of the angle of the lateral axis, seen from above; y' = roll z without spin."""
        (x, y, z), (roll, pitch), (roll_rate, _) = self._turning(t)
        first = roll * z
        square = y[0] ** 2 + y[1] ** 2
        square = np.where(square > CARRYING.vertical_axis, square, np.inf)
        rate = (y[0] * first[1] - y[1] * first[0]) / square
        if order == 1:
            return np.asarray(rate)
        second = roll_rate * z + roll * (pitch * x - roll * y)
        along = y[0] * first[0] + y[1] * first[1]
        return np.asarray((y[0] * second[1] - y[1] * second[0] - 2.0 * rate * along) / square)

    @cached_property
    def _unwrapped(self) -> tuple[FloatArray, FloatArray]:
        """Instants and the continuous yaw there."""
        start, width, shares = (
            self._transport.start,
            self._transport.width,
            np.arange(CARRYING.samples) / CARRYING.samples,
        )
        grid = np.append(start[:, None] + width[:, None] * shares, self.path.duration)
        return grid, np.unwrap(_yaw_of(self.axes(grid)[1]))


def _yaw_of(lateral: FloatArray) -> FloatArray:
    """Angle of the horizontal direction to which lateral axes (3, m) are perpendicular."""
    return np.asarray(np.arctan2(-lateral[0], lateral[1]))
