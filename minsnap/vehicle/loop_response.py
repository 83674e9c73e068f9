r"""What a control loop answers to a disturbance: integrals of its impulse responses, bounded from above.

The loop of one axis has the state x = (position, velocity, acceleration of the thrust, integral part) and obeys

.. math:: \dot x(t) = A\,x(t) + B\,x(t - \theta),

a delay equation. Its response :math:`\Phi` to impulses is approximated by polynomials of degree 5 on cells that the
delay is a whole number of: :math:`\hat\Phi' = A\hat\Phi + B\hat\Phi(\cdot - \theta) + R`, where R is what is left. Then
:math:`\Phi = \hat\Phi - \Phi * R`, and with :math:`N_{ij} = \|\Phi_{ij}\|_1` and :math:`M_{ij} = \|R_{ij}\|_1`

.. math:: N \le \hat N + N M \quad\Rightarrow\quad N \le \hat N\,(I - M)^{-1}

if the spectral radius of M is below 1, which also proves that the loop is stable. Integrals of absolute values are
bounded by means of Bernstein coefficients. So neither the steps nor the end of the computation are trusted.

Source of the norm: G. Zames and others; the largest answer to bounded disturbances is the integral of |h| (Desoer and
Vidyasagar, *Feedback Systems: Input-Output Properties*, 1975).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, comb

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import VehicleError


@dataclass(frozen=True)
class ResponseSteps:
    """How a response is computed.

    Parameters
    ----------
    cell : float
        Longest cell [s].
    per_lag : float
        Cells within the time constant of the thrust, at least.
    longest : float
        Time after which a response that still lasts is given up [s].
    faded : float
        Share of its greatest value below which a response is made to end.
    fade : float
        In what time [s].
    nodes : int
        Of the quadrature of a step.
    """

    cell: float = 0.02
    per_lag: float = 5.0
    longest: float = 300.0
    faded: float = 1e-7
    fade: float = 1.0
    nodes: int = 8


STEPS = ResponseSteps()

ZERO = np.zeros(())


@dataclass(frozen=True)
class AxisLoop:
    """The loop of one axis; gains as :class:`~minsnap.vehicle.Loop` has them.

    Parameters
    ----------
    position_gain, velocity_gain, velocity_integral, velocity_derivative : float
        [1/s], [1/s], [1/s^2], [1].
    lag : float
        Time constant of the acceleration after its command [s].
    delay : float
        From the state to its effect on the command [s].
    drag : float
        Linear, over mass [1/s].
    cell : float
        Step of the computation, of which the delay is a whole number [s].
    """

    position_gain: float
    velocity_gain: float
    velocity_integral: float
    velocity_derivative: float
    lag: float
    delay: float
    drag: float
    cell: float

    @property
    def order(self) -> int:
        """Number of states: four, or three without an integral part."""
        return 4 if self.velocity_integral > 0.0 else 3

    @property
    def steps_of_delay(self) -> int:
        """How many cells the delay is."""
        return round(self.delay / self.cell)

    @property
    def command(self) -> FloatArray:
        """Row that gives the command of feedback from the state, shape (order,)."""
        p, v, d = self.position_gain, self.velocity_gain, self.velocity_derivative
        return np.array([-p * v, d * self.drag - v, -d, 1.0])[: self.order]

    @property
    def plant(self) -> FloatArray:
        """A: what acts without delay, shape (order, order)."""
        matrix = np.zeros((4, 4))
        matrix[0, 1], matrix[1, 1], matrix[1, 2], matrix[2, 2] = 1.0, -self.drag, 1.0, -1.0 / self.lag
        matrix[3, :2] = -self.velocity_integral * self.position_gain, -self.velocity_integral
        return matrix[: self.order, : self.order]

    @property
    def feedback(self) -> FloatArray:
        """B: what acts after the delay, shape (order, order)."""
        matrix = np.zeros((self.order, self.order))
        matrix[2] = self.command / self.lag
        return matrix


def cell_of(delay: float, lags: tuple[float, ...]) -> float:
    """Return the length of cells [s] for a delay and lags [s]."""
    longest = min(STEPS.cell, min(lags) / STEPS.per_lag)
    return delay / ceil(delay / longest) if delay > 0.0 else longest


def bernstein_of_ends(ends: FloatArray, cell: float) -> FloatArray:
    """Return control points (k, 6, ...) of polynomials from (x, x', x'') at both ends, (k, 6, ...)."""
    x0, v0, a0, x1, v1, a1 = np.moveaxis(ends, 1, 0)
    one, two = cell / 5.0, cell * cell / 20.0
    points = (x0, x0 + one * v0, x0 + 2.0 * one * v0 + two * a0, x1 - 2.0 * one * v1 + two * a1, x1 - one * v1, x1)
    return np.stack(points, axis=1)


def slopes_of(points: FloatArray, cell: float) -> FloatArray:
    """Return control points of the derivative (k, 6, ...), of the same degree 5."""
    steps = 5.0 / cell * np.diff(points, axis=1)
    weight = (np.arange(1, 5) / 5.0).reshape(-1, *(1,) * (points.ndim - 2))
    inner = weight * steps[:, :-1] + (1.0 - weight) * steps[:, 1:]
    return np.concatenate((steps[:, :1], inner, steps[:, -1:]), axis=1)


def delayed(points: FloatArray, steps: int) -> FloatArray:
    """Return cells that come some steps later, zero before; as many."""
    if not steps:
        return points
    zeros = np.zeros((min(steps, len(points)), *points.shape[1:]))
    return np.concatenate((zeros, points[:-steps]))[: len(points)]


class Stepper:
    """Advances a loop by one cell, exactly for polynomials of degree 5 a delay ago.

    Parameters
    ----------
    loop : AxisLoop
    """

    def __init__(self, loop: AxisLoop) -> None:
        from scipy.linalg import expm

        self.steps, cell = loop.steps_of_delay, loop.cell
        self._now = loop.plant if self.steps else loop.plant + loop.feedback
        self._late = loop.feedback
        nodes, weights = np.polynomial.legendre.leggauss(STEPS.nodes)
        self.nodes, self._weights = 0.5 * (nodes + 1.0), 0.5 * cell * weights
        self._whole = expm(self._now * cell)
        self._rest = np.stack([expm(self._now * cell * (1.0 - node)) for node in self.nodes])
        at_nodes = bernstein_of_ends(np.eye(6)[None], cell)[0].T @ bernstein_values(self.nodes, 5).T
        self._old = np.einsum("g,gij,jk,eg->eik", self._weights, self._rest, self._late, at_nodes)

    def forced(self, values: FloatArray) -> FloatArray:
        """Return what inputs (cells, nodes, order, axes) of the derivative add over cells: (cells, order, axes)."""
        return np.asarray(np.einsum("g,gij,cgja->cia", self._weights, self._rest, values))

    def advance(self, state: FloatArray, old: FloatArray | None) -> FloatArray:
        """Return the state (order, ...) a cell later; ``old`` are the ends of the cell a delay ago, (6, order, ...)."""
        moved = np.asarray(self._whole @ state)
        return moved if old is None else moved + np.einsum("eik,ek...->i...", self._old, old)

    def rate(self, state: FloatArray, old: FloatArray | None) -> FloatArray:
        """Return the derivative for a state, and that a delay ago."""
        now = self._now @ state
        return now if old is None else now + self._late @ old


def bernstein_values(at: FloatArray, degree: int) -> FloatArray:
    """Return the values of the Bernstein polynomials at points (...) of [0, 1]: (..., degree + 1)."""
    j = np.arange(degree + 1)
    counts = np.array([comb(degree, int(k)) for k in j])
    return np.asarray(counts * at[..., None] ** j * (1.0 - at[..., None]) ** (degree - j))


def _impulse_cells(loop: AxisLoop) -> FloatArray:
    """Control points of the response to an impulse of each state: (cells, 6, order, order), of no value later on."""
    stepper, start = Stepper(loop), np.eye(loop.order)
    lag, ends = stepper.steps, list[FloatArray]()
    state, greatest, count = start, 1.0, 0
    block = max(lag, ceil(1.0 / loop.cell))
    while True:
        for _ in range(block):
            old = ends[count - lag] if lag and count >= lag else None
            after = stepper.advance(state, old)
            ends.append(ends_of_cell(stepper, state, after, old))
            state, count = after, count + 1
        last = max(float(np.abs(each[0]).max()) for each in ends[-block:])
        greatest = max(greatest, last)
        if not np.isfinite(last) or last > 1e9 or count * loop.cell > STEPS.longest:
            raise VehicleError("the loop does not come to rest: with these gains, lag and delay it is not stable")
        if last <= STEPS.faded * greatest:
            return _faded(bernstein_of_ends(np.stack(ends), loop.cell), ends[-1][3:], loop)


def ends_of_cell(
    stepper: Stepper,
    before: FloatArray,
    after: FloatArray,
    old: FloatArray | None,
    inputs: Sequence[tuple[FloatArray, FloatArray]] = ((ZERO, ZERO), (ZERO, ZERO)),
) -> FloatArray:
    """Return the state and its two derivatives at both ends of a cell, (6, order, ...).

    ``old`` are those a delay ago; ``inputs`` what is added to the derivative at either end, and its own derivative.
    """
    ends = []
    for state, row, (push, change) in ((before, 0, inputs[0]), (after, 3, inputs[1])):
        rate = stepper.rate(state, None if old is None else old[row]) + push
        ends += [state, rate, stepper.rate(rate, None if old is None else old[row + 1]) + change]
    return np.stack(ends)


def _faded(points: FloatArray, last: FloatArray, loop: AxisLoop) -> FloatArray:
    """Append a polynomial that brings the last state to zero, cut into cells, and zeros for as long as the delay."""
    count = max(1, round(STEPS.fade / loop.cell))
    whole = bernstein_of_ends(np.concatenate((last, np.zeros_like(last)))[None], count * loop.cell)[0]
    t = np.arange(count + 1) / count
    first = 5.0 * np.diff(whole, axis=0)
    second = 4.0 * np.diff(first, axis=0)
    values = [np.tensordot(bernstein_values(t, 5 - k), each, 1) for k, each in enumerate((whole, first, second))]
    values = [each / (count * loop.cell) ** k for k, each in enumerate(values)]
    ends = np.stack([each[:-1] for each in values] + [each[1:] for each in values], axis=1)
    zeros = np.zeros((loop.steps_of_delay, *points.shape[1:]))
    return np.concatenate((points, bernstein_of_ends(ends, loop.cell), zeros))


@dataclass(frozen=True, eq=False)
class Response:
    """Bounds of what a loop answers, proved as the module says.

    Parameters
    ----------
    loop : AxisLoop
    error : ndarray, shape (cells, 6)
        Control points of the position after an impulse of acceleration [s], approximate: h.
    rate : ndarray, shape (cells, 6)
        The velocity after it [1].
    command : ndarray, shape (cells, 6)
        The command of feedback after it, but for the impulse of the derivative part [1/s].
    states : ndarray, shape (order, order)
        Upper bounds N of the integrals of the response of each state to an impulse of each.
    peaks : ndarray, shape (order, order)
        Upper bounds of the greatest values of these responses.
    excess : ndarray, shape (3,)
        What the true integrals of error, rate and command may have beyond those of the control points.
    """

    loop: AxisLoop
    error: FloatArray
    rate: FloatArray
    command: FloatArray
    states: FloatArray
    peaks: FloatArray
    excess: FloatArray

    def gains(self) -> tuple[float, float, float]:
        """Return bounds of the position [s^2], the velocity [s] and the command [1] for a unit of acceleration."""
        error, rate, command = (norm(each, self.loop.cell) for each in (self.error, self.rate, self.command))
        extra, derivative = self.excess, self.loop.velocity_derivative
        return error + extra[0], rate + extra[1], command + derivative + extra[2]

    def moved_by(self, greatest: FloatArray, whole: FloatArray) -> tuple[float, float]:
        """Return bounds of what inputs of the states do to the position [m] and to the command [m/s^2].

        Parameters
        ----------
        greatest, whole : ndarray, shape (order,)
            Greatest absolute value of each input, and the integral of it.
        """
        states = np.minimum(self.states * greatest, self.peaks * whole).sum(axis=1)
        return float(states[0]), float(np.abs(self.loop.command) @ states)


def norm(points: FloatArray, cell: float) -> float:
    """Bound of the integral of |x| over cells from above, of control points (k, n)."""
    return float(cell * np.abs(points).mean(axis=1).sum())


@lru_cache(maxsize=64)
def response_of(loop: AxisLoop) -> Response:
    """Return what a loop answers.

    Raises
    ------
    VehicleError
        If it is not stable, or slower than is computed.
    """
    points, cell = _impulse_cells(loop), loop.cell
    now, late = (np.einsum("ij,knjl->knil", m, points) for m in (loop.plant, loop.feedback))
    left = slopes_of(points, cell) - now - delayed(late, loop.steps_of_delay)
    mean = cell * np.abs(left).mean(axis=1).sum(axis=0)
    if max(abs(np.linalg.eigvals(mean))) >= 0.5:
        raise VehicleError("this loop is too fast to be bounded: its lag or delay is too small beside its gains")
    inverse = np.linalg.inv(np.eye(loop.order) - mean)
    states = cell * np.abs(points).mean(axis=1).sum(axis=0) @ inverse
    peaks = np.abs(points).max(axis=(0, 1)) @ inverse
    kick = loop.velocity_derivative / loop.lag  # the derivative part feels the impulse itself, a delay later
    both = points[..., 1] - kick * delayed(points[..., 2], loop.steps_of_delay)
    wrong = mean[:, 1] + kick * mean[:, 2]
    command = both @ loop.command
    excess = np.array([states[0] @ wrong, states[1] @ wrong, np.abs(loop.command) @ states @ wrong])
    return Response(loop, both[..., 0], both[..., 1], command, states, peaks, excess)
