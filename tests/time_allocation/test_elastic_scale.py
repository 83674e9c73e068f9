import numpy as np
import pytest

import minsnap
from minsnap.optimisation.elastic import Elastic
from minsnap.time_allocation import elastic_scale

POINTS = [(0, 0, 1), (4, 0, 1), (4, 3, 1)]
LIMITS = minsnap.Limits(speed=2.0, acceleration=3.0)


def refusal(durations):
    with pytest.raises(minsnap.InfeasibleError) as caught:
        minsnap.plan(POINTS, durations=durations, corridor=0.2, limits=LIMITS)
    return caught.value


def test_a_stretch_does_and_a_little_less_does_not():
    durations = np.array([1.0, 0.8])
    stretch = refusal(durations).stretch
    minsnap.plan(POINTS, durations=1.001 * stretch * durations, corridor=0.2, limits=LIMITS)
    refusal(0.97 * stretch * durations)  # a factor is named with what it was tried with


def test_the_relaxation_that_proves_a_refusal_is_not_found_again(monkeypatch):
    durations, asked, own = np.array([1.0, 0.8]), [], 1.8 / np.sqrt(1.0 * 0.8)

    class Counted(Elastic):
        def run(self):
            asked.append(self.problem.durations.sum())
            return super().run()

    monkeypatch.setattr(elastic_scale, "Elastic", Counted)
    assert refusal(durations).stretch > 1.0
    assert asked and len(set(np.round(asked, 9))) == len(asked)
    assert min(asked) > 1.1 * own
