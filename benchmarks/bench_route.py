"""Seconds from a map to a plan: a 2-D map of 100 x 80 cells, and one of 200 x 200 x 40 with sixty pillars."""

from time import perf_counter

import numpy as np

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


def best(run, repeats=3):
    times = []
    for _ in range(repeats):
        began = perf_counter()
        run()
        times.append(perf_counter() - began)
    return min(times)


if __name__ == "__main__":
    for name, cells, start, goal, clearance in maps():
        grid = minsnap.routes.GridMap(cells, np.full(cells.ndim, 0.1))
        ends = np.array(start), np.array(goal)
        way = best(lambda: find_passage(grid, *ends, clearance))  # noqa: B023
        whole = best(lambda: minsnap.routes.plan_through(grid, start, goal, clearance))  # noqa: B023
        print(f"{name}: way and boxes {way:.2f} s, with the plan and its distance {whole:.2f} s")
