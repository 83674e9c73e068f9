"""Tables of numbers: what is read at once is what is read line by line."""

import random

import pytest

from minsnap.basics.storage import table
from minsnap.basics.storage.table import read_table
from minsnap.errors import FileError

CELLS = ["1", "-1.5", "+2", "5.", " 1", "1\t", "1e5", "1E-400", "4.9e-324", "0.30000000000000004", "9" * 300, "１"]
WRONG = ["", " ", "1_0", "0x10", "nan", "inf", "1e999", "1d5", '"1"', "#1", "1#2", "1e", "--1", "1\x00", "9" * 400]


def read(path):
    """Bytes of the columns, or the sentence that refuses them."""
    try:
        return [column.tobytes() for column in read_table(path, ["a", "b"]).values()]
    except FileError as refused:
        return str(refused)


@pytest.mark.parametrize("seed", range(40))
def test_rows_read_at_once_are_those_read_line_by_line(tmp_path, monkeypatch, seed):
    draw = random.Random(seed)
    lines = [",".join(draw.choice(CELLS) for _ in "ab") for _ in range(20)]
    if seed % 4:
        lines[draw.randrange(20)] = draw.choice([f"1,{draw.choice(WRONG)}", "1", "1,2,3", "", " ", "# 1,2"])
    (tmp_path / "a.csv").write_text("\n".join(["a,b", *lines, "1,1"]))
    quick = read(tmp_path / "a.csv")
    monkeypatch.setattr(table, "_plain_rows", lambda lines, columns: None)
    assert quick == read(tmp_path / "a.csv") and isinstance(quick, str) == bool(seed % 4)
