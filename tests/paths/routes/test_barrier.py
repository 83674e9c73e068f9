"""Proofs that no way through a map has a clearance: random maps, other sides of cells, and tampered proofs."""

from dataclasses import replace

import numpy as np
import pytest

from minsnap.corridors.occupancy_grid import grown
from minsnap.errors import CorridorError, InfeasibleError, WaypointError
from minsnap.paths.routes.grid_map import GridMap
from minsnap.paths.routes.passage import find_passage


def refusal(cells, start, goal, clearance, sides=0.1):
    with pytest.raises(InfeasibleError, match="too narrow") as refused:
        find_passage(GridMap(cells, sides), np.array(start), np.array(goal), clearance)
    return refused.value


def wall_with_hole():
    cells = np.zeros((40, 40), dtype=bool)
    cells[20] = True
    cells[20, 18:25] = False
    return cells


def test_a_hole_too_narrow_is_proved():
    refused = refusal(wall_with_hole(), (0.5, 0.5), (3.5, 3.5), 0.4)
    assert refused.verify() and refused.contradiction.reached.sum() > 500


@pytest.mark.parametrize("dim", [2, 3])
def test_refusals_of_random_maps_verify(dim):
    random, proved = np.random.default_rng(5), 0
    for _ in range(60):
        shape = random.integers(6, 14, dim)
        sides = random.uniform(0.1, 0.4, dim)
        cells = random.random(shape) < 0.1
        cells[0] = cells[-1] = False
        start, goal = 0.5 * sides, (np.array(shape) - 0.5) * sides
        try:
            find_passage(GridMap(cells, sides), start, goal, random.uniform(0.0, 0.5))
        except InfeasibleError as refused:
            assert refused.verify()
            proved += 1
        except (CorridorError, WaypointError):
            continue
    assert proved >= 5


def test_tampered_proofs_do_not_verify():
    proof = refusal(wall_with_hole(), (0.5, 0.5), (3.5, 3.5), 0.4).contradiction
    assert proof.verify()
    assert not replace(proof, goal=proof.start).verify()
    assert not replace(proof, start=proof.goal).verify()
    assert not replace(proof, clearance=0.3).verify(), "the hole lets 0.3 m pass"
    assert not replace(proof, border=proof.border[1:], near=proof.near[1:]).verify()
    far = proof.near.copy()
    far[:] = (20, 39)
    assert not replace(proof, near=far).verify()
    free = proof.near.copy()
    free[0] = proof.border[0] - (1, 0)
    assert not proof.grid.occupied[tuple(free[0])] and not replace(proof, near=free).verify()


def test_cells_at_the_clearance_exactly_are_free():
    """A hole of seven cells of a quarter metre has 0.75 m on each side of its middle one."""
    cells, sides = wall_with_hole(), 0.25
    assert not grown(cells, 0.75, np.array([sides, sides]))[20, 21]
    proof = refusal(cells, (1.0, 1.0), (9.0, 9.0), 0.8, sides).contradiction
    assert proof.verify() and not replace(proof, clearance=0.75).verify()
