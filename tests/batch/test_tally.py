import numpy as np
import pyarrow
import pytest
from batches import walks

from minsnap.batch.columns import Tally, record_batch
from minsnap.batch.dataset_rows import planned_row, stopped_row


@pytest.fixture(scope="module")
def table():
    rows = [planned_row(walks(), number) for number in range(12)]
    rows[5] = stopped_row(walks(), 5, "timeout", "slow")
    return pyarrow.Table.from_batches([record_batch(rows)])


def test_a_tally_counts_what_the_rows_hold(table):
    tally = Tally()
    tally.add(table)
    costs = np.array([cost for cost in table.column("cost").to_pylist() if cost is not None])
    assert tally.statuses == {"done": 11, "timeout": 1} and tally.certified == 11
    assert tally.ranges["cost"] == [costs.min(), costs.max()]
    low, counts = tally.histogram("cost")
    assert (counts == np.histogram(costs, np.append(low, low[-1] * 10 ** (1 / 8)))[0]).all() and counts.sum() == 11


def test_tallies_of_parts_add_up_to_that_of_the_whole(table):
    whole, sum_ = Tally(), Tally()
    whole.add(table)
    for first in (0, 4, 5, 9):
        part = Tally()
        part.add(table.slice(first, {0: 4, 4: 1, 5: 4, 9: 3}[first]))
        sum_.join(Tally(part.plain()))
    one, other = whole.plain(), sum_.plain()
    assert (one["statuses"], one["ranges"], one["certified"]) == (
        other["statuses"],
        other["ranges"],
        other["certified"],
    )
    assert all((whole.histogram(n)[1] == sum_.histogram(n)[1]).all() for n in one["bins"])


def test_rows_that_all_failed_have_no_ranges():
    tally = Tally()
    tally.add(pyarrow.Table.from_batches([record_batch([stopped_row(walks(), 0, "invalid", "x")])]))
    assert tally.plain()["ranges"] == {} and len(tally.histogram("cost")[0]) == 0
