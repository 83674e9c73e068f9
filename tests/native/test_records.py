"""The border: structs have the fields that the library lists, and what does not fit a field is refused."""

import subprocess
import sys
from ctypes import Structure, c_double

import numpy as np
import pytest

from minsnap.native import library, records
from minsnap.native.library import NativeCoreError, address
from minsnap.native.records import (
    CorridorRecord,
    ManyRecord,
    Record,
    ShortestRequest,
    SplitRecord,
    StopRecord,
    WallsRecord,
)

EVERY = Record.__subclasses__()
native = pytest.mark.skipif(library.loaded().library is None, reason="there is no native core")


@native
def test_every_record_of_the_library_is_named_here():
    assert set(records.border()) == {record.__name__ for record in EVERY}


@native
@pytest.mark.parametrize("record", EVERY)
def test_structs_have_the_fields_of_the_library(record):
    record()
    assert [name for name, *_ in record._fields_] == list(records.border()[record.__name__])


@native
def test_fields_hold_what_the_header_declares():
    assert records.border()["MomentaryLimit"] == {"kind": "int64", "parameters": "float64*"}
    kinds = {"walls": "WallsRecord*", "pinned": "uint8*", "length": "float64", "closed": "int64", "values": "float64*"}
    assert kinds.items() <= records.border()["CorridorRecord"].items()
    assert records.border()["StopRecord"]["cones"] == "WallsRecord*"
    assert records.border()["ChainRecord"]["masks"] == "uint32*"


@native
def test_the_text_of_a_declaration_is_read_as_the_compiler_reads_it():
    text = "{ std::int64_t one, two; const double *points, *ends, share; "
    text += "volatile std::int32_t *stop; Poll poll; void *context; }"
    kinds = {
        "one": "int64",
        "two": "int64",
        "points": "float64*",
        "ends": "float64*",
        "share": "float64",
        "stop": "int32*",
    }
    assert dict(records._fields(text)) == kinds | {"poll": "poll", "context": "context"}


@native
def test_a_struct_of_another_size_than_the_library_s_is_refused(monkeypatch):
    texts = {"Shorter": ("{ std::int64_t one; double two; }", 24)}
    monkeypatch.setattr(records, "_told", lambda: texts)
    monkeypatch.setattr(records, "border", lambda: {"Shorter": dict(records._fields(texts["Shorter"][0]))})
    with pytest.raises(NativeCoreError, match=r"Shorter has 24 bytes in the library and 16 here: .*native\.build"):
        type("Shorter", (Record,), {})(one=1)


@native
@pytest.mark.parametrize("record", [CorridorRecord, StopRecord, WallsRecord])
def test_a_misspelt_field_is_refused(record):
    with pytest.raises(TypeError, match=f"{record.__name__} has no field 'durattions': .*native.build"):
        record(durattions=np.ones(3))
    with pytest.raises(TypeError, match="no field 'durattions'"):
        record().put(durattions=np.ones(3))


@native
@pytest.mark.parametrize(
    "array", [np.zeros((4, 4))[:, ::2], np.zeros((3, 2)).T, np.zeros(3, dtype=np.float32), np.zeros(3, dtype=complex)]
)
def test_arrays_that_are_not_contiguous_or_of_another_kind_are_refused(array):
    with pytest.raises(TypeError, match="contiguous"):
        address(array)
    with pytest.raises(TypeError, match="contiguous"):
        CorridorRecord(positions=array)


@native
def test_integers_do_not_pass_for_numbers():
    with pytest.raises(TypeError, match="float64, not of int64"):
        SplitRecord(durations=np.ones(3, dtype=np.int64))
    with pytest.raises(TypeError, match="int32, not of int64"):
        ManyRecord(statuses=np.ones(3, dtype=np.int64))


@native
@pytest.mark.parametrize("value", [np.zeros(3), 1.0, "three", [1.0]])
def test_what_is_no_list_of_records_does_not_pass_for_one(value):
    with pytest.raises(TypeError):
        ShortestRequest(cones=value)


@native
def test_truth_values_pass_for_bytes_alone():
    flags = np.array([True, False])
    assert CorridorRecord(pinned=flags).pinned == flags.ctypes.data
    with pytest.raises(TypeError, match="uint8, not of float64"):
        CorridorRecord(pinned=flags.astype(float))


@native
def test_arrays_live_as_long_as_their_record():
    record = WallsRecord(count=1, width=np.array([2.5]))
    assert c_double.from_address(record.width).value == 2.5
    stop = StopRecord(cones=[WallsRecord(radius=np.array([0.5])), WallsRecord(radius=np.array([1.5]))])
    assert [c_double.from_address(stop.cones[i].radius).value for i in range(2)] == [0.5, 1.5]
    assert issubclass(WallsRecord, Structure)


THREADS = """
from concurrent.futures import ThreadPoolExecutor
from minsnap.native.records import CorridorRecord, WallsRecord
with ThreadPoolExecutor(8) as pool:
    made = list(pool.map(lambda count: CorridorRecord(walls=[WallsRecord(count=count)]), range(64)))
print([record.walls[0].count for record in made] == list(range(64)))
"""


@native
def test_threads_that_make_the_first_records_together_get_one_struct():
    run = subprocess.run([sys.executable, "-c", THREADS], capture_output=True, text=True, check=False)
    assert run.stdout == "True\n", run.stderr


def test_without_a_library_records_keep_what_they_are_made_from(monkeypatch):
    blank = type("Blank", (Record,), {})
    monkeypatch.setattr(records, "border", dict)
    record = blank(count=3, bound=np.ones(2)[::-1])
    assert record.kept["count"] == 3
