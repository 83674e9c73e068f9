"""The prisms before and behind gates, on both legs beside each, against their corners."""

import numpy as np
import pytest

from minsnap import Gate
from minsnap.missions.gate_passages import GatePassages


@pytest.mark.parametrize("normal", [(1, 0, 0), (1, 2, 0.5)])
def test_both_legs_stay_inside_the_prism_of_the_opening(normal):
    gate = Gate((3, 1, 2), normal, 1.0, 0.6, crossing=1)
    (faces,) = GatePassages.of([(1, gate)]).walls(np.zeros((5, 3)))
    assert sorted(faces.leg) == [1] * 4 + [2] * 4
    for leg in (1, 2):
        own = faces.leg == leg
        margin = faces.upper[own] - (gate.corners + 0.7 * gate.normal) @ faces.normal[own].T
        assert margin.min(axis=1) == pytest.approx(0.0, abs=1e-12) and (margin > -1e-12).all()
        assert (faces.upper[own] - faces.normal[own] @ gate.centre).min() == pytest.approx(0.3)
        beyond = gate.centre + 1.01 * (gate.corners - gate.centre)
        assert ((faces.upper[own] - beyond @ faces.normal[own].T).min(axis=1) < 0.0).all()


def test_without_gates_there_are_none():
    assert GatePassages.of([]) is None
