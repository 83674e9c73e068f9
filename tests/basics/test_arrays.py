"""Read-only arrays stay read-only, however a value travels."""

import copy
import pickle
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

import minsnap
from minsnap.corridors.constraint import Walls
from minsnap.trajectory.trajectory import Trajectory
from minsnap.vehicle import Quadrotor, RotorSpeedDrag, Surface

CORNERS = [(0, 0, 1), (2, 0, 1), (2, 1, 1)]


def planned():
    return minsnap.plan(CORNERS, [2.0, 1.5], corridor=0.3, yaw=[0.0, 0.5, 0.0])


VALUES = {
    "trajectory": planned,
    "samples": lambda: planned().sample(10.0),
    "tube": lambda: minsnap.Tube([0.1, 0.2]),
    "round tube": lambda: minsnap.RoundTube([0.1, 0.2]),
    "boxes": lambda: minsnap.Boxes([(0, 0)] * 2, [(1, 1)] * 2),
    "polytopes": lambda: minsnap.Polytopes([(np.vstack([np.eye(2), -np.eye(2)]), np.ones(4))] * 2),
    "room": lambda: minsnap.Room((0, 0), (1, 1)),
    "half-spaces": lambda: minsnap.HalfSpaces((1, 0), 2.0),
    "faces": lambda: Walls.planes([0], [[1.0, 0.0]], [[0.0, 0.0]], [-1.0], [1.0], [1.0]),
    "balls": lambda: Walls.balls([0], np.eye(2)[None], [[0.0, 0.0]], [1.0]),
    "vehicle": Quadrotor.dji_f330,
    "surface": lambda: Surface("fitted", ("velocity",), ((1,),), [2.0]),
    "rotor drag": lambda: RotorSpeedDrag((1e-4, 1e-4, 0.0)),
    "point to look at": lambda: minsnap.LookAt((1, 2)),
    "circle": minsnap.circle,
    "certificate": lambda: minsnap.certify(planned(), CORNERS, 0.3),
    "problem": lambda: minsnap.build_qp(CORNERS, [2.0, 1.5], 0.3),
    "plans": lambda: minsnap.plan_many([CORNERS, CORNERS], [2.0, 1.5], gradients=True),
}
WAYS = {"pickle": lambda value: pickle.loads(pickle.dumps(value)), "copy": copy.copy, "deepcopy": copy.deepcopy}


def arrays(value, found=None):
    """Return every array that a value holds, however deep; not those made when they are asked for."""
    found = [] if found is None else found
    if isinstance(value, np.ndarray):
        found.append(value)
    held = vars(value).values() if hasattr(value, "__dict__") else ()
    if isinstance(value, Trajectory):
        held = value.control_points, value.durations, value.yaw
    for entry in value if isinstance(value, (list, tuple)) else held:
        arrays(entry, found)
    return found


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", VALUES)
def test_arrays_of_copies_are_equal_and_read_only(name, way):
    first = VALUES[name]()
    again = WAYS[way](first)
    before, after = arrays(first), arrays(again)
    assert len(before) == len(after) > 0
    for one, other in zip(before, after, strict=True):
        assert not other.flags.writeable
        np.testing.assert_array_equal(one, other)


def test_a_plan_that_comes_back_from_a_process_is_read_only():
    with ProcessPoolExecutor(1) as pool:
        path = pool.submit(planned).result()
    assert not any(array.flags.writeable for array in arrays(path))
    assert path(1.0) == pytest.approx(planned()(1.0), abs=0.0)
