"""The command that holds a vehicle's parameters against a flight."""

import json

import pytest
from flying import PATH
from px4_parameters import PX4
from standin import StandIn

from minsnap import write_csv


@pytest.mark.slow
def test_the_command_says_what_does_not_fit_and_writes_what_is_named(call, tmp_path):
    path = tmp_path / "path.csv"
    write_csv(PATH, path)
    with StandIn(parameters=PX4 | {"COM_OBL_RC_ACT": 3}) as vehicle:
        link = f"udpout:127.0.0.1:{vehicle.port}"
        first = call("preflight", path, "--connect", link)
        assert first.returncode == 1 and "does not fit  COM_OBL_RC_ACT = 3" in first.stdout and vehicle.written == []
        second = call("preflight", path, "--connect", link, "--set", "COM_OBL_RC_ACT=4", "--json")
        assert second.returncode == 0 and vehicle.written == ["COM_OBL_RC_ACT"]
        assert json.loads(second.stdout)["COM_OBL_RC_ACT"] == {
            "parameters": {"COM_OBL_RC_ACT": 4.0, "RTL_RETURN_ALT": 60.0},
            "fits": True,
            "problem": None,
        }
        bad = call("preflight", "--connect", link, "--set", "COM_OBL_RC_ACT")
        assert bad.returncode == 2 and "give NAME=VALUE" in bad.stderr


class Forgetful(StandIn):
    """Answers that it has set a parameter, and restarts with the old one."""

    def _tell(self, message):
        super()._tell(message)
        if message.get_type() == "PARAM_SET":
            self.parameters["COM_OBL_RC_ACT"] = 3


@pytest.mark.slow
def test_a_parameter_that_is_lost_again_is_said(call):
    """It was said to be set alone, where the vehicle restarted half way."""
    with Forgetful(parameters=PX4 | {"COM_OBL_RC_ACT": 3}) as vehicle:
        done = call("preflight", "--connect", f"udpout:127.0.0.1:{vehicle.port}", "--set", "COM_OBL_RC_ACT=4")
    assert done.returncode == 2 and "set COM_OBL_RC_ACT = 4" in done.stderr
    assert "COM_OBL_RC_ACT = 4 was set, and now the vehicle has COM_OBL_RC_ACT = 3: did it restart?" in done.stderr
