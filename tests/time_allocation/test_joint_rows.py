"""Walls and limits at an instant: excesses and their linear models, against finite differences and exact measures."""

from dataclasses import replace

import numpy as np
import pytest
from tasks import random_legs, task_of

import minsnap
from minsnap.corridors.boxes import Boxes
from minsnap.corridors.tubes import RoundTube, Tube
from minsnap.limits.limits import Limits
from minsnap.time_allocation.joint_layout import JointLayout, JointState
from minsnap.time_allocation.joint_rows import wall_blocks
from minsnap.time_allocation.momentary_limits import momentary_blocks
from minsnap.time_allocation.rotor_limits import rotor_block
from minsnap.time_allocation.true_peaks import PeakFinder, derivatives_at, scattered
from minsnap.trajectory.heading import ConstantHeading
from minsnap.vehicle import Quadrotor, flatness_of

LIMITS = {
    "norms": Limits(speed=2.0, acceleration=5.0, jerk=20.0),
    "axes": Limits(speed=2.0, norm="axis", vertical_acceleration=3.0),
    "parts": Limits(horizontal_speed=2.0, climb_speed=0.6, descent_speed=0.4),
    "thrust": Limits(max_thrust=1.5, tilt=0.6),
    "momentary": Limits(acceleration=9.0, min_thrust=0.8, body_rate=1.5),
}
VEHICLE = Quadrotor(0.85, (0.001, 0.001, 0.0017), 0.15, 1e-6, 5e-8, np.sqrt(6.879e6), 0.0)


def case(limits, corridor=None, seed=0):
    """Layout, blocks and a state of a curve planned by its distances."""
    points, durations = random_legs(seed, 3)
    task = task_of(points, corridor)
    layout = JointLayout(task, task.units(durations))
    momentary = momentary_blocks(limits, layout.units, 3)
    names = {block.name for block in momentary}
    walls = [*task.walls, *(wall for wall in limits.walls(points) if wall.name not in names)]
    blocks = wall_blocks(walls, layout.units, 1, 3) + momentary
    step = np.concatenate((0.2 * np.random.default_rng(seed).normal(size=layout.size), np.zeros(3)))
    state = layout.moved(layout.state(layout.problem.values, durations / layout.units.time), step, 1.0)
    return layout, blocks, state


def values_of(layout, block, state, index, s):
    piece = block.piece[index]
    return block.at(scattered(layout, state, layout.ends(state), piece, s, block.orders), index)


@pytest.mark.parametrize("name", LIMITS)
@pytest.mark.parametrize("corridor", [None, Tube(0.2), RoundTube(0.3)], ids=["none", "tube", "round"])
def test_the_grid_and_single_instants_agree(name, corridor):
    layout, blocks, state = case(LIMITS[name], corridor)
    grid = np.linspace(0.0, 1.0, 5)
    x = derivatives_at(layout, state, grid, 5)
    for block in blocks:
        whole = block.on_grid(x)
        index = np.repeat(np.arange(len(block.piece)), 5)
        assert values_of(layout, block, state, index, np.tile(grid, len(block.piece))) == pytest.approx(
            whole.reshape(-1)
        )


def rotors(layout, yaw):
    return [rotor_block(VEHICLE, 0.1, layout.units, layout.pieces, yaw)]


@pytest.mark.parametrize("name", [*LIMITS, "rotors", "spinless rotors"])
def test_linear_models_have_the_slopes_of_the_excess(name):
    """Of the boundary where it is crossed: a cone is scaled by a power of time, which changes slopes off it."""
    layout, blocks, state = case(LIMITS.get(name, LIMITS["norms"]), Tube(0.2))
    if "rotors" in name:
        blocks = rotors(layout, None if "spinless" in name else 0.3)
    random, step = np.random.default_rng(1), 1e-6
    direction = random.normal(size=layout.size + layout.pieces)
    for block in blocks:
        index, s = random.integers(0, len(block.piece), 12), random.uniform(0.05, 0.95, 12)
        piece, ends = block.piece[index], layout.ends(state)
        found = block.linearised(scattered(layout, state, ends, piece, s, block.orders), index)
        change = scattered_change(layout, state, direction, step, piece, s, block.orders)
        moved = found.value + sum(np.einsum("ncd,nd->nc", found.gradient[p], change[p]) for p in block.orders)
        moved += found.own * (step * direction[layout.size :])[piece, None]
        later = values_of(layout, block, layout.moved(state, direction, step), index, s)
        before = values_of(layout, block, state, index, s)
        model = np.linalg.norm(moved[:, 1:], axis=1) - moved[:, 0]
        power = block.order if hasattr(block, "order") else 0
        scaled = later * (1.0 + power * step * direction[layout.size :][piece])
        assert (model - before) / step == pytest.approx((scaled - before) / step, rel=2e-4, abs=2e-4), block.name


