"""What a Crazyflie flies of the commands that it is given: the rules of its firmware's planner, written out.

planner.c, pptraj.c and crtp_commander_high_level.c of crazyflie-firmware 2a18fc29. A take-off is refused with error 1
unless the planner is idle, a landing while it lands; both go straight up or down from the last setpoint, as if at rest.
A go-to begins with position, velocity and acceleration of the setpoint of that moment. All are polynomials of degree 7
from jerk 0 to jerk 0, at rest at their ends. A trajectory is flown as it lies in the memory, and its end is held.
"""

import struct

import numpy as np

SET_GROUP, DEFINE, TAKE_OFF, LAND, GO_TO, START = 0, 6, 7, 8, 12, 13
IDLE, FLYING, LANDING = range(3)


def to_rest(seconds, start, goal):
    """Ascending powers, (8, 3), from position, velocity and acceleration, (3, 3), to rest at a goal; jerk 0 at both."""
    k = np.arange(8)
    at_end = [np.prod([k - j for j in range(order)], axis=0) if order else np.ones(8) for order in range(4)]
    rows = np.zeros((8, 8))
    for order, factor in enumerate((1.0, 1.0, 2.0, 6.0)):
        rows[order, order] = factor
        rows[4 + order] = at_end[order]
    asked = np.zeros((8, 3))
    asked[:3] = start * np.array([[1.0], [seconds], [seconds**2]])
    asked[4] = goal
    return np.linalg.solve(rows, asked) / seconds ** k[:, None]


class Planner:
    """The setpoints of a vehicle that stands somewhere, for all time; instants in seconds."""

    def __init__(self, place):
        self.memory = None
        self.defined = {}
        self.state, self.flown = IDLE, [(-np.inf, [(np.array([place, *np.zeros((7, 3))], dtype=float), 0.0)])]

    def take(self, body, now):
        """Do what a command says, and return its error."""
        if body[0] == DEFINE:
            self.defined[body[1]] = struct.unpack("<BBIB", body[2:])
        if self.state == LANDING and now > self.flown[-1][0] + self.flown[-1][1][-1][1]:
            self.state = IDLE
        acts = {TAKE_OFF: self._take_off, LAND: self._land, GO_TO: self._go_to, START: self._start}
        return acts[body[0]](body, now) if body[0] in acts else 0

    def _take_off(self, body, now):
        _, _, height, _, _, seconds = struct.unpack("<BBff?f", body)
        return 1 if self.state != IDLE else self._vertical(height, seconds, now, FLYING)

    def _land(self, body, now):
        _, _, height, _, _, seconds = struct.unpack("<BBff?f", body)
        return 1 if self.state == LANDING else self._vertical(height, seconds, now, LANDING)

    def _vertical(self, height, seconds, now, state):
        place = self(now)
        self._fly([(to_rest(seconds, np.stack([place, np.zeros(3), np.zeros(3)]), [*place[:2], height]), seconds)], now)
        self.state = state
        return 0

    def _go_to(self, body, now):
        _, _, relative, linear, x, y, z, _, seconds = struct.unpack("<BBBBfffff", body)
        assert not relative and not linear
        start = np.stack([self(now, order) for order in range(3)])
        self._fly([(to_rest(seconds, start, [x, y, z]), seconds)], now)
        self.state = FLYING
        return 0

    def _start(self, body, now):
        _, _, relative, turned, backwards, number, scale = struct.unpack("<BBBBBBf", body)
        assert (relative, turned, backwards, scale) == (0, 0, 0, 1.0)
        location, kind, offset, pieces = self.defined.get(number, (0, 0, 0, 0))
        if not location:
            return 0
        assert (location, kind) == (1, 0)
        rows = np.frombuffer(bytes(self.memory[offset : offset + 132 * pieces]), "<f4").reshape(-1, 33).astype(float)
        self._fly([(row[:24].reshape(3, 8).T, row[32]) for row in rows], now)
        self.state = FLYING
        return 0

    def _fly(self, pieces, now):
        self.flown.append((now, pieces))

    def __call__(self, t, order=0):
        """Return the setpoint at an instant, or a derivative."""
        began, pieces = next(each for each in reversed(self.flown) if each[0] <= t)
        left = t - began if np.isfinite(began) else 0.0
        for powers, seconds in pieces:
            if left <= seconds or powers is pieces[-1][0]:
                break
            left -= seconds
        if left > seconds:
            left, order = (seconds, order) if order == 0 else (seconds, 9)
        k = np.arange(8)
        factor = np.prod([k - j for j in range(order)], axis=0) if order else np.ones(8)
        return (
            (factor * np.where(k >= order, left, 0.0) ** np.maximum(k - order, 0)) @ powers
            if order < 9
            else np.zeros(3)
        )


def least_distance(planners, downwash=1.0, step=0.005):
    """Return the least distance of any two at any instant of their flights, heights divided by the downwash.

    All curves count from the instant of the last start: how far starts are apart is the matter of other tests.
    """
    moments = [[each[0] for each in planner.flown[1:]] for planner in planners]
    ends = [planner.flown[-1][0] + sum(seconds for _, seconds in planner.flown[-1][1]) for planner in planners]
    begun = [([None] + [t for t, pieces in planner.flown if len(pieces) > 1])[-1] for planner in planners]
    together = max((t for t in begun if t is not None), default=0.0)
    times = np.arange(min(map(min, moments)) - 0.1, max(ends) + 0.1, step)
    places = []
    for planner, start in zip(planners, begun, strict=True):
        late = together - start if start is not None else 0.0
        after = next((t for t, _ in planner.flown if start is not None and t > start), np.inf)
        moved = [t - late if start is not None and start <= t < after else t for t in times]
        places.append([planner(t) for t in moved])
    places = np.array(places) / (1.0, 1.0, downwash)
    pairs = np.triu_indices(len(planners), 1)
    return float(np.linalg.norm(places[pairs[0]] - places[pairs[1]], axis=2).min())
