"""The command that compares flights takes the lead of their setpoints from the file, or is told."""

import json
from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap.trajectory.samples import Samples

LATE, LEAD = 0.3, 0.2


@pytest.mark.slow
def test_the_command_takes_the_lead_from_the_file_or_is_told(call, tmp_path):
    path = minsnap.rectangle(width=6, length=4, total_time=14.0)
    file, t = path.sample(20.0), np.arange(0.0, 17.0, 0.02)
    minsnap.write_csv(file, tmp_path / "plain.csv")
    minsnap.write_csv(replace(file, lead=LEAD), tmp_path / "led.csv")
    minsnap.write_csv(Samples(t, path(np.clip(t - LATE, 0.0, path.duration))), tmp_path / "flown.csv")
    plain, led, told = (
        json.loads(call("compare", *given, "flown.csv", "--json").stdout)["flown.csv"]
        for given in (["plain.csv"], ["led.csv"], ["plain.csv", "--lead", LEAD])
    )
    page = call("compare", "led.csv", "flown.csv", "--report", "page.html")
    assert page.returncode == 0 and "flown.csv tells nothing of drag" in (tmp_path / "page.html").read_text()
    assert led["rmse_3d"] == told["rmse_3d"] < 0.4 * plain["rmse_3d"]
    assert (plain["delay"], led["delay"]) == (pytest.approx(LATE, abs=2e-3), pytest.approx(LATE - LEAD, abs=2e-3))
