"""The command that measures the machine."""

import json

import pytest


@pytest.mark.slow
def test_ten_lines_say_what_this_machine_does(call):
    done = call("bench", "--seconds", "0.001")
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 10 and "budget to give" in done.stdout
    found = json.loads(call("bench", "--seconds", "0.001", "--json").stdout)
    assert found["budget to give"] == pytest.approx(1.5 * found["longest replan"])
    assert found["longest replan"] >= found["replan, 4 legs"] > 0.0
