"""The least time along a line, from rest to rest, within a speed and an acceleration."""

from math import inf, sqrt


def trapezoid_time(way: float, speed: float, acceleration: float) -> float:
    """Return the least time over a way within limits that may be infinite [s]; 0 where both are."""
    if acceleration == inf:
        return way / speed
    if speed == inf or way * acceleration < speed * speed:
        return 2.0 * sqrt(way / acceleration)
    return way / speed + speed / acceleration
