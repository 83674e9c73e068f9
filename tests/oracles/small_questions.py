"""Random questions of two or three legs whose optimum sums of squares find: arguments of both."""

import numpy as np

import minsnap

DEGREES = (5, 7, 7, 9)


def _legs(random):
    count = int(random.integers(2, 4))
    steps = random.normal(size=(count, int(random.integers(2, 4))))
    lengths = random.uniform(1.0, 4.0, count)
    steps *= lengths[:, None] / np.linalg.norm(steps, axis=1)[:, None]
    points = np.round(np.concatenate((np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0))), 3)
    return points, np.round(lengths * random.uniform(0.6, 1.6, count), 2)


def _both(random, points, durations, plan, oracle):
    """Arguments of both, with a degree; those that they share among them."""
    degree = int(random.choice(DEGREES))
    return (points, durations, plan | {"degree": degree}), (points, durations, oracle | {"degree": degree})


def _boxes(random):
    points, durations = _legs(random)
    low, high = np.minimum(points[:-1], points[1:]), np.maximum(points[:-1], points[1:])
    low, high = low - random.uniform(0.1, 0.6, low.shape), high + random.uniform(0.1, 0.6, low.shape)
    eye = np.eye(points.shape[1])
    planes = [(np.vstack((eye, -eye)), np.concatenate((b, -a))) for a, b in zip(low, high, strict=True)]
    return _both(random, points, durations, {"corridor": minsnap.Boxes(low, high)}, {"planes": planes})


def _polytopes(random):
    points, durations = _legs(random)
    spaces = []
    for start, end in zip(points[:-1], points[1:], strict=True):
        normals = np.linalg.qr(random.normal(size=(len(start),) * 2))[0]
        rows = np.vstack((normals, -normals, random.normal(size=(2, len(start)))))
        rows /= np.linalg.norm(rows, axis=1)[:, None]
        spaces.append((rows, np.maximum(rows @ start, rows @ end) + random.uniform(0.1, 0.6, len(rows))))
    return _both(random, points, durations, {"corridor": minsnap.Polytopes(spaces)}, {"planes": spaces})


def _round_tubes(random):
    points, durations = _legs(random)
    radius = random.uniform(0.05, 0.6)
    return _both(random, points, durations, {"corridor": minsnap.RoundTube(radius)}, {"radius": radius})


def _tubes_of_pieces(random):
    points, durations = _legs(random)
    shared = {"pieces": int(random.integers(2, 4))}
    points, durations = points[:3], durations[:2]
    width = random.uniform(0.05, 0.5)
    return _both(random, points, durations, shared | {"corridor": width}, shared | {"half_width": width})


def _free_waypoints(random):
    points, durations = _legs(random)
    shared, width = {"tolerance": random.uniform(0.05, 0.4)}, random.uniform(0.3, 0.6)
    plan = {"waypoint_tolerance": shared["tolerance"], "corridor": width}
    return _both(random, points, durations, plan, shared | {"half_width": width})


def _moving_starts(random):
    points, durations = _legs(random)
    speed, width = 0.5 * random.normal(size=points.shape[1]), random.uniform(0.3, 0.8)
    plan = {"start": {"velocity": speed}, "corridor": width}
    return _both(random, points, durations, plan, {"states": {0: {1: speed}}, "half_width": width})


KINDS = {
    "boxes": _boxes,
    "polytopes": _polytopes,
    "round tubes": _round_tubes,
    "pieces": _tubes_of_pieces,
    "free waypoints": _free_waypoints,
    "moving starts": _moving_starts,
}


def small_question(kind, seed):
    """Points, durations and further arguments: of ``plan``, and of ``enclosed``."""
    return KINDS[kind](np.random.default_rng(seed))
