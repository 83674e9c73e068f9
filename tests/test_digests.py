"""The same plan to the bit: stored digests, under several choices of the kernels of BLAS and NumPy."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from helpers import digest_plans

from minsnap.native.library import core

pytestmark = pytest.mark.skipif(core().library is None, reason="the Python core rounds as BLAS does")

KERNELS = {
    "as they are": {},
    "Prescott": {"OPENBLAS_CORETYPE": "Prescott"},
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "Zen": {"OPENBLAS_CORETYPE": "Zen"},
    "plain NumPy": {"NPY_DISABLE_CPU_FEATURES": " ".join(np._core._multiarray_umath.__cpu_dispatch__)},
}


@pytest.mark.slow
@pytest.mark.parametrize("kernels", KERNELS)
def test_plans_are_those_stored_whatever_the_kernels(kernels):
    environment = os.environ | KERNELS[kernels] | {"PYTHONPATH": os.pathsep.join(sys.path)}
    script = [sys.executable, digest_plans.__file__]
    run = subprocess.run(script, env=environment, capture_output=True, text=True, check=True)
    stored = json.loads(digest_plans.STORED.read_text(encoding="utf-8"))
    found = json.loads(run.stdout)
    assert set(found) == set(stored)
    assert {name for name in found if found[name] != stored[name]} == set()


@pytest.mark.parametrize("name", digest_plans.GIVEN)
def test_plans_for_given_times_are_found_by_the_native_core(name):
    report = digest_plans.GIVEN[name]().report
    assert report.core == "native", report.handed_over


def test_a_plan_does_not_depend_on_those_before_it():
    names = ("tube, continuity 6", "200 legs in a tube", "narrow tube")
    once = {name: digest_plans.digest(digest_plans.GIVEN[name]()) for name in names}
    again = {name: digest_plans.digest(digest_plans.GIVEN[name]()) for name in reversed(names)}
    assert once == again
