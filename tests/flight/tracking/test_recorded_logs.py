"""Recorded flights (tests/recorded): led, stopped on the way, and a mission, as PX4 and ArduPilot log them."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from minsnap.files.convert import read_samples
from minsnap.files.flights import load_log
from minsnap.flight.tracking.log_comparison import compare_in_log
from minsnap.flight.tracking.tracking_plot import write_flight_page

HERE = Path(__file__).parents[2] / "recorded"
TRUTH = json.loads((HERE / "truth.json").read_text())


def compared(name, ending, **changes):
    plan = replace(read_samples(HERE / f"{name}.json"), **({"lead": TRUTH[name]["lead"]} | changes))
    log = load_log(HERE / f"{name}{ending}")
    (found,) = compare_in_log(plan, log.reference, log.flight)
    return found


@pytest.mark.parametrize("ending", [".ulg", ".bin"])
@pytest.mark.parametrize("name", TRUTH)
def test_what_a_flight_missed_is_found_in_its_log(name, ending):
    found, truth = compared(name, ending), TRUTH[name]
    assert found.comparison.rmse_3d == pytest.approx(truth["rmse"], abs=0.02)
    assert found.comparison.max_error == pytest.approx(truth["greatest"], abs=0.05)
    assert not found.place.shift.any() and abs(found.place.rate - 1.0) < 2e-3


@pytest.mark.parametrize("ending", [".ulg", ".bin"])
def test_a_stopped_flight_is_compared_as_far_as_it_went(ending):
    found = compared("stopped", ending)
    assert found.place.end == pytest.approx(TRUTH["stopped"]["followed"], abs=0.5)
    assert any("that part is compared" in remark for remark in found.remarks())


@pytest.mark.slow
def test_a_lead_that_is_not_said_would_count_as_error(tmp_path):
    said, silent = compared("led", ".ulg"), compared("led", ".ulg", lead=0.0)
    assert silent.comparison.rmse_3d > 1.15 * said.comparison.rmse_3d
    write_flight_page({"led": said}, tmp_path / "page.html", logs={"led": HERE / "led.ulg"})
    assert "0.2 s ahead" in (tmp_path / "page.html").read_text()
