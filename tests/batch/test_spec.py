import json

import pytest
from batches import WALKS, good_row, walks, write_problems

from minsnap.batch.dataset_rows import planned_row
from minsnap.batch.spec import SHAPES, read_mapping, read_spec
from minsnap.errors import FileError


@pytest.mark.parametrize("generator", SHAPES)
def test_the_plain_form_is_complete_and_means_the_same(generator):
    spec = read_mapping({"generator": generator, "count": 10, "limits": {"speed": [2, 3]}, "degree": 5})
    assert read_mapping(spec.plain() | {"vehicle": "f330"}).plain()["vehicle"] == ["dji_f330"]
    plain = json.loads(json.dumps(spec.plain()))
    assert read_mapping(plain) == spec and read_mapping(plain).name() == spec.name()
    assert plain.keys() >= SHAPES[generator].keys() | {"count", "seed", "shard_rows", "limits", "degree"}


def test_rows_of_files_cover_all_problems_once():
    spec = walks(count=21, shard_rows=8)
    assert spec.shards == 3
    assert [number for shard in range(3) for number in spec.rows_of(shard)] == list(range(21))


def test_files_are_about_64_mb_and_at_least_a_hundred():
    plain = {"generator": "walks", "legs": [4, 10], "count": 10**9}
    rows = read_mapping(plain).shard_rows
    assert 20_000 < rows < 60_000
    assert read_mapping(plain | {"count": 1000}).shards == 100
    assert read_mapping(plain | {"count": 3}).shards == 3


def test_every_difference_has_another_name_and_the_order_of_keys_has_not():
    names = {walks(**change).name() for change in ({}, {"seed": 8}, {"corridor": 0.3}, {"legs": [2, 6]}, {"degree": 9})}
    assert len(names) == 5
    assert read_mapping(dict(reversed(WALKS.items()))).name() == walks().name()


def test_a_table_counts_by_its_content_and_not_by_its_place(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        write_problems(tmp_path / folder / "p.csv", [good_row(0), good_row(1)])
        (tmp_path / folder / "s.yaml").write_text("{table: p.csv, shard_rows: 1}")
    one, two = (read_spec(tmp_path / folder / "s.yaml") for folder in ("a", "b"))
    assert one.count == 2 and one.table != two.table and one.name() == two.name()
    write_problems(tmp_path / "b" / "p.csv", [good_row(0), good_row(2)])
    assert read_spec(tmp_path / "b" / "s.yaml").name() != one.name()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[1, 2]", "holds no batch"),
        ("{count: 3}", "either generator"),
        ("{generator: walks, table: p.csv, count: 3}", "either generator"),
        ("{generator: rides, count: 3}", "generator is 'rides': use walks, gates, boxes"),
        ("{generator: [walks], count: 3}", "generator is"),
        ("{generator: walks}", "has no count: give it"),
        ("{generator: walks, count: 0}", "count is 0: give a whole number from 1"),
        ("{generator: walks, count: 3, vehicle: racer}", "vehicle is 'racer': give one of"),
        ("{generator: walks, count: 3, leg: 4}", "walks: 'leg' is not known: did you mean legs"),
        ("{generator: walks, count: 3, opening: 1}", "'opening' is not known"),
        ("{generator: walks, count: 3, corridor: -1}", "corridor is -1"),
        ("{generator: walks, count: 3, dim: 4}", "dim is 4"),
        ("{generator: walks, count: 3, limits: {sped: 3}}", "limits: 'sped' is not known: did you mean speed"),
        ("{generator: walks, count: 3, limits: {speed: fast}}", "limits: speed is 'fast'"),
        ("{generator: walks, count: 3, shard_rows: 2.5}", "shard_rows is 2.5"),
        ("{table: nowhere.csv}", "nowhere.csv cannot be read"),
        ("{table: 3}", "table is 3"),
        ("{table: s.yaml}", "is no table of problems"),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(tmp_path, text, said):
    path = tmp_path / "s.yaml"
    path.write_text(text)
    with pytest.raises(FileError, match=said.replace("[", r"\[")) as caught:
        read_spec(path)
    assert str(path) in str(caught.value)


def test_cells_beyond_the_columns_make_a_row_invalid_and_whole_floats_are_whole_numbers(tmp_path):
    path, head = tmp_path / "p.csv", "waypoints,durations,degree"
    path.write_text(f'{head}\n[[0,0],[8,0]],[2],9\n"[[0, 0], [8, 0]]",[2],9.0\n')
    spec = read_mapping({"table": str(path)})
    rows = [planned_row(spec, number) for number in range(2)]
    assert [row["status"] for row in rows] == ["invalid", "done"] and rows[1]["degree"] == 9
    assert "row 0 has more cells than columns" in rows[0]["error"]
    path.write_text(f"{head},durations\n,,,\n")
    with pytest.raises(FileError, match="has a column twice"):
        read_mapping({"table": str(path)})
