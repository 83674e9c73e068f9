"""Fuzzing of every reader: whatever bytes a file holds, it is read or refused with one exception."""

import warnings

import numpy as np
import pytest
from file_seeds import mutated, readers, seeds
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from minsnap.errors import FileError, MinsnapError, VehicleError

EXAMPLES = {".csv": 1500, ".npz": 1000, ".ulg": 1000, ".yaml": 300}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    return seeds(tmp_path_factory.mktemp("seeds"))


def allowed(name):
    return (FileError, VehicleError) if name == "vehicle.yaml" else (FileError,)


@pytest.mark.parametrize("name", readers())
def test_seeds_are_valid(files, name, tmp_path):
    (tmp_path / name).write_bytes(files[name])
    readers()[name](tmp_path / name)


@pytest.mark.parametrize("name", readers())
def test_bytes_near_a_file_are_read_or_refused(files, name, tmp_path_factory):
    path = tmp_path_factory.mktemp("near") / name
    read = readers()[name]

    @settings(
        max_examples=EXAMPLES[name[name.rindex(".") :]],
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.integers(0, 2**63))
    def hold(number):
        path.write_bytes(mutated(files[name], np.random.default_rng(number)))
        attempt(read, path, allowed(name))

    hold()


@pytest.mark.parametrize("name", readers())
@settings(max_examples=200, deadline=None, suppress_health_check=list(HealthCheck))
@given(content=st.binary(max_size=300) | st.text(max_size=300).map(lambda text: text.encode("utf-8", "replace")))
def test_any_bytes_are_read_or_refused(name, tmp_path_factory, content):
    path = tmp_path_factory.mktemp("any") / name
    path.write_bytes(content)
    attempt(readers()[name], path, allowed(name))


def attempt(read, path, errors):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            read(path)
        except errors as error:
            assert isinstance(error, MinsnapError) and 0 < len(str(error)) < 600
