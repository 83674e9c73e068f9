"""What every plan keeps, whatever it is asked: continuity, waypoints, states, corridors."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.curves import jumps, offsets, quadrature_cost
from properties.strategies import corridors, state_orders

import minsnap

SMALL = 1e-9


@given(corridors())
def test_derivatives_are_continuous_at_every_knot(asked):
    traj = minsnap.plan(**asked)
    for order in range((traj.degree + 1) // 2):
        assert (jumps(traj, order) <= SMALL).all(), order


@given(corridors(walls=False))
def test_without_walls_all_derivatives_that_can_be_are_continuous(asked):
    traj = minsnap.plan(**asked)
    for order in range(traj.degree):
        assert (jumps(traj, order) <= 1e-7).all(), order


@given(corridors(walls=False, closed=True, legs=(2, 5)))
def test_a_closed_lap_is_as_smooth_at_its_seam_as_elsewhere(asked):
    traj = minsnap.plan(**asked)
    twice = traj.then(traj)
    for order in range(traj.degree):
        assert (jumps(twice, order) <= 1e-7).all(), order


@given(corridors(closed=True, dims=(2, 4), legs=(2, 5)))
def test_a_closed_lap_in_a_corridor_ends_in_the_state_it_began_in(asked):
    traj = minsnap.plan(**asked)
    for order in range((traj.degree + 1) // 2):
        assert (jumps(traj.then(traj), order) <= SMALL).all(), order
    assert minsnap.certify(traj, asked["waypoints"], asked["corridor"]).corridor_margin >= 0.0


@given(corridors())
def test_every_waypoint_is_passed_at_its_instant(asked):
    traj = minsnap.plan(**asked)
    size = np.abs(asked["waypoints"]).max()
    assert np.abs(traj(traj.leg_breaks) - asked["waypoints"]).max() <= 1e-12 * size
    assert traj.leg_breaks[1:] == pytest.approx(np.cumsum(asked["durations"]), rel=1e-12)


@given(corridors())
def test_the_ends_are_at_rest(asked):
    traj = minsnap.plan(**asked)
    for order in range(1, (traj.degree + 1) // 2):
        largest = np.abs(traj.derivative(order).control_points).max()
        assert np.abs(traj([0.0, traj.duration], order)).max() <= SMALL * largest, order


@settings(max_examples=40)
@given(corridors(dims=(2, 4)))
def test_the_curve_stays_in_its_corridor_at_every_instant(asked):
    traj = minsnap.plan(**asked)
    certificate = minsnap.certify(traj, asked["waypoints"], asked["corridor"])
    assert certificate.ok
    assert certificate.corridor_margin >= 0.0
    reach = np.abs(offsets(traj, asked["waypoints"])).max(axis=(1, 2))
    assert (reach <= asked["corridor"] + 1e-13 * np.abs(asked["waypoints"]).max()).all()


@given(corridors(dims=(2, 3), legs=(1, 4)))
def test_a_round_tube_holds_at_every_instant(asked):
    tube = minsnap.RoundTube(asked.pop("corridor"))
    traj = minsnap.plan(**asked, corridor=tube)
    assert minsnap.certify(traj, asked["waypoints"], tube).corridor_margin >= 0.0
    reach = np.linalg.norm(offsets(traj, asked["waypoints"]), axis=2).max(axis=1)
    assert (reach <= tube.radius + 1e-13 * np.abs(asked["waypoints"]).max()).all()


@given(corridors(dims=(2, 3), legs=(1, 4)), st.integers(2, 4))
def test_pieces_of_a_leg_stay_inside_and_cost_no_more(asked, pieces):
    one, many = minsnap.plan(**asked), minsnap.plan(**asked, pieces=pieces)
    half = (one.degree + 1) // 2
    assert minsnap.certify(many, asked["waypoints"], asked["corridor"]).ok
    assert many.cost(half) <= one.cost(half) * (1.0 + 3e-6)
    for order in range(half):
        assert (jumps(many, order) <= SMALL).all(), order


@given(corridors(walls=False, legs=(2, 5)), st.data())
def test_states_at_the_ends_and_pins_between_hold(asked, data):
    names, dim = state_orders(asked["degree"]), asked["waypoints"].shape[1]
    vector = st.lists(st.floats(-3.0, 3.0), min_size=dim, max_size=dim)
    state = st.dictionaries(st.sampled_from(names), vector, min_size=1, max_size=2)
    start, end, pin = data.draw(state), data.draw(state), data.draw(state)
    knot = data.draw(st.integers(1, len(asked["durations"]) - 1))
    traj = minsnap.plan(**asked, start=start, end=end, pins={knot: pin})
    for instant, wanted in ((0.0, start), (traj.breaks[knot], pin), (traj.duration, end)):
        for order, name in enumerate(names, start=1):
            value = wanted.get(name, None if wanted is pin else np.zeros(dim))
            if value is not None:
                size = np.abs(traj.derivative(order).control_points).max()
                assert traj(instant, order) == pytest.approx(np.array(value), abs=1e-9 * size), (instant, name)
    for order in range((traj.degree + 1) // 2):
        assert (jumps(traj, order) <= SMALL).all(), order


@given(corridors())
def test_the_cost_is_the_integral_of_the_squared_derivative(asked):
    traj = minsnap.plan(**asked)
    half = (traj.degree + 1) // 2
    assert traj.cost(half) == pytest.approx(quadrature_cost(traj, half), rel=1e-9)
    assert traj.report.cost == pytest.approx(traj.cost(half), rel=1e-6)
