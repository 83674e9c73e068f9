import numpy as np
import pytest
from batches import good_row, walks, write_problems

from minsnap.batch.dataset_rows import request
from minsnap.batch.spec import read_mapping, seed_of
from minsnap.corridors.boxes import Boxes
from minsnap.corridors.gates import Gate
from minsnap.errors import InputError


def test_a_problem_depends_on_its_number_alone():
    first, again = request(walks(), 5), request(walks(count=1000, shard_rows=3), 5)
    assert (first.arguments["waypoints"] == again.arguments["waypoints"]).all()
    assert first.seed == again.seed == seed_of(7, 5)
    free = read_mapping({"generator": "walks", "count": 40, "seed": 7, "legs": [2, 5]})
    assert (request(free, 5).arguments["waypoints"] == first.arguments["waypoints"]).all()
    with pytest.raises(InputError, match="problem 40 is not one of the 40"):
        request(walks(), 40)


def test_walks_keep_their_ranges():
    spec = walks(count=300, legs=[3, 6], step=[0.5, 2.0], speed=[1.0, 4.0], dim=2)
    legs, steps, speeds, widths = [], [], [], []
    for number in range(300):
        given = request(spec, number).arguments
        moves = np.diff(given["waypoints"], axis=0)
        lengths = np.sqrt((moves**2).sum(axis=1))
        legs.append(len(lengths))
        steps.extend(lengths)
        speeds.extend(lengths / given["durations"])
        widths.append(given["corridor"])
        assert moves.shape[1] == 2 and np.ptp(lengths / given["durations"]) < 1e-12
    assert set(legs) == {3, 4, 5, 6}
    for values, low, high in ((steps, 0.5, 2.0), (speeds, 1.0, 4.0), (widths, 0.2, 0.5)):
        assert low <= min(values) < low + 0.1 * (high - low) and high - 0.1 * (high - low) < max(values) <= high + 1e-12


def test_gates_stand_on_the_walk_and_face_the_next_waypoint():
    given = request(read_mapping({"generator": "gates", "count": 3, "legs": 5, "opening": [0.8, 1.2]}), 2).arguments
    points = [p.center if isinstance(p, Gate) else p for p in given["waypoints"]]
    assert [isinstance(p, Gate) for p in given["waypoints"]] == [False, True, True, True, True, False]
    for index in range(1, 5):
        gate, way = given["waypoints"][index], points[index + 1] - points[index - 1]
        assert np.cross(gate.normal, way) == pytest.approx(np.zeros(3), abs=1e-12)
        side = np.sqrt(((gate.corners[1] - gate.corners[0]) ** 2).sum())
        assert 0.8 <= side <= 1.2


def test_limits_are_drawn_and_replace_the_speed_of_the_walk():
    given = request(walks(limits={"speed": [2.0, 3.0], "acceleration": 5.0}), 0).arguments
    assert "durations" not in given and 2.0 <= given["limits"].speed <= 3.0 and given["limits"].acceleration == 5.0
    assert "durations" not in request(walks(total_time=9.0), 0).arguments


def test_boxes_lead_through_free_space():
    given = request(read_mapping({"generator": "boxes", "count": 5, "occupied": 0.2}), 1).arguments
    assert given["waypoints"] is None and isinstance(given["corridor"], Boxes)
    assert len(given["durations"]) == len(given["corridor"])


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_rows_of_a_table_are_what_was_written(tmp_path, ending):
    rows = [good_row(seed, seed + 2) for seed in range(4)]
    rows[1] |= {"start": {"velocity": [1.0, 0.0, 0.0]}}
    rows[2] |= {"limits": {"speed": 3.0}}
    del rows[2]["durations"]
    path = tmp_path / f"p.{ending}"
    if ending == "csv":
        write_problems(path, rows)
    else:
        import pyarrow
        from pyarrow import parquet

        names = set().union(*rows)
        table = pyarrow.Table.from_pylist([dict.fromkeys(names) | row for row in rows])
        parquet.write_table(table, path, row_group_size=3)
    spec = read_mapping({"table": str(path), "degree": 9})
    for number, row in enumerate(rows):
        given = request(spec, number).arguments
        assert np.array_equal(given["waypoints"], row["waypoints"]) and given["degree"] == 9
        assert given.get("durations") == row.get("durations") and given["corridor"] == 0.4
    assert request(spec, 1).arguments["start"] == {"velocity": [1.0, 0.0, 0.0]}
    assert request(spec, 2).arguments["limits"].speed == 3.0
