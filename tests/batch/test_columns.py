import numpy as np
import pytest
from batches import good_row, walks, write_problems

import minsnap
from minsnap.batch.columns import COLUMNS, parquet_writer, record_batch, schema, trajectory_of
from minsnap.batch.dataset_rows import planned_row, request
from minsnap.batch.spec import read_mapping
from minsnap.errors import InputError


@pytest.fixture
def dataset(tmp_path):
    """A file with walks of several lengths and one problem that failed."""
    import pyarrow

    rows = [good_row(seed, seed + 1) for seed in range(6)]
    rows[2]["durations"][0] = -1.0
    write_problems(tmp_path / "p.csv", rows)
    spec = read_mapping({"table": str(tmp_path / "p.csv")})
    path = tmp_path / "data" / "part-00000.parquet"
    path.parent.mkdir()
    with open(path, "wb") as file, parquet_writer(file, {"batch": "x"}) as writer:
        writer.write_table(pyarrow.Table.from_batches([record_batch([planned_row(spec, n) for n in range(6)])]))
    return spec, path


def same_bits(curve, planned):
    pairs = zip(
        (curve.control_points, curve.durations, curve.breaks),
        (planned.control_points, planned.durations, planned.breaks),
        strict=True,
    )
    return all(a.tobytes() == b.tobytes() and a.shape == b.shape for a, b in pairs)


def rows_by_pandas(path):
    import pandas

    return [row for _, row in pandas.read_parquet(path.parent).iterrows()]


def rows_by_duckdb(path):
    import duckdb

    with duckdb.connect() as connection:
        found = connection.sql(f"select * from '{path.parent}/*.parquet' order by problem")
        return [dict(zip(found.columns, row, strict=True)) for row in found.fetchall()]


def rows_by_arrow(path):
    from pyarrow import parquet

    return parquet.read_table(path).to_pylist()


@pytest.mark.parametrize("read", [rows_by_pandas, rows_by_duckdb, rows_by_arrow])
def test_trajectories_read_back_are_the_planned_ones_to_the_last_bit(dataset, read):
    spec, path = dataset
    rows = read(path)
    assert [row["problem"] for row in rows] == list(range(6)) and list(dict(rows[0])) == list(COLUMNS)
    for number in (0, 1, 3, 4, 5):
        planned = minsnap.plan(**request(spec, number).arguments)
        assert same_bits(trajectory_of(rows[number]), planned) and rows[number]["cost"] == planned.cost()
    with pytest.raises(InputError, match="not planned, its status is 'invalid'"):
        trajectory_of(rows[2])


def test_a_problem_that_failed_has_nulls_and_not_zeros(dataset):
    row = rows_by_arrow(dataset[1])[2]
    assert "duration" in row["error"] and row["waypoints"] is not None
    assert all(row[name] is None for name in ("control_points", "cost", "certified", "max_speed", "degree"))


def test_several_pieces_and_two_coordinates(tmp_path):
    spec = walks(pieces=2, dim=2)
    row = record_batch([planned_row(spec, 3)]).to_pylist()[0]
    assert same_bits(trajectory_of(row), minsnap.plan(**request(spec, 3).arguments)) and row["pieces"] == 2


def test_lists_are_flat_and_empty_rows_are_no_problem():
    batch = record_batch([{"problem": 1, "seed": 2, "waypoints": np.arange(6.0).reshape(2, 3)}, {"problem": 2}])
    assert batch.schema == schema() and batch.column("waypoints").to_pylist() == [[0, 1, 2, 3, 4, 5], None]
    assert record_batch([]).num_rows == 0
