"""Seconds from a map to a plan: a 2-D map of 100 x 80 cells, and one of 200 x 200 x 40 with sixty pillars."""

from functools import partial
from time import perf_counter

import numpy as np
from measure import least_times

import minsnap
from minsnap.paths.routes.passage import find_passage


def maps():
    flat = np.zeros((100, 80), dtype=bool)
    flat[30:33, :55] = flat[60:63, 25:] = flat[45:48, 40:60] = True
    yield "100 x 80", flat, (1.0, 1.0), (9.0, 7.0), 0.3
    draw, pillars = np.random.default_rng(0), np.zeros((200, 200, 40), dtype=bool)
    for x, y in draw.integers(0, 190, (60, 2)):
        pillars[x : x + 8, y : y + 8, : draw.integers(10, 40)] = True
    pillars[:, :, 0] = True
    yield "200 x 200 x 40", pillars, (0.5, 0.5, 1.0), (19.0, 19.5, 1.0), 0.35


if __name__ == "__main__":
    for name, cells, start, goal, clearance in maps():
        grid = minsnap.routes.GridMap(cells, np.full(cells.ndim, 0.1))
        ends = np.array(start), np.array(goal)
        way = partial(find_passage, grid, *ends, clearance)
        (seconds,), _ = least_times([way], 0.0, clock=perf_counter)
        whole = partial(minsnap.routes.plan_through, grid, start, goal, clearance)
        (both,), _ = least_times([whole], 0.0, clock=perf_counter)
        print(f"{name}: way and boxes {seconds:.2f} s, with the plan and its distance {both:.2f} s")
