import numpy as np
import pytest

from minsnap.batch.spec import Range, draws_of, ranged, seed_of
from minsnap.errors import FileError


def test_seeds_depend_on_both_numbers_and_stay_what_they_are():
    seeds = {seed_of(a, b) for a in range(5) for b in range(200)}
    assert len(seeds) == 1000 and all(0 <= seed < 2**63 for seed in seeds)
    assert seed_of(7, 0) == 1693125408465869867  # a new value here means that old datasets cannot be made again


def test_draws_are_uniform_over_the_range():
    rng = draws_of(3)
    values = Range(2.0, 5.0).draw(rng, 20_000)
    assert values.min() >= 2.0 and values.max() <= 5.0
    assert np.mean(values) == pytest.approx(3.5, abs=4 * 3 / np.sqrt(12 * 20_000))
    whole = [Range(4, 6).whole(rng) for _ in range(3000)]
    assert set(whole) == {4, 5, 6} and min(np.bincount(whole)[4:]) > 850


def test_one_number_is_a_range_that_takes_a_draw_all_the_same():
    one, two = draws_of(1), draws_of(1)
    assert ranged(0, 1).read("corridor", 0.3).draw(one) == 0.3
    ranged(0, 1).read("corridor", [0.2, 0.5]).draw(two)
    assert one.random() == two.random()
    assert ranged(0, 1).read("x", 0.3).plain() == 0.3 and ranged(0, 9, whole=True).read("x", [1, 2]).plain() == [1, 2]


@pytest.mark.parametrize(
    "value", [[2, 1], [1, 2, 3], "1", None, True, float("nan"), [0.5, float("inf")], -1, [], [[1], 2]]
)
def test_what_is_no_range_is_refused(value):
    with pytest.raises(FileError, match=r"step is .*: give a number or \[low, high\], from 0 to 10"):
        ranged(0, 10).read("step", value)


def test_a_range_of_whole_numbers_takes_no_others():
    with pytest.raises(FileError, match="a whole number"):
        ranged(1, 10, whole=True).read("legs", [1.5, 2])
