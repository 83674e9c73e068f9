"""Samples as a table."""

import numpy as np

import minsnap


def test_a_table_has_every_quantity_by_name():
    samples = minsnap.circle(radius=2.0, yaw="velocity").sample(10.0)
    table = samples.to_dataframe()
    names = [f"{prefix}{axis}" for prefix in ("", "v", "a", "j", "s") for axis in "xyz"]
    names = ["t", *names, "yaw", "yaw_rate"]
    assert list(table.columns) == names and len(table) == len(samples)
    assert np.array_equal(table[["vx", "vy", "vz"]], samples.velocity) and np.array_equal(table["yaw"], samples.yaw)


def test_a_table_of_positions_has_nothing_else_and_can_be_planned_through():
    table = minsnap.Samples(np.arange(3.0), np.eye(3)[:, :2]).to_dataframe()
    assert list(table.columns) == ["t", "x", "y"]
    assert np.allclose(minsnap.plan(table)([0.0, 1.0, 2.0]), np.eye(3)[:, :2])


def test_no_rows_of_samples_last_no_time():
    none = minsnap.circle().sample(10.0)[:0]
    assert (len(none), none.duration, none.rate) == (0, 0.0, 0.0)
