"""Where the laws are tried: one strategy of corridors for all of them."""

import numpy as np
from hypothesis import strategies as st

DEGREES = (3, 5, 7, 9, 11)

SPANS = {
    3: ((0.2, 20.0), 0.5),
    5: ((0.3, 12.0), 0.4),
    7: ((0.5, 8.0), 0.3),
    9: ((1.0, 4.0), 0.15),
    11: ((1.0, 4.0), 0.15),
}
"""Lengths of legs [m] and powers of ten of speeds: the ratio of durations enters to the power of the degree."""


def decades(low, high):
    """Numbers spread evenly over powers of ten."""
    return st.floats(np.log10(low), np.log10(high)).map(lambda power: float(10.0**power))


@st.composite
def corridors(draw, legs=(1, 6), dims=(1, 4), degrees=DEGREES, walls=True, closed=False, lengths=None, pace=None):
    """Arguments of ``plan``: legs of such lengths in any direction, widths 0.03 to 1.6 m, speeds 10**±pace."""
    degree = draw(st.sampled_from(degrees))
    lengths = lengths or SPANS[degree][0]
    pace = pace or SPANS[degree][1]
    count, dim = draw(st.integers(*legs)), draw(st.integers(*dims))
    count = max(count, dim if dim > 3 else 1)  # three rows of more columns are taken for x, y and z
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    sizes = np.array(draw(st.lists(decades(*lengths), min_size=count, max_size=count)))
    directions = random.normal(size=(count, dim))
    if draw(st.booleans()):
        directions = np.sign(directions[:, :1]) * np.eye(dim)[random.integers(dim, size=count)]
    steps = sizes[:, None] * directions / np.linalg.norm(directions, axis=1)[:, None]
    points = np.concatenate((np.zeros((1, dim)), np.cumsum(steps, axis=0))) + random.normal(size=dim)
    if closed:
        points[-1] = points[0] if np.linalg.norm(points[-2] - points[0]) > 0.05 else points[-1]
        points = points if (points[-1] == points[0]).all() else np.concatenate((points, points[:1]))
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    durations = lengths * 10.0 ** random.uniform(-pace, pace, len(lengths))
    given = {"waypoints": points, "durations": durations, "degree": degree}
    if walls:
        given["corridor"] = draw(decades(0.03, 1.6)) * 10.0 ** random.uniform(-0.3, 0.3, len(lengths))
    if closed:
        given["closed"] = True
    return given


def state_orders(degree):
    """Names of the derivatives that can be pinned."""
    return ("velocity", "acceleration", "jerk", "snap", "crackle")[: (degree + 1) // 2 - 1]
