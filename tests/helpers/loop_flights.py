"""Flights of a control loop, by small steps, coded apart from the library: many gusts at once."""

import numpy as np


def flown(gains, drag, lag, delay, gusts, step, setpoints=None, feed=None):
    """Position of a vehicle on one axis, (m, gusts): its loop step by step, by the explicit midpoint rule.

    ``gains`` are those of position, velocity, its integral and its derivative; ``gusts`` accelerations (m, gusts), each
    for one step; ``setpoints`` the position and velocity that are asked for, (m, 2), and ``feed`` the acceleration.
    """
    kp, kv, ki, kd = gains
    late = round(delay / step)
    count, many = gusts.shape
    asked = np.zeros((count, 2)) if setpoints is None else setpoints
    pushed = np.zeros(count) if feed is None else feed
    p, v, a, i = (np.zeros(many) for _ in range(4))
    commands, path = np.zeros((count + late + 1, many)), np.zeros((count, many))
    for k in range(count):
        path[k] = p
        speed = asked[k, 1] + kp * (asked[k, 0] - p)
        commands[k + late] = pushed[k] + kv * (speed - v) + i - kd * (a - drag * v + gusts[k])
        i = i + step * ki * (speed - v)
        command = commands[k]
        middle_a = a + 0.5 * step * (command - a) / lag
        middle_v = v + 0.5 * step * (a - drag * v + gusts[k])
        a = a + step * (command - middle_a) / lag
        p, v = p + step * middle_v, v + step * (middle_a - drag * middle_v + gusts[k])
    return path
