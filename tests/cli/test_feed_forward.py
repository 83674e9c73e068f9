"""Feed-forward on the command line: written with setpoints, checked, drawn, compared; refused where none can be."""

import json

import numpy as np
import pytest
from flying import PATH

import minsnap
from minsnap.files.consistency import check_samples
from minsnap.flight.mavlink.setpoints import FeedForward
from minsnap.vehicle import Quadrotor

STATED = FeedForward(drag=0.4).stated(PATH)


@pytest.mark.slow
@pytest.mark.parametrize("command", [["rect", "--time", 12], ["circle"], ["plan", "w.csv"]])
def test_commands_write_it(call, tmp_path, command):
    (tmp_path / "w.csv").write_text("x,y,z\n0,0,1\n4,0,1\n4,3,2\n")
    Quadrotor.px4_sih().to_yaml(tmp_path / "v.yaml")
    by_number = call(*command, "-o", "a.csv", "--drag", 1.0)
    by_vehicle = call(*command, "-o", "b.csv", "--vehicle", "v.yaml")
    assert by_number.returncode == by_vehicle.returncode == 0, by_number.stderr + by_vehicle.stderr
    assert "drag offset by up to" in by_number.stdout
    one, two = (minsnap.read_csv(tmp_path / name) for name in ("a.csv", "b.csv"))
    np.testing.assert_allclose(one.feed_forward, one.velocity, atol=1e-12)
    np.testing.assert_allclose(two.feed_forward, one.feed_forward, atol=1e-9)
    checked = call("check", "a.csv")
    assert checked.returncode == 0 and "feed-forward        up to" in checked.stdout
    assert json.loads(call("check", "a.csv", "--json").stdout)["feed_forward"] > 0.3
    assert call("plot", "a.csv", "-o", "a.png").returncode == 0


@pytest.mark.slow
def test_a_preset_is_known_by_its_names(call, tmp_path):
    written = [call("circle", "-o", f"{name}.csv", "--vehicle", name) for name in ("px4-sih", "px4_sih")]
    assert all(done.returncode == 0 and "drag offset" in done.stdout for done in written)
    assert (tmp_path / "px4-sih.csv").read_bytes() == (tmp_path / "px4_sih.csv").read_bytes()


def test_a_lead_is_written_and_shown(call, tmp_path):
    plain, led = call("circle", "-o", "a.csv"), call("circle", "-o", "b.csv", "--lead", 0.2)
    assert plain.returncode == led.returncode == 0 and "setpoints sent 200 ms ahead" in led.stdout
    one, two = (minsnap.read_csv(tmp_path / name) for name in ("a.csv", "b.csv"))
    np.testing.assert_array_equal(two.position, one.position)
    assert two.feed_forward is None and check_samples(two).ok and (one.lead, two.lead) == (0.0, 0.2)
    assert "sent 0.2 s before" in call("check", "b.csv").stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--drag", 1.0], "give -o FILE"),
        (["--drag", 1.0, "-o", "a.json"], "polynomials hold no feed-forward"),
        (["--drag", -1.0, "-o", "a.csv"], "the drag is -1.0 1/s"),
        (["--lead", 1.2, "-o", "a.csv"], "between 0 and 1 s"),
        (["--vehicle", "none.yaml", "-o", "a.csv"], "none.yaml cannot be read"),
    ],
)
def test_what_cannot_be_written_is_refused(call, options, says):
    done = call("circle", *options)
    assert done.returncode == 2 and says in done.stderr


def test_a_flight_is_compared_with_a_file_that_states_it(call, tmp_path):
    minsnap.write_csv(STATED, tmp_path / "a.csv")
    minsnap.write_csv(PATH, tmp_path / "flown.csv")
    done = call("compare", "a.csv", "flown.csv", "--json")
    assert done.returncode == 0, done.stderr
