"""Entry points of the native core that only tests ask: walls that a curve keeps, and local maxima."""

from ctypes import c_double, c_int64, c_void_p

import numpy as np

from minsnap.native.library import Entry, address
from minsnap.native.records import WallsRecord
from minsnap.native.status import Status

_KEPT = Entry("minsnap_walls_kept", c_int64, c_int64, c_int64, c_void_p, c_void_p, WallsRecord, c_void_p)
_SUMMITS = Entry("minsnap_local_maxima", *[c_int64] * 2, c_void_p, c_double, c_int64, *[c_void_p] * 4)


def walls_kept(points, durations, walls):
    """Which of some ``Walls`` on pieces a curve is proved to keep at every instant, rounding included: bool (m,)."""
    pieces, count, dim = points.shape
    kept = np.zeros(len(walls.leg), dtype=np.uint8)
    known = (address(points), address(durations), walls.record, address(kept))
    status = Status(_KEPT.function()(count // 2, pieces, dim, *known))
    if status is not Status.DONE:
        raise ValueError(f"the walls cannot be checked: {status.reason}")
    return kept.astype(bool)


def local_maxima(points, level=-np.inf):
    """Rows, places on [0, 1] and values of all local maxima above a level of polynomials (m, n + 1), or None."""
    call, rows, degree = _SUMMITS.function(), len(points), points.shape[1] - 1
    if call is None:
        return None
    points, capacity = np.ascontiguousarray(points, dtype=np.float64), rows * (degree // 2 + 2)
    row, s, value = np.empty(capacity, dtype=np.int64), np.empty(capacity), np.empty(capacity)
    total = np.zeros(1, dtype=np.int64)
    arrays = [address(array) for array in (row, s, value, total)]
    if call(rows, degree, address(points), level, capacity, *arrays):
        return None
    return row[: total[0]], s[: total[0]], value[: total[0]]