def scattered_change(layout, state, direction, step, piece, s, orders):
    """Change of derivatives in the piece's present time: by the ends alone."""
    moved = layout.moved(state, direction, step)
    difference = layout.ends(moved) - layout.ends(state)
    held = JointState(state.scaled, state.durations)
    return scattered(layout, held, difference, piece, s, orders)


@pytest.mark.parametrize("name", LIMITS)
def test_peaks_are_those_of_the_exact_measure(name):
    limits = LIMITS[name]
    layout, blocks, state = case(limits, seed=3)
    measured = PeakFinder(layout, blocks).measure(state)
    used = {entry.name: entry for entry in limits.utilisation(layout.trajectory(state))}
    block = blocks[measured.worst[0]]
    if block.name in ("body_rate", "tilt", "min_thrust"):
        assert np.sign(measured.limit) == np.sign(used[block.name].fraction - 1.0)
    elif block.name in used and "norm" not in name:
        assert measured.limit * block.weight == pytest.approx(used[block.name].fraction - 1.0, rel=1e-3, abs=1e-4)


def test_walls_are_measured_as_the_certificate_does():
    layout, blocks, state = case(LIMITS["norms"], Tube(0.2), seed=4)
    curve, points = layout.trajectory(state), layout.task.waypoints
    margin = minsnap.certify(curve, points, corridor=0.2).corridor_margin
    assert PeakFinder(layout, blocks).measure(state).wall == pytest.approx(-margin / 0.2, rel=1e-3)


def test_rotor_thrusts_are_those_of_the_vehicle():
    layout, _, state = case(LIMITS["norms"])
    curve, block = replace(layout.trajectory(state), yaw=ConstantHeading(0.3)), rotors(layout, 0.3)[0]
    s = np.linspace(0.1, 0.9, 7)
    speed = flatness_of(VEHICLE, curve, curve.breaks[1] + s * curve.durations[1]).rotor_speed
    thrust = VEHICLE.thrust_coefficient * speed * np.abs(speed)
    hover, most = VEHICLE.hover_thrust, 6.879
    above = hover + 0.9 * (most - hover) - 5e-4 * hover
    for rotor in range(4):
        index = np.full(7, block.count + rotor)
        found = values_of(layout, block, state, index, s)
        assert found * above + above == pytest.approx(thrust[:, rotor], rel=1e-6)


@pytest.mark.parametrize("yaw", [0.0, 0.4, 0.8, 1.3])
def test_without_spin_no_direction_of_the_body_asks_for_more(yaw):
    """Torques of a body that points anywhere, from the angular acceleration alone."""
    layout, _, state = case(LIMITS["norms"])
    block, s = rotors(layout, None)[0], np.linspace(0.05, 0.95, 9)
    index = np.full(9, 2 * 1)
    x = scattered(layout, state, layout.ends(state), block.piece[index], s, (2, 3, 4))
    f, jerk, snap = (x[p] * layout.units.of_order(p) for p in (2, 3, 4))
    f = f + np.array([0.0, 0.0, VEHICLE.gravity])
    c = np.linalg.norm(f, axis=1, keepdims=True)
    z = f / c
    rate = (jerk - z * (z * jerk).sum(axis=1, keepdims=True)) / c
    turn = (snap - z * (z * snap).sum(axis=1, keepdims=True)) / c - 2.0 * rate * (z * jerk).sum(
        axis=1, keepdims=True
    ) / c
    side = np.cross(z, [np.cos(yaw), np.sin(yaw), 0.3])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    front = np.cross(side, z)
    accelerations = np.stack((-(side * turn).sum(axis=1), (front * turn).sum(axis=1), np.zeros(9)), axis=1)
    wrench = np.concatenate((VEHICLE.mass * c, accelerations @ VEHICLE.inertia.T), axis=1)
    most = VEHICLE.rotor_thrusts(wrench).max(axis=1)
    hover = VEHICLE.hover_thrust
    above = hover + 0.9 * (6.879 - hover) - 5e-4 * hover
    assert (values_of(layout, block, state, index, s) * above + above >= most - 1e-9).all()


def test_walls_stand_on_every_piece_of_their_leg():
    boxes = Boxes([(-1, -1, -1), (0, -1, -1)], [(1, 1, 1), (2, 1, 1)])
    points = np.array([(0.0, 0, 0), (0.5, 0, 0), (1.5, 0, 0)])
    task = task_of(points, boxes, pieces=3)
    (block,) = wall_blocks(task.walls, task.units(np.ones(6)), 3, 6)
    assert sorted(block.piece.tolist()) == sorted(np.repeat(np.arange(6), 6).tolist())
