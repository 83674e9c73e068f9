"""Gates with room for the vehicle, round and polygonal ones, and when they are passed."""

import numpy as np
import pytest

import minsnap
from minsnap.corridors.passages import gate_passages
from minsnap.errors import WaypointError

START, GOAL = (0.0, 0.0, 1.0), (4.0, -1.0, 1.0)
LIMITS = minsnap.Limits(speed=4.0, acceleration=6.0)
TRIANGLE = [(2.0, 1.0, 0.5), (2.0, 3.0, 0.5), (2.0, 2.0, 2.5)]


def gates(margin):
    return {
        "square": minsnap.Gate((2, 2, 1), (1, 0, 0), 1.0, margin=margin),
        "slanted": minsnap.Gate((2, 2, 1), (1, 0.5, 0.2), 1.0, margin=margin),
        "round": minsnap.Gate.circle((2, 2, 1), (1, 0, 0), 0.5, margin=margin),
        "triangle": minsnap.Gate.polygon(TRIANGLE, margin=margin),
    }


@pytest.mark.parametrize("shape", gates(0.0))
def test_the_path_stays_away_from_the_edges_by_the_margin(shape):
    near, far = (minsnap.plan([START, gates(margin)[shape], GOAL], limits=LIMITS) for margin in (0.0, 0.2))
    (grazing,) = gate_passages(near, [gates(0.0)[shape]])
    (clear,) = gate_passages(far, [gates(0.0)[shape]])
    assert grazing.clearance < 0.1 and clear.clearance >= 0.2 - 1e-7
    assert far.duration >= near.duration - 1e-6
    assert clear.speed == pytest.approx(np.linalg.norm(far(clear.instant, 1)))


def test_a_round_opening_is_inside_of_its_circle():
    gate = minsnap.Gate.circle((1, 2, 3), (1, 1, 0), 0.5)
    assert np.allclose(np.linalg.norm(gate.corners - gate.center, axis=1), 0.5)
    assert np.allclose((gate.corners - gate.center) @ gate.normal, 0.0)
    assert gate.edges()[1] == pytest.approx(0.5 * np.cos(np.pi / 24))
    again = minsnap.Gate.polygon(gate.corners)
    assert np.allclose(again.normal, gate.normal)


@pytest.mark.parametrize("shape", gates(0.0))
def test_a_margin_that_leaves_no_opening_is_refused(shape):
    with pytest.raises(WaypointError, match=r"the margin of a gate is 0.9 m, and its nearest edge is 0\.\d+ m"):
        gates(0.9)[shape]
    with pytest.raises(WaypointError, match="margin"):
        gates(-0.1)[shape]
