"""Fuzzing of every reader: whatever bytes a file holds, it is read or refused with one exception."""

import warnings

import numpy as np
import pytest
from file_seeds import mutated, readers, refusals, seeds
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from minsnap.errors import MinsnapError
from minsnap.files.convert import file_formats
from minsnap.files.geodetic_missions import READERS

EXAMPLES = {".csv": 500, ".npz": 500, ".npy": 500, ".traj": 500}
"""By ending; 300 of the others."""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    return seeds(tmp_path_factory.mktemp("seeds"))


@pytest.mark.parametrize("name", readers())
def test_seeds_are_valid(files, name, tmp_path):
    (tmp_path / name).write_bytes(files[name])
    readers()[name](tmp_path / name)


def test_every_ending_that_is_read_has_a_seed():
    """A new format or mission needs one here, so that it is fuzzed too."""
    read = {ending for kind in file_formats().values() for ending in kind.reads} | set(READERS)
    assert read - {name[name.rindex(".") :] for name in readers()} == set()


@pytest.mark.slow
@pytest.mark.parametrize("name", readers())
def test_bytes_near_a_file_are_read_or_refused(files, name, tmp_path):
    random = np.random.default_rng(0)
    for _ in range(EXAMPLES.get(name[name.rindex(".") :], 300)):
        (tmp_path / name).write_bytes(mutated(files[name], random))
        attempt(readers()[name], tmp_path / name)


@pytest.mark.slow
@pytest.mark.parametrize("name", readers())
@settings(max_examples=50, deadline=None, suppress_health_check=list(HealthCheck))
@given(content=st.binary(max_size=300) | st.text(max_size=300).map(lambda text: text.encode("utf-8", "replace")))
def test_any_bytes_are_read_or_refused(name, tmp_path_factory, content):
    path = tmp_path_factory.mktemp("any") / name
    path.write_bytes(content)
    attempt(readers()[name], path)


def attempt(read, path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            read(path)
        except refusals() as error:
            assert isinstance(error, MinsnapError) and 0 < len(str(error)) < 600
