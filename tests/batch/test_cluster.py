"""What workers tell about their rows: all of them, and not too often."""

from minsnap.batch.run import RowCounter


def test_rows_are_told_once_in_a_while_and_at_the_end():
    now, told = [0.0], []
    with RowCounter(told.append, 2.0, lambda: now[0]) as counter:
        for instant in range(6):
            now[0] = float(instant)
            counter({"done": 3, "timeout": instant % 2})
        assert [sum(rows.values()) for rows in told] == [10, 7]
    assert told[-1] == {"done": 3, "timeout": 1} and len(told) == 3
    assert sum(rows["done"] for rows in told) == 18


def test_nothing_is_told_of_no_rows():
    told = []
    with RowCounter(told.append, 0.0):
        pass
    assert told == []
