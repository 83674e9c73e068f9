import numpy as np
import pytest

from minsnap.trajectory.heading import Heading
from minsnap.trajectory.path import Path


class SineHeading(Heading):
    """Yaw that swings."""

    def __call__(self, t, order: int = 0):
        return 1.5 * 0.7**order * np.sin(0.7 * np.asarray(t) + order * np.pi / 2)


class SinePath(Path):
    """Three sines per axis for 12 s: every derivative is known and none is zero."""

    duration, dim, yaw = 12.0, 3, SineHeading()

    def __init__(self, size: float = 0.5, seed: int = 0) -> None:
        random = np.random.default_rng(seed)
        self.amplitude, self.phase = size * random.normal(size=(3, 3)), random.uniform(0, 6, (3, 3))

    def _evaluate(self, t, order):
        rate = np.array([1.0, 1.4, 2.1])
        angle = rate * t[:, None, None] + self.phase + order * np.pi / 2
        return (self.amplitude * rate**order * np.sin(angle)).sum(axis=-1)


@pytest.fixture
def sines() -> SinePath:
    return SinePath()
