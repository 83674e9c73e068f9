"""The border: layouts of both sides are compared by name, and what is no contiguous array is refused."""

from ctypes import Structure, c_double

import numpy as np
import pytest

from minsnap.native import library, records
from minsnap.native.library import NativeCoreError, address
from minsnap.native.records import CorridorRecord, Record, ShortestRequest, SplitRecord, WallsRecord

EVERY = [value for value in vars(records).values() if isinstance(value, type) and Record in value.__bases__]


@pytest.fixture
def native():
    with library.using("auto") as core:
        if core.library is None:
            pytest.skip("there is no native core")
        yield core.library


@pytest.mark.parametrize("record", EVERY)
def test_layouts_are_those_of_the_library(native, record):
    record.check(native)


def test_every_record_of_the_library_is_declared_here(native):
    assert set(records.layout(native)) == {record.__name__ for record in EVERY}


def test_swapped_fields_of_the_same_type_are_refused(native):
    fields = list(CorridorRecord._fields_)
    length, time = [next(i for i, field in enumerate(fields) if field[0] == name) for name in ("length", "time")]
    fields[length], fields[time] = fields[time], fields[length]
    swapped = type("CorridorRecord", (Record,), {"_fields_": fields})
    with pytest.raises(NativeCoreError, match="another CorridorRecord"):
        swapped.check(native)


def test_a_field_too_few_is_refused(native):
    shorter = type("WallsRecord", (Record,), {"_fields_": WallsRecord._fields_[:-1]})
    with pytest.raises(NativeCoreError, match="another WallsRecord"):
        shorter.check(native)


@pytest.mark.parametrize(
    "array", [np.zeros((4, 4))[:, ::2], np.zeros((3, 2)).T, np.zeros(3, dtype=np.float32), np.zeros(3, dtype=complex)]
)
def test_arrays_that_are_not_contiguous_or_of_another_kind_are_refused(array):
    with pytest.raises(TypeError, match="contiguous"):
        address(array)
    with pytest.raises(TypeError, match="contiguous"):
        CorridorRecord(positions=array)


def test_integers_do_not_pass_for_numbers():
    with pytest.raises(TypeError, match="float64, not of int64"):
        SplitRecord(durations=np.ones(3, dtype=np.int64))


def test_what_a_request_points_to_is_compared_as_well(native, monkeypatch):
    fields = [("limits", c_double), *records.MomentaryLimit._fields_]
    monkeypatch.setattr(records, "MomentaryLimit", type("MomentaryLimit", (Record,), {"_fields_": fields}))
    with pytest.raises(NativeCoreError, match="another MomentaryLimit"):
        ShortestRequest.check(native)


def test_arrays_live_as_long_as_their_record():
    record = WallsRecord(count=1, bound=np.array([2.5]))
    assert c_double.from_address(record.bound.value).value == 2.5
    assert issubclass(WallsRecord, Structure)
